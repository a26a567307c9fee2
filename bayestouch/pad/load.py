"""Nonlinearity of the readings of a pad in the load."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.loads import loads_vary
from bayestouch.pad.candidates import PadCandidate, percent_of_peak
from bayestouch.pad.fit import fit_chain
from bayestouch.pad.problem import PadProblem
from bayestouch.pad.residual_map import MapDiscrepancy

# Largest number of touches. The exponent is only a description; this number of touches determines it to 1 %.
_MOST_TOUCHES = 400


def load_statistics(problem: PadProblem, model: PadCandidate) -> dict[str, float]:
    """Measures of the nonlinearity in the load; empty if loads were not measured or hardly vary.

    Parameters
    ----------
    problem : PadProblem
        The known touches.
    model : PadCandidate
        The model with the smallest error, chosen or not: its remaining errors are mainly due to the load.

    Returns
    -------
    dict
        ``load_exponent``: n for which ``offset + (map of location) P^n`` predicts left-out readings best, with the
        kernel and hyper-parameters of the model for n = 1, and a noise that is the same at all loads; n near 0 is a
        logarithm.
        ``error_percent_peak_power``: rms error with this n, ``error_percent_peak_linear``: rms error with n = 1, both
        over the same touches, percent of peak.
        ``load_trend_share``: share of the variance of the errors of the linear model that a parabola in the load
        explains.
    """
    load = problem.known.load
    if not (problem.load_measured and loads_vary(load)):
        return {}
    from scipy.optimize import minimize_scalar

    chosen = np.arange(len(load))
    if len(load) > _MOST_TOUCHES:
        chosen = np.sort(np.random.default_rng(problem.seed).choice(len(load), _MOST_TOUCHES, replace=False))
    known = problem.known.select(chosen)
    misfit = _with_even_noise(model.fit.misfit.select(chosen))
    priors = problem.priors.of(model.kernel)
    typical = float(np.median(known.load))

    def error(exponent: float) -> float:
        bent = typical * (known.load / typical) ** exponent
        touches = replace(known, load=bent)
        fit = fit_chain(model.fit.chain, priors, touches, replace(misfit, load=bent))
        return percent_of_peak(fit.left_out[0], known.readings - fit.chain.offset)

    best = minimize_scalar(error, bounds=(0.01, 3.0), method="bounded", options={"xatol": 0.01})
    return {
        "load_exponent": float(best.x),
        "error_percent_peak_power": float(best.fun),
        "error_percent_peak_linear": error(1.0),
        "load_trend_share": _trend_share(model.left_out.residual, load),
    }


def _with_even_noise(misfit: MapDiscrepancy) -> MapDiscrepancy:
    """The discrepancy with the mean variance of each element in all its readings.

    The noise of the linear model includes its error at high loads. With this noise few readings at low loads would
    determine the exponent.
    """
    mean = np.where(misfit.present, misfit.variance, 0.0).sum(axis=0) / np.maximum(misfit.present.sum(axis=0), 1)
    return replace(misfit, variance=np.where(misfit.present, mean, np.inf))


def _trend_share(residual: FloatArray, load: FloatArray) -> float:
    """Share of the variance of residuals (n, m) that a parabola in the load explains, mean over elements."""
    design = np.vander((load - load.mean()) / np.ptp(load), 3)
    total, left = 0.0, 0.0
    for column in residual.T:
        here = np.isfinite(column)
        if here.sum() < 4:
            continue
        fit, *_ = np.linalg.lstsq(design[here], column[here], rcond=None)
        scale = float(np.var(column[here])) or 1.0
        total += 1.0
        left += float(np.var(column[here] - design[here] @ fit)) / scale
    return 1 - left / total if total else float("nan")
