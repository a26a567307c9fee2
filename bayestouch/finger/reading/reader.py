"""Posterior density of touches on a calibrated finger, for many touches at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.array_types import BoolArray, FloatArray, IntArray
from bayestouch.chain.noise import Noise
from bayestouch.data.arrays import nearest_turn, read_once
from bayestouch.finger.known_touches import hardest_load
from bayestouch.finger.reading.indenter_coordinate import IndenterCoordinate
from bayestouch.finger.reading.reading_table import ReadingTable
from bayestouch.finger.reading.signal_noise import SignalNoise
from bayestouch.priors.indenters import IndenterPrior, UniformRadius
from bayestouch.priors.parameters import Prior, Uniform
from bayestouch.reading.ends import is_at_the_end
from bayestouch.results.objects import Calibration

#: A whole turn, rad.
TURN = 2 * np.pi


class CalibratedFinger(Protocol):
    """Protocol of a finger for the inference of touches: the elastic chain, or one with an identified E map."""

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

    @property
    def finite_strain(self) -> float:
        """Fraction of the finite strain in the readings; 0 where they are in proportion to the load."""
        ...

    def effective_radius(self, radius_mm: FloatArray, angle: FloatArray) -> FloatArray:
        """Composite radius (...), mm, with the curvature of the surface at locations (...), rad.

        `radius_mm` (...) is the composite radius R on a round surface.
        """
        ...

    def predict(self, radius_mm: ArrayLike, angle: ArrayLike, load: ArrayLike) -> FloatArray:
        """Readings (..., m) for touches of composite radius R (mm), location (rad) and load (N/m)."""
        ...

    def beyond_linear(self, radius_mm: ArrayLike, angle: ArrayLike, load: ArrayLike) -> FloatArray:
        """Part of the readings (..., m) due to finite strain; parameters as in `predict`."""
        ...


class TouchContext(Protocol):
    """Protocol of the effects on the readings of given touches, which may depend on the times of the touches."""

    def select(self, index: IntArray) -> TouchContext:
        """Some of the touches."""
        ...

    def joined(self, parts: Sequence[TouchContext]) -> TouchContext:
        """The effects on the touches of several contexts together; this context is one of `parts`."""
        ...

    def without_loads(self) -> TouchContext:
        """The context with errors of corrected loads that are independent of the predicted readings."""
        ...

    def inexact(self) -> TouchContext:
        """The context with the uncertainty of the calibration, also where the calibration counts as exact."""
        ...

    def readings(
        self, signal: NDArray[np.floating], radius_mm: FloatArray, angle: FloatArray, load: FloatArray, touch: IntArray
    ) -> NDArray[np.floating]:
        """Readings (n, m) from signals (n, m) before the effects, for R (mm), θ_c (rad) and P (N/m), all (n,)."""
        ...

    def covariance(self, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
        """Covariance (t, m, m) of the mean readings without each element's own noise."""
        ...

    def noise_of_signal(self, signal: FloatArray, covariance: FloatArray) -> SignalNoise | None:
        """Noise that depends on the signal, with readings (t, m) and their covariance (t, m, m) at the modes."""
        ...

    def added_variance(self, signal: FloatArray) -> FloatArray:
        """Variance (t, m) that noise effects add to the mean readings, for predicted readings (t, m)."""
        ...


@dataclass(frozen=True, eq=False)
class TouchReadings:
    """Mean readings of unknown touches; t touches, m elements.

    Attributes
    ----------
    readings : (t, m) array
        Mean readings minus the rest reading; NaN missing.
    counts : (t, m) array
        Number of raw readings in each mean; 0 where missing.
    load, load_sd : (t,) arrays
        Measured load and its standard error, N/m; the load is NaN where not measured or not used.
    context : TouchContext, optional
        Effects on these touches.
    """

    readings: FloatArray
    counts: FloatArray
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

    def with_independent_loads(self) -> TouchReadings:
        """The touches with errors of the loads that are independent of the predicted readings.

        The loads can then be left out.
        """
        return self if self.context is None else replace(self, context=self.context.without_loads())


