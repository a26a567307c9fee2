"""Posterior density of one touch on a calibrated finger, in the few numpy calls that a control loop has time for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.array_types import FloatArray
from bayestouch.data.arrays import nearest_turn
from bayestouch.finger.reading.modes import DIFFERENCES
from bayestouch.finger.reading.reader import TURN, CalibratedFinger, TouchContext
from bayestouch.finger.reading.reading_table import ReadingTable

# Centre, and both neighbours along each of the coordinates (w, θ_c, P).
_MOVES = np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])


@dataclass(frozen=True, eq=False)
class Expansion:
    """Second-order expansion of the log density at x (3,): value, gradient (3,) and minus the Hessian (3, 3).

    `log_likelihood` is minus half the squared residuals at x, with that of the load. `steps` (3,) and `rows` (7, m) are
    the steps and the predicted readings of the central differences.
    """

    x: FloatArray
    value: float
    log_likelihood: float
    gradient: FloatArray
    hessian: FloatArray
    steps: FloatArray
    rows: NDArray[np.float32]

    @cached_property
    def covariance(self) -> FloatArray:
        """Inverse of `hessian`, (3, 3)."""
        return np.asarray(np.linalg.inv(self.hessian))

    def newton_step(self, damping: float) -> FloatArray:
        """Newton step (3,), with each diagonal element of the Hessian increased by the share `damping`.

        Written out: `numpy.linalg.solve` takes five times as long for three numbers.
        """
        (a, b, c), (_, d, e), (_, _, f) = self.hessian.tolist()
        x, y, z = self.gradient.tolist()
        a, d, f = a * (1 + damping), d * (1 + damping), f * (1 + damping)
        # Gaussian elimination; the Hessian is positive definite, so that no pivots are exchanged.
        by_b, by_c = b / a, c / a
        d, e, f = d - by_b * b, e - by_b * c, f - by_c * c
        y, z = y - by_b * x, z - by_c * x
        by_e = e / d
        last = (z - by_e * y) / (f - by_e * e)
        middle = (y - e * last) / d
        return np.array([(x - b * middle - c * last) / a, middle, last])


@dataclass(frozen=True, eq=False)
class OneTouch:
    """Log density of one touch in the coordinates (w, θ_c, P): that of `FingerPosterior`, for n points at a time.

    Attributes
    ----------
    chain, table
        As in `FingerPosterior`.
    per_modulus : float
        ``1/μ`` in the unit that gives κ in mm² from P in N/m and R in mm.
    ends : (float, float, float, float)
        Lowest and highest θ_c (rad), lowest and highest P (N/m): their priors are uniform.
    radius_ends : (float, float)
        Smallest and largest R (mm) of the density for the search of the mode.
    w_grid, w_log_prior : (k,) arrays
        Log prior density of w for this search, at points that are denser than the steps of the derivatives.
    readings : (m,) float32 array
        Mean readings minus the rest reading; zero where missing.
    whitener : (m, m) float32 array
        Transposed ``Σ^(-1/2)``; columns and rows of missing readings are zero.
    load, load_sd : float
        Measured load and its standard error, N/m; the load is NaN if not measured.
    context : TouchContext or None
        Effects on this touch.
    middle : float or None
        As in `FingerPosterior`: on a full ring `ends` are half a turn from about the mode of the touch.
    """

    chain: CalibratedFinger
    table: ReadingTable
    per_modulus: float
    ends: tuple[float, float, float, float]
    radius_ends: tuple[float, float]
    w_grid: FloatArray
    w_log_prior: FloatArray
    readings: NDArray[np.float32]
    whitener: NDArray[np.float32]
    load: float
    load_sd: float
    context: TouchContext | None = None
    middle: float | None = None

    def with_(self, **changes: object) -> OneTouch:
        """The touch with some fields changed; `dataclasses.replace` takes ten times as long."""
        new = object.__new__(OneTouch)
        new.__dict__.update(self.__dict__)
        new.__dict__.update(changes)
        return new

    def predicted(self, radius: FloatArray, angle: FloatArray, load: FloatArray) -> NDArray[np.float32]:
        """Readings (n, m) for R (mm), θ_c (rad) and P (N/m), all (n,)."""
        angle = self.in_row(angle)
        kappa = load * self.chain.effective_radius(radius, angle)
        kappa *= self.per_modulus
        # Points of the quadrature may have a load below zero.
        rows = self.table(np.maximum(kappa, 0.0, out=kappa), angle)
        rows *= load.astype(np.float32)[:, None]
        if self.chain.finite_strain:
            rows += self.chain.beyond_linear(radius, angle, load).astype(np.float32)
        if self.context is None:
            return rows
        touch = np.zeros(len(load), dtype=np.int64)
        return np.asarray(self.context.readings(rows, radius, angle, load, touch), dtype=np.float32)

    def in_row(self, angle: FloatArray) -> FloatArray:
        """Locations (rad); on a full ring within half a turn of the middle of the row."""
        return angle if self.middle is None else nearest_turn(angle, self.middle, TURN)

    def about(self, angle: float) -> OneTouch:
        """The touch; on a full ring with the ends of its location half a turn from this angle (rad)."""
        if self.middle is None:
            return self
        return self.with_(ends=(angle - np.pi, angle + np.pi, *self.ends[2:]))

    def residual(self, radius: FloatArray, angle: FloatArray, load: FloatArray) -> NDArray[np.float32]:
        """Whitened prediction minus reading (n, m)."""
        rows = self.predicted(radius, angle, load)
        rows -= self.readings
        return rows @ self.whitener

    def log_load(self, load: FloatArray) -> FloatArray:
        """Log likelihood of the measured load, (n,), up to a constant; zeros without one."""
        if self.load != self.load:
            return np.zeros(load.shape)
        miss = (load - self.load) / self.load_sd
        return np.asarray(-0.5 * miss * miss)

    def inside(self, angle: FloatArray, load: FloatArray) -> NDArray[np.bool_]:
        """Whether θ_c and P are inside their uniform priors, (n,)."""
        low, high, least, most = self.ends
        return np.asarray((angle >= low) & (angle <= high) & (load >= least) & (load <= most))

    def log_density(self, radius: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
        """Log density without the prior of R, (n,)."""
        z = self.residual(radius, angle, load)
        out = self.log_load(load) - 0.5 * np.einsum("nm,nm->n", z, z)
        inside = self.inside(angle, load)
        return out if inside.all() else np.where(inside, out, -np.inf)

    def expansion(self, x: FloatArray) -> Expansion:
        """Expansion of the log density at x (3,); as in `modes`."""
        steps = DIFFERENCES * (1.0, 1.0, max(float(x[2]), 1e-3))
        places = x + _MOVES * steps
        columns = np.ascontiguousarray(places.T)
        columns[0] = self.radii(columns[0])
        return self.expanded(x, steps, self.predicted(*columns))

    def expanded(self, x: FloatArray, steps: FloatArray, rows: NDArray[np.float32]) -> Expansion:
        """Expansion from the readings (7, m) of the central differences; with another whitener they are used again."""
        w, _, load = x.tolist()
        low, high, least, most = self.ends
        if not (low <= x[1] <= high and least <= load <= most):
            return Expansion(x, -np.inf, -np.inf, np.zeros(3), np.eye(3), steps, rows)
        z = ((rows - self.readings) @ self.whitener).astype(np.float64)
        jacobian = (z[1:4] - z[4:]) / (2 * steps[:, None])
        h = DIFFERENCES[0]
        here, up, down = np.interp((w, w + h, w - h), self.w_grid, self.w_log_prior).tolist()
        gradient = -(jacobian @ z[0])
        gradient[0] += (up - down) / (2 * h)
        likelihood = -0.5 * float(z[0] @ z[0])
        share = 1 / (1 + np.exp(-w))
        hessian = jacobian @ jacobian.T
        hessian[0, 0] += max((2 * here - up - down) / h**2, 0.2 * share * (1 - share) + 1e-3)
        hessian[1, 1] += 1 / (high - low) ** 2
        hessian[2, 2] += 1e-6 / max(load, 1e-3) ** 2
        if self.load == self.load:
            miss = (load - self.load) / self.load_sd
            likelihood -= 0.5 * miss**2
            gradient[2] -= miss / self.load_sd
            hessian[2, 2] += 1 / self.load_sd**2
        return Expansion(x, here + likelihood, likelihood, gradient, hessian, steps, rows)

    def radii(self, w: ArrayLike) -> FloatArray:
        """R in mm of a density at w, (n,)."""
        low, high = self.radius_ends
        return np.asarray(low + (high - low) / (1 + np.exp(-np.asarray(w))))
