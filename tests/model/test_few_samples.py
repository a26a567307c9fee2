"""Means of few samples with outliers, against mixtures of normal densities written out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayestouch.data.averages import TouchMeans
from bayestouch.data.touches import Touches, touches_from
from bayestouch.model.few_samples import FewSamples, doubtful_samples
from bayestouch.model.noise import AddedNoise
from bayestouch.model.outliers import RightReadings

NAN = np.nan
SD, PEAK = np.array([2.0, 2.0]), np.array([100.0, 100.0])
RIGHT = RightReadings(SD, PEAK, AddedNoise())
#: With noise of a tenth of the signal beside.
GROWING = RightReadings(SD, PEAK, AddedNoise(share=0.1))
SHARE, SIZE = 0.1, 0.4
WIDE = 2.0**2 + 40.0**2


def table(readings: list[list[float]], touch: list[int]) -> Touches:
    return touches_from(np.array(touch), np.array(readings), sample=np.arange(len(touch)))


def few_of(rows: Touches, right: RightReadings = RIGHT) -> FewSamples:
    few = FewSamples.of(rows, (SHARE, SIZE), right)
    assert few is not None
    return few


def weighed(rows: Touches, at: list[list[float]], variance: float, right: RightReadings = RIGHT) -> TouchMeans:
    """Means if the other elements always expect true means `at` (t, m) with one variance."""

    def expected(means: TouchMeans) -> tuple[np.ndarray, np.ndarray]:
        read = SD**2 + (right.added.share * np.array(at)) ** 2
        return means.readings - np.array(at), variance + read / means.counts

    return few_of(rows, right).weighed(rows.averaged(), expected)


def test_samples_in_doubt() -> None:
    """Five samples with four left are judged; with two of four left they are not, nor are one, two or three."""
    touch = [4, 4, 4, 4, 4, 1, 1, 1, 1, 7]
    readings = np.arange(20.0).reshape(10, 2)
    kept = readings.copy()
    kept[0] = NAN
    kept[5:7, 0] = NAN
    rows = table(readings.tolist(), touch)
    found = doubtful_samples(rows, rows.with_(readings=kept)).readings
    wanted = readings.copy()
    wanted[:5] = NAN
    wanted[5:9, 1] = NAN
    np.testing.assert_array_equal(found, wanted)


@pytest.mark.parametrize(
    ("reading", "right"), [(51.0, RIGHT), (54.0, RIGHT), (51.0, GROWING), (58.0, GROWING), (62.0, GROWING)]
)
def test_one_sample_is_right_or_wrong(reading: float, right: RightReadings) -> None:
    """Mean and variance of the product with what others expect: of the mixture of both cases.

    The noise is that at the mean of the product, which is found in steps.
    """
    about, variance, mean = 50.0, 9.0, 50.0
    for _ in range(20):
        usual = 4.0 + (right.added.share * mean) ** 2
        mass, means, variances = [], [], []
        for share, own in ((1 - SHARE, usual), (SHARE, usual + 40.0**2)):
            total = own + variance
            mass.append(share * np.exp(-0.5 * (reading - about) ** 2 / total) / np.sqrt(total))
            means.append((reading / own + about / variance) / (1 / own + 1 / variance))
            variances.append(1 / (1 / own + 1 / variance))
        share = np.array(mass) / np.sum(mass)
        mean = float(share @ means)
    spread = float(share @ (np.array(variances) + np.square(means))) - mean**2
    found = weighed(table([[reading, 20.0]], [0]), [[about, 20.0]], variance, right)
    precision = found.counts[0, 0] / usual
    product = precision + 1 / variance
    assert 1 / product == pytest.approx(spread, rel=0.02)
    assert (precision * found.readings[0, 0] + about / variance) / product == pytest.approx(mean, rel=0.01)


def test_reading_between_right_and_wrong_says_nothing() -> None:
    """Two separate ranges of the true mean: no normal density stands for them, and the expectation is left as it is."""
    found = weighed(table([[60.0, 20.0]], [0]), [[50.0, 20.0]], 9.0)
    assert found.readings[0, 0] == pytest.approx(60.0)
    assert found.counts[0, 0] == pytest.approx(SD[0] ** 2 / WIDE, rel=0.1)


def test_reading_that_others_contradict_hardly_counts() -> None:
    found = weighed(table([[90.0, 20.0]], [0]), [[50.0, 20.0]], 9.0)
    assert found.readings[0, 0] == pytest.approx(90.0)
    assert found.counts[0, 0] == pytest.approx(SD[0] ** 2 / WIDE, rel=0.1)
    assert found.counts[0, 1] == pytest.approx(1.0, abs=0.05)


def test_a_wrong_reading_counts_by_the_noise_at_the_signal_that_others_expect() -> None:
    """4 + 5² = 29 at 50, with which touches are read: not 94 at the reading 95."""
    found = weighed(table([[95.0, 20.0]], [0]), [[50.0, 20.0]], 9.0, GROWING)
    assert found.counts[0, 0] == pytest.approx(29.0 / (29.0 + 40.0**2), rel=0.1)
    # The other element, at 20, has the noise 4 + 2² and is right.
    assert found.counts[0, 1] == pytest.approx(1.0, abs=0.05)


def test_others_say_which_of_two_samples_is_right() -> None:
    found = weighed(table([[50.0, 20.0], [80.0, 21.0]], [0, 0]), [[51.0, 20.0]], 9.0)
    # The wrong one adds 1/WIDE to the precision 1/4 of the right one; that both are wrong is possible.
    assert found.readings[0, 0] == pytest.approx(50.0, abs=0.3)
    assert found.counts[0, 0] == pytest.approx(1.0, abs=0.15)
    assert found.readings[0, 1] == pytest.approx(20.5, abs=0.01)
    assert found.counts[0, 1] == pytest.approx(2.0, rel=0.02)


def test_elements_that_expect_nothing() -> None:
    """A reading alone has the variance of right and wrong ones together, within two sd of wrong ones."""
    rows = table([[50.0, 20.0]], [0])
    found = few_of(rows).weighed(rows.averaged(), lambda means: (np.zeros((1, 2)), np.full((1, 2), np.inf)))
    np.testing.assert_allclose(found.readings, [[50.0, 20.0]], atol=0.01)
    within = 4 * WIDE
    mass = np.array([(1 - SHARE) / np.sqrt(4.0 + within), SHARE / np.sqrt(WIDE + within)])
    product = mass @ [1 / (1 / 4.0 + 1 / within), 1 / (1 / WIDE + 1 / within)] / mass.sum()
    np.testing.assert_allclose(SD**2 / found.counts, 1 / (1 / product - 1 / within), rtol=0.15)


def test_element_that_is_always_off_is_no_outlier() -> None:
    """Its readings stay as they are, for the check of the sensor."""
    rows = table([[90.0, 20.0]] * 40, list(range(40)))
    found = weighed(rows, [[50.0, 20.0]] * 40, 9.0)
    alone = few_of(rows).weighed(rows.averaged(), lambda means: (np.zeros((40, 2)), np.full((40, 2), np.inf)))
    np.testing.assert_array_equal(found.counts[:, 0], alone.counts[:, 0])
    np.testing.assert_allclose(found.counts[:, 1], 1.0, atol=0.05)


def test_rest_reading_stays_in_the_counts() -> None:
    rows = table([[50.0, 20.0]], [0]).with_(rest_reads=np.full((1, 2), 3.0))
    found = weighed(rows, [[50.0, 20.0]], 9.0)
    np.testing.assert_allclose(found.counts, 1 / (1 + 1 / 3), rtol=0.05)


def test_loads_keep_their_reads() -> None:
    rows = table([[90.0, 20.0]], [0])
    np.testing.assert_array_equal(weighed(rows, [[50.0, 20.0]], 9.0).reads_of_load, rows.averaged().reads_of_load)


def test_nothing_in_doubt() -> None:
    rows = table([[NAN, NAN]], [0])
    assert FewSamples.of(rows, (SHARE, SIZE), RIGHT) is None
    averages = replace(table([[1.0, 2.0]], [0]), reads=np.array([5.0]))
    assert FewSamples.of(averages, (SHARE, SIZE), RIGHT) is None
