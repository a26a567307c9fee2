"""Checks of the model: readings predicted again from the posterior, and how far the posterior follows the prior."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.stats import binom

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.reporting.calibration_tables import describe
from bayestouch.reporting.evidence import Evidence
from bayestouch.results.objects import Calibration, TouchPosteriors
from bayestouch.sampling.pareto import pareto_smooth

#: Groups that the checks need, of the calibration and of the touches.
CALIBRATION_GROUPS, TOUCH_GROUPS = ("log_likelihood", "log_prior"), ("log_likelihood", "posterior_predictive")
#: Predicted readings that are held in memory: 256 MB, and as much for their likelihood. With more there is no check.
MOST_PREDICTED = 1 << 26
#: A sensitivity above this is noticeable (Kallioinen et al. 2024, Statistics and Computing 34, 57).
NOTICEABLE = 0.05
#: Probability of the intervals, %; and below which a number of readings inside them is unlikely.
LEVELS, RARE = (50, 90), 0.01


def about_checks(evidence: Evidence) -> dict[str, Any]:
    """Numbers of ``report.json`` about the checks; null where a check is not possible.

    ``others_read`` says whether any touch has more than one reading, so that others can predict it.
    """
    return {
        "predictive": predictive_check(evidence.posteriors),
        "others_read": bool(with_others(np.isfinite(evidence.posteriors.rows.observed)).any()),
        "prior_sensitivity": prior_sensitivity(evidence.calibration),
    }


def predictive_check(posteriors: TouchPosteriors) -> dict[str, Any] | None:
    """How often the readings of each element are inside the intervals that the other readings of a touch predict.

    Each reading is left out by Pareto-smoothed weights, as in `arviz.loo_pit`: a posterior that has seen a reading
    predicts it too well. An element is named if so many of its readings are inside or outside that this has a
    probability below `RARE` among all elements.
    """
    again = posteriors.groups.get("posterior_predictive", {}).get("reading")
    log = posteriors.groups.get("log_likelihood", {}).get("reading")
    if again is None or log is None:
        return None
    rank = left_out_ranks(posteriors.rows.observed, again, log)
    if not np.isfinite(rank).any():
        return None
    rows: list[dict[str, Any]] = []
    outside, within = list[str](), list[str]()

    def name(e: int) -> str:
        return f"e{e + 1:02d}"

    elements = np.flatnonzero(np.isfinite(rank).any(axis=0)).tolist()
    # One of all elements is named by chance with the probability `RARE`, on either side.
    rare = 0.5 * RARE / max(len(elements), 1)
    for e in elements:
        own = rank[:, e][np.isfinite(rank[:, e])]
        inside = {level: int((np.abs(own - 0.5) <= level / 200).sum()) for level in LEVELS}
        fewest, most = (float(x) for x in binom(len(own), 0.9).ppf([rare, 1 - rare]))
        # Numbers of readings are compared, not percentages, which are rounded.
        outside += [name(e)] * (inside[90] < fewest)
        within += [name(e)] * (inside[90] > most)
        rows.append(
            {
                "element": name(e),
                "readings": len(own),
                "percent_inside": {str(level): 100 * count / len(own) for level, count in inside.items()},
                "expected_low": 100 * fewest / len(own),
                "expected_high": 100 * most / len(own),
            }
        )
    return {
        "readings": sum(row["readings"] for row in rows),
        "percent_inside_90": float(100 * np.mean(np.abs(rank[np.isfinite(rank)] - 0.5) <= 0.45)),
        "by_element": rows,
        "too_often_outside": outside,
        "too_often_inside": within,
    }


def left_out_ranks(observed: FloatArray, again: FloatArray, log: FloatArray) -> FloatArray:
    """Probability (t, m) that a reading is smaller than observed, predicted without this reading.

    NaN where the reading is missing, or the only one of its touch: no other reading predicts it.

    Parameters
    ----------
    observed : (t, m) array
        Readings.
    again, log : (chain, draw, t, m) arrays
        Replicated readings, and log likelihoods of the observed ones.
    """
    again, log = (values.reshape(-1, *values.shape[2:]) for values in (again, log))
    rank = np.full(observed.shape, np.nan)
    known = with_others(np.isfinite(observed) & np.isfinite(log[0]))
    for e in range(observed.shape[1]):
        here = np.flatnonzero(known[:, e])
        if here.size:
            weight, _ = pareto_smooth(-log[:, here, e].T.astype(np.float64))
            rank[here, e] = (weight * (observed[here, e, None] > again[:, here, e].T)).sum(axis=1)
    return rank


def with_others(read: BoolArray) -> BoolArray:
    """Readings (t, m) with at least one other reading of the same touch."""
    return np.asarray(read & (read.sum(axis=1, keepdims=True) > 1))


def prior_sensitivity(calibration: Calibration) -> dict[str, Any] | None:
    """Sensitivity of each calibration parameter to powers of the prior and of the likelihood, by ArviZ.

    Of a parameter with a value for each element that of the most sensitive element is given.
    """
    if not all(name in calibration.groups for name in CALIBRATION_GROUPS):
        return None
    names = [name for name in calibration.groups["log_prior"] if name in calibration.posterior]
    prior, likelihood = power_scaling(calibration, names)
    rows = []
    for name in names:
        symbol, _, text, meaning = describe(calibration, name)
        to_prior, to_likelihood = (float(np.max(each[name])) for each in (prior, likelihood))
        rows.append(
            {
                "name": name,
                "symbol": symbol,
                "meaning": meaning,
                "stated": text,
                "prior": to_prior,
                "likelihood": to_likelihood,
                "finding": _finding(to_prior, to_likelihood),
            }
        )
    return {"parameters": rows, "noticeable": NOTICEABLE}


def _finding(prior: float, likelihood: float) -> str:
    if prior < NOTICEABLE:
        return "the touches decide"
    return "prior and touches both matter" if likelihood >= NOTICEABLE else "the prior decides"


def power_scaling(calibration: Calibration, names: list[str]) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
    """Sensitivities to the prior and to the likelihood by name, () or (m,), of either line of ArviZ."""
    import arviz

    data, functions = calibration.to_arviz(), vars(arviz)
    if "psens" in functions:
        both = [functions["psens"](data, component=each, var_names=names) for each in ("prior", "likelihood")]
    else:
        both = [functions["psense"](data, var_names=names, group=each) for each in ("prior", "likelihood")]
    # of a single parameter ArviZ 0.x gives an array, not a data set
    sets = [getattr(found, "data_vars", {names[0]: found}) for found in both]
    first, second = ({name: np.asarray(found[name]) for name in names} for found in sets)
    return first, second
