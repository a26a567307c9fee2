"""Diagnosis of a finger, from its data set to models before and after."""

from __future__ import annotations

from bayestouch.affected.fitting import Fitted
from bayestouch.affected.result import AddedEffect, added_effects, calibration_of
from bayestouch.affected.start import base_fit
from bayestouch.dataset import DataSet
from bayestouch.diagnosis.correction import corrected_fit, table_of
from bayestouch.diagnosis.data import DiagnosisData
from bayestouch.diagnosis.held_out import HeldOut, held_out
from bayestouch.diagnosis.placed import Correction
from bayestouch.diagnosis.search import ERRORS, Round, search
from bayestouch.diagnosis.touch_errors import TouchReading, read_held_out
from bayestouch.diagnosis.traced import Stand, Traced
from bayestouch.diagnosis.verdict import Remaining, lack_of_fit
from bayestouch.effects import Setting, catalogue
from bayestouch.progress import Progress

# Shares of the time: fits and search, then reading the held-out touches before and after.
START, SEARCHED, READ = 0.1, 0.75, 0.85


def trace_finger(
    dataset: DataSet, *, contact: str, draws: int, sample: bool, seed: int, progress: Progress | None
) -> Traced:
    """Fit, search, and compare before and after; see `bayestouch.diagnose`."""
    advance = progress or (lambda fraction: None)
    data = DiagnosisData.of(dataset)
    fitted = base_fit(data.observations(data.training), data.dataset.sensor, contact)
    setting = data.setting(contact, fitted.model.reference_load)
    advance(START)
    rounds = search(fitted, catalogue(setting), lambda share: advance(START + (SEARCHED - START) * share))
    advance(SEARCHED)
    last = rounds[-1]
    added = in_order(rounds, last.before)
    stand = _Stands(data, setting, draws, sample, seed)
    before = stand(fitted, (), None)
    advance(READ)
    explained = stand(last.before, added, None) if added else before
    remaining = Remaining(
        before=lack_of_fit(fitted, before.held_out), after=lack_of_fit(last.before, explained.held_out)
    )
    corrected = None
    if remaining.after.there and last.correction_gain > ERRORS * last.correction_se > 0:
        new = corrected_fit(last.before)
        if new is not None:
            corrected = stand(new[0], added, new[1])
    advance(1.0)
    return Traced(data, rounds, stand.steps(rounds, before, explained), added, before, explained, corrected, remaining)


def in_order(rounds: tuple[Round, ...], fitted: Fitted) -> tuple[AddedEffect, ...]:
    """Effects of the last model, in the order in which they were added."""
    chosen = [each.added for each in rounds if each.added is not None]
    noise = tuple((each.noise.effect, each.noise.values, each.noise.sd) for each in chosen if each.noise is not None)
    by_name = {each.effect.name: each for each in added_effects(fitted, noise)}
    return tuple(by_name[each.effect.name] for each in chosen if each.effect.name in by_name)


class _Stands:
    """Makes a `Stand` of a fit: calibration, and errors on the held-out touches."""

    def __init__(self, data: DiagnosisData, setting: Setting, draws: int, sample: bool, seed: int) -> None:
        self.data, self.setting, self.draws, self.sample, self.seed = data, setting, draws, sample, seed
        self.observed = data.observations(data.held_out) if data.n_held_out else None

    def __call__(self, fitted: Fitted, added: tuple[AddedEffect, ...], correction: Correction | None) -> Stand:
        calibration = calibration_of(
            fitted,
            list(added),
            sensor=self.data.dataset.sensor,
            setting=self.setting,
            rest=self.data.rest,
            draws=self.draws,
            seed=self.seed,
            notes=self.data.notes,
            extra=None if correction is None else table_of(fitted, correction).arrays(),
        )
        held: HeldOut | None = None
        read: TouchReading | None = None
        if self.observed is not None:
            held = held_out(fitted, correction, self.observed, calibration.noise.force_sd)
            if self.sample:
                read = read_held_out(calibration, self.data, held, seed=self.seed)
        return Stand(fitted, correction, calibration, held, read)

    def steps(self, rounds: tuple[Round, ...], before: Stand, explained: Stand) -> tuple[HeldOut, ...]:
        """Held-out residuals at the beginning of each round."""
        if self.observed is None or before.held_out is None or explained.held_out is None:
            return ()
        force_sd = before.calibration.noise.force_sd
        between = [held_out(each.before, None, self.observed, force_sd) for each in rounds[1:-1]]
        return (before.held_out, *between, explained.held_out)[: len(rounds)]
