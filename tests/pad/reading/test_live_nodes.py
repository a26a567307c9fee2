"""Moments of the integrals of one touch on a pad, and what is known of its load."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.chain.noise import Noise
from bayestouch.pad.reading.live_nodes import OnePadTouch, PadNodes
from bayestouch.reading.live import HeldTouch


def test_moments_are_those_of_a_mixture() -> None:
    """Two places of 1/4 and 3/4: between them variances p q d² and covariance p q d e; the load has its own, too."""
    location, load = np.array([[1.0, 5.0], [3.0, 4.0]]), np.array([2.0, 6.0])
    nodes = PadNodes(location, np.array([0.25, 0.75]), np.zeros((1, 2)), load, np.array([1.0, 3.0]), 0.0)
    mean, covariance = nodes.with_load()
    np.testing.assert_allclose(mean, [2.5, 4.25, 5.0])
    steps = np.array([2.0, -1.0, 4.0])
    wanted = 0.25 * 0.75 * np.outer(steps, steps)
    wanted[2, 2] += 0.25 * 1.0 + 0.75 * 3.0
    np.testing.assert_allclose(covariance, wanted)
    assert nodes.load_sd == pytest.approx(np.sqrt(wanted[2, 2]))


def reader(measured: bool) -> Any:
    """A pad whose second element is not used; a load that is not measured is 5 ± 2 N."""
    noise = Noise(np.ones(3), np.zeros(3), force_sd=0.4, load_scatter=0.3)
    return SimpleNamespace(
        usable=np.array([True, False, True]),
        load=5.0,
        load_sd=2.0,
        load_measured=measured,
        noise=noise,
        map=SimpleNamespace(offset=np.array([1.0, 1.0, 1.0])),
        measured_load_sd=lambda load, reads: noise.force_sd / np.sqrt(reads),
    )


@pytest.mark.parametrize(
    ("load", "measured", "mean", "sd"), [(7.0, True, 7.0, 0.2), (7.0, False, 5.0, 2.0), (np.nan, True, 5.0, 2.0)]
)
def test_load_before_the_readings(load: float, measured: bool, mean: float, sd: float) -> None:
    """Four reads of the force sensor halve its sd; without it, or in a calibration without it, the prior's is used."""
    touch = HeldTouch.none(3).after(np.array([3.0, 4.0, np.nan]), load, 4.0)
    one = OnePadTouch.of(reader(measured), touch)
    assert (one.load, one.load_sd) == (mean, pytest.approx(sd))
    assert one.felt_sd == pytest.approx(np.sqrt(sd**2 + 0.3**2))
    np.testing.assert_array_equal(one.reading, [2.0, 0.0, 0.0])
    np.testing.assert_array_equal(one.counts, [4.0, 0.0, 0.0])
