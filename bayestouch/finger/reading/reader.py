"""Reading touches of a calibrated finger: the posterior density of many touches at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.noise import Noise
from bayestouch.finger.place.chain import PlacedFinger
from bayestouch.finger.reading.indenter_coordinate import IndenterCoordinate
from bayestouch.finger.reading.reading_table import ReadingTable
from bayestouch.priors.indenters import IndenterPrior, UniformRadius
from bayestouch.priors.parameters import Prior, Uniform


class CalibratedFinger(Protocol):
    """What reading a touch needs of a finger: the elastic chain or one with an identified E map."""

    @property
    def outer_radius_mm(self) -> float:
        """``r_b`` in mm."""
        ...

    @property
    def shear_modulus_MPa(self) -> float:
        """μ in MPa."""
        ...

    @property
    def angle(self) -> FloatArray:
        """``θ_s`` of the elements, rad."""
        ...

    @property
    def contact(self) -> str:
        """Name of the contact model."""
        ...

    def predict(self, radius_mm: ArrayLike, angle: ArrayLike, load: ArrayLike) -> FloatArray:
        """Readings (..., m) under touches of composite radius R (mm), location (rad) and load (N/m)."""
        ...


class TouchContext(Protocol):
    """What effects make of the readings of touches that were made when they were made."""

    def select(self, index: IntArray) -> TouchContext:
        """Some of the touches."""
        ...

    def joined(self, parts: Sequence[TouchContext]) -> TouchContext:
        """The touches of several contexts of the same effects, of which this is one."""
        ...

    def readings(
        self, signal: NDArray[np.floating], radius_mm: FloatArray, angle: FloatArray, load: FloatArray, touch: IntArray
    ) -> NDArray[np.floating]:
        """Readings (n, m) from signals of the elastic finger under touches (mm, rad, N/m), all (n,)."""
        ...

    def covariance(self, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
        """Covariance (t, m, m) of the mean readings beyond each element's own noise."""
        ...


@dataclass(frozen=True, eq=False)
class TouchReadings:
    """Mean readings of unknown touches; t touches, m elements.

    Attributes
    ----------
    readings : (t, m) array
        Mean readings, rest reading subtracted; NaN missing.
    counts : (t, m) array
        Raw readings behind each; 0 where missing.
    load, load_sd : (t,) arrays
        Measured load and its standard error, N/m; NaN load where not measured or not to be used.
    context : TouchContext, optional
        What effects make of these touches.
    """

    readings: FloatArray
    counts: IntArray
    load: FloatArray
    load_sd: FloatArray
    context: TouchContext | None = None

    @property
    def n_touches(self) -> int:
        """Number of touches."""
        return len(self.load)

    def select(self, index: IntArray) -> TouchReadings:
        """Some of the touches."""
        context = None if self.context is None else self.context.select(index)
        return TouchReadings(self.readings[index], self.counts[index], self.load[index], self.load_sd[index], context)


@dataclass(frozen=True)
class IndenterPriors:
    """Priors of a touch on a finger.

    Attributes
    ----------
    radius : Prior
        Composite radius R in mm, between 0 (edge) and ``r_b`` (flat): a density, or a `RadiusOfTips`. That nothing
        blunter than a flat touches the finger is itself a prior: concave indenters are left out.
    location : Uniform
        θ_c in rad.
    load : Prior
        P in N/m where it is not measured; where it is, the measurement multiplies it.
    """

    radius: Prior
    location: Uniform
    load: Prior

    @classmethod
    def of(cls, chain: CalibratedFinger, typical_load: float, indenter: IndenterPrior | None = None) -> IndenterPriors:
        """The indenter's prior (uniform in R up to the flat by default), uniform in θ_c and in P.

        θ_c over the elements and 20° beyond, P up to three typical loads.
        """
        margin = np.radians(20)
        return cls(
            radius=(indenter or UniformRadius()).radius_prior(chain.outer_radius_mm),
            location=Uniform(float(chain.angle.min() - margin), float(chain.angle.max() + margin)),
            load=Uniform(0.0, 3 * typical_load),
        )


