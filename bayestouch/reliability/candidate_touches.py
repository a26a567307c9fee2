"""A grid of touches to choose from, like those with which a sensor was calibrated."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.data.touches import Touches, touches_from
from bayestouch.errors import InputError, number_array, require_whole
from bayestouch.model.planned_table import usual_load
from bayestouch.results.data import require_calibration
from bayestouch.results.keys import EFFECT_PEAK
from bayestouch.results.objects import Calibration

# Number of places along a line, and along each side of a plane.
ALONG, ACROSS = 25, 12


def candidate_touches(
    calibration: Calibration,
    *,
    places: ArrayLike | None = None,
    tips_mm: Sequence[float] | None = None,
    loads: Sequence[float] | None = None,
    samples: int | None = None,
) -> Touches:
    """Grid of touches to choose from: every tip at every place under every load.

    Parameters
    ----------
    calibration : Calibration
        Calibration of a finger or a pad.
    places : (n,) or (n, 2) array_like, optional
        Places: degree on a finger, mm on a pad (x, or x and y). By default, 25 places evenly over the range of the
        calibration touches, or 12 by 12 places on a pad in the plane.
    tips_mm : sequence of float, optional
        Radii r_c of the tips on a finger, 0 knife edge, inf flat; by default those of the calibration.
    loads : sequence of float, optional
        Loads as the force sensor reads them, N/m on a finger and N on a pad; by default the mean load of the
        calibration.
    samples : int, optional
        Samples that are averaged in a touch; by default the median of the calibration, rounded.
        Where the calibration touches have rest readings of their own, planned touches have such a one, too. Where they
        have one load each, planned touches have one reading of the force sensor, too.

    Returns
    -------
    Touches
        One row a touch, without readings.

    Raises
    ------
    InputError
        It is no calibration, the places have another number of coordinates, there are no tips or loads, a radius is
        below zero, a load is not above zero or larger than the calibration can predict, or the number of samples is not
        a whole number above zero.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> dataset = bayestouch.simulate(design, seed=3).dataset
    >>> calibration = bayestouch.calibrate(dataset, draws=200)
    >>> bayestouch.candidate_touches(calibration, places=[-10.0, 0.0, 10.0], tips_mm=[0.0, 3.9]).n_touches
    6
    """
    require_calibration(calibration)
    rows, columns = calibration.rows, calibration.sensor.body.location_columns
    where = _even([*rows.location.values()]) if places is None else number_array("places", places, 1, 2)
    where = where[:, None] if where.ndim == 1 else where
    if where.ndim != 2 or where.shape[1] != len(columns):
        raise InputError(f"places: expected an array (n, {len(columns)}) of {' and '.join(columns)}")
    tips = np.unique(rows.radius_mm) if tips_mm is None else np.atleast_1d(number_array("tips_mm", tips_mm, 0, 1))
    if not len(tips) or (tips_mm is not None and not (tips >= 0).all()):
        raise InputError("tips_mm: expected radii of zero and larger, and at least one")
    load = np.array([usual_load(calibration)]) if loads is None else np.atleast_1d(number_array("loads", loads, 0, 1))
    if samples is None:
        samples = round(float(np.median(rows.samples)))
    require_whole("samples", samples, 1)
    # Beyond this load a finger has no contact table; a pad has no such limit.
    largest = float(calibration.settings.get("largest_load", np.inf))
    if not len(load) or not (np.isnan(load) | ((load > 0) & (load < np.inf) & (load <= largest))).all():
        limit = f", at most {largest:g}" if np.isfinite(largest) else ""
        raise InputError(f"loads: expected numbers above zero{limit}")
    tip, force, place = (each.ravel() for each in np.meshgrid(tips, load, np.arange(len(where)), indexing="ij"))
    n = len(tip)
    return touches_from(
        np.arange(n),
        np.full((n, calibration.sensor.n_elements), np.nan),
        indenter_radius_mm=tip,
        load=force,
        contact=1.0,
        reads=float(samples),
        **{name: where[place, axis] for axis, name in enumerate(columns)},
    )


def touches_to_read(calibration: Calibration) -> Touches:
    """Grid of touches that are read: as `candidate_touches`, over the places between the elements.

    An element is taken to be where its reading per unit load is largest in the calibration, beside that without touch.
    Beyond the outer elements touches may calibrate, but cannot be read well.
    """
    rows = calibration.rows
    alive = rows.responds
    load = np.where(np.isfinite(rows.load), rows.load, 1.0)[:, None]
    size = np.abs(rows.observed - _without_touch(calibration))[:, alive] / load
    largest = np.nanargmax(size, axis=0)
    return candidate_touches(calibration, places=_even([axis[largest] for axis in rows.location.values()]))


def _without_touch(calibration: Calibration) -> FloatArray:
    """Fitted reading of each element without touch, (m,): a parameter of a pad, an effect of a finger."""
    mode, m = calibration.mode, calibration.sensor.n_elements
    share = np.array([mode.get(f"rest_offset_own_{e + 1:02d}", 0.0) for e in range(m)])
    return np.asarray(mode["offset"] if "offset" in mode else share * calibration.extra.get(EFFECT_PEAK, 0.0))


def _even(location: Sequence[FloatArray]) -> FloatArray:
    """Places (n, D) evenly over the box around locations (t,) of each coordinate."""
    count = ALONG if len(location) == 1 else ACROSS
    axes = [np.linspace(np.nanmin(axis), np.nanmax(axis), count) for axis in location]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
