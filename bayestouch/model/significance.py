"""Normal scores and tail probabilities of chi-squares and of sums of them, also far out in the tails."""

from __future__ import annotations

import numpy as np
from scipy.special import gammaincc, gammaln, ndtri, ndtri_exp

from bayestouch.array_types import FloatArray

# Below this tail probability its logarithm is computed: smaller numbers lose digits.
SMALLEST_TAIL = 1e-300
# Above this chi-square the root is used where it is exact, with one degree of freedom.
FAR = 600.0


def normal_score(chi_square: float, freedom: float) -> float:
    """Two-sided normal score z with the same tail probability as a chi-square."""
    if freedom == 1 and chi_square > FAR:
        return float(np.sqrt(chi_square))
    half, x = 0.5 * freedom, 0.5 * max(chi_square, 0.0)
    tail = float(gammaincc(half, x))
    if tail > SMALLEST_TAIL:
        return float(-ndtri(0.5 * tail)) if tail < 1 else 0.0
    # First term of the continued fraction of the incomplete gamma function. The tail is so small only where x is more
    # than 30 sd above its mean; there the score is right to a relative error below 1e-5.
    log_tail = half * np.log(x) - x - gammaln(half) - np.log(x + 1 - half)
    return float(-ndtri_exp(log_tail - np.log(2)))


def quadratic_score(slope: FloatArray, information: FloatArray) -> float:
    """Score of a random function: sum of squares of `slope`, with covariance `information` if the model is complete.

    The sum is approximated by a scaled chi-square with the same first two moments (Satterthwaite). The score has the
    tail probability of the sum, and is zero where the sum is below its mean.
    """
    mean, square = float(np.trace(information)), float((information**2).sum())
    if mean <= 0 or square <= 0:
        return 0.0
    scale, freedom = square / mean, mean**2 / square
    chi_square = float(slope @ slope) / scale
    return normal_score(chi_square, freedom) if chi_square > freedom else 0.0


def at_least_one(tail: float, trials: int) -> float:
    """Probability that the smallest tail probability of `trials` independent trials is at most `tail` (Šidák)."""
    return float(-np.expm1(trials * np.log1p(-min(tail, 1 - 1e-16))))


def lack_of_fit_tail(ratio: float, freedom: float, pure_freedom: float) -> float:
    """Tail probability of a lack-of-fit ratio: F distribution with the freedoms of residual and pure error."""
    from scipy.special import fdtrc

    return float(fdtrc(freedom, pure_freedom, ratio)) if freedom > 0 and pure_freedom > 0 else float("nan")


def lack_of_fit_limits(chance: float, freedom: float, pure_freedom: float) -> tuple[float, float]:
    """Limits of the central `1 - chance` of the lack-of-fit ratio if the model is complete."""
    from scipy.special import fdtri

    if freedom <= 0 or pure_freedom <= 0:
        return float("nan"), float("nan")
    low, high = fdtri(freedom, pure_freedom, [0.5 * chance, 1 - 0.5 * chance])
    return float(low), float(high)
