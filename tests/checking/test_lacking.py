"""Advice of a check on elements: those that are dead, and those whose readings come in coarse steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from known_fingers import dataset, known_touches

import bayestouch
from bayestouch.checking.lacking import coarse_elements
from bayestouch.data.touches import Touches, touches_from


def rounded(noise: float, step: float, samples: int = 4) -> Touches:
    """200 touches of two elements with this noise; the readings of the first are multiples of the step."""
    rng = np.random.default_rng(0)
    readings = np.repeat(rng.uniform(0.0, 20.0, (200, 2)), samples, axis=0) + rng.normal(0.0, noise, (200 * samples, 2))
    readings[:, 0] = step * np.round(readings[:, 0] / step)
    return touches_from(np.repeat(np.arange(200), samples), readings, contact=1.0)


@pytest.mark.parametrize(("noise", "coarse"), [(0.02, True), (0.2, True), (0.4, True), (0.6, False), (2.0, False)])
def test_steps_of_more_than_twice_the_noise(noise: float, coarse: bool) -> None:
    """Steps of 1: above a noise of 0.5 the rounding errors of samples are independent, and samples scatter by more."""
    table = rounded(noise, 1.0)
    assert coarse_elements(table, table.averaged()).tolist() == [coarse, False]


def test_touches_that_are_not_repeated_tell_no_step() -> None:
    """Nor do samples that are all equal, of which the check says more."""
    table = rounded(0.02, 1.0, samples=1)
    assert not coarse_elements(table, table.averaged()).any()


def test_dead_and_coarse_elements_are_named() -> None:
    whole = known_touches(1, step=3.0)
    readings = whole.readings.copy()
    readings[:, 2] = 0.0
    scatter = np.sqrt(whole.averaged().pure_error_variance[0])
    readings[:, 0] = 6 * scatter * np.round(readings[:, 0] / (6 * scatter))
    table = whole.with_(readings=readings)
    for each, said in (
        (whole, []),
        (table, ["e03: no readings, or the same one in every row", "e01: readings come in"]),
    ):
        facts = bayestouch.check(replace(dataset(each), calibration=each, touches=each)).facts
        named = [line for line in facts["advice"] if line[:1] == "e" and line[1:3].isdigit()]
        assert len(named) == len(said) and all(a.startswith(b) for a, b in zip(named, said, strict=True))
