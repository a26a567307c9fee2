"""The study of touches that a choice saves: even grids are even, and the sets that it counts are equally good."""

from __future__ import annotations

import numpy as np
import pytest
from study_modules import study

import bayestouch
from bayestouch.model.planned_table import planned_table
from bayestouch.reliability.choice_of_touches import lowest_sd

module = study("next_touches")
sets = study("_touch_sets")


@pytest.fixture(scope="module")
def finger() -> tuple[bayestouch.Calibration, bayestouch.Touches]:
    dataset = bayestouch.simulate(module.FINGER, seed=1).dataset
    return bayestouch.calibrate(dataset, draws=200), dataset.touches


def test_even_grids_are_even(finger: tuple[bayestouch.Calibration, bayestouch.Touches]) -> None:
    one, table = finger
    means = planned_table(table, one)
    assert means.angle_deg is not None
    for box, low, high in ((None, -35.0, 35.0), (module.FINGER_PART, -10.0, 10.0)):
        for tips, index in zip((2, 5), sets.even_grids(means, 15, box), strict=True):
            assert len(set(index.tolist())) == 15
            assert len(set(means.indenter_radius_mm[index].tolist())) == tips
            # Each place is the nearest that is left: at most a step of the candidates from the even one.
            np.testing.assert_allclose(np.sort(means.angle_deg[index]), np.linspace(low, high, 15), atol=2.5)
    plane = bayestouch.simulate(module.PAD, seed=1).dataset.touches.averaged()
    (index,) = sets.even_grids(plane, 20)
    assert len(set(index.tolist())) == len(index) and abs(len(index) - 20) <= 2


def test_the_chosen_touches_are_the_fewest_that_are_not_worse(
    finger: tuple[bayestouch.Calibration, bayestouch.Touches],
) -> None:
    one, table = finger
    planned, asked = module.Question("σ, μ, r_s", ("sigma", "mu", "r_s")).of(one, table)
    found = sets.sets_for_sd(planned, asked, sets.even_grids(planned_table(table, one), 15))
    even, chosen = (
        sets.relative(lowest_sd(planned.select(each), asked, len(each)).value) for each in (found.even, found.chosen)
    )
    assert chosen[-1] <= even[-1] < chosen[-2]
    assert found.saved == pytest.approx(100 * (1 - len(found.chosen) / 15))


def test_the_log_ratio_is_that_of_the_densities_of_readings() -> None:
    """Readings of one element, with known parameters: two normal densities."""
    from scipy.stats import norm

    from bayestouch.data.touches import touches_from
    from bayestouch.model.planned import PlannedReadings

    table = touches_from([0, 1], [[1.0], [3.0]], angle_deg=[0.0, 1.0], indenter_radius_mm=0.0, load=100.0)
    one, two = (
        PlannedReadings(np.full((2, 1), mean), np.zeros((2, 1, 1)), np.eye(1), np.full((2, 1, 1), sd**2))
        for mean, sd in ((1.0, 2.0), (2.0, 1.0))
    )
    expected = norm.logpdf([1.0, 3.0], 1.0, 2.0).sum() - norm.logpdf([1.0, 3.0], 2.0, 1.0).sum()
    assert sets.log_ratio((one, two), table, np.array([0, 1])) == pytest.approx(expected)
