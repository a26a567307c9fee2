"""Bias of estimates at a place, predicted from calibration touches at that place, whatever the cause."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.contact import composite_radius
from bayestouch.data.arrays import nearest_turn, read_once
from bayestouch.data.averages import TouchMeans
from bayestouch.data.grouping import grouped_mean
from bayestouch.errors import InputError
from bayestouch.reliability.known_finger import KnownFinger, TouchPlaces
from bayestouch.reliability.location_bias import NAMES, TouchEstimator


def place_bias(
    known: KnownFinger,
    calibrating: TouchMeans,
    indenters_mm: ArrayLike,
    angle_deg: ArrayLike,
    *,
    better: KnownFinger | None = None,
    load: float | None = None,
    samples: int = 1,
    use_load: bool = True,
) -> dict[str, FloatArray]:
    """Signed bias for other indenters that is implied by residuals of knife edges at the same place.

    The residual of an edge per unit load is assumed to be the same for every indenter at that place, and is multiplied
    by the weights of the estimate. The assumption is right for errors of the place. Errors of an element's E map have
    less effect on blunt indenters, so they should be included in `better`. Residuals of edges at one place are
    averaged. For each element, they are shrunk by the share of their variance that noise explains, so that a correct
    model gives no bias. Between places they are interpolated linearly.

    Parameters
    ----------
    known : KnownFinger
        Model that is used for the estimates.
    calibrating : TouchMeans
        Averaged calibration touches, rest reading subtracted.
    better : KnownFinger, optional
        Model that predicts touches better, such as one with the identified E map. Residuals are then relative to it,
        and its difference from `known` is part of the bias, as in `known_bias`.
    indenters_mm, angle_deg, load, samples, use_load
        As in `bayestouch.reliability.sweet_spots`.

    Returns
    -------
    mapping of (k, n) arrays
        Bias by estimate: R (mm), theta_c (degree), P (N/m).

    Raises
    ------
    InputError
        If there are fewer than two knife edges with location and load.
    """
    radii = np.atleast_1d(np.asarray(indenters_mm, dtype=float))
    where = np.atleast_1d(np.asarray(angle_deg, dtype=float))
    push = known.typical_load if load is None else load
    composite = np.asarray(composite_radius(radii, known.outer_radius_mm))
    touches = TouchPlaces.grid(composite, np.radians(where), push, known.largest_load)
    estimator = TouchEstimator.of(known, touches, samples=samples, use_load=use_load)
    angle, left = _residuals(known if better is None else better, calibrating)
    asked = nearest_turn(np.degrees(touches.angle), _middle(known))
    there = np.stack([np.interp(asked, angle, column) for column in left.T], axis=1)
    missed = push * there
    if better is not None:
        missed += better.predict(touches) - known.predict(touches)
    bias = estimator.errors(missed)
    return {name: bias[:, i].reshape(len(radii), len(where)) for i, name in enumerate(NAMES)}


def _middle(known: KnownFinger) -> float:
    """Angle of the middle of the elements, degree."""
    element = np.degrees(known.chain.angle)
    return 0.5 * float(element.min() + element.max())


def _residuals(known: KnownFinger, calibrating: TouchMeans) -> tuple[FloatArray, FloatArray]:
    """Angles of the edges (t,), ascending, and residual of each element per N/m (t, m), shrunk."""
    if calibrating.angle_deg is None:
        raise InputError("the bias of places needs angle_deg of the calibration touches")
    angle, load = nearest_turn(calibrating.angle_deg, _middle(known)), calibrating.load
    edges = (calibrating.indenter_radius_mm == 0) & np.isfinite(angle) & np.isfinite(load) & (load > 0)
    if edges.sum() < 2:
        raise InputError("the bias of places needs two knife edges with a known location and load at least")
    rows = np.flatnonzero(edges)
    predicted = known.predict(TouchPlaces(np.zeros(len(rows)), np.radians(angle[rows]), load[rows]))
    residual = calibrating.readings[rows] - predicted
    # Edges at one place are averaged: they have one residual, of which noise explains less.
    _, first, place = np.unique(angle[rows].round(9), return_index=True, return_inverse=True)

    def mean(values: FloatArray) -> FloatArray:
        return np.stack([grouped_mean(column, place, len(first)) for column in values.T], axis=1)

    n_edges = np.bincount(place)
    left, at = mean(residual), np.bincount(place, weights=load[rows]) / n_edges
    noise = mean(known.noise.tactile_sd**2 / read_once(calibrating.counts[rows])) / n_edges[:, None]
    variance = np.nanmean(left**2, axis=0)
    share = np.clip(1 - np.nanmean(noise, axis=0) / np.maximum(variance, 1e-300), 0.0, 1.0)
    return angle[rows][first], np.nan_to_num(share * left) / at[:, None]
