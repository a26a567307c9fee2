"""What is made of a fit of a pad with effects."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
from pad_simulation import line

from bayestouch.model.split_data import SplitData
from bayestouch.pad.beginning import PadEvaluation, begin


def test_no_residuals_where_no_touch_could_be_held_out() -> None:
    """Too few touches leave none aside: the answer is that there is nothing, whatever was fitted."""
    unused = cast(Any, None)
    evaluation = PadEvaluation(unused, unused, None, None, 8, 0, np.ones(1))
    assert evaluation.held_out(unused, None) is None


def test_models_of_the_start_are_used_again_and_change_no_bit() -> None:
    pad = line()
    touches = pad.touch(np.linspace(6, 32, 53)[:, None], np.random.default_rng(0))
    data = SplitData.of(replace(pad.dataset(touches), calibration=None))
    started = begin(data, kernel="gaussian", draws=64, seed=0)
    evaluation = cast(PadEvaluation, started.evaluation)
    assert {"gaussian", "gaussian with map"} <= set(evaluation.earlier)
    again, anew = (each.calibration(started.fitted, (), None) for each in (evaluation, replace(evaluation, earlier={})))
    assert again.settings == anew.settings and again.notes == anew.notes
    for name, draws in anew.posterior.items():
        np.testing.assert_array_equal(again.posterior[name], draws)
    for name, table in anew.extra.items():
        np.testing.assert_array_equal(again.extra[name], table)
