"""Contact parameters of one touch at a time: section 4 of the paper (its Figure 11), by Nelder-Mead.

The fit minimises the squared strain error of the elements, ``Σ (D_i/gain_i - ε̂_i)²``, over radius, location and
load, or over radius and location if the load of the force sensor is given. The results are point estimates without
errors; use `bayestouch.inference` for posteriors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.contact import composite_radius, indenter_radius
from bayestouch.errors import InputError

Radius = Literal["R", "r_c"]

# Starting points of the simplex, of which the best is used: radii as fractions of r_b, and steps of location, degree.
START_SHARES = (0.05, 0.35, 0.65, 0.93)
START_STEP_DEG, START_MARGIN_DEG = 2.0, 20.0
STEPS = np.array([1.0, 1.0, 10.0])  # size of the first simplex: mm, degree, N/m
LARGEST_INDENTER_MM = 1e4  # radius of a flat, if r_c is the unknown


class TouchPredictor(Protocol):
    """Protocol of a calibrated finger for the fit: `FingerChain` or `EmpiricalFinger`."""

    @property
    def outer_radius_mm(self) -> float:
        """``r_b``."""
        ...

    @property
    def largest_load(self) -> float:
        """Largest load that can be predicted, N/m."""
        ...

    @property
    def angle(self) -> FloatArray:
        """``θ_s``, rad, shape (m,)."""
        ...

    @property
    def gain(self) -> FloatArray:
        """Reading per unit of strain, up to a common factor, shape (m,)."""
        ...

    @property
    def response(self) -> FloatArray:
        """Reading per N/m of a knife edge directly above each element, shape (m,)."""
        ...

    def predict(self, radius_mm: ArrayLike, angle: ArrayLike, load: ArrayLike) -> FloatArray:
        """Return the readings (..., m) under touches of composite radius R (mm) at θ_c (rad) with P (N/m)."""
        ...


@dataclass(frozen=True)
class TouchFit:
    """Fitted contact of one touch.

    Attributes
    ----------
    composite_radius_mm, indenter_radius_mm : float
        R and r_c; r_c is inf for a flat.
    angle_deg : float
        θ_c.
    load : float
        P, N/m: fitted, or as given.
    error_percent_peak : float
        Root mean square of reading minus fit in % of each element's peak, its reading directly under a knife edge
        with this load.
    converged : bool
        Whether the simplex reached the convergence criterion.
    """

    composite_radius_mm: float
    indenter_radius_mm: float
    angle_deg: float
    load: float
    error_percent_peak: float
    converged: bool


def fit_touch(
    finger: TouchPredictor, reading: ArrayLike, *, load: float | None = None, radius: Radius = "R"
) -> TouchFit:
    """Return the fit of radius, location and load of one touch.

    Parameters
    ----------
    finger : FingerModel
        Calibrated finger; the fit uses its contact model (``chain.with_(contact="hertz")`` changes it).
    reading : (m,) array_like
        Readings of the elements, NaN missing.
    load : float, optional
        Load of the force sensor, N/m, taken as exact; by default the load is fitted.
    radius : {"R", "r_c"}
        Radius that the simplex varies. The minimum is the same, except that a flat has no finite r_c.

    Raises
    ------
    InputError
        If there are fewer readings than unknowns, all readings are those without contact, or the load is out of range.
    """
    loads = None if load is None else [load]
    return fit_touches(finger, np.asarray(reading, dtype=float)[None], loads=loads, radius=radius)[0]


def fit_touches(
    finger: TouchPredictor,
    readings: ArrayLike,
    *,
    loads: Sequence[float] | FloatArray | None = None,
    radius: Radius = "R",
) -> tuple[TouchFit, ...]:
    """Return the fits of touches one by one, from readings (t, m) and optional loads (t,). See `fit_touch`."""
    data = np.atleast_2d(np.asarray(readings, dtype=float))
    given = None if loads is None else np.asarray(loads, dtype=float)
    if given is not None and not np.all((given > 0) & (given <= finger.largest_load)):
        raise InputError(f"load of a touch: expected above 0, at most {finger.largest_load:g} N/m")
    data = np.where(np.isfinite(finger.response), data, np.nan)  # for elements that could not be calibrated
    few = int(np.isfinite(data).sum(axis=1).min(initial=data.shape[1]))
    unknowns = 3 if given is None else 2
    if few < unknowns:
        raise InputError(f"a touch has {few} readings for {unknowns} unknowns")
    starts = _Starts.of(finger)
    return tuple(
        _fit(finger, row, None if given is None else float(given[i]), radius, starts) for i, row in enumerate(data)
    )


@dataclass(frozen=True, eq=False)
class _Starts:
    """Strains of touches on a grid, per N/m at half the largest load."""

    radius_mm: FloatArray
    angle: FloatArray
    strain: FloatArray

    @classmethod
    def of(cls, finger: TouchPredictor) -> _Starts:
        margin = np.radians(START_MARGIN_DEG)
        line = np.arange(finger.angle.min() - margin, finger.angle.max() + margin, np.radians(START_STEP_DEG))
        radius, angle = (
            grid.ravel() for grid in np.meshgrid(np.array(START_SHARES) * finger.outer_radius_mm, line, indexing="ij")
        )
        load = finger.largest_load / 2
        signal = finger.predict(radius, angle, np.full(len(angle), load)) - _rest(finger)
        return cls(radius, angle, signal / finger.gain / load)

    def best(self, strain: FloatArray, load: float | None, largest: float) -> FloatArray:
        """R (mm), θ_c (rad) and P (N/m) of the grid point with the closest strain; NaN strains are missing."""
        there = np.isfinite(strain)
        model, data = self.strain[:, there], strain[there]
        power, cross = (model**2).sum(axis=1), model @ data
        best = np.clip(cross / power, 0.02 * largest, largest) if load is None else np.full(len(cross), load)
        i = int(np.argmin(power * best**2 - 2 * cross * best))
        return np.array([self.radius_mm[i], self.angle[i], best[i]])


def _rest(finger: TouchPredictor) -> FloatArray:
    """Readings without contact."""
    return finger.predict(0.0, 0.0, 0.0)


def _fit(finger: TouchPredictor, reading: FloatArray, load: float | None, radius: Radius, starts: _Starts) -> TouchFit:
    from scipy.optimize import minimize

    outer = finger.outer_radius_mm
    there = np.isfinite(reading)
    gain = finger.gain
    strain = (reading - _rest(finger)) / gain
    power = float((strain[there] ** 2).sum())
    if power == 0:
        raise InputError("a touch reads the same as no contact in all elements: nothing can be fitted")
    n = 3 if load is None else 2

    def touch(x: FloatArray) -> tuple[float, float, float]:
        moved = x * STEPS[:n]
        composite = float(composite_radius(moved[0], outer)) if radius == "r_c" else float(moved[0])
        return composite, float(np.radians(moved[1])), float(moved[2]) if load is None else load

    def misfit(x: FloatArray) -> float:
        error = (reading - finger.predict(*touch(x))) / gain
        return float((error[there] ** 2).sum()) / power

    first = starts.best(strain, load, finger.largest_load)
    first[1] = np.degrees(first[1])
    if radius == "r_c":
        first[0] = float(indenter_radius(first[0], outer))
    ends = [(0.0, outer if radius == "R" else LARGEST_INDENTER_MM), (first[1] - 60, first[1] + 60)]
    ends = [*ends, (1e-3 * finger.largest_load, finger.largest_load)][:n]
    limits = [(low / step, high / step) for (low, high), step in zip(ends, STEPS, strict=False)]
    start = first[:n] / STEPS[:n]
    to_unconstrained = np.where(start + 1 > np.array(limits)[:, 1], -1, 1)
    found = minimize(
        misfit,
        start,
        method="Nelder-Mead",
        bounds=limits,
        options={
            "initial_simplex": np.vstack([start, start + np.diag(to_unconstrained)]),
            "xatol": 1e-4,
            "fatol": 1e-10,
            "maxfev": 1000,
        },
    )
    composite, angle, newtons = touch(found.x)
    error = ((reading - finger.predict(composite, angle, newtons)) / finger.response / newtons)[there]
    return TouchFit(
        composite_radius_mm=composite,
        indenter_radius_mm=float(indenter_radius(composite, outer)),
        angle_deg=float(np.degrees(angle)),
        load=newtons,
        error_percent_peak=100 * float(np.sqrt(np.mean(error**2))),
        converged=bool(found.success),
    )
