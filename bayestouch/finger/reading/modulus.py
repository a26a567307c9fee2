"""Radii of touches where the shear modulus is hardly known: a mixture over the draws of the calibration.

Readings depend on R and the shear modulus μ by P R/μ alone. A touch is read with one modulus μ₀, that of the mode, and
so gives ``R' = R μ₀/μ``. Touches that say nothing of μ leave it independent of all else, and each R is R' times a draw
of μ/μ₀: its posterior is as skewed as that of μ. A covariance of the readings, which is right to first order, makes it
nearly symmetric.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.finger.lacking import is_from_prior
from bayestouch.priors.parameters import Parameter, Prior
from bayestouch.priors.radius import RadiusOfTips

# Standard deviation of log μ up to which the covariance is enough: the 5 % quantile of a normal distribution is then a
# tenth of an sd off that of a log-normal one, as much as the quantile of 400 draws scatters.
LINEAR_ENOUGH = 0.08
# Values of the modulus, in standard normal scores of their probability: so close that a density of R' is smooth, and so
# far that 1 in 4000 is beyond them.
VALUES = np.linspace(-3.5, 3.5, 561)
# Knots in log R': first one over the largest R', and spacing. Below the first knot, the density of R' is that there.
FIRST, SPACING = 1e-5, 0.02
#: Knots of R for given R', in standard normal scores of its probability.
SCORES = np.linspace(-3.5, 3.5, 57)
#: Probability of each.
SHARES = np.exp(-0.5 * SCORES**2) / np.exp(-0.5 * SCORES**2).sum()
_LOG_WEIGHT = -0.5 * VALUES**2 - np.logaddexp.reduce(-0.5 * VALUES**2)


@dataclass(frozen=True, eq=False)
class RadiusOverModulus:
    """Prior of ``R' = R μ₀/μ``, mm, and R given R'. A `bayestouch.priors.parameters.Prior`.

    Attributes
    ----------
    of_radius : Prior
        Prior of R, mm: a density.
    log_ratio : (g,) array
        Values of ``log(μ/μ₀)`` at the scores `VALUES`, ascending.
    """

    of_radius: Prior
    log_ratio: FloatArray

    @classmethod
    def of(
        cls, of_radius: Prior, parameters: Sequence[Parameter], posterior: Mapping[str, FloatArray], modulus_MPa: float
    ) -> RadiusOverModulus | None:
        """Prior for a calibration, or None where a covariance of the readings is enough, or R has known values.

        Parameters
        ----------
        of_radius : Prior
            Prior of R, mm.
        parameters : sequence of Parameter
            Parameters of the calibration, with their priors.
        posterior : mapping of str to array
            Draws of the parameters.
        modulus_MPa : float
            μ₀.
        """
        prior = next((each.prior for each in parameters if each.name == "mu"), None)
        if prior is None or isinstance(of_radius, RadiusOfTips):
            return None
        log_mu = np.log(np.ravel(posterior["mu"]))
        levels = ndtr(VALUES)
        log_prior = np.log(prior.quantile(levels))
        prior_sd = float(np.sqrt(np.exp(_LOG_WEIGHT) @ (log_prior - np.exp(_LOG_WEIGHT) @ log_prior) ** 2))
        if log_mu.std() < LINEAR_ENOUGH or not is_from_prior(log_mu, prior_sd):
            return None
        return cls(of_radius, np.quantile(log_mu, levels) - np.log(modulus_MPa))

    @property
    def widest(self) -> float:
        """Largest R' over the largest R."""
        return float(np.exp(-self.log_ratio[0]))

    @property
    def support(self) -> tuple[float, float]:
        low, high = self.of_radius.support
        return low * float(np.exp(-self.log_ratio[-1])), high * self.widest

    def log_density(self, value: ArrayLike) -> FloatArray:
        radius = np.asarray(value, dtype=float)
        low, high = self.support
        with np.errstate(divide="ignore"):
            log = np.interp(np.log(radius), self._log_knots, self._log_density)
        return np.where((radius >= low) & (radius <= high), log, -np.inf)

    def quantile(self, probability: ArrayLike) -> FloatArray:
        knots = np.exp(self._log_knots)
        density = np.exp(self._log_density)
        between = 0.5 * (density[1:] + density[:-1]) * np.diff(knots)
        below = np.cumsum(np.append(density[0] * knots[0], between))
        return np.asarray(np.interp(np.asarray(probability) * below[-1], np.append(0.0, below), np.append(0.0, knots)))

    def radius(self, over_modulus_mm: FloatArray) -> FloatArray:
        """R in mm for draws of R', (chain, draw, t).

        The modulus of a draw has the same probability in all touches, since they share it.
        """
        chains, draws, _ = over_modulus_mm.shape
        table, (i, row) = self._log_ratio_given, self._place(over_modulus_mm)
        column = (np.clip(_scores(chains, draws), SCORES[0], SCORES[-1]) - SCORES[0]) / (SCORES[1] - SCORES[0])
        j = np.minimum(column.astype(np.intp), len(SCORES) - 2)
        s, u = row - i, column - j
        left = table[i, j] + s * (table[i + 1, j] - table[i, j])
        right = table[i, j + 1] + s * (table[i + 1, j + 1] - table[i, j + 1])
        return np.asarray(np.clip(over_modulus_mm * np.exp(left + u * (right - left)), *self.of_radius.support))

    def radii(self, over_modulus_mm: FloatArray) -> FloatArray:
        """R in mm at the `SCORES` of its distribution given R' (g,), (g, 57)."""
        i, row = self._place(over_modulus_mm)
        lower, upper = self._log_ratio_given[i], self._log_ratio_given[i + 1]
        ratio = np.exp(lower + (row - i)[:, None] * (upper - lower))
        return np.asarray(np.clip(over_modulus_mm[:, None] * ratio, *self.of_radius.support))

    def _place(self, over_modulus_mm: FloatArray) -> tuple[IntArray, FloatArray]:
        """Number of the knot below R' (...), and place among the knots."""
        knots = self._log_knots
        with np.errstate(divide="ignore"):
            row = (np.log(over_modulus_mm) - knots[0]) / (knots[1] - knots[0])
        row = np.clip(row, 0.0, len(knots) - 1 - 1e-9)
        return row.astype(np.int64), row

    @cached_property
    def _log_knots(self) -> FloatArray:
        """Logarithms of the knots in R', (k,)."""
        high = self.support[1]
        return np.asarray(np.log(high) + np.linspace(np.log(FIRST), 0.0, int(-np.log(FIRST) / SPACING) + 1))

    @cached_property
    def _log_weight(self) -> FloatArray:
        """Log density of R' and a value of the modulus at the knots of R', (k, g)."""
        # dR/dR' is the ratio of the moduli.
        log = self.of_radius.log_density(np.exp(self._log_knots[:, None] + self.log_ratio)) + self.log_ratio
        return np.asarray(log + _LOG_WEIGHT)

    @cached_property
    def _log_density(self) -> FloatArray:
        return np.asarray(np.maximum(np.logaddexp.reduce(self._log_weight, axis=1), -1e3))

    @cached_property
    def _log_ratio_given(self) -> FloatArray:
        """Quantiles of ``log(μ/μ₀)`` given R' at the `SCORES`, (k, 57)."""
        weight = np.exp(self._log_weight - self._log_density[:, None])
        below = np.cumsum(weight, axis=1)
        middle = (below - 0.5 * weight) / np.maximum(below[:, -1:], 1e-300)
        levels = ndtr(SCORES)
        return np.stack([np.interp(levels, row, self.log_ratio) for row in middle])


@cache
def _scores(chains: int, draws: int) -> FloatArray:
    """Standard normal scores of evenly spread probabilities in a random order, (chains, draws, 1)."""
    n = chains * draws
    return np.asarray(ndtri((np.random.default_rng(0).permutation(n) + 0.5) / n).reshape(chains, draws, 1))
