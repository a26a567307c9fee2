"""Posterior of the strength λ of the departure from the elastic family and of the error factor φ, by quadrature.

The elements share a scale Λ: the prior of ``λ_e`` is half-Cauchy with scale Λ, so that the departure of each element
may be near zero or large; the prior of log Λ is uniform.

Source: C. M. Carvalho, N. G. Polson and J. G. Scott (2010), doi:10.1093/biomet/asq017 (half-Cauchy scales).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from bayestouch.array_types import FloatArray
from bayestouch.finger.empirical.regression import DiagonalElement, Weights

# Grid of λ: from a value too small to be observed to ten times the scale. With n effective coefficients the sd of log λ
# is 1/√(2n): steps of 0.1 are fine enough for the 150 coefficients of a detailed E map.
STRENGTHS = np.geomspace(1e-4, 10.0, 121)
# Grid of Λ: from a thousandth of the scale, which cannot be observed, to the whole scale.
SCALES = np.geomspace(1e-3, 1.0, 61)
# Grid of log φ: steps are half the sd of its posterior with 150 touches; up to an error 30 times the known one.
LOG_FACTORS = np.arange(0.0, 3.4, 0.03)


@dataclass(frozen=True, eq=False)
class StrengthPosterior:
    """Posterior of the strength of the departure.

    Attributes
    ----------
    weights : tuple of Weights
        Posterior of (λ, φ) of each element.
    scale, scale_weight : (l,) arrays
        Grid of Λ and its posterior; empty if λ was given.
    """

    weights: tuple[Weights, ...]
    scale: FloatArray
    scale_weight: FloatArray

    def interval(self, probability: float = 0.9) -> tuple[float, float]:
        """Central interval of Λ; NaN if λ was given."""
        if not len(self.scale):
            return np.nan, np.nan
        cumulative = np.cumsum(self.scale_weight) - 0.5 * self.scale_weight
        tail = (1 - probability) / 2
        low, high = np.exp(np.interp([tail, 1 - tail], cumulative, np.log(self.scale)))
        return float(low), float(high)


def infer_strength(
    elements: Sequence[DiagonalElement], factor_known: Sequence[bool], strength: float | None = None
) -> StrengthPosterior:
    """Posterior of λ and φ of every element and of their scale Λ, by quadrature.

    Parameters
    ----------
    elements : sequence of DiagonalElement
        Data and priors of the elements.
    factor_known : sequence of bool
        For each element whether its error is known from repeats, so that φ is at least 1; else φ is free.
    strength : float, optional
        Fixed λ of all elements: 0 is the family, infinity no prior. Inferred by default.
    """
    strengths = STRENGTHS if strength is None else np.array([float(strength)])
    priors = [_factor_prior(known) for known in factor_known]
    tables = [
        element.log_evidence(strengths, factors) + log_prior
        for element, (factors, log_prior) in zip(elements, priors, strict=True)
    ]
    if strength is not None:
        empty = np.zeros(0)
        held = [Weights.on(strengths, factors, table) for (factors, _), table in zip(priors, tables, strict=True)]
        return StrengthPosterior(tuple(held), empty, empty)
    # log p(λ_i | Λ_l) on the grid of log λ
    ratio = np.log(STRENGTHS[:, None] / SCALES)
    conditional = -np.logaddexp(ratio, -ratio)
    conditional -= logsumexp(conditional, axis=0)
    own = np.stack([logsumexp(table, axis=1) for table in tables])
    by_scale = logsumexp(own[:, :, None] + conditional, axis=1)
    log_scale = by_scale.sum(axis=0)
    log_scale -= logsumexp(log_scale)
    weights = []
    for e, (factors, _) in enumerate(priors):
        # Posterior of λ of an element: its evidence times its prior, averaged over Λ given the other elements.
        others = log_scale - by_scale[e]
        log_prior = logsumexp(conditional + others, axis=1)
        weights.append(Weights.on(STRENGTHS, factors, tables[e] + log_prior[:, None]))
    return StrengthPosterior(tuple(weights), SCALES, np.exp(log_scale))


def _factor_prior(known: bool) -> tuple[FloatArray, FloatArray]:
    """Grid of φ and log prior masses.

    If the error is known from repeats, ``φ² = 1 + d²`` with a half-Cauchy d of scale 1: the model error may be smaller
    than the noise, about equal, or much larger. Otherwise log φ is uniform.
    """
    if not known:
        factors = np.exp(np.concatenate([-LOG_FACTORS[:0:-1], LOG_FACTORS]))
        return factors, np.full(len(factors), -np.log(len(factors)))
    factors = np.exp(LOG_FACTORS)
    edges = np.concatenate([[0.0], 0.5 * (LOG_FACTORS[1:] + LOG_FACTORS[:-1]), [LOG_FACTORS[-1] + 0.015]])
    share = np.arctan(np.sqrt(np.maximum(np.exp(2 * edges) - 1, 0.0)))
    mass = np.diff(share)
    return factors, np.log(mass / mass.sum())
