"""Folds are blocks in time: short ones, or long ones where touches that follow each other are neighbours in place."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.diagnosis.comparison import folds


@pytest.mark.parametrize(("scanned", "size"), [(False, 8), (True, 10)])
def test_folds_are_blocks_in_time(scanned: bool, size: int) -> None:
    """Of 300 touches: blocks of 8, or a thirtieth of a scan, dealt out to eight folds in turn."""
    order = np.random.default_rng(0).permutation(300)
    observed = SimpleNamespace(n_touches=300, touch_time_s=order.astype(float))
    fitted: Any = SimpleNamespace(model=SimpleNamespace(known=observed, time_is_place=scanned))
    np.testing.assert_array_equal(folds(fitted), (order // size) % 8)
