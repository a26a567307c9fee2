"""The empirical map of a pad: a smooth function of location for each element that is added to its kernel.

The correction of the sensitivity of an element is a Gaussian process with the covariance
``amplitude_e² [A² + B² K_e(x) K_e(x')] ρ(|x - x'|/l)`` between locations x and x': an error of size A everywhere and
one of size B in proportion to the kernel K, both with the correlation length l. A, B and l are shared by the elements
and estimated by `bayestouch.pad.misfit_fit.fit_misfit`; amplitude_e is the absolute signal of the element. If the mean
is the kernel, an E map is identified with a prior that is centred on the elastic model; if the mean is a constant, the
prior has no model of location.

Source: C. E. Rasmussen and C. K. I. Williams, Gaussian Processes for Machine Learning (2006), equations 2.23 to
2.26, 2.30 (marginal likelihood), 5.12 (leave-one-out).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.chain.smooth import distances
from bayestouch.pad.inducing import REST, InducedCovariance

# As `REST`, for the functions that a sampler integrates out beside other unknowns: a third of their number, and the
# standard deviation of a reading changes by 1.5 % at most.
REST_OF_FEW = 0.03


def matern_5_2(r: FloatArray) -> FloatArray:
    """Matérn correlation of smoothness 5/2 (twice differentiable); `r` is the distance over the correlation length."""
    s = np.sqrt(5.0) * r
    return np.asarray((1 + s + s * s / 3) * np.exp(-s))


def matern_5_2_by_length(r: FloatArray) -> FloatArray:
    """Derivative of `matern_5_2` over the logarithm of the correlation length."""
    s = np.sqrt(5.0) * r
    return np.asarray(s * s / 3 * (1 + s) * np.exp(-s))


@dataclass(frozen=True, eq=False)
class MapDiscrepancy:
    """Covariance of reading minus kernel: smooth correction and noise; n touches, m elements.

    Attributes
    ----------
    location : (n, D) array
        Locations of the touches, mm.
    load : (n,) array
        Loads; the correction is per unit load.
    variance : (n, m) array
        Noise variance of the readings; inf where missing.
    amplitude : (m,) array
        Absolute signal of each element per unit load.
    shape : (n, m) array
        Kernel of each element at each touch.
    misfit : float
        A; 0 for no correction.
    relative : float
        B.
    length_mm : float
        l.
    """

    location: FloatArray
    load: FloatArray
    variance: FloatArray
    amplitude: FloatArray
    shape: FloatArray
    misfit: float = 0.0
    relative: float = 0.0
    length_mm: float = 1.0

    def select(self, index: NDArray[np.int64]) -> MapDiscrepancy:
        """The covariance for some of the touches."""
        return replace(
            self,
            location=self.location[index],
            load=self.load[index],
            variance=self.variance[index],
            shape=self.shape[index],
        )

    @property
    def present(self) -> NDArray[np.bool_]:
        """Whether each reading is present, (n, m)."""
        return np.isfinite(self.variance)

    @cached_property
    def _correlations(self) -> FloatArray:
        rho = matern_5_2(distances(self.location, self.location) / self.length_mm)
        return np.asarray(rho * self.load[:, None] * self.load)

    def _filled(self, variance: FloatArray) -> FloatArray:
        # A missing reading has a noise so large that it carries no information; 1e9 keeps the factor accurate.
        present = np.isfinite(variance)
        largest = np.where(present, variance, 0.0).max(axis=0)
        signal = (self.misfit**2 + self.relative**2) * self.amplitude**2 * (self.load**2).max()
        return np.where(present, variance, 1e9 * np.maximum(largest + signal, 1e-300))

    @cached_property
    def covariances(self) -> tuple[InducedCovariance, ...]:
        """Covariance of the readings of each element."""
        noises = self._filled(self.variance).T
        if self.misfit == 0:
            return tuple(InducedCovariance.independent(noise) for noise in noises)
        return tuple(self._induced(e, noise) for e, noise in enumerate(noises))

    def few_functions(self, variance: FloatArray, most: int, rest: float) -> tuple[InducedCovariance, ...]:
        """Covariance of the readings of each element with few inducing touches: for fits with their weights.

        Parameters
        ----------
        variance : (n, m) array
            Noise variance of the readings; inf where missing.
        most : int
            Largest number of inducing touches of one element.
        rest : float
            As `REST`.
        """
        return tuple(self._induced(e, noise, rest, most) for e, noise in enumerate(self._filled(variance).T))

    def _induced(
        self, element: int, noise: FloatArray, rest: float = REST, most: int | None = None
    ) -> InducedCovariance:
        covariance = self._modulated(element, self._correlations, self.shape[:, element], self.shape[:, element])
        return InducedCovariance.of(covariance, noise, rest, most)

    def functions_at(
        self, element: int, location: FloatArray, shape: FloatArray, covariance: InducedCovariance | None = None
    ) -> FloatArray:
        """Correction of the sensitivity of an element per unit of each of its weights, at q locations, (q, k).

        Parameters
        ----------
        element : int
            Index of the element.
        location : (q, D) array
            Locations, mm.
        shape : (q,) array
            Kernel of the element there.
        covariance : InducedCovariance, optional
            One of `few_functions`, if the weights are those of its functions and not of all.
        """
        covariance = covariance or self.covariances[element]
        at = covariance.inducing
        rho = matern_5_2(distances(location, self.location[at]) / self.length_mm) * self.load[at]
        return covariance.functions_at(self._modulated(element, rho, shape, self.shape[at, element]))

    def prior_variance(self, element: int, shape: FloatArray) -> FloatArray:
        """Prior variance of the correction of an element where its kernel is `shape`."""
        return np.asarray(self.amplitude[element] ** 2 * (self.misfit**2 + (self.relative * shape) ** 2))

    def functions(self, variance: FloatArray, most: int) -> tuple[tuple[FloatArray, ...], FloatArray]:
        """The correction of each element as a sum of functions with standard normal weights, and the variance left out.

        There are at most `most` functions of one element; `bayestouch.pad.inducing` has how they are chosen.

        Parameters
        ----------
        variance : (n, m) array
            Noise variance of the readings.
        most : int
            Largest number of functions of one element.

        Returns
        -------
        tuple of (k_e, n) arrays, (n, m) array
            Change of the readings per unit of each weight, and the variance of the rest of the correction.
        """
        found = self.few_functions(variance, most, REST_OF_FEW)
        return tuple(each.columns.T.copy() for each in found), np.column_stack([each.left for each in found])

    def _modulated(self, element: int, correlation: FloatArray, one: FloatArray, two: FloatArray) -> FloatArray:
        """Covariance (q, n) of an element from correlations (q, n), where its kernel is `one` (q,) and `two` (n,)."""
        own = (self.relative * self.amplitude[element]) ** 2 * np.outer(one, two)
        return np.asarray(((self.misfit * self.amplitude[element]) ** 2 + own) * correlation)