@dataclass(frozen=True, eq=False)
class FingerPosterior:
    """Log posterior density of touches in the coordinates ``(w, θ_c, P)``; w is that of `IndenterCoordinate`.

    By default ``R = r_b/(1 + e^-w)``, which keeps R between edge and flat; the Jacobian is in the density. `whitener`
    turns residuals into independent standard ones: it holds sensor noise and, unless plugged in, what the calibration
    leaves uncertain.

    Attributes
    ----------
    chain : FingerChain
        Calibrated finger.
    touches : TouchReadings
        What was read.
    priors : IndenterPriors
        Priors of the touches.
    whitener : (t, m, m) or (t, m) array
        ``Σ^(-1/2)`` of each touch, or its diagonal; rows of missing readings are zero.
    table : ReadingTable, optional
        Readings by lookup, for many evaluations; without it the chain is evaluated.
    """

    chain: CalibratedFinger
    touches: TouchReadings
    priors: IndenterPriors
    whitener: FloatArray
    table: ReadingTable | None = None

    @cached_property
    def indenter(self) -> IndenterCoordinate:
        """What w means."""
        return IndenterCoordinate(self.priors.radius, self.chain.outer_radius_mm)

    def radius(self, w: FloatArray) -> FloatArray:
        """Composite radius R in mm."""
        return self.indenter.radius(w)

    def residual(self, x: FloatArray, blocks: IntArray) -> NDArray[np.floating]:
        """Whitened prediction minus reading (B, W, m) at coordinates x (B, W, 3) of the touches `blocks` (B,).

        By table in float32, which is good to 1e-4 of a squared residual; by the chain in float64 without a table.
        """
        # Coordinates are read one at a time: they may lie together in memory.
        angle, load = np.ascontiguousarray(x[..., 1]), np.ascontiguousarray(x[..., 2])
        radius = self.radius(np.ascontiguousarray(x[..., 0]))
        readings, whitener = np.nan_to_num(self.touches.readings[blocks])[:, None], self.whitener[blocks]
        difference: NDArray[np.floating]
        if self.table is None:
            difference = (
                self.effects_chain(self.chain.predict(radius, angle, load), radius, angle, load, blocks) - readings
            )
        else:
            if isinstance(self.chain, PlacedFinger):
                radius = self.chain.effective_radius(radius, angle)
            kappa = (load * radius / (1000 * self.chain.shear_modulus_MPa)).ravel()
            rows = self.table(np.maximum(kappa, 0.0), angle.ravel())
            rows *= load.astype(np.float32).reshape(-1, 1)
            rows = rows.reshape(*load.shape, -1)
            if isinstance(self.chain, FingerChain) and self.chain.finite_strain:
                rows += self.chain.beyond_linear(radius, angle, load).astype(np.float32)
            rows = self.effects_chain(rows, radius, angle, load, blocks)
            rows -= readings.astype(np.float32)
            difference, whitener = rows, whitener.astype(np.float32)
        if whitener.ndim == 2:
            difference *= whitener[:, None]
            return difference
        return np.asarray(difference @ whitener.swapaxes(-1, -2))

    def effects_chain(
        self, rows: NDArray[np.floating], radius_mm: FloatArray, angle: FloatArray, load: FloatArray, blocks: IntArray
    ) -> NDArray[np.floating]:
        """Signals (B, W, m) after the effects of the touches `blocks` (B,), which have these coordinates (B, W)."""
        context = self.touches.context
        if context is None:
            return rows
        touch = np.repeat(blocks, load.shape[1])
        flat = context.readings(rows.reshape(-1, rows.shape[-1]), radius_mm.ravel(), angle.ravel(), load.ravel(), touch)
        return flat.reshape(rows.shape)

    def log_prior(self, x: FloatArray, blocks: IntArray) -> FloatArray:
        """Log prior density with the transform's Jacobian, force reading included; (B, W)."""
        load = self.touches.load[blocks][:, None]
        with np.errstate(invalid="ignore"):
            miss = np.where(np.isnan(load), 0.0, (x[..., 2] - load) / self.touches.load_sd[blocks][:, None])
        return np.asarray(
            self.indenter.log_density(x[..., 0])
            + self.priors.location.log_density(x[..., 1])
            + self.priors.load.log_density(x[..., 2])
            - 0.5 * miss * miss
        )

    def log_density(self, x: FloatArray, blocks: IntArray) -> FloatArray:
        """Log posterior density up to a constant per touch; ``-inf`` outside the priors. (B, W)."""
        prior = self.log_prior(x, blocks)
        return np.where(np.isfinite(prior), prior - 0.5 * _sum_of_squares(self.residual(x, blocks)), -np.inf)


def _sum_of_squares(rows: NDArray[np.floating]) -> FloatArray:
    return np.asarray(np.einsum("bwm,bwm->bw", rows, rows), dtype=np.float64)


def noise_whitener(noise: Noise, touches: TouchReadings) -> FloatArray:
    """Diagonal whitener (t, m) from sensor noise alone."""
    sd = noise.mean_sd(touches.counts, np.zeros(touches.counts.shape))
    return np.where(np.isfinite(sd) & ~np.isnan(touches.readings), 1 / sd, 0.0)


def full_whitener(noise: Noise, touches: TouchReadings, calibration_covariance: FloatArray) -> FloatArray:
    """Whitener (t, m, m) from sensor noise and the calibration's covariance of the readings (t, m, m).

    Missing readings get a row of zeros, and do not disturb the others.
    """
    diagonal = noise_whitener(noise, touches)
    # Σ = D^(-1) (I + D C D) D^(-1) with D the diagonal whitener: a missing reading has D = 0 and drops out.
    inner = diagonal[:, :, None] * calibration_covariance * diagonal[:, None, :]
    root = np.linalg.cholesky(inner + np.eye(inner.shape[-1]))
    return np.linalg.solve(root, np.eye(inner.shape[-1])[None] * diagonal[:, None, :])
