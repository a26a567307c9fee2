"""What is made of a fit of a pad with effects."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from bayestouch.pad.beginning import PadEvaluation


def test_no_residuals_where_no_touch_could_be_held_out() -> None:
    """Too few touches leave none aside: the answer is that there is nothing, whatever was fitted."""
    unused = cast(Any, None)
    evaluation = PadEvaluation(unused, unused, None, None, 8, 0, np.ones(1))
    assert evaluation.held_out(unused, None) is None
