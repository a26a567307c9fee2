"""Probabilities of tips: odds, names and groups, by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.errors import InputError
from bayestouch.results.tips import TipProbabilities

SHARES = np.array([[0.5, 0.3, 0.2], [1e-9, 0.25, 0.75 - 1e-9]])


def made() -> TipProbabilities:
    prior: Any = SimpleNamespace(density="some", indenter_radius_mm=(0.0, 2.5), weights=(0.4, 0.4), share=0.2)
    return TipProbabilities.of(prior, np.log(SHARES).T)


def test_alternatives_and_their_odds() -> None:
    tips = made()
    assert tips.names == ("0", "2.5", "round")
    np.testing.assert_array_equal(tips.radius_mm, [0.0, 2.5, np.nan])
    np.testing.assert_array_equal(tips.prior, [0.4, 0.4, 0.2])
    np.testing.assert_allclose(tips.probability, SHARES)
    np.testing.assert_allclose(tips.log_odds, np.log(SHARES / (1 - SHARES)), rtol=1e-8)


def test_tips_alone() -> None:
    prior: Any = SimpleNamespace(density=None, indenter_radius_mm=(0.0, np.inf), weights=(0.5, 0.5), share=0.0)
    tips = TipProbabilities.of(prior, np.log([[0.9], [0.1]]))
    assert tips.names == ("0", "inf") and len(tips.prior) == 2
    only: Any = SimpleNamespace(density=None, indenter_radius_mm=(3.0,), weights=(1.0,), share=0.0)
    assert TipProbabilities.of(only, np.zeros((1, 2))).log_odds.tolist() == [[np.inf], [np.inf]]


def test_group_of_a_file() -> None:
    tips = made()
    group = tips.to_group(np.array([4, 7]))
    assert group["touch"].values.tolist() == [4, 7] and group["r_c"].attrs["units"] == "mm"
    np.testing.assert_allclose(group["tip_probability"].sel(touch=7), SHARES[1])
    again = TipProbabilities.from_groups({"tips": group}, 2)
    assert again is not None
    for name in ("radius_mm", "prior", "log_probability"):
        np.testing.assert_array_equal(getattr(again, name), getattr(tips, name))
    assert TipProbabilities.from_groups({}, 2) is None
    with pytest.raises(InputError):
        TipProbabilities.from_groups({"tips": group}, 3)
    group["tip_log_probability"] = group["tip_log_probability"] + 0.01
    with pytest.raises(InputError, match="add up to 1"):
        TipProbabilities.from_groups({"tips": group}, 2)
