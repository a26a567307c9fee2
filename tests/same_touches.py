"""Whether touches are the same, bit for bit."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from bayestouch.data.touches import Touches


def same_touches(one: Touches, other: Touches) -> bool:
    """Whether both hold the same data bit for bit (NaN equal to NaN, 0 not to −0); notes do not count."""
    for each in fields(one):
        mine, theirs = getattr(one, each.name), getattr(other, each.name)
        if each.name == "extra":
            if mine.keys() != theirs.keys() or any(list(mine[k]) != list(theirs[k]) for k in mine):
                return False
        elif each.name != "notes" and not _same_bits(mine, theirs):
            return False
    return True


def _same_bits(mine: Any, theirs: Any) -> bool:
    if mine is None or theirs is None:
        return mine is theirs
    both_nan = np.isnan(mine) & np.isnan(theirs) if mine.shape == theirs.shape else False
    return mine.shape == theirs.shape and bool(
        np.all(both_nan | ((mine == theirs) & (np.signbit(mine) == np.signbit(theirs))))
    )
