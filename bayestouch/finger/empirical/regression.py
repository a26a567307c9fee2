"""Linear regression about a parametric family, with one strength of departure; independent of fingers.

One element: ``y = X (m + J c + S a) + ε``. The prior mean m can change along a few tangents J (c has a wide normal
prior about a start). From this family each coefficient departs by ``a ~ N(0, λ²)`` times its scale S. The error of each
reading is ``φ`` times its known standard deviation. If φ also scales the wide prior of c, one singular value
decomposition makes data and prior diagonal, so that each (λ, φ) needs only a sum.

Source: C. M. Bishop, Pattern Recognition and Machine Learning (2006), sections 3.3 to 3.5.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from bayestouch.array_types import FloatArray
from bayestouch.errors import InputError

# Singular values below this share of the largest one do not determine a coefficient.
SMALLEST_SINGULAR_VALUE = 1e-12
NEGLIGIBLE_WEIGHT = 1e-9


@dataclass(frozen=True, eq=False)
class MapPrior:
    """Prior of the p coefficients of one element.

    Attributes
    ----------
    mean : (p,) array
        Prior mean m.
    scale : (p,) array
        S: the standard deviation of the departure of a coefficient is λ times this.
    tangents : (p, k) array
        J: change of the coefficients for one standard deviation of each parameter of the family; k may be 0.
    start : (k,) array
        Prior mean of c, in standard deviations.
    """

    mean: FloatArray
    scale: FloatArray
    tangents: FloatArray
    start: FloatArray


@dataclass(frozen=True, eq=False)
class ElementData:
    """Readings of one element, without missing ones.

    Attributes
    ----------
    design : (n, p) array
        Design matrix X.
    readings, sd : (n,) arrays
        Readings y and the known standard deviation of their errors.
    """

    design: FloatArray
    readings: FloatArray
    sd: FloatArray


@dataclass(frozen=True, eq=False)
class Weights:
    """Posterior of (λ, φ) of one element: grid points with a weight that is not negligible. The sum of weights is 1."""

    strength: FloatArray
    factor: FloatArray
    weight: FloatArray

    @classmethod
    def on(cls, strengths: FloatArray, factors: FloatArray, log_weight: FloatArray) -> Weights:
        """Weights from a table (λ, φ) of log weights."""
        weight = np.exp(log_weight - log_weight.max())
        kept = weight > NEGLIGIBLE_WEIGHT
        row, column = np.nonzero(kept)
        return cls(strengths[row], factors[column], weight[kept] / weight[kept].sum())


@dataclass(frozen=True, eq=False)
class DiagonalElement:
    """An element in the basis where data and departure are diagonal: ``z_i = s_i α_i + φ noise``, ``α_i ~ N(0, λ²)``.

    Attributes
    ----------
    singular, projected : (r,) arrays
        s and z.
    outside : float
        Sum of squares of the whitened readings that no departure can explain.
    n : int
        Number of readings.
    base : (p,) array
        Coefficients for α = 0: the family fitted to the readings.
    basis : (p, p) array
        Derivative of the coefficients over α, with the family fitted to the rest of the readings. The readings carry no
        information on the last ``p - r``.
    family_root : (p, k) array
        Root of the covariance of the coefficients due to the parameters of the family, for φ = 1.
    """

    singular: FloatArray
    projected: FloatArray
    outside: float
    n: int
    base: FloatArray
    basis: FloatArray
    family_root: FloatArray

    @classmethod
    def of(cls, data: ElementData, prior: MapPrior) -> DiagonalElement:
        """Diagonal form of an element's data and prior."""
        n, p = data.design.shape
        design = data.design / data.sd[:, None]
        tangents = design @ prior.tangents
        expected = prior.mean + prior.tangents @ prior.start
        residual = data.readings / data.sd - design @ expected
        # Family: c - start = Γ residual, with covariance (I + TᵀT)⁻¹; stable by QR of [T; I].
        k = tangents.shape[1]
        orthogonal, upper = np.linalg.qr(np.concatenate([tangents, np.eye(k)]))
        family = prior.tangents @ solve_triangular(upper, np.eye(k), lower=False)
        explain = family @ orthogonal[:n].T
        departure = design * prior.scale
        left, singular, right = np.linalg.svd(_reduced(departure, tangents), full_matrices=n < p)
        whitened = _reduced(residual[:, None], tangents)[:, 0]
        projected = left.T @ whitened
        r = len(singular)
        basis = right.T * prior.scale[:, None] - explain @ (departure @ right.T)
        return cls(
            singular=singular,
            projected=projected[:r],
            outside=max(float(whitened @ whitened - projected[:r] @ projected[:r]), 0.0),
            n=n,
            base=expected + explain @ residual,
            basis=basis,
            family_root=family,
        )

    def log_evidence(self, strengths: FloatArray, factors: FloatArray) -> FloatArray:
        """Log marginal likelihood over (λ, φ), up to a constant, (len(strengths), len(factors)).

        λ may be infinite: then only the part that the departure cannot explain is used (restricted likelihood).
        """
        out = np.zeros((len(strengths), len(factors)))
        square = factors**2
        r = len(self.singular)
        outside = self.outside / square + (self.n - r) * np.log(square)
        for i, strength in enumerate(strengths):
            total = outside
            if np.isfinite(strength):
                variance = square[:, None] + (strength * self.singular) ** 2
                total = outside + (self.projected**2 / variance + np.log(variance)).sum(axis=1)
            out[i] = -0.5 * total
        return out

    def mean(self, weights: Weights) -> FloatArray:
        """Posterior mean of the coefficients (p,), (λ, φ) integrated out."""
        gain, _, _ = self._shrinkage(weights)
        alpha = (weights.weight @ gain) * self.projected
        return np.asarray(self.base + self.basis[:, : len(alpha)] @ alpha)

    def posterior(self, weights: Weights) -> tuple[FloatArray, FloatArray]:
        """Mean (p,) and covariance (p, p) of the coefficients, (λ, φ) integrated out."""
        gain, inside, beyond = self._shrinkage(weights)
        r = len(self.singular)
        spread = np.full(self.basis.shape[1], float(weights.weight @ beyond))
        spread[:r] = weights.weight @ inside
        # Covariance between the means at the grid points.
        moved = np.sqrt(weights.weight)[:, None] * ((gain - weights.weight @ gain) * self.projected)
        family = float(np.sqrt(weights.weight @ weights.factor**2)) * self.family_root
        root = np.concatenate([self.basis * np.sqrt(spread), self.basis[:, :r] @ moved.T, family], axis=1)
        return self.mean(weights), root @ root.T

    def effective_coefficients(self, weights: Weights) -> float:
        """Number of coefficients that the readings determine rather than the prior, without those of the family."""
        gain, _, _ = self._shrinkage(weights)
        return float(weights.weight @ (gain * self.singular).sum(axis=1))

    def _shrinkage(self, weights: Weights) -> tuple[FloatArray, FloatArray, FloatArray]:
        """For each α at each grid point: mean over z and variance (g, r); variance without data (g,)."""
        strength, factor = weights.strength, weights.factor
        s = self.singular
        if np.isinf(strength).any():
            if len(s) < self.basis.shape[1] or not s.all() or s[-1] < SMALLEST_SINGULAR_VALUE * s[0]:
                rank = int((s > SMALLEST_SINGULAR_VALUE * s.max(initial=0.0)).sum())
                raise InputError(
                    f"{self.n} touches determine only {rank} of {self.basis.shape[1]} coefficients of the E map; "
                    "without a prior all must be: touch all the way around, or take fewer coefficients"
                )
            gain = np.broadcast_to(1 / s, (len(strength), len(s)))
            return gain, factor[:, None] ** 2 * gain**2, np.zeros(len(strength))
        square = strength[:, None] ** 2
        share = square / (factor[:, None] ** 2 + square * s**2)
        return share * s, share * factor[:, None] ** 2, strength**2


def _reduced(rows: FloatArray, tangents: FloatArray) -> FloatArray:
    """``(I + T Tᵀ)^(-1/2) rows``: the part that the family cannot explain."""
    left, singular, _ = np.linalg.svd(tangents, full_matrices=False)
    return np.asarray(rows - left @ ((1 - 1 / np.sqrt(1 + singular**2))[:, None] * (left.T @ rows)))
