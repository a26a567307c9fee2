"""Table of the covariance of a finger's readings due to its calibration, for one touch at a time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.errors import InputError

# Knots in log(1 + κ/κ_s), spacing in θ_c (rad) and loads over the typical one. A peak is 4° wide, so that the error of
# linear interpolation over half a degree is 1 % of the calibration's part of the covariance.
KAPPAS, ANGLE_STEP, LOADS = 16, np.radians(0.5), (0.25, 1.0, 3.0)
# Loads where readings of the same κ are not in proportion to the load: between those of `LOADS` an sd of R would be up
# to 30 % too large.
LOADS_OF_BEND = (0.25, 0.6, 0.9, 1.2, 1.6, 2.2, 3.0)
# Touches whose covariance is computed together.
PART = 2048

Covariance = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]


@dataclass(frozen=True, eq=False)
class CovarianceTable:
    """Covariance over the square of the load on a grid of log load, ``log(1 + κ/κ_s)`` and θ_c; linear between knots.

    Attributes
    ----------
    loads : (l,) array
        Logarithms of the loads, N/m; one if the covariance is in proportion to the square of the load.
    kappa_scale, kappa_step, angle_first, angle_step : float
        ``κ_s`` (mm²), spacing of ``log(1 + κ/κ_s)``, first θ_c and spacing (rad).
    values : (l, k, a, f) float32 array
        Columns at each knot, over the square of the load.
    """

    loads: FloatArray
    kappa_scale: float
    kappa_step: float
    angle_first: float
    angle_step: float
    values: NDArray[np.float32]

    @classmethod
    def of(
        cls,
        columns: Covariance,
        modulus_MPa: float,
        ends: tuple[float, float],
        kappa_scale: float,
        largest_kappa: float,
        loads: FloatArray,
    ) -> CovarianceTable:
        """Table of a function of R (mm), θ_c (rad) and P (N/m), (t,) each, with results (t, f) or (t, m, m)."""
        across = np.linspace(0.0, np.log1p(largest_kappa / kappa_scale), KAPPAS)
        angles = np.linspace(*ends, int(np.ceil((ends[1] - ends[0]) / ANGLE_STEP)) + 1)
        load, kappa, angle = np.meshgrid(loads, kappa_scale * np.expm1(across), angles, indexing="ij")
        radius = 1000 * modulus_MPa * kappa / load
        flat = [each.ravel() for each in (radius, angle, load)]
        rows = [
            columns(*(each[i : i + PART] for each in flat)).reshape(len(flat[0][i : i + PART]), -1)
            / flat[2][i : i + PART, None] ** 2
            for i in range(0, len(flat[0]), PART)
        ]
        values = np.concatenate(rows).astype(np.float32).reshape(*load.shape, -1)
        return cls(np.log(loads), kappa_scale, float(across[1]), float(ends[0]), float(angles[1] - angles[0]), values)

    def arrays(self) -> dict[str, FloatArray]:
        """The table for a file."""
        axes = [self.kappa_scale, self.kappa_step, self.angle_first, self.angle_step]
        return {"covariance_loads": self.loads, "covariance_axes": np.array(axes), "covariance": self.values}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, FloatArray]) -> CovarianceTable:
        """The table from the result of `arrays`.

        Raises
        ------
        InputError
            A part of the table is missing.
        """
        if missing := {"covariance_axes", "covariance", "covariance_loads"} - arrays.keys():
            raise InputError(f"the tables of the live reader are damaged: {min(missing)} is missing")
        scale, step, first, spacing = np.asarray(arrays["covariance_axes"]).tolist()
        values = np.asarray(arrays["covariance"], dtype=np.float32)
        return cls(np.asarray(arrays["covariance_loads"]), scale, step, first, spacing, values)

    def __call__(self, kappa: float, angle: float, load: float) -> FloatArray:
        """Columns (f,) at κ (mm²), θ_c (rad) and P (N/m)."""
        n_loads, n_kappas, n_angles, f = self.values.shape
        places = (
            float(np.interp(np.log(load), self.loads, np.arange(n_loads))) if n_loads > 1 else 0.0,
            np.log1p(kappa / self.kappa_scale) / self.kappa_step,
            (angle - self.angle_first) / self.angle_step,
        )
        row, weight = [0], [1.0]
        for place, n in zip(places, (n_loads, n_kappas, n_angles), strict=True):
            place = min(max(place, 0.0), n - 1.0)
            cell = min(int(place), max(n - 2, 0))
            share = place - cell
            ends = ((0, 1.0 - share), (1, share)) if share else ((0, 1.0),)
            row = [r * n + cell + step for r in row for step, _ in ends]
            weight = [v * part for v in weight for _, part in ends]
        flat = self.values.reshape(-1, f)
        return np.asarray(np.array(weight) @ flat[row] * load**2)
