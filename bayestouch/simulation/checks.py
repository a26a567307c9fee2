"""Checks of a design for values that are impossible."""

from __future__ import annotations

import numpy as np

from bayestouch.errors import InputError, number_array


def check_positive(**values: float) -> None:
    """Refuse values that are not finite and above zero."""
    for name, value in values.items():
        if not 0 < number_array(name, value, 0) < np.inf:
            raise InputError(f"{name}: expected a finite number above zero, got {value:g}")


def check_not_negative(**values: float) -> None:
    """Refuse values that are not finite or are below zero."""
    for name, value in values.items():
        if not 0 <= number_array(name, value, 0) < np.inf:
            raise InputError(f"{name}: expected a finite number, zero or larger, got {value:g}")


def check_ratio(poisson_ratio: float) -> None:
    """Refuse a Poisson's ratio that no rubber has."""
    if not 0 <= number_array("poisson_ratio", poisson_ratio, 0) <= 0.5:
        raise InputError(f"poisson_ratio: expected a ratio from 0 to 0.5, got {poisson_ratio:g}")


def check_range(load_range: tuple[float, float]) -> None:
    """Refuse a load range that is not of two positive, finite loads in order."""
    number_array("load_range", load_range, 1)
    if len(load_range) != 2 or not 0 < load_range[0] <= load_range[1] < np.inf:
        raise InputError(f"load_range: expected two finite loads in order, got {load_range}")
