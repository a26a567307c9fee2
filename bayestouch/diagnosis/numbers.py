"""Content of ``diagnosis.json``."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

import numpy as np

from bayestouch.data.dataset import DataSet
from bayestouch.data.json_values import strict
from bayestouch.diagnosis.causes import IN_TIME, causes, drifts_not_added, number_tried
from bayestouch.diagnosis.change import standard_errors
from bayestouch.diagnosis.fingerprints import data_fingerprints
from bayestouch.diagnosis.imitations import Named, by_chance, with_imitations
from bayestouch.diagnosis.place_or_time import IN_PLACE, Difference, PlaceOrTime, in_place
from bayestouch.diagnosis.rounds import SearchRound, Tried
from bayestouch.diagnosis.traced import EvaluatedModel, Refused, Traced
from bayestouch.diagnosis.verdict import LackOfFit, structure_left, verdict
from bayestouch.diagnosis.where import where_it_is
from bayestouch.model.added import AddedEffect
from bayestouch.model.touch_errors import KEYS
from bayestouch.model.usable_touches import left_out_elements
from bayestouch.results.objects import Calibration
from bayestouch.results.targets import kept_draws

Numbers = dict[str, Any]


def diagnosis_numbers(traced: Traced, dataset: DataSet) -> Numbers:
    """Content of ``diagnosis.json`` of a data set in plain types; None for what the data cannot give."""
    data, after, remaining = traced.data, traced.after, traced.remaining
    held = traced.before.held_out
    said = verdict(len(traced.added), remaining, traced.returned)
    chosen = {each.added.effect.name: each.added for each in traced.rounds if each.added is not None}
    effects = [_effect(each, chosen[each.effect.name], traced.explained.calibration) for each in traced.added]
    numbers: Numbers = {
        "data": {
            "touches": len(np.unique(data.table.touch[data.training | data.held_out])),
            "elements": data.dataset.sensor.n_elements,
            "held_out_touches": data.n_held_out,
            "unreferenced": data.unreferenced,
            "elements_left_out": left_out_elements(data.table, data.training | data.held_out),
            "fingerprints": data_fingerprints(dataset),
        },
        "noise_floor_percent_peak": _noise_floor(traced),
        "noise_from_repeats": _has_repeats(traced),
        "loads_measured": held is None or bool(np.isfinite(held.observed.load).all()),
        "before": _errors(traced.before),
        "after": _errors(after),
        "after_against_stated": _errors(after, stated=True),
        "change_against_stated_se": standard_errors(traced.before, after),
        "lack_of_fit_limits": {"before": _limits(remaining.before), "after": _limits(traced.returned)},
        "verdict": said,
        "causes": [asdict(each) for each in with_imitations(causes(traced.rounds), _named(traced, said))],
        "effects": effects,
        "draws": _draws(traced.explained.calibration),
        "candidates": [_candidate(each) for each in traced.rounds[0].tried],
        "unexplained": {
            "fraction": remaining.fraction,
            "p_value": remaining.after.p_value,
            "where": where_it_is(traced.explained.held_out) if remaining.after.there else "nowhere",
            "test": asdict(remaining.after),
        },
        "correction": None,
        "calibration_after": {
            "effects": list(after.fitted.names),
            "correction": after.correction is not None,
        },
        "not_used": [_not_used(each) for each in traced.refused],
        "in_place": _in_place(traced),
        "not_distinguishable": _not_distinguishable(traced),
        "measure": None if traced.advice is None else {**asdict(traced.advice), "advice": str(traced.advice)},
        "rounds": [_round(each) for each in traced.rounds],
        "notes": list(data.notes),
    }
    if traced.corrected is not None and traced.corrected.correction is not None:
        numbers["correction"] = {
            "before": _errors(traced.uncorrected),
            "after": _errors(traced.corrected),
            "sizes_percent_peak": {k: 100 * v for k, v in traced.corrected.correction.sizes.items()},
        }
    plain: Numbers = strict(numbers)
    return plain


def _errors(evaluated: EvaluatedModel, *, stated: bool = False) -> Numbers:
    """Errors against references, either as the model corrects them or as the data set states them."""
    held = evaluated.held_stated if stated else evaluated.held_out
    of_touches: Numbers = dict.fromkeys(KEYS)
    if evaluated.read is not None:
        of_touches = evaluated.read.against_stated if stated else evaluated.read.errors
    # On pads the prediction error is that of samples, so that of touch means is added; on fingers it already is.
    means = {} if held is None or held.samples is None else {"touch_error_percent_peak": held.touch_error_percent_peak}
    return {
        "prediction_error_percent_peak": None if held is None else held.error_percent_peak,
        "lack_of_fit": None if held is None else held.lack_of_fit,
        **means,
        **of_touches,
    }


def _draws(calibration: Calibration) -> Numbers:
    """Grades of the draws of the effects' values, and their number, on which the targets depend."""
    kept = kept_draws(calibration.posterior)
    grades = {key: calibration.statistics.get(key) for key in ("ess_bulk", "rhat")}
    return {**grades, "kept": None if kept is None else math.prod(kept)}


