"""From a fit without effects to what was traced, on any body: search, models before and after, what remains."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Protocol

from bayestouch.diagnosis.correction import corrected_fit
from bayestouch.diagnosis.correction_basis import Correction
from bayestouch.diagnosis.data import DiagnosisData
from bayestouch.diagnosis.drift_posterior import settled_drifts
from bayestouch.diagnosis.held_out import HeldOut
from bayestouch.diagnosis.measure import advice
from bayestouch.diagnosis.rounds import SearchRound
from bayestouch.diagnosis.search import ERRORS, search
from bayestouch.diagnosis.traced import EvaluatedModel, Traced
from bayestouch.diagnosis.verdict import Remaining, lack_of_fit
from bayestouch.effects import Effect, Values
from bayestouch.model.added import AddedEffect, added_effects, moved_to
from bayestouch.model.fitting import Fitted
from bayestouch.pad.model import PadModel
from bayestouch.progress import Progress

# Shares of the time: fits and search, then reading the held-out touches before and after.
START, SEARCHED, READ = 0.1, 0.75, 0.85


class Evaluate(Protocol):
    """What a body makes of a fit."""

    def __call__(self, fitted: Fitted, added: tuple[AddedEffect, ...], correction: Correction | None) -> EvaluatedModel:
        """Calibration, and errors on the held-out touches."""
        ...

    def held(self, fitted: Fitted, correction: Correction | None, *, stated: bool = False) -> HeldOut | None:
        """Residuals of the held-out touches, or those at stated references; None where none could be held out."""
        ...


def follow(
    data: DiagnosisData,
    fitted: Fitted,
    effects: tuple[Effect, ...],
    evaluate: Evaluate,
    progress: Progress | None,
    scheduler: str | None,
) -> Traced:
    """Search from a fit without effects, and compare before and after.

    Parameters
    ----------
    data : DiagnosisData
        Touches, parted.
    fitted : Fitted
        Fit to the training touches, without effects.
    effects : tuple of Effect
        Effects that are tried.
    stand : Stands
        Of the body.
    progress : callable, optional
        Called with the fraction done.
    scheduler : str, optional
        As of `bayestouch.diagnose`.
    """
    advance = progress or (lambda fraction: None)
    advance(START)
    rounds = search(fitted, effects, lambda share: advance(START + (SEARCHED - START) * share), scheduler)
    advance(SEARCHED)
    last = rounds[-1]
    final, spreads = settled_drifts(last.before)
    added = effects_as_added(rounds, final, spreads)
    before = evaluate(fitted, (), None)
    advance(READ)
    explained = evaluate(final, added, None) if added else before
    remaining = Remaining(before=lack_of_fit(fitted, before.held_out), after=lack_of_fit(final, explained.held_out))
    corrected = None
    if remaining.after.there and last.correction_gain > ERRORS * last.correction_se > 0:
        new = corrected_fit(final)
        if new is not None:
            corrected = evaluate(new[0], moved_to(new[0], added), new[1])
    advance(1.0)
    return Traced(
        data=data,
        rounds=rounds,
        steps=_steps(rounds, evaluate, before, explained),
        added=added,
        before=before,
        explained=explained,
        corrected=corrected,
        remaining=remaining,
        advice=None if isinstance(fitted.model, PadModel) else advice(rounds),
    )


def effects_as_added(
    rounds: tuple[SearchRound, ...], fitted: Fitted, spreads: Mapping[str, Values]
) -> tuple[AddedEffect, ...]:
    """Effects of the last model, in the order in which they were added; drifts with their standard deviations."""
    chosen = [each.added for each in rounds if each.added is not None]
    noise = tuple((n.effect, n.values, n.sd) for n in (each.found_noise for each in chosen) if n is not None)
    by_name = {
        each.effect.name: replace(each, sd=spreads.get(each.effect.name, each.sd))
        for each in added_effects(fitted, noise)
    }
    return tuple(by_name[each.effect.name] for each in chosen if each.effect.name in by_name)


def _steps(
    rounds: tuple[SearchRound, ...], evaluate: Evaluate, before: EvaluatedModel, explained: EvaluatedModel
) -> tuple[HeldOut, ...]:
    """Held-out residuals at the beginning of each round; empty where none could be held out."""
    between = [evaluate.held(each.before, None) for each in rounds[1:-1]]
    steps = (before.held_out, *between, explained.held_out)[: len(rounds)]
    return tuple(each for each in steps if each is not None)
