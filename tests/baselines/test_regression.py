"""Regression without physics: touches of a pad whose posterior can be written out."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from bayestouch.baselines import Regression, RegressionTouches, gaussian_process, polynomial, read_by_regression
from bayestouch.errors import InputError

pytest.importorskip("sklearn", reason="needs the extra `baselines`")

NOISE, TOUCHES, HELD = 0.05, 300, 200


Way = Callable[[RegressionTouches], Regression]
BOTH = pytest.mark.parametrize("way", [gaussian_process, polynomial])


def made(seed: int, count: int, loaded: bool) -> RegressionTouches:
    """Two elements that read P (1 + x/10) and P (2 - x/10), x from 0 to 10 mm, P from 1 to 3 N or 1 that is unknown."""
    rng = np.random.default_rng(seed)
    x, load = rng.uniform(0.0, 10.0, count), rng.uniform(1.0, 3.0, count) if loaded else np.ones(count)
    readings = load[:, None] * np.stack([1 + x / 10, 2 - x / 10], axis=1)
    readings += NOISE * rng.standard_normal(readings.shape)
    return RegressionTouches(x[:, None], load if loaded else None, readings)


@pytest.mark.slow
@BOTH
@pytest.mark.parametrize("loaded", [True, False])
def test_touches_are_read_as_the_true_law_would(way: Way, loaded: bool) -> None:
    known, held = made(0, TOUCHES, loaded), made(1, HELD, loaded)
    regression = way(known)
    # The law has few terms, so that what 300 touches leave open is small beside the noise.
    assert regression.left_out_percent == pytest.approx(100 * NOISE, rel=0.12)
    read = read_by_regression(regression, known, held, force_sd=1e-6)
    # Given the load, two readings tell x with slopes P/10 and -P/10.
    load = held.load if loaded else np.ones(HELD)
    sd = NOISE / (np.sqrt(2) * load / 10)
    inside = (held.location[:, 0] > 1.5) & (held.location[:, 0] < 8.5)  # far from the ends of the prior
    np.testing.assert_allclose(read.location_sd[inside, 0], sd[inside], rtol=0.15)
    error = (read.location[:, 0] - held.location[:, 0])[inside] / sd[inside]
    # The mean of squares of some 140 normal numbers scatters by 12 %; three times that.
    assert np.mean(error**2) == pytest.approx(1.0, abs=0.35)
    # Three standard deviations of the binomial distribution of 200 touches are 6 %.
    assert read.location_inside.mean() == pytest.approx(0.9, abs=0.065)
    if not loaded:
        assert np.isnan(read.load).all()
        return
    # Without it, P is the sum of the readings over 3, whatever x is.
    np.testing.assert_allclose(np.median(read.load_sd), np.sqrt(2) * NOISE / 3, rtol=0.15)
    low, high = read.load_interval.T
    assert np.mean((low <= held.load) & (held.load <= high)) == pytest.approx(0.9, abs=0.065)


def test_a_reading_that_is_missing_says_nothing() -> None:
    known, held = made(0, TOUCHES, False), made(1, 40, False)
    held.readings[:, 1] = np.nan
    read = read_by_regression(polynomial(known), known, held)
    inside = (held.location[:, 0] > 2) & (held.location[:, 0] < 8)
    np.testing.assert_allclose(read.location_sd[inside, 0], 10 * NOISE, rtol=0.15)


@BOTH
def test_an_element_that_is_hardly_read_says_nothing(way: Way) -> None:
    """One that was never read, one that four touches read, and one that is stuck: the others read as without them."""
    known, held = made(0, TOUCHES, False), made(1, 40, False)
    few = np.where(np.arange(TOUCHES) < 4, known.readings[:, 0], np.nan)
    more = np.column_stack([known.readings, np.full(TOUCHES, np.nan), few, np.full(TOUCHES, 0.7)])
    wider = np.column_stack([held.readings, np.full(40, np.nan), held.readings[:, 0], np.full(40, 0.7)])
    regression = way(RegressionTouches(known.location, None, more))
    alone = way(known)
    assert regression.left_out_percent == alone.left_out_percent
    read = read_by_regression(regression, known, RegressionTouches(held.location, None, wider))
    np.testing.assert_array_equal(read.location, read_by_regression(alone, known, held).location)
    assert np.isnan(read.residual[:, 2:]).all() and np.isfinite(read.residual[:, :2]).all()


@pytest.mark.parametrize("reads", [None, 4.0])
def test_the_error_of_a_load_is_that_of_a_mean(reads: float | None) -> None:
    """Given a load with an error, two readings tell x with slopes P/10 and -P/10, and a variance that has it, too."""
    known, held = made(0, TOUCHES, True), made(1, 40, True)
    assert held.load is not None
    held = replace(held, reads_of_load=None if reads is None else np.full(40, reads))
    read = read_by_regression(polynomial(known), known, held, force_sd=0.2)
    x, load_sd = held.location[:, 0], 0.2 / np.sqrt(reads or 1.0)
    information = sum((held.load / 10) ** 2 / (NOISE**2 + (load_sd * slope) ** 2) for slope in (1 + x / 10, 2 - x / 10))
    narrow = (x > 3) & (x < 7) & (held.load > 2)  # far from the ends of the prior
    np.testing.assert_allclose(read.location_sd[narrow, 0], information[narrow] ** -0.5, rtol=0.1)


def test_loads_that_are_all_the_same_are_refused() -> None:
    known = made(0, 40, True)
    with pytest.raises(InputError, match="the same load"):
        read_by_regression(polynomial(known), replace(known, load=np.ones(40)), known)


@BOTH
def test_touches_on_one_line_of_a_plane(way: Way) -> None:
    """A coordinate that never changes is neither a division by zero nor of any use."""
    known, held = made(0, TOUCHES, False), made(1, 40, False)
    flat = [
        RegressionTouches(np.column_stack([each.location, 0 * each.location + 4.0]), None, each.readings)
        for each in (known, held)
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read = read_by_regression(way(flat[0]), *flat)
    on_line = read_by_regression(way(known), known, held)
    # Weights sum to one but for rounding, of which the standard deviation shows the root.
    np.testing.assert_allclose(read.location[:, 1], 4.0, rtol=1e-12)
    np.testing.assert_allclose(read.location_sd[:, 1], 0.0, atol=1e-6)
    # A grid of 121 nodes in place of 601: steps of 0.09 mm beside a posterior of 0.35 mm.
    np.testing.assert_allclose(read.location[:, 0], on_line.location[:, 0], atol=0.05)


@BOTH
def test_a_plane_with_loads_is_read_as_the_true_law_would(way: Way) -> None:
    """Three elements that read P (1 + x/10), P (1 + y/10) and P (3 - (x + y)/10); x and y from 0 to 10 mm."""

    def touches(seed: int, count: int) -> RegressionTouches:
        rng = np.random.default_rng(seed)
        place, load = rng.uniform(0.0, 10.0, (count, 2)), rng.uniform(1.0, 3.0, count)
        slopes = np.array([[1, 0, -1], [0, 1, -1]]) / 10
        readings = load[:, None] * (np.array([1, 1, 3]) + place @ slopes)
        return RegressionTouches(place, load, readings + NOISE * rng.standard_normal(readings.shape))

    known, held = touches(0, 80), touches(1, 25)
    read = read_by_regression(way(known), known, held, force_sd=1e-6)
    assert held.load is not None
    inside = ((held.location > 2) & (held.location < 8)).all(axis=1)
    # Given the load, the information on (x, y) is (P/10/noise)² [[2, 1], [1, 2]]; its inverse has 2/3 on the diagonal.
    sd = np.sqrt(2 / 3) * NOISE * 10 / held.load
    np.testing.assert_allclose(read.location_sd[inside], np.stack([sd, sd], 1)[inside], rtol=0.25)
    # P is the sum of the readings over 5.
    np.testing.assert_allclose(np.median(read.load_sd), np.sqrt(3) * NOISE / 5, rtol=0.25)


@BOTH
def test_without_scikit_learn_one_line_says_what_to_install(way: Way, monkeypatch: pytest.MonkeyPatch) -> None:
    known = made(0, TOUCHES, False)
    monkeypatch.setitem(sys.modules, "sklearn", None)
    with pytest.raises(InputError, match=r"needs scikit-learn.*pip install 'bayestouch\[baselines\]'"):
        way(known)
