"""Diagnosis of a finger, from its data set to models before and after."""

from __future__ import annotations

from collections.abc import Mapping

from bayestouch.data.dataset import DataSet
from bayestouch.diagnosis.as_stated import at_stated_references
from bayestouch.diagnosis.beginning import Beginning
from bayestouch.diagnosis.correction import table_of
from bayestouch.diagnosis.correction_basis import Correction
from bayestouch.diagnosis.data import DiagnosisData
from bayestouch.diagnosis.follow import follow
from bayestouch.diagnosis.held_out import HeldOut, held_out
from bayestouch.diagnosis.touch_errors import TouchReading, read_held_out
from bayestouch.diagnosis.traced import EvaluatedModel, Traced
from bayestouch.effects import Setting, catalogue
from bayestouch.finger.calibration import finger_calibration
from bayestouch.finger.calibration_with_effects import calibration_with_effects
from bayestouch.finger.start import FingerStart, finger_start
from bayestouch.model.added import AddedEffect
from bayestouch.model.fitting import Fitted
from bayestouch.model.left_over import force_noise
from bayestouch.priors.parameters import Prior
from bayestouch.progress import Progress
from bayestouch.results.objects import Calibration


def trace_finger(
    dataset: DataSet,
    *,
    contact: str,
    draws: int,
    sample: bool,
    seed: int,
    progress: Progress | None,
    scheduler: str | None,
) -> Traced:
    """Fit, search, and compare before and after; see `bayestouch.diagnose`."""
    begun = begin_finger(DiagnosisData.of(dataset), contact=contact, draws=draws, sample=sample, seed=seed)
    return follow(begun.data, begun.fitted, begun.effects, begun.evaluate, progress, scheduler)


def begin_finger(
    data: DiagnosisData,
    *,
    contact: str,
    draws: int,
    seed: int,
    sample: bool = False,
    stated: Mapping[str, Prior] | None = None,
) -> Beginning:
    """Fit a finger without effects, with priors that may be stated."""
    start = finger_start(data.observations(data.training), data.dataset.sensor, contact, stated)
    setting = data.setting(contact, start.fitted.model.reference_load)
    evaluate = _EvaluateFinger(data, start, setting, draws, sample, seed, stated)
    return Beginning(data, start.fitted, setting, catalogue(setting), evaluate)


class _EvaluateFinger:
    """Makes an `EvaluatedModel` of a fit: calibration, and errors on the held-out touches."""

    def __init__(
        self,
        data: DiagnosisData,
        start: FingerStart,
        setting: Setting,
        draws: int,
        sample: bool,
        seed: int,
        stated: Mapping[str, Prior] | None,
    ) -> None:
        self.start, self.stated = start, stated
        self.data, self.setting, self.draws, self.sample, self.seed = data, setting, draws, sample, seed
        self.observed = data.observations(data.held_out) if data.n_held_out else None

    def __call__(self, fitted: Fitted, added: tuple[AddedEffect, ...], correction: Correction | None) -> EvaluatedModel:
        calibration = self.calibration(fitted, added, correction)
        held = self.held(fitted, correction)
        read: TouchReading | None = None
        if held is not None and self.sample:
            read = read_held_out(calibration, self.data, held, seed=self.seed)
        # Nothing moves a reference: what is at the stated ones is the same.
        unmoved = at_stated_references(fitted) is fitted
        held_stated = held if unmoved else self.held(fitted, correction, stated=True)
        return EvaluatedModel(fitted, correction, calibration, held, held_stated, read)

    def calibration(self, fitted: Fitted, added: tuple[AddedEffect, ...], correction: Correction | None) -> Calibration:
        """Posterior of a fit; without effects and correction that of `bayestouch.calibrate` for the same touches."""
        data = self.data
        if not added and correction is None:
            return finger_calibration(
                self.start.calibrated,
                self.start.fitted.model.known.means,
                self.start.used,
                sensor=data.dataset.sensor,
                priors=self.start.priors,
                rest=data.rest,
                draws=self.draws,
                seed=self.seed,
                notes=(*data.notes, *self.start.notes),
            )
        return calibration_with_effects(
            fitted,
            added,
            sensor=data.dataset.sensor,
            setting=self.setting,
            rest=data.rest,
            draws=self.draws,
            seed=self.seed,
            notes=data.notes,
            extra=None if correction is None else table_of(fitted, correction).arrays(),
            stated=self.stated,
        )

    def held(self, fitted: Fitted, correction: Correction | None, *, stated: bool = False) -> HeldOut | None:
        """Residuals of the held-out touches."""
        if self.observed is None:
            return None
        return held_out(fitted, correction, self.observed, force_noise(fitted), stated=stated)
