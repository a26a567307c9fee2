"""Conversion of user input to arrays of a given type and shape, differences of angles, and quantiles of draws."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from bayestouch.array_types import BoolArray, FloatArray, FloatOrArray, IntArray, ObjectArray
from bayestouch.errors import InputError, shown

#: Upper limit of ids: integers below it are exact in double precision.
MAX_ID = 2**53


def quantiles(draws: FloatArray, probabilities: Sequence[float], axis: int | tuple[int, ...]) -> FloatArray:
    """Quantiles of draws along some axes, interpolated linearly.

    Where one of these draws is infinite (r_c of a flat), the quantile is one of them: the smallest that at least this
    share of them does not exceed. Draws at other places of the remaining axes do not matter.
    """
    finite = np.isfinite(draws).all(axis=axis)
    if not finite.size:
        return np.empty((len(probabilities), *finite.shape))
    with np.errstate(invalid="ignore"):  # between infinite draws, which are replaced
        between = np.quantile(draws, probabilities, axis=axis)
    if finite.all():
        return np.asarray(between)
    return np.where(finite, between, np.quantile(draws, probabilities, axis=axis, method="inverted_cdf"))


def responding(readings: FloatArray) -> BoolArray:
    """Elements (m,) whose readings (n, m) differ, or that have only one; NaN missing.

    An element without readings, or with the same one throughout, is dead: touches do not change what it reads.
    """
    some = ~np.isnan(readings)
    largest = np.where(some, readings, -np.inf).max(axis=0, initial=-np.inf)
    least = np.where(some, readings, np.inf).min(axis=0, initial=np.inf)
    return np.asarray((largest > least) | (some.sum(axis=0) == 1))


def read_once(counts: npt.NDArray[Any]) -> FloatArray:
    """Numbers of reads, and 1 where there is none: for a variance that is not used there, but must be finite."""
    return np.where(counts > 0, counts, 1.0)


def turned(degrees: npt.ArrayLike) -> FloatArray:
    """Differences of angles, in degree, as the shorter way around the circle: from -180 to below 180."""
    return np.asarray((np.asarray(degrees, dtype=np.float64) + 180) % 360 - 180)


def nearest_turn(angles: FloatArray, to: FloatOrArray, turn: float = 360.0) -> FloatArray:
    """Angles in degree, with as many whole turns added as bring them nearest to other angles.

    Angles that are within half a turn of the others are unchanged to the bit; one that is not finite becomes NaN. In
    another unit a whole turn is `turn`.
    """
    with np.errstate(invalid="ignore"):
        return np.asarray(angles + turn * np.round((to - angles) / turn))


def kept(array: npt.NDArray[Any], given: object) -> npt.NDArray[Any]:
    """The array of a value that was given, read-only; copied if whoever gave it can still write to it."""
    shared = array is given or array.base is not None
    return read_only(array.copy() if shared and array.flags.writeable else array)


def read_only(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    view = array.view()
    view.flags.writeable = False
    return view


def as_floats(value: Any) -> FloatArray:
    """Numbers of a user as an array of floats, not copied if it is one; masked and missing ones become NaN.

    Raises
    ------
    InputError
        It has values that are no real numbers, or dates or durations.
    """
    try:
        array = np.asarray(value)
        kinds = {array.dtype.kind, getattr(getattr(value, "dtype", None), "kind", "")}
        if not kinds & {"m", "M", "c"}:
            return _with_nan(value, array)
    except (TypeError, ValueError):
        raise InputError(f"expected numbers, got {shown(value)}") from None
    if "c" in kinds:
        raise InputError(f"expected real numbers, got complex ones: {shown(value)}")
    # The numbers behind dates count µs, ns or another unit, by the way in which they were made.
    got, since = ("datetime64", "(t - t[0])") if "M" in kinds else ("timedelta64", "t")
    raise InputError(
        f"expected seconds as numbers, got {got}: give seconds since the first row, as {since} / np.timedelta64(1, 's')"
    )


def _with_nan(value: Any, array: npt.NDArray[Any]) -> FloatArray:
    """The array of a value as floats, with NaN where the value has none: masked in numpy, NA in pandas."""
    if isinstance(value, np.ma.MaskedArray):
        return np.asarray(np.ma.filled(value.astype(np.float64), np.nan))
    if array.dtype.kind == "O" and hasattr(value, "isna"):  # a table or column of pandas
        return np.asarray(value.to_numpy(dtype=np.float64, na_value=np.nan))
    return np.asarray(array, dtype=np.float64)


def float_array(value: object, name: str, shape: tuple[int, ...]) -> FloatArray:
    try:
        array = as_floats(value)
    except InputError as error:
        raise InputError(error.message, column=name) from None
    if array.shape != shape:
        raise InputError(f"expected an array of shape {shape}, got {array.shape}", column=name)
    return kept(array, value)


def whole_array(value: object, name: str, n: int) -> IntArray:
    array = np.asarray(value)
    if array.dtype.kind not in "iu" or np.ma.is_masked(value):
        array = float_array(value, name, (n,))
    if array.shape != (n,):
        raise InputError(f"expected an array of shape {(n,)}, got {array.shape}", column=name)
    if not np.all((array > -MAX_ID) & (array < MAX_ID) & (array == np.floor(array))):
        raise InputError(f"expected integers below 2^53, got {shown(value)}", column=name)
    return read_only(array.astype(np.int64))


def text_rows(values: object, name: str, n: int) -> ObjectArray:
    array = np.asarray(values, dtype=object)
    if array.shape != (n,):
        raise InputError(f"expected an array of shape {(n,)}, got {array.shape}", column=name)
    if not all(isinstance(value, str) for value in array):
        array = np.array([value if isinstance(value, str) else str(value) for value in array], dtype=object)
    return kept(array, values)
