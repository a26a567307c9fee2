"""A chosen correction fitted together with the finger, and what it does anywhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.diagnosis.correction_basis import Correction, fit_correction, where_of
from bayestouch.finger.correction_table import CorrectionTable
from bayestouch.finger.model import finger_model
from bayestouch.model.fitting import Fitted, drift_columns, fit
from bayestouch.pad.model import PadModel

TABLE_STEP_DEG = 0.5


def corrected_fit(fitted: Fitted) -> tuple[Fitted, Correction] | None:
    """The finger fitted anew under the correction that suits it; None where none does.

    A pad stays as it is: its map can follow whatever a correction does, so that a fit of both would end anywhere.
    """
    chosen = fit_correction(fitted)
    if chosen is None:
        return None
    if isinstance(fitted.model, PadModel):
        return replace(fitted, linear=chosen.linear), chosen
    new = fit(fitted.model, fitted.vector, fitted.noise, fitted.drifts, further=chosen.columns(*where_of(fitted)))
    return new, chosen


def weights_of(fitted: Fitted) -> tuple[FloatArray, FloatArray]:
    """Weights (k,) of the correction of a corrected fit, and their covariance (k, k)."""
    functions = fitted.linear.functions
    assert functions is not None
    first = len(drift_columns(fitted.model, fitted.vector, fitted.drifts))
    covariance = np.linalg.inv(functions.root @ functions.root.T)
    return fitted.linear.weights()[first:], np.asarray(covariance[first:, first:], dtype=np.float64)


def table_of(fitted: Fitted, chosen: Correction) -> CorrectionTable:
    """The correction of a corrected fit over the locations that were touched."""
    model = finger_model(fitted.model)
    angle = where_of(fitted)[1]
    grid = np.arange(np.floor(angle.min()) - 5, np.ceil(angle.max()) + 5 + 1e-9, TABLE_STEP_DEG)
    weights, covariance = weights_of(fitted)
    one, outer, load = np.ones(len(grid)), model.finger.outer_radius_mm, model.reference_load

    def under(radius: float, load: float) -> FloatArray:
        """Addition over the load."""
        columns = chosen.columns(radius * one, grid, load * one)
        return np.asarray(np.tensordot(weights, columns, axes=1) / load)

    edge = chosen.columns(0 * one, grid, load * one) / load
    even = under(0.0, load)
    # Columns grow with the load as P and P²: two loads give both.
    loaded = (under(0.0, 2 * load) - even) / load
    wide = (under(outer, load) - even) / (load * outer / 1000)
    variance = np.einsum("kam,kl,lam->am", edge, covariance, edge, optimize=True)
    return CorrectionTable(grid, even - load * loaded, wide, loaded, np.sqrt(np.maximum(variance, 0.0)))