@dataclass(frozen=True)
class IndenterPriors:
    """Priors of a touch on a finger.

    Attributes
    ----------
    radius : Prior
        Prior of R in mm, between 0 (edge) and ``r_b`` (flat): a density, or a `RadiusOfTips`. Concave indenters are
        excluded.
    location : Uniform
        Prior of θ_c in rad.
    load : Prior
        Prior of P in N/m; the likelihood of a measured load multiplies it.
    """

    radius: Prior
    location: Uniform
    load: Prior

    @property
    def whole_turn(self) -> bool:
        """Whether every location is possible (a full ring of elements): then both ends of the prior are one place."""
        low, high = self.location.support
        return high - low > TURN * (1 - 1e-9)

    @property
    def half_a_turn_on(self) -> IndenterPriors:
        """The same priors of a full ring, with the ends of the location at the opposite place."""
        low, high = self.location.support
        return replace(self, location=Uniform(low + np.pi, high + np.pi))

    @property
    def without_ends(self) -> IndenterPriors:
        """The priors of a full ring with a location that goes on beyond both ends, for a search from a place inside."""
        low, high = self.location.support
        return replace(self, location=Uniform(low - TURN, high + TURN))

    def in_turn(self, angle: FloatArray) -> FloatArray:
        """Locations (rad); on a full ring with whole turns added that bring them between the ends of the prior."""
        return nearest_turn(angle, float(np.mean(self.location.support)), TURN) if self.whole_turn else angle

    @classmethod
    def of(
        cls,
        chain: CalibratedFinger,
        typical_load: float,
        indenter: IndenterPrior | None = None,
        *,
        largest_load: float = 0.0,
    ) -> IndenterPriors:
        """Prior of the indenter (default: uniform in R from edge to flat), uniform priors of θ_c and P.

        θ_c is within 20° of the elements, but in one turn at most, so that no location occurs twice. P is at most three
        typical loads, or half as much again as the largest load of the calibration, if that is more.
        """
        margin = min(float(np.radians(20)), max(0.0, np.pi - 0.5 * float(np.ptp(chain.angle))))
        return cls(
            radius=(indenter or UniformRadius()).radius_prior(chain.outer_radius_mm),
            location=Uniform(float(chain.angle.min() - margin), float(chain.angle.max() + margin)),
            load=Uniform(0.0, hardest_load(typical_load, largest_load)),
        )

    @classmethod
    def of_calibration(
        cls, chain: CalibratedFinger, calibration: Calibration, indenter: IndenterPrior | None = None
    ) -> IndenterPriors:
        """Priors of a touch on a calibrated finger, as `of` with the loads of its calibration."""
        largest = float(np.fmax.reduce(calibration.rows.load, initial=0.0))
        return cls.of(chain, float(calibration.settings["typical_load"]), indenter, largest_load=largest)

    def cut_off(self, angle: FloatArray, load: FloatArray) -> BoolArray:
        """Whether an end of the prior of location or load cuts off the posterior of a touch, (t,).

        A load near zero does not count, because a light touch is a touch. The location of a full ring has no end.

        Parameters
        ----------
        angle, load : (chain, draw, t) arrays
            Draws of θ_c (rad) and P (N/m).
        """
        (first, last), (lightest, hardest) = self.location.support, self.load.support
        beside = [(hardest - load, hardest - lightest)]
        if not self.whole_turn:
            beside += [(angle - first, last - first), (last - angle, last - first)]
        return np.asarray(np.any([is_at_the_end(distance, width) for distance, width in beside], axis=0))


