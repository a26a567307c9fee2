"""The flat vector of the calibration parameters of a finger: order and priors.

For m elements: log |response| (reading per N/m), depths r_s (mm), angles θ_s (rad), σ, log μ (MPa), log noise
(reading), log discrepancy (multiple of the noise of a touch's mean; only if repeats distinguish it from noise), log
noise of the force sensor (N/m). The chain depends on the first ``3 m + 2`` coordinates.

With effects, the values of those in the chain follow log μ, and the values of drifts and noise effects are last.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.priors.parameters import LogNormal, LogStudentT, Normal, Prior, StudentT


@dataclass(frozen=True)
class FlatLayout:
    """Positions of the parameters in the flat vector.

    Attributes
    ----------
    n_elements : int
        Number of elements m.
    discrepancy : bool
        Whether the vector has discrepancies.
    n_values : int
        Number of values of effects in the chain.
    n_further : int
        Number of values of drifts and noise effects.
    """

    n_elements: int
    discrepancy: bool
    n_values: int = 0
    n_further: int = 0

    @property
    def n_base(self) -> int:
        """Number of coordinates of the chain without effects."""
        return 3 * self.n_elements + 2

    def n_determined(self, present: BoolArray) -> int:
        """Number of the coordinates `n_base` on which the readings that are `present` (t, m) depend."""
        return self.n_base - 3 * int((~present).all(axis=0).sum())

    @property
    def n_chain(self) -> int:
        """Number of coordinates on which the chain depends."""
        return self.n_base + self.n_values

    @property
    def size(self) -> int:
        """Number of all coordinates."""
        return self.force_noise + 1 + self.n_further

    @property
    def response(self) -> slice:
        return slice(0, self.n_elements)

    @property
    def depth(self) -> slice:
        return slice(self.n_elements, 2 * self.n_elements)

    @property
    def angle(self) -> slice:
        return slice(2 * self.n_elements, 3 * self.n_elements)

    @property
    def sigma(self) -> int:
        return 3 * self.n_elements

    @property
    def log_mu(self) -> int:
        return 3 * self.n_elements + 1

    @property
    def noise(self) -> slice:
        return slice(self.n_chain, self.n_chain + self.n_elements)

    @property
    def log_discrepancy(self) -> slice:
        """Logarithms of the discrepancies over the noise; empty if the vector has none."""
        first = self.n_chain + self.n_elements
        return slice(first, first + (self.n_elements if self.discrepancy else 0))

    @property
    def force_noise(self) -> int:
        return self.n_chain + self.n_elements * (2 if self.discrepancy else 1)

    @property
    def values(self) -> slice:
        """Values of effects in the chain."""
        return slice(self.n_base, self.n_chain)

    @property
    def further(self) -> slice:
        """Values of drifts and noise effects."""
        return slice(self.force_noise + 1, self.size)


@dataclass(frozen=True, eq=False)
class FlatPrior:
    """Independent priors of all d coordinates.

    Attributes
    ----------
    layout : FlatLayout
        Positions in the flat vector.
    priors : tuple of Prior
        Prior of each value.
    logarithmic : (d,) bool array
        Whether the coordinate is the logarithm of the value.
    mean, spread : (d,) arrays
        Mean and sd of the normal approximation of the prior of each coordinate: exact for a normal prior, and for a
        log-normal prior of a logarithmic coordinate.
    """

    layout: FlatLayout
    priors: tuple[Prior, ...]
    logarithmic: NDArray[np.bool_]
    mean: FloatArray
    spread: FloatArray

    @classmethod
    def of(cls, n_elements: int, priors: tuple[Prior, ...]) -> FlatPrior:
        """Priors in the order of the flat vector; their number determines whether it has discrepancies."""
        layout = FlatLayout(n_elements, len(priors) > 4 * n_elements + 3)
        assert len(priors) == layout.size
        logarithmic = np.ones(layout.size, dtype=bool)
        logarithmic[n_elements : layout.log_mu] = False
        return cls._of(layout, priors, logarithmic)

    def with_values(self, values: Sequence[tuple[Prior, bool]], further: Sequence[tuple[Prior, bool]]) -> FlatPrior:
        """The priors with values of effects added: for each its prior, and whether its coordinate is a logarithm."""
        at = self.layout
        layout = replace(at, n_values=len(values), n_further=len(further))
        own = list(zip(self.priors, self.logarithmic.tolist(), strict=True))
        every = [*own[: at.n_base], *values, *own[at.n_base :], *further]
        return self._of(layout, tuple(prior for prior, _ in every), np.array([log for _, log in every]))

    @classmethod
    def _of(cls, layout: FlatLayout, priors: tuple[Prior, ...], logarithmic: NDArray[np.bool_]) -> FlatPrior:
        pairs = [normal_approximation(prior, bool(log)) for prior, log in zip(priors, logarithmic, strict=True)]
        mean, spread = np.array(pairs).T
        return cls(layout, priors, logarithmic, mean, spread)

    @cached_property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lowest and highest value of each coordinate, (d,) each."""
        low, high = np.array([prior.support for prior in self.priors]).T
        with np.errstate(divide="ignore"):
            log_low, log_high = (np.log(np.maximum(each, 0.0)) for each in (low, high))
        return np.where(self.logarithmic, log_low, low), np.where(self.logarithmic, log_high, high)

    def about(self, vector: FloatArray) -> FlatPrior:
        """The same priors with the normal approximation of each Student-t prior about a coordinate of `vector` (d,).

        The approximation has the slope of the log density at this coordinate, as in iteratively reweighted least
        squares: far from the centre of the prior it is wider. Normal priors are not changed.
        """
        at, centre, scale, dof = self._student
        mean, spread = self.mean.copy(), self.spread.copy()
        mean[at] = centre
        spread[at] = np.sqrt((dof * scale**2 + (vector[at] - centre) ** 2) / (dof + 1))
        return replace(self, mean=mean, spread=spread)

    def for_proposals(self) -> FlatPrior:
        """The same priors, with at least its standard deviation as the spread of each Student-t prior.

        With narrower normal proposals, chains accept few steps in the tails of the prior. The spread is at most twice
        the scale, since the standard deviation is infinite with few degrees of freedom.
        """
        at, _, scale, dof = self._student
        spread = self.spread.copy()
        spread[at] = np.maximum(spread[at], scale * np.sqrt(dof / np.maximum(dof - 2, dof / 4)))
        return replace(self, spread=spread)

    @cached_property
    def _student(self) -> tuple[NDArray[np.intp], FloatArray, FloatArray, FloatArray]:
        """Indices of the coordinates with a Student-t density; its centre, scale and degrees of freedom."""
        found = [
            (i, prior.centre, prior.scale, prior.dof)
            if isinstance(prior, StudentT)
            else (i, np.log(prior.median), prior.spread, prior.dof)
            for i, (prior, log) in enumerate(zip(self.priors, self.logarithmic, strict=True))
            if (isinstance(prior, StudentT) and not log) or (isinstance(prior, LogStudentT) and log)
        ]
        at, centre, scale, dof = np.array(found, dtype=float).reshape(-1, 4).T
        return at.astype(np.intp), centre, scale, dof

    @cached_property
    def _other(self) -> NDArray[np.intp]:
        """Indices of the coordinates whose prior is neither normal nor Student-t."""
        plain = [
            isinstance(prior, (LogNormal, LogStudentT) if log else (Normal, StudentT))
            for prior, log in zip(self.priors, self.logarithmic, strict=True)
        ]
        return np.flatnonzero(~np.array(plain))

    def log_density(self, vectors: FloatArray) -> FloatArray:
        """Log density (...) of coordinates (..., d) inside the bounds, up to a constant."""
        z = (vectors - self.mean) / self.spread
        z[..., self._other] = 0.0
        student, centre, scale, dof = self._student
        z[..., student] = 0.0
        total = -0.5 * np.einsum("...d,...d->...", z, z)
        if len(student):
            t = (vectors[..., student] - centre) / scale
            total = total - 0.5 * ((dof + 1) * np.log1p(t * t / dof)).sum(axis=-1)
        for i in self._other:
            coordinate = vectors[..., i]
            jacobian = coordinate if self.logarithmic[i] else 0.0
            value = np.exp(coordinate) if self.logarithmic[i] else coordinate
            total = total + self.priors[i].log_density(value) + jacobian
        return np.asarray(total)


def normal_approximation(prior: Prior, logarithmic: bool) -> tuple[float, float]:
    """Mean and standard deviation of a coordinate; from its quartiles if its prior is not normal."""
    if isinstance(prior, Normal) and not logarithmic:
        return prior.mean, prior.sd
    if isinstance(prior, LogNormal) and logarithmic:
        return float(np.log(prior.median)), prior.spread
    low, middle, high = prior.quantile([0.25, 0.5, 0.75])
    if logarithmic:
        low, middle, high = np.log([low, middle, high])
    # The quartiles of a normal distribution are 0.6745 standard deviations from the mean.
    return float(middle), float(high - low) / (2 * 0.6745)
