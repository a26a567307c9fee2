"""Checks of single values of `sensor.toml`."""

from __future__ import annotations

import math
import numbers
from collections.abc import Iterable, Mapping

from bayestouch.errors import InputError, shown


def checked_number(value: object, column: str) -> float:
    """Return the value as a finite number; raises `InputError` for anything else."""
    # In Python a bool is a number, but `true` as a radius is a mistake.
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise InputError(f"expected a number, got {shown(value)}", column=column)
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise InputError(f"expected a finite number, got {shown(value)}", column=column)
    return number


def checked_positive(value: object, column: str) -> float:
    """Return the value as a finite number above zero; raises `InputError` for anything else."""
    number = checked_number(value, column)
    if number <= 0:
        raise InputError(f"expected a number above zero, got {number!r}", column=column)
    return number


def checked_numbers(values: object, column: str) -> tuple[float, ...]:
    """Return the values as finite numbers, at least one; raises `InputError` for anything else."""
    if isinstance(values, str | bytes | Mapping) or not isinstance(values, Iterable):
        raise InputError(f"expected an array of numbers, got {shown(values)}", column=column)
    found = tuple(checked_number(value, f"{column}[{i}]") for i, value in enumerate(values))
    if not found:
        raise InputError("expected one number for each element, got none", column=column)
    return found


def checked_text(value: object, column: str) -> str:
    """Return the value if it is a text; raises `InputError` for anything else."""
    if not isinstance(value, str):
        raise InputError(f"expected text, got {shown(value)}", column=column)
    return value
