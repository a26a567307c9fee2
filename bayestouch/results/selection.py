"""Some of the touches of a result: by their position in the table, by number, by tip and by place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.data.arrays import nearest_turn
from bayestouch.errors import InputError, few, number_array, shown
from bayestouch.results.data import PosteriorsData, TouchRows
from bayestouch.results.draws_on_file import DrawsOnFile

AnyPosteriors = TypeVar("AnyPosteriors", bound=PosteriorsData)
#: What a touch may be chosen by: a number, several of them, or a range with both ends.
Wanted = float | ArrayLike | slice
# Half of the last decimal of the places in posterior files, see `bayestouch.results.schema.touch_coordinates`.
_ROUNDING = 5.1e-7


def touches_at(posteriors: AnyPosteriors, positions: IntArray) -> AnyPosteriors:
    """Return the posteriors of the touches at some positions (from 0), in this order."""

    def along(arrays: Mapping[str, FloatArray], axis: int = -1) -> dict[str, FloatArray]:
        return {name: np.take(values, positions, axis=axis) for name, values in arrays.items()}

    rows: dict[str, Any] = {name: values[positions] for name, values in posteriors.rows.arrays().items()}
    draws, tips = posteriors.posterior, posteriors.tips
    return replace(
        posteriors,
        posterior=draws.at(positions) if isinstance(draws, DrawsOnFile) else along(draws) or draws,
        sample_stats=along(posteriors.sample_stats),
        reference=along(posteriors.reference),
        estimates=along(posteriors.estimates),
        groups={name: along(group, axis=2) for name, group in posteriors.groups.items()},
        rows=TouchRows(location=along(posteriors.rows.location), **rows),
        tips=None if tips is None else replace(tips, log_probability=tips.log_probability[positions]),
    )


def positions_of(rows: TouchRows, index: int | slice | ArrayLike) -> IntArray:
    """Return the positions that an index of numpy means: a position, a slice, positions, or a condition (t,).

    Raises
    ------
    IndexError
        If a position is not in the table, the condition has another length, or the index has more than one axis.
    """
    if isinstance(index, list) and not index:  # numpy makes numbers with a point of it, which are no positions
        return np.arange(0)
    found = np.arange(len(rows.touch))[index if isinstance(index, slice) else np.asarray(index)]
    if found.ndim > 1:
        raise IndexError(f"touches have one axis, got an index of shape {found.shape}")
    return np.atleast_1d(found)


def positions_with(rows: TouchRows, wanted: Mapping[str, Wanted | None]) -> IntArray:
    """Return the positions of the touches that meet every condition.

    Parameters
    ----------
    rows : TouchRows
        t touches.
    wanted : mapping
        Condition by coordinate (see `coordinates_of`): a number, several numbers, or a slice with both ends included;
        None is no condition.

    Raises
    ------
    InputError
        If the touches have no such coordinate, or none of them meets a condition.
    """
    conditions = {name: value for name, value in wanted.items() if value is not None}
    known = coordinates_of(rows)
    meets = np.ones(len(rows.touch), dtype=bool)
    for name, value in conditions.items():
        if name not in known:
            raise InputError(f"{name}: touches of this sensor are chosen by {', '.join(known)}")
        if isinstance(value, slice) and value.step is not None:
            raise InputError(f"{name}: a slice of touches has no step, got {value.step}")
        for each in (value.start, value.stop) if isinstance(value, slice) else (value,):
            if each is not None:
                number_array(name, each, *((0,) if isinstance(value, slice) else (0, 1)))
        this = _meets(known[name], value, turn="theta_c" in rows.location and name == "place")
        if not this.any():
            raise InputError(f"{name}: no touch has {_in_words(value)}; {_there_are(known[name])}")
        meets &= this
    if not meets.any():
        raise InputError(f"no touch meets all of {', '.join(f'{k}={_in_words(v)}' for k, v in conditions.items())}")
    return np.flatnonzero(meets)


def coordinates_of(rows: TouchRows) -> dict[str, FloatArray | IntArray]:
    """Return what touches can be chosen by, (t,) arrays with the names that posterior files use.

    ``touch``, the number in the table; ``tip``, the reference radius r_c in mm; ``place`` in degrees or mm, on a pad in
    two dimensions ``place_x`` and ``place_y``. NaN unknown.
    """
    one = len(rows.location) == 1
    places = {"place" if one else f"place_{axis}": values for axis, values in rows.location.items()}
    return {"touch": rows.touch, "tip": rows.radius_mm, **places}


def _meets(values: FloatArray | IntArray, wanted: Wanted, *, turn: bool) -> NDArray[np.bool_]:
    """Whether values (t,) meet a condition; with `turn` they are angles, of which a whole turn more is the same."""
    if isinstance(wanted, slice):
        low = -np.inf if wanted.start is None else wanted.start
        high = np.inf if wanted.stop is None else wanted.stop
        if turn and np.isfinite(low) and np.isfinite(high):
            return np.asarray((values - low + _ROUNDING) % 360 <= high - low + 2 * _ROUNDING)
        end = high if np.isinf(low) else low
        if turn and 180 < np.abs(end) < np.inf:
            # Angles from 0 to 360, or down to -360, as the one end that is given.
            values = nearest_turn(np.asarray(values, dtype=np.float64), float(np.copysign(180, end)))
        return np.asarray((values >= low - _ROUNDING) & (values <= high + _ROUNDING))
    each = np.atleast_1d(np.asarray(wanted, dtype=np.float64))
    near = np.asarray(values[:, None], dtype=np.float64)
    if turn:
        near = np.where(np.isfinite(each), nearest_turn(near, each), near)
    return np.asarray(np.isclose(near, each, rtol=0, atol=_ROUNDING).any(axis=1))


def _in_words(wanted: Wanted) -> str:
    if isinstance(wanted, slice):
        return f"{wanted.start} to {wanted.stop}"
    return shown(wanted)


def _there_are(values: FloatArray | IntArray) -> str:
    known = np.unique(values[~np.isnan(values)])
    if not known.size:
        return "it is not known of any touch"
    if len(known) > 12:
        return f"there are {known[0]:g} to {known[-1]:g}"
    return f"there are {few([f'{value:g}' for value in known], 12)}"