@dataclass(frozen=True, eq=False)
class FingerPosterior:
    """Log posterior density of touches in the coordinates ``(w, θ_c, P)``; for w see `IndenterCoordinate`.

    By default ``R = r_b/(1 + e^-w)``, which keeps R between edge and flat; the density includes the Jacobian.
    `whitener` transforms residuals to independent standard normal ones. It includes the noise and, unless the
    calibration counts as exact, the uncertainty of the calibration.

    Attributes
    ----------
    chain : CalibratedFinger
        Calibrated finger.
    touches : TouchReadings
        Readings of the touches.
    priors : IndenterPriors
        Priors of the touches.
    whitener : (t, m, m) or (t, m) array
        ``Σ^(-1/2)`` of each touch, or its diagonal; rows of missing readings are zero.
    table : ReadingTable, optional
        Table of readings, for many evaluations; without it the chain is evaluated.
    noise_of_signal : SignalNoise, optional
        Noise that depends on the signal: the variance of each reading is that at the mode, which `whitener` has, times
        its growth. Correlations are those at the mode.
    """

    chain: CalibratedFinger
    touches: TouchReadings
    priors: IndenterPriors
    whitener: FloatArray
    table: ReadingTable | None = None
    noise_of_signal: SignalNoise | None = None

    def select(self, index: IntArray) -> FingerPosterior:
        """Posterior of some of the touches."""
        noise = None if self.noise_of_signal is None else self.noise_of_signal.select(index)
        touches = self.touches.select(index)
        return replace(self, touches=touches, whitener=self.whitener[index], noise_of_signal=noise)

    @cached_property
    def indenter(self) -> IndenterCoordinate:
        """Conversion between w and the indenter."""
        return IndenterCoordinate(self.priors.radius, self.chain.outer_radius_mm)

    @property
    def without_ends(self) -> FingerPosterior:
        """The posterior without ends of the location, if the elements are a full ring."""
        return replace(self, priors=self.priors.without_ends) if self.priors.whole_turn else self

    @cached_property
    def middle(self) -> float | None:
        """Middle of the row of a full ring of elements, rad; None on other fingers.

        Tables and effects have locations within half a turn of it.
        """
        return middle_of(self.chain, self.priors)

    def radius(self, w: FloatArray) -> FloatArray:
        """Composite radius R in mm."""
        return self.indenter.radius(w)

    @cached_property
    def _compared_with(self) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
        """Readings, 0 where missing, and whitener, in the precision of the predictions."""
        precision = np.float64 if self.table is None else np.float32
        return np.nan_to_num(self.touches.readings).astype(precision), self.whitener.astype(precision)

    def residual(self, x: FloatArray, blocks: IntArray) -> NDArray[np.floating]:
        """Whitened prediction minus reading (B, W, m) at coordinates x (B, W, 3) of the touches `blocks` (B,).

        With a table it is float32, with an error of 1e-4 in a squared residual; without a table it is float64.
        """
        # Each coordinate contiguous in memory, since they are used one at a time.
        angle, load = np.ascontiguousarray(x[..., 1]), np.ascontiguousarray(x[..., 2])
        radius = self.radius(np.ascontiguousarray(x[..., 0]))
        readings, whitener = (each[blocks] for each in self._compared_with)
        difference = self.predicted(radius, angle, load, blocks)
        growth = None if self.noise_of_signal is None else self.noise_of_signal.growth(difference, blocks)
        difference -= readings[:, None]
        if growth is not None:
            difference = difference / np.sqrt(growth).astype(difference.dtype)
        if whitener.ndim == 2:
            difference *= whitener[:, None]
            return difference
        return np.asarray(difference @ whitener.swapaxes(-1, -2))

    def predicted(
        self, radius: FloatArray, angle: FloatArray, load: FloatArray, blocks: IntArray
    ) -> NDArray[np.floating]:
        """Predicted readings (B, W, m) for R (mm), θ_c (rad) and P (N/m), (B, W) each, of the touches `blocks` (B,).

        With a table they are float32, without a table float64.
        """
        if self.middle is not None:
            angle = nearest_turn(angle, self.middle, TURN)
        if self.table is None:
            return self.effects_chain(self.chain.predict(radius, angle, load), radius, angle, load, blocks)
        kappa = (load * self.chain.effective_radius(radius, angle) / (1000 * self.chain.shear_modulus_MPa)).ravel()
        rows = self.table(np.maximum(kappa, 0.0), angle.ravel())
        rows *= load.astype(np.float32).reshape(-1, 1)
        rows = rows.reshape(*load.shape, -1)
        if self.chain.finite_strain:
            rows += self.chain.beyond_linear(radius, angle, load).astype(np.float32)
        return self.effects_chain(rows, radius, angle, load, blocks)

    def effects_chain(
        self, rows: NDArray[np.floating], radius_mm: FloatArray, angle: FloatArray, load: FloatArray, blocks: IntArray
    ) -> NDArray[np.floating]:
        """Readings (B, W, m) after the effects on the touches `blocks` (B,).

        From signals `rows` (B, W, m), R (mm), θ_c (rad) and P (N/m), (B, W) each.
        """
        context = self.touches.context
        if context is None:
            return rows
        touch = np.repeat(blocks, load.shape[1])
        flat = context.readings(rows.reshape(-1, rows.shape[-1]), radius_mm.ravel(), angle.ravel(), load.ravel(), touch)
        return flat.reshape(rows.shape)

    def log_prior(self, x: FloatArray, blocks: IntArray) -> FloatArray:
        """Log prior density (B, W) with the Jacobian, plus the log likelihood of the measured load."""
        load = self.touches.load[blocks][:, None]
        with np.errstate(invalid="ignore"):
            miss = np.where(np.isnan(load), 0.0, (x[..., 2] - load) / self.touches.load_sd[blocks][:, None])
        return np.asarray(
            self.indenter.log_density(x[..., 0])
            + self.priors.location.log_density(x[..., 1])
            + self.priors.load.log_density(x[..., 2])
            - 0.5 * miss * miss
        )

    def log_factor(self, x: FloatArray, blocks: IntArray) -> FloatArray:
        """Log posterior density (B, W) without the squares of the residuals: prior, load and volume of the noise."""
        prior = self.log_prior(x, blocks)
        if self.noise_of_signal is None:
            return prior
        angle, load = np.ascontiguousarray(x[..., 1]), np.ascontiguousarray(x[..., 2])
        predicted = self.predicted(self.radius(np.ascontiguousarray(x[..., 0])), angle, load, blocks)
        diagonal = self.whitener if self.whitener.ndim == 2 else np.einsum("tii->ti", self.whitener)
        logs = np.log(self.noise_of_signal.growth(predicted, blocks))
        return np.asarray(prior - 0.5 * (logs * (diagonal[blocks] != 0)[:, None]).sum(axis=-1))

    def log_density(self, x: FloatArray, blocks: IntArray) -> FloatArray:
        """Log posterior density (B, W), up to a constant per touch; ``-inf`` outside the priors."""
        prior = self.log_factor(x, blocks)
        return np.where(np.isfinite(prior), prior - 0.5 * _sum_of_squares(self.residual(x, blocks)), -np.inf)


