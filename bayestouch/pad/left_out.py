"""Touches that are left out together, so that their prediction from the others shows the noise of later touches."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import IntArray

# Number of blocks. Touches that follow each other have similar errors, for example if a zero drifts or the rubber has
# not recovered: a single left-out touch would be predicted better than a touch of another day is.
BLOCKS = 40


def blocks_left_out(touches: int) -> list[IntArray]:
    """Blocks of touches that follow each other, as indices; single touches if there are few."""
    return np.array_split(np.arange(touches), min(BLOCKS, touches))
