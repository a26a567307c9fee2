"""Bias of a place that calibration touches there have already shown, whatever causes it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.contact import composite_radius
from bayestouch.data.averages import TouchMeans
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
    plug_in: bool = False,
) -> dict[str, FloatArray]:
    """Bias, with its sign, that the residuals of knife edges at the same place imply for other indenters.

    What an edge's readings leave over, per unit load, is taken to be there for every indenter at that place, and sent
    through the weights of the estimate. That holds for errors of the place; errors of an element's E map are felt
    less by blunt indenters, so they go into `better`. Residuals are shrunk element by element by the share of their
    variance that noise explains: where the model is right nothing is predicted. Between edges they are interpolated
    linearly.

    Parameters
    ----------
    known : KnownFinger
        What touches are read with.
    calibrating : TouchMeans
        Averaged calibration touches, rest reading subtracted.
    better : KnownFinger, optional
        What predicts touches better, such as the identified E map: residuals are about it, and what it changes is part
        of the bias, as in `known_bias`.
    indenters_mm, angle_deg, load, samples, use_load, plug_in
        As in `bayestouch.reliability.sweet_spots`.

    Returns
    -------
    mapping of (k, n) arrays
        By estimate: R (mm), theta_c (degree), P (N/m).

    Raises
    ------
    InputError
        If fewer than two knife edges with location and load were made.
    """
    radii = np.atleast_1d(np.asarray(indenters_mm, dtype=float))
    where = np.atleast_1d(np.asarray(angle_deg, dtype=float))
    push = known.typical_load if load is None else load
    touches = TouchPlaces.grid(np.asarray(composite_radius(radii, known.outer_radius_mm)), np.radians(where), push)
    estimator = TouchEstimator.of(known, touches, samples=samples, use_load=use_load, plug_in=plug_in)
    angle, left = _residuals(known if better is None else better, calibrating)
    there = np.stack([np.interp(np.degrees(touches.angle), angle, column) for column in left.T], axis=1)
    missed = push * there
    if better is not None:
        missed += better.predict(touches) - known.predict(touches)
    bias = estimator.errors(missed)
    return {name: bias[:, i].reshape(len(radii), len(where)) for i, name in enumerate(NAMES)}


def _residuals(known: KnownFinger, calibrating: TouchMeans) -> tuple[FloatArray, FloatArray]:
    """Angles of the edges (t,), rising, and what each element misses of them per N/m (t, m), shrunk."""
    if calibrating.angle_deg is None:
        raise InputError("the bias of places needs angle_deg of the calibration touches")
    angle, load = calibrating.angle_deg, calibrating.load
    edges = (calibrating.indenter_radius_mm == 0) & np.isfinite(angle) & np.isfinite(load) & (load > 0)
    if edges.sum() < 2:
        raise InputError("the bias of places needs two knife edges with a known location and load at least")
    order = np.flatnonzero(edges)[np.argsort(angle[edges])]
    predicted = known.predict(TouchPlaces(np.zeros(len(order)), np.radians(angle[order]), load[order]))
    left = calibrating.readings[order] - predicted
    noise = known.noise.tactile_sd**2 / np.maximum(calibrating.counts[order], 1)
    variance = np.nanmean(left**2, axis=0)
    share = np.clip(1 - np.nanmean(noise, axis=0) / np.maximum(variance, 1e-300), 0.0, 1.0)
    return angle[order], np.nan_to_num(share * left) / load[order, None]
