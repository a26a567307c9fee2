"""Conversion of user input to arrays of a given type and shape, and quantiles of draws."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from bayestouch.array_types import FloatArray, IntArray, ObjectArray
from bayestouch.errors import InputError, shown

#: Upper limit of ids: integers below it are exact in double precision.
MAX_ID = 2**53


def quantiles(draws: FloatArray, probabilities: Sequence[float], axis: int | tuple[int, ...]) -> FloatArray:
    """Quantiles of draws, interpolated linearly; without interpolation if a draw is infinite (r_c of a flat)."""
    method = "linear" if np.isfinite(draws).all() else "inverted_cdf"
    return np.asarray(np.quantile(draws, probabilities, axis=axis, method=method))  # type: ignore[call-overload]  # the stubs want a literal


def read_only(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    view = array.view()
    view.flags.writeable = False
    return view


def float_array(value: object, name: str, shape: tuple[int, ...]) -> FloatArray:
    try:
        array: FloatArray = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"expected numbers, got {shown(value)}", column=name) from None
    if array.shape != shape:
        raise InputError(f"expected an array of shape {shape}, got {array.shape}", column=name)
    return read_only(array)


def whole_array(value: object, name: str, n: int) -> IntArray:
    array = np.asarray(value)
    if array.dtype.kind not in "iu":
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
    return read_only(array)
