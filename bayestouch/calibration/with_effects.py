"""Calibration of a sensor with stated effects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from bayestouch.data.dataset import DataSet
from bayestouch.effects import Effect, Values
from bayestouch.effects.stated import StatedModel
from bayestouch.errors import InputError, about, unknown_name
from bayestouch.model.added import AddedEffect, added_effects, moved_to
from bayestouch.model.beginning import Evaluation
from bayestouch.model.body import body_of
from bayestouch.model.candidates import score_in_form
from bayestouch.model.correction import Correction, corrected_fit
from bayestouch.model.drift_posterior import settled_drifts
from bayestouch.model.effect_list import named_effects
from bayestouch.model.fitting import Fitted
from bayestouch.model.joining import fit_with
from bayestouch.model.noise_posterior import FoundNoise
from bayestouch.model.peaks import settled
from bayestouch.model.rest_errors import begun_with_rest
from bayestouch.model.split_data import SplitData
from bayestouch.output.progress import Progress
from bayestouch.results.objects import Calibration


@dataclass(frozen=True, eq=False)
class StatedFit:
    """A sensor fitted with stated effects.

    Attributes
    ----------
    evaluation : Evaluation
        Computes the calibration.
    fitted : Fitted
        The fit.
    added : tuple of AddedEffect
        Effects of the fit, in the order in which they are stated.
    correction : Correction or None
        Correction of the fit; None if it has none.
    notes : tuple of str
        Notes for the calibration.
    """

    evaluation: Evaluation
    fitted: Fitted
    added: tuple[AddedEffect, ...]
    correction: Correction | None
    notes: tuple[str, ...]


def calibrate_with_effects(
    dataset: DataSet, model: StatedModel, *, draws: int, seed: int, progress: Progress | None, **options: Any
) -> Calibration:
    """Calibrate a sensor with the effects of a `StatedModel`, from its calibration touches.

    Parameters
    ----------
    dataset, draws, seed, progress
        As in `bayestouch.calibrate`.
    model : StatedModel
        Effects, with the starting values of fits.
    options
        Options of the body: contact of a finger, kernel of a pad, E map and priors.

    Raises
    ------
    InputError
        For the reasons of `bayestouch.calibrate`, or an effect cannot occur or be observed with these touches.
    """
    fit = fit_stated(dataset, model, draws=draws, seed=seed, progress=progress, **options)
    calibration = fit.evaluation.calibration(fit.fitted, fit.added, fit.correction)
    return replace(calibration, notes=(*calibration.notes, *fit.notes))


def fit_stated(
    dataset: DataSet, model: StatedModel, *, draws: int, seed: int, progress: Progress | None = None, **options: Any
) -> StatedFit:
    """Fit a sensor with the effects of a `StatedModel`; parameters and errors as in `calibrate_with_effects`."""
    advance = progress or (lambda fraction: None)
    data = SplitData.of_calibration(dataset)
    _, begun = begun_with_rest(body_of(dataset.sensor), data, draws=draws, seed=seed, **options)
    fitted, known = begun.fitted, {effect.name for effect in begun.effects}
    with about(model.path):
        effects = named_effects([name for name, _ in model.effects], begun.setting, dict(model.effects))
        for effect, (_, start) in zip(effects, model.effects, strict=True):
            if effect.name not in known:
                reason = f"effect {effect.name} goes with the place of the touch: the map of a pad has it already"
                raise InputError(reason)
            require_starts(effect, start)
    noise: tuple[FoundNoise, ...] = ()
    for i, (effect, (_, start)) in enumerate(zip(effects, model.effects, strict=True)):
        advance((i + 1) / (len(effects) + 2))
        fitted, found = _with_effect(fitted, effect, start)
        noise = found or noise
    fitted, spreads = settled_drifts(fitted)
    added = added_effects(fitted, noise, spreads)
    order = [effect.name for effect in effects]
    added.sort(key=lambda each: order.index(each.effect.name))
    correction = None
    notes: tuple[str, ...] = ()
    if model.correction and begun.no_correction:
        notes = (f"no correction is added: {begun.no_correction}",)
    elif model.correction:
        corrected = corrected_fit(fitted)
        if corrected is None:
            notes = ("the model states a correction, but these touches show no error to correct",)
        else:
            fitted, correction = corrected
            added = list(moved_to(fitted, added))
    return StatedFit(begun.evaluation, fitted, tuple(added), correction, notes)


def require_starts(effect: Effect, start: Mapping[str, float]) -> None:
    """Raise an error unless a fit of the effect can start from the stated values.

    Raises
    ------
    InputError
        A value is of no parameter of the effect, or is not above zero where the fit starts from its logarithm.
    """
    names = [parameter.name for parameter in effect.parameters]
    if wrong := sorted(set(start) - set(names)):
        raise unknown_name(f"parameter of effect {effect.name}:", wrong[0], names, column="effect.start")
    for each in effect.parameters:
        # A fit starts from the logarithm of such a value.
        if each.logarithmic and start.get(each.name, 1.0) <= 0:
            reason = f"{each.name} of effect {effect.name}: expected a start above 0, got {start[each.name]:g}"
            raise InputError(reason, column="effect.start")


def _with_effect(fitted: Fitted, effect: Effect, start: Mapping[str, float]) -> tuple[Fitted, tuple[FoundNoise, ...]]:
    """The model fitted with one more effect, from stated starting values if there are any."""
    effect = effect.as_stated(start)
    new = fit_with(effect, fitted, partial(_start, fitted, effect, start))
    return (new.fitted if new.noise else settled(new.fitted)), new.noise


def _start(fitted: Fitted, effect: Effect, stated: Mapping[str, float]) -> Values:
    """Starting values of the fit of an effect of the chain: the stated ones, else those of its score test."""
    begun = score_in_form(fitted, effect).start
    values = tuple(stated.get(p.name, value) for p, value in zip(effect.parameters, begun, strict=True))
    low, high = zip(*(p.prior.support for p in effect.parameters), strict=True)
    return tuple(min(max(v, a), b) for v, a, b in zip(values, low, high, strict=True))