def middle_of(chain: CalibratedFinger, priors: IndenterPriors) -> float | None:
    """Middle of the row of a full ring of elements, rad; None on other fingers."""
    return 0.5 * float(chain.angle.min() + chain.angle.max()) if priors.whole_turn else None


def _sum_of_squares(rows: NDArray[np.floating]) -> FloatArray:
    return np.asarray(np.einsum("bwm,bwm->bw", rows, rows), dtype=np.float64)


def noise_whitener(noise: Noise, touches: TouchReadings) -> FloatArray:
    """Diagonal whitener (t, m) for sensor noise only."""
    sd = noise.mean_sd(touches.counts, np.zeros(touches.counts.shape))
    return np.where(np.isfinite(sd) & ~np.isnan(touches.readings), 1 / sd, 0.0)


def full_whitener(noise: Noise, touches: TouchReadings, calibration_covariance: FloatArray) -> FloatArray:
    """Whitener (t, m, m) for sensor noise and the covariance of the readings due to the calibration (t, m, m).

    Rows of missing readings are zero; they do not affect the others.
    """
    diagonal = noise_whitener(noise, touches)
    # Σ = D^(-1) (I + D C D) D^(-1) with the diagonal whitener D: D = 0 removes a missing reading.
    inner = diagonal[:, :, None] * calibration_covariance * diagonal[:, None, :]
    root = np.linalg.cholesky(inner + np.eye(inner.shape[-1]))
    return np.linalg.solve(root, np.eye(inner.shape[-1])[None] * diagonal[:, None, :])


def with_noise_of_signal(
    posterior: FingerPosterior, mode: FloatArray, noise: Noise, covariance: FloatArray
) -> FingerPosterior:
    """The posterior with noise that depends on the signal, if its touches have any.

    Parameters
    ----------
    posterior : FingerPosterior
        The posterior with the whitener at the modes.
    mode : (t, 3) array
        Modes of the touches in (w, θ_c, P).
    noise : Noise
        Each element's own noise.
    covariance : (t, m, m) array
        Covariance of the readings at the modes without it.
    """
    touches, (w, angle, load) = posterior.touches, mode.T[:, :, None]
    if touches.context is None:
        return posterior
    signal = posterior.predicted(posterior.radius(w), angle, load, np.arange(len(mode)))[:, 0].astype(np.float64)
    own = noise.mean_sd(read_once(touches.counts), np.zeros(touches.counts.shape)) ** 2
    whole = covariance + own[:, :, None] * np.eye(own.shape[1])
    return replace(posterior, noise_of_signal=touches.context.noise_of_signal(signal, whole))