def _not_used(refused: Refused) -> Numbers:
    """A model that is not returned, with its errors and what it reads worse."""
    model = refused.model
    return {
        "effects": list(model.fitted.names),
        "correction": model.correction is not None,
        "references_corrected": refused.believed,
        "worse": {
            each.key: {"before": each.before, "after": each.after, "touches": each.touches} for each in refused.worse
        },
        "after": _errors(model),
        "after_against_stated": _errors(model, stated=True),
    }


def _in_place(traced: Traced) -> Numbers | None:
    """Gain of functions of place over the last model; None if they or the misfit that remains are not certain."""
    last = traced.rounds[-1]
    there = traced.remaining.after.there
    gained = in_place(last.before, last.held_out, last.held_out_in_place) if there else None
    return None if gained is None else {name: _difference(each) for name, each in gained.items()}


def _not_distinguishable(traced: Traced) -> list[list[str]]:
    """Pairs of explanations between which these data do not decide."""
    added = [each.added for each in traced.rounds if each.added is not None]
    pairs = [[each.effect.name, other] for each in added for other in each.indistinguishable]
    return pairs + [[each.drift, IN_PLACE] for each in traced.rounds[-1].place_or_time if each.undecided]


def _named(traced: Traced, said: str) -> Named:
    """What the verdict says of causes, with the names that sets of causes have."""
    drifts = drifts_not_added(traced.rounds)
    pairs = [tuple(IN_TIME if each in drifts else each for each in pair) for pair in _not_distinguishable(traced)]
    # "Nothing" is the model without effects, so that its lack of fit counts.
    before = traced.remaining.before
    chance = by_chance(before.p_value, number_tried(traced.rounds)) if before.there else 1.0
    return Named(tuple(each.effect.name for each in traced.added), structure_left(said), tuple(pairs), chance)


def _difference(found: Difference) -> Numbers:
    return dict(zip(("elpd_gain", "elpd_gain_se"), found, strict=True))


def _limits(test: LackOfFit) -> Numbers:
    return {"low": test.low, "high": test.high, "expected": test.expected}


def _has_repeats(traced: Traced) -> bool:
    """True if the noise of the readings is known from repeats."""
    held, means = traced.before.held_out, traced.before.fitted.model.known.means
    return (held is None or held.repeated) and bool(np.nansum(means.pure_error_dof) > 0)


def _noise_floor(traced: Traced) -> float | None:
    """Prediction error of a correct model: noise of the readings, from repeats, and the error of the load.

    It is computed with the effects of the model that is returned, because changes during a touch are not noise.
    """
    held = traced.tested.held_out
    return held.floor_percent_peak if held is not None and _has_repeats(traced) else None


def _effect(added: AddedEffect, tried: Tried, calibration: Calibration) -> Numbers:
    parameters = {}
    for parameter in added.effect.public_parameters():
        draws = calibration.posterior[parameter.name]
        spread = float(draws.std())
        parameters[parameter.name] = {
            "mean": float(draws.mean()),
            "sd": spread if spread > 1e-9 * abs(float(draws.mean())) else None,
            "unit": parameter.unit,
        }
    return {
        "name": added.effect.name,
        "stage": added.effect.stage,
        "summary": added.effect.summary,
        "parameters": parameters,
        "elpd_gain": tried.gain,
        "elpd_gain_se": tried.gain_se,
        "explained_fraction": tried.share,
        "indistinguishable_from": list(tried.indistinguishable),
    }


def _candidate(tried: Tried) -> Numbers:
    return {
        "name": tried.effect.name,
        "stage": tried.effect.stage,
        "score_z": tried.z,
        "elpd_gain": tried.gain,
        "elpd_gain_se": tried.gain_se,
        "explained_fraction": tried.share,
        "visible_fraction": tried.seen,
    }


def _round(each: SearchRound) -> Numbers:
    return {
        "added": None if each.added is None else each.added.effect.name,
        "candidates": [_candidate(tried) for tried in each.tried],
        "correction_elpd_gain": each.correction_gain,
        "correction_elpd_gain_se": each.correction_se,
        "place_or_time": [_place_or_time(one) for one in each.place_or_time],
    }


def _place_or_time(each: PlaceOrTime) -> Numbers:
    """Gain of a drift over functions of place, and the probability that it predicts better."""
    probability = each.probability_of_drift
    across = {name: {**_difference(one), "probability": probability[name]} for name, one in each.across.items()}
    return {"drift": each.drift, "across": across}
