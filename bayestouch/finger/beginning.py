"""Start of the fits of a finger with effects, and the results of a fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from bayestouch.effects import Setting, catalogue
from bayestouch.finger.calibration import finger_calibration, require_likelihood, with_identified_map
from bayestouch.finger.calibration_with_effects import calibration_with_effects
from bayestouch.finger.correction_table import errs_by_element, table_of
from bayestouch.finger.density_with_effects import EffectPosterior
from bayestouch.finger.fit import without_offsets
from bayestouch.finger.fit_with_effects import effect_fit
from bayestouch.finger.held_out import held_out
from bayestouch.finger.log_density import density_of_fit, density_with_effects
from bayestouch.finger.place.fit import fit_of_places, fit_with_places
from bayestouch.finger.place.functions import PlaceFunctions
from bayestouch.finger.start import FingerStart, finger_start
from bayestouch.finger.touch_errors import read_held_out
from bayestouch.model.added import AddedEffect
from bayestouch.model.beginning import Beginning
from bayestouch.model.correction import Correction
from bayestouch.model.fitting import Fitted
from bayestouch.model.held_out import HeldOut
from bayestouch.model.log_density import LogDensity
from bayestouch.model.observations import Observations
from bayestouch.model.split_data import SplitData
from bayestouch.model.touch_errors import Infer, TouchReading
from bayestouch.priors.parameters import Prior
from bayestouch.results.keys import MODEL_MAP
from bayestouch.results.objects import Calibration


def begin(
    data: SplitData,
    *,
    contact: str,
    draws: int,
    seed: int,
    priors: Mapping[str, Prior] | None = None,
    e_map: str = MODEL_MAP,
    groups: Sequence[str] = (),
    moves: Any = None,
    functions: PlaceFunctions | None = None,
) -> Beginning:
    """Fit of a finger without effects, with default or stated priors.

    With `functions` of place, the fit includes them, and no effect can be added to it.

    Raises
    ------
    InputError
        For the reasons of `bayestouch.finger.start.finger_start`, or an identified E map with `groups`.
    """
    require_likelihood(groups, e_map)
    searched = data.observations(data.searched)
    start = finger_start(searched, data.dataset.sensor, contact, priors, data.rest_offsets(searched.means.touch))
    if functions is not None:
        start = replace(start, calibrated=fit_with_places(start.calibrated, functions)[0])
    setting = data.setting(contact, start.fitted.model.reference_load)
    observed = data.observations(data.held_out) if data.n_held_out else None
    evaluation = FingerEvaluation(data, setting, observed, start, draws, seed, e_map, moves, tuple(groups))
    has_it = "" if e_map == MODEL_MAP else "the identified E map includes errors that depend on element and location"
    return Beginning(start.fitted, setting, catalogue(setting), evaluation, no_correction=has_it)


@dataclass(frozen=True, eq=False)
class FingerEvaluation:
    """A `bayestouch.model.beginning.Evaluation` of fits of a finger.

    Attributes
    ----------
    data : SplitData
        Training and held-out touches.
    setting : Setting
        Setting by which the effects chose their priors.
    observed : Observations or None
        Held-out touches.
    start : FingerStart
        The fits without effects.
    draws, seed : int
        Number of draws and seed of the calibrations.
    e_map : str
        E map of the calibrations: that of the elastic model, or identified with the effects.
    moves : object
        Moves of emcee, as in `bayestouch.calibrate`; None for the default.
    groups : tuple of str
        Groups of the ArviZ schema that the calibrations have.
    """

    data: SplitData
    setting: Setting
    observed: Observations | None
    start: FingerStart
    draws: int
    seed: int
    e_map: str = MODEL_MAP
    moves: Any = None
    groups: tuple[str, ...] = ()

    def calibration(self, fitted: Fitted, added: tuple[AddedEffect, ...], correction: Correction | None) -> Calibration:
        """Posterior of a fit; without effects and correction that of `bayestouch.calibrate`, discrepancy "touch".

        Without effects, a correction with errors of the E maps (see `errs_by_element`) becomes the discrepancy "place"
        of `bayestouch.calibrate`, whose functions and lengths are chosen again.
        """
        data, in_place = self.data, correction is not None and self.e_map == MODEL_MAP and errs_by_element(correction)
        if not added and (correction is None or in_place):
            fit, chosen = self.start.calibrated, None
            why: tuple[str, ...] = ()
            if in_place:
                fit, chosen, why = fit_of_places(fit, wanted=True)
            calibration = finger_calibration(
                fit,
                self.start.fitted.model.known.means,
                self.start.used,
                sensor=data.dataset.sensor,
                priors=self.start.priors,
                rest=data.rest,
                draws=self.draws,
                seed=self.seed,
                notes=(*data.notes, *self.start.notes, *why),
                places=chosen,
                groups=self.groups,
                moves=self.moves,
            )
            return (
                calibration
                if self.e_map == MODEL_MAP
                else with_identified_map(calibration, without_offsets(self.start.calibrated))
            )
        calibration = calibration_with_effects(
            fitted,
            added,
            sensor=data.dataset.sensor,
            priors=self.start.priors,
            raw=self.start.fitted.model.known,
            setting=self.setting,
            rest=data.rest,
            draws=self.draws,
            seed=self.seed,
            notes=data.notes,
            extra=None if correction is None else table_of(fitted, correction).arrays(),
            groups=self.groups,
            moves=self.moves,
        )
        return calibration if self.e_map == MODEL_MAP else with_identified_map(calibration, fitted)

    def uses_correction(self, calibration: Calibration) -> bool:
        """True: a correction always becomes a part of the calibration."""
        return True

    def log_density(self, fitted: Fitted, added: tuple[AddedEffect, ...], correction: Correction | None) -> LogDensity:
        """Posterior density of the fit as a function."""
        unit = self.data.dataset.sensor.reading_unit
        if not added and correction is None:
            return density_of_fit(self.start.calibrated, unit)
        posterior = EffectPosterior.of(fitted, self.start.priors, self.start.fitted.model.known)
        return density_with_effects(effect_fit(fitted, added, posterior), unit)

    def held_out(self, fitted: Fitted, correction: Correction | None, *, stated: bool = False) -> HeldOut | None:
        """Residuals of the held-out touches (at stated references if `stated`); None if no touch is held out."""
        return (
            None
            if self.observed is None
            else held_out(fitted, correction, self.observed, self.start.peak, stated=stated)
        )

    def read(self, infer: Infer, calibration: Calibration, held: HeldOut) -> TouchReading:
        """Posteriors of the held-out touches, read by `infer` as unknown touches, and their errors."""
        return read_held_out(infer, calibration, self.data, held, seed=self.seed)
