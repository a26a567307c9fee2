"""Subtracting what the elements read while nothing touches them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bayestouch.arrays import FloatArray
from bayestouch.averages import grouped_mean, groups
from bayestouch.errors import InputError
from bayestouch.touches import Touches


def rest_reading(touches: Touches) -> FloatArray | None:
    """Mean no-contact reading of each element over the whole table, averaged rows by their `reads`.

    Returns
    -------
    array, shape (m,), or None
        NaN for an element that has none; None where the table has no no-contact row.
    """
    rows = ~touches.in_contact
    if not rows.any():
        return None
    one = np.zeros(int(rows.sum()), dtype=np.int64)
    weights = _weights(touches)[rows]
    return np.array([grouped_mean(values, one, 1, weights)[0] for values in touches.readings[rows].T])


def correct(touches: Touches, rest: npt.ArrayLike | None = None) -> Touches:
    """Subtract the no-contact readings, element by element.

    A touch with no-contact rows of its own has their mean subtracted (this takes out drift, and adds the
    noise of that mean to all its samples alike). Any other touch has the mean of all no-contact rows of
    the table subtracted or, where the table has none, `rest`. No-contact rows are corrected too and kept.

    Parameters
    ----------
    touches : Touches
    rest : array, shape (m,), optional
        Reading at rest from elsewhere (`Touches.rest_reading` of the calibration table, say).

    Returns
    -------
    Touches
        With a note of what was done.

    Raises
    ------
    InputError
        `rest` has not one value for each element.
    """
    general = rest_reading(touches)
    if general is None and rest is not None:
        general = np.asarray(rest, dtype=np.float64)
        if general.shape != (touches.n_elements,):
            raise InputError(f"expected a rest reading of {touches.n_elements} elements, got shape {general.shape}")
        return _subtracted(touches, np.tile(general, (touches.n_rows, 1)), "the rest reading given was subtracted")
    if general is None:
        return touches.with_(notes=(*touches.notes, "no reading without contact: readings are taken as they are"))
    ids, group = groups(touches.touch)
    away = ~touches.in_contact
    weights = _weights(touches)[away]
    own = np.stack(
        [grouped_mean(values, group[away], len(ids), weights) for values in touches.readings[away].T], axis=1
    )
    offset = np.where(np.isnan(own), general, own)[group]
    touched = np.unique(group[~away])
    with_own = int(np.isin(touched, group[away]).sum())
    if with_own == len(touched):
        note = "each touch's own mean no-contact reading was subtracted"
    elif with_own == 0:
        note = f"the mean of all {int(away.sum())} no-contact rows was subtracted"
    else:
        note = (
            f"the mean no-contact reading was subtracted: its own in {with_own} of {len(touched)} touches, "
            "that of all no-contact rows in the others"
        )
    return _subtracted(touches, offset, note)


def _subtracted(touches: Touches, offset: FloatArray, note: str) -> Touches:
    unknown = np.isnan(offset).all(axis=0)
    if unknown.any():
        names = ", ".join(f"e{k + 1:02d}" for k in np.flatnonzero(unknown))
        note += f" ({names}: no such reading, left as it is)"
    readings = touches.readings - np.where(np.isnan(offset), 0.0, offset)
    return touches.with_(readings=readings, notes=(*touches.notes, note))


def _weights(touches: Touches) -> FloatArray:
    return np.ones(touches.n_rows) if touches.reads is None else np.where(np.isnan(touches.reads), 1, touches.reads)
