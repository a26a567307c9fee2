"""Tests of columns on residuals of a few touches: gains, offsets and limits worked out by hand."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bayestouch.reading import fault_tests
from bayestouch.reading.fault_kinds import named
from bayestouch.reading.fault_notes import fault_notes, fault_settings
from bayestouch.reading.fault_tests import FEWEST, FEWEST_SIGNALS, SensorMisfit
from bayestouch.reading.faults import ColumnFault, SensorCheck, _exchanged, _root_mean_squares

SCALE = np.array([10.0, 20.0, 40.0])  # two elements and a force sensor


def misfit(touches: int, **changes: Any) -> SensorMisfit:
    """Residuals of ±1 sd in turn; signals at half of their peak, sds of a hundredth of it."""
    sign = np.where(np.arange(touches) % 2, -1.0, 1.0)[:, None]
    information = np.tile(1 / (0.01 * SCALE) ** 2, (touches, 1))
    values: dict[str, Any] = {
        "score": sign * np.sqrt(information),
        "information": information,
        "signal": np.tile(0.5 * SCALE, (touches, 1)),
        "signal_sd": np.zeros((touches, 3)),
        "shared": lambda direction: np.zeros(3),
        "discrepancy": np.zeros(3),
        "scale": SCALE,
    }
    return SensorMisfit(**(values | changes))


def test_settings() -> None:
    assert (FEWEST, FEWEST_SIGNALS) == (8, 3)
    assert (fault_tests.TOLERANCE, fault_tests.FORCE_TOLERANCE, fault_tests.SIGNAL_SHARE) == (0.01, 0.005, 0.2)
    assert (fault_tests.THRESHOLD, fault_tests.SCATTER) == (4.0, 2.5)


def test_what_the_other_columns_say_of_an_element() -> None:
    """Score times variance is the difference; without information the variance is infinite; elements only."""
    made = misfit(2)
    made.score[:], made.information[:] = [[6.0, 8.0, 1.0], [2.0, 3.0, 1.0]], [[4.0, 2.0, 1.0], [0.5, 0.0, 1.0]]
    difference, variance = made.expected
    np.testing.assert_allclose(difference, [[1.5, 4.0], [4.0, 0.0]])
    np.testing.assert_allclose(variance, [[0.25, 0.5], [2.0, np.inf]])


@pytest.mark.parametrize(("touches", "tells"), [(7, False), (8, True)])
def test_eight_touches_tell(touches: int, tells: bool) -> None:
    found = fault_tests.tested(misfit(touches))
    for values in (found.gain, found.gain_sd, found.offset_sd[:2], found.offset[:2], found.scatter):
        assert np.isfinite(values).all() == tells
    assert np.isnan(found.offset[2]), "a force sensor has no peak"
    assert not found.faulty.any() and found.agree


def test_gain_and_offset() -> None:
    """Residuals of 2 % of the peak at every touch, of half a peak each: a gain of 1.04 or an offset of 0.02.

    Eight touches of sd 1 %, over 1/2: 0.02/sqrt(8) for the gain, 0.01/sqrt(8) for the offset. Residuals of 2 sd make
    all scatter by 2/0.6745.
    """
    made = misfit(8)
    made.score[:] = 2 * np.sqrt(made.information)
    found = fault_tests.tested(made)
    usual = 2 / 0.6744897501960817
    assert found.usual == pytest.approx(usual)
    np.testing.assert_allclose(found.gain, 1.04)
    np.testing.assert_allclose(found.gain_sd, 0.02 / np.sqrt(8) * usual)
    np.testing.assert_allclose(found.offset, [0.02, 0.02, np.nan])
    np.testing.assert_allclose(found.offset_sd, [0.01 / np.sqrt(8) * usual] * 2 + [np.nan])
    np.testing.assert_allclose(found.drop, 8 * 4.0)
    np.testing.assert_allclose(found.scatter, 1.0)


def test_what_the_calibration_leaves_open_counts() -> None:
    """A variance of sums over touches, by the square of the weight: direction² times information."""
    made = misfit(8, shared=lambda direction: (direction**2).sum(axis=0))
    # residuals of one sd: their robust sd is 1/0.6745
    usual2 = (1 / 0.6744897501960817) ** 2
    weight = 8 * made.information[0]
    np.testing.assert_allclose(
        fault_tests.tested(made).offset_sd[:2], (np.sqrt(usual2 / weight + 8 / weight**2) / SCALE)[:2], rtol=1e-12
    )


def test_the_error_of_a_rest_reading_counts_once_for_all_touches() -> None:
    """Each element is off by one error in all touches: the variance of the sums is that of simulated errors."""
    rng = np.random.default_rng(3)
    direction, left, variance = rng.normal(size=(9, 3)), rng.normal(size=(9, 3, 2)), np.array([4.0, 0.25])
    found = fault_tests.with_rest_errors(lambda _: np.array([1.0, 2.0, 3.0]), left, variance)(direction)
    errors = np.sqrt(variance) * rng.standard_normal((200_000, 2))
    sums = np.einsum("ta,tai,ni->na", direction, left, errors)
    # the relative standard error of a variance from 200,000 draws is 0.3 per cent
    np.testing.assert_allclose(found, np.array([1.0, 2.0, 3.0]) + sums.var(axis=0), rtol=0.013)


@pytest.mark.parametrize(("size", "faulty"), [(3.9, False), (4.1, True)])
def test_readings_that_are_off_alike_by_the_rest_reading_do_not_scatter(size: float, faulty: bool) -> None:
    """The error of the rest reading has three sd of a reading; one of three elements is off by so many sd of it."""
    score = 10 * np.where(np.arange(20) % 2, -1.0, 1.0)[:, None] * np.ones(4)
    score[:, 0] = size * 3 * 10
    made = misfit(
        20,
        score=score,
        information=np.full((20, 4), 100.0),
        signal=np.zeros((20, 4)),
        signal_sd=np.zeros((20, 4)),
        shared=lambda _: np.full(4, np.inf),
        discrepancy=np.zeros(4),
        scale=np.full(4, 10.0),
        rest_variance=np.full(3, 0.3**2),
    )
    assert fault_tests.tested(made).faulty.tolist() == [faulty, False, False, False]


@pytest.mark.parametrize(("signals", "tells"), [(2, False), (3, True)])
def test_three_signals_tell_a_gain(signals: int, tells: bool) -> None:
    """Signals of a fifth of the peak and less are none, of either sign."""
    made = misfit(8)
    made.signal[:] = 0.2 * SCALE
    made.signal[:signals] = np.array([[-0.201], [0.201], [0.201]])[:signals] * SCALE
    found = fault_tests.tested(made)
    assert np.isfinite(found.gain).all() == np.isfinite(found.gain_sd).all() == tells
    assert np.isfinite(found.offset[:2]).all()


def shifted(shift: list[float], touches: int = 100, **changes: Any) -> SensorMisfit:
    """Offsets in shares of the peak beside the noise of one per cent."""
    made = misfit(touches, **changes)
    made.signal[:] = 0.0
    made.score[:] += np.array(shift) * SCALE * made.information
    return made


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("size", "faulty"), [(1.02, True), (0.98, False)])
def test_offset_beyond_chance_and_tolerance(sign: float, size: float, faulty: bool) -> None:
    """One per cent, twice the discrepancy of 0.3 %, and four sds 0.01/sqrt(100) times the usual scatter."""
    for discrepancy in (0.0, 0.003):
        usual = 1 / 0.6744897501960817
        # the element that is off scatters by as much about itself as others about zero: medians of |±1| and |±1 + s|
        limit = 0.01 + 2 * discrepancy + 4 * 0.001 * usual
        made = shifted([sign * size * limit, 0.0, 0.0], discrepancy=np.full(3, discrepancy))
        made.score[:, 1:] = np.where(made.score[:, 1:] > 0, 1.0, -1.0) * np.sqrt(made.information[:, 1:])
        spread = np.median(np.abs(made.score[:, 0] / np.sqrt(made.information[:, 0]))) * usual
        limit = 0.01 + 2 * discrepancy + 4 * 0.001 * (spread + usual) / 2
        made = shifted([sign * size * limit, 0.0, 0.0], discrepancy=np.full(3, discrepancy))
        about = np.abs(made.score[:, 0] / np.sqrt(made.information[:, 0]))
        middle = 0.5 * (np.median(about) + 1) * usual
        wanted = size * limit > 0.01 + 2 * discrepancy + 4 * 0.001 * max(1.0, middle)
        assert bool(fault_tests.tested(made).faulty[0]) == wanted
        assert not fault_tests.tested(made).faulty[1:].any()


@pytest.mark.parametrize(("width", "faulty"), [(2.49, False), (2.51, True)])
def test_scatter_beside_that_of_the_median_element(width: float, faulty: bool) -> None:
    """Of three elements and a force sensor, all but one scatter alike."""
    scale = np.full(4, 10.0)
    sign = np.where(np.arange(20) % 2, -1.0, 1.0)[:, None]
    information = np.full((20, 4), 100.0)
    made = misfit(
        20,
        score=sign * np.array([1.0, 1.0, width, 1.0]) * 10,
        information=information,
        signal=np.zeros((20, 4)),
        signal_sd=np.zeros((20, 4)),
        shared=lambda direction: np.zeros(4),
        discrepancy=np.zeros(4),
        scale=scale,
    )
    found = fault_tests.tested(made)
    assert found.faulty.tolist() == [False, False, faulty, False] and found.agree == (not faulty)
    np.testing.assert_allclose(found.scatter, [1, 1, width, 1])


def test_readings_that_the_others_do_not_tell() -> None:
    made = misfit(20)
    made.information[:, 1] = 0.0
    found = fault_tests.tested(made)
    assert np.isnan([found.gain[1], found.offset[1], found.scatter[1]]).all() and found.drop[1] == 0.0


@pytest.mark.parametrize(("n", "variance"), [(4, 0.0), (5, (1 / 0.6744897501960817) ** 2 - 0.09)])
def test_how_far_sound_elements_differ(n: int, variance: float) -> None:
    """Of five or more: values -1 and 1 about 0, sds of 0.3."""
    value = np.array([-1.0, 1.0, 0.0, 1.0, -1.0])[:n]
    found, chance = fault_tests._excess(value, np.full(n, 0.3))
    assert found == pytest.approx(np.sqrt(variance)) and chance == (n < 5)
    # One that is three times less precise than the median is not looked at.
    assert fault_tests._excess(np.append(value, 9.0), np.append(np.full(n, 0.3), 0.9))[0] == pytest.approx(found)


@pytest.mark.parametrize(("size", "chance"), [(0.99, True), (1.01, False)])
def test_differences_that_chance_could_make(size: float, chance: bool) -> None:
    """Four times 1.17/sqrt(n) more than one: 1 + 4.68/3 of nine."""
    limit = (1 + 4 * 1.17 / 3) * 0.6744897501960817
    value = size * limit * np.array([-1, 1, 1, -1, -1, 1, 1, -1, 0.0])
    assert fault_tests._excess(value, np.ones(9))[1] == chance
    assert fault_tests._excess(np.zeros(9), np.ones(9)) == (0.0, True)


def test_root_mean_squares() -> None:
    """Of elements alone: squares 1, 4 of the first, 9 of the second, whose other reading is not told."""
    made = misfit(2)
    made.information[:] = [[4.0, 9.0, 1.0], [4.0, 0.0, 1.0]]
    made.score[:] = [[2.0, 9.0, 100.0], [4.0, 5.0, 100.0]]
    overall, worst = _root_mean_squares(made)
    assert overall == pytest.approx(np.sqrt((1 + 4 + 9) / 3)) and worst == pytest.approx(3.0)


def column(read: np.ndarray, which: int = 0, **changes: Any) -> ColumnFault:
    """What is said of these readings, where the others tell signals from a tenth to the whole peak of 10."""
    made = misfit(len(read), **changes)
    made.signal[:] = np.linspace(0.1, 1.0, len(read))[:, None] * SCALE
    return named(which, read, made)


def test_kinds_of_faults() -> None:
    signal = 10 * np.linspace(0.1, 1.0, 40)
    noise = 0.05 * np.where(np.arange(40) % 2, -1.0, 1.0)
    stuck = column(np.full(40, 3.7))
    assert (stuck.kind, stuck.column) == ("stuck", 0)
    dead = column(0.1 * signal + noise)
    assert dead.kind == "dead" and dead.value == pytest.approx(0.1, abs=0.01)
    gain = column(1.3 * signal + noise)
    assert gain.kind == "gain" and gain.value == pytest.approx(1.3, abs=0.005) and 0 < gain.sd < 0.01
    offset = column(signal + 0.4 + noise)
    assert (
        offset.kind == "offset" and offset.value == pytest.approx(0.04) and offset.sd == pytest.approx(0.02 / 40**0.5)
    )
    assert column(10 - signal + noise).kind == "unlike"
    force = named(2, 4 * (signal + 0.4 + noise), _with_signal(40))
    assert force.kind != "offset"
    # A share of its signal that a dead element gets from others, and a load in another unit; then one unit and noise.
    assert column(0.01 * signal).kind == "dead"
    small, large = (named(2, 4 * factor * signal * (1 + 0.03 * noise), _with_signal(40)) for factor in (0.01, 100.0))
    assert small.kind == large.kind == "gain"
    assert (small.value, large.value) == (pytest.approx(0.01, rel=1e-3), pytest.approx(100.0, rel=1e-3))
    assert named(2, noise, _with_signal(40)).kind == "dead"
    assert column(np.append(1.3 * signal[:39], np.nan)).value == pytest.approx(1.3)


def _with_signal(n: int) -> SensorMisfit:
    made = misfit(n)
    made.signal[:] = np.linspace(0.1, 1.0, n)[:, None] * SCALE
    return made


def test_standard_deviation_of_a_gain() -> None:
    """Two touches of one sd, signals 4 and 8: gain (4 y1 + 8 y2)/80, and its sd from the residuals as they are."""
    made = misfit(2)
    made.signal[:, 0] = [4.0, 8.0]
    found = named(0, np.array([8.6, 17.8]), made)
    gain = (4 * 8.6 + 8 * 17.8) / 80
    sd = np.hypot(4 * (8.6 - 4 * gain), 8 * (17.8 - 8 * gain)) / 80
    assert (found.value, found.sd) == (pytest.approx(gain), pytest.approx(sd)) and found.kind == "gain"
    # A signal that is uncertain by 1: its variance is taken out of its square.
    made.signal_sd[:, 0] = 1.0
    found = named(0, np.array([8.6, 17.8]), made)
    assert found.value == pytest.approx((4 * 8.6 + 8 * 17.8) / (80 - 2))
    made.signal_sd[:, 0] = 0.0
    # A rest reading that is off by 0.3 moves the gain by 0.3 (4 + 8)/80.
    found = named(0, np.array([8.6, 17.8]), replace(made, rest_variance=np.array([0.09, 0.0])))
    assert found.sd == pytest.approx(np.hypot(sd, 0.3 * 12 / 80))
    made.signal_sd[:, 0] = 9.0
    assert named(0, np.array([8.6, 17.8]), made).kind == "unlike"


def check(*faults: ColumnFault, order: list[int] | None = None, excess: float = 1.0) -> SensorCheck:
    return SensorCheck(faults, np.array([0, 1, 2, 3] if order is None else order), excess, 200)


def test_faults_in_words() -> None:
    found = check(
        ColumnFault(0, "dead", 0.01, 0.02),
        ColumnFault(1, "stuck"),
        ColumnFault(2, "gain", 1.3, 0.02),
        ColumnFault(3, "offset", -0.041, 0.003),
        ColumnFault(4, "gain", 0.9, 0.01),
        excess=2.25,
    )
    notes = fault_notes(found, "N")
    begin = "sensor check (200 touches): "
    assert notes[0] == f"{begin}e01 does not follow the touches (dead) and is left out"
    assert notes[1] == f"{begin}e02 reads the same at every touch (stuck) and is left out"
    assert notes[2].startswith(f"{begin}e03 reads 1.3 ± 0.02 times what the calibration and the other elements say")
    assert notes[3].startswith(f"{begin}e04 reads -4.1 % of its peak beside what it should")
    assert notes[4].startswith(f"{begin}the force sensor reads 0.9 ± 0.01 times the load that the elements say")
    assert notes[5].startswith(f"{begin}the readings miss the calibrated model by 2.2 times") and len(notes) == 6
    assert found.left_out.tolist() == [True] * 4 and found.force_left_out and not found.sound
    wanted = {"touches_checked": 200.0, "elements_left_out": "e01 e02 e03 e04", "force_sensor": "left out"}
    assert fault_settings(found) == wanted | {"noise_widened": 2.25}
    (late,) = fault_notes(check(ColumnFault(1, "stuck", since=121)), "N")
    assert late == f"{begin}e02 reads the same from touch 121 on (stuck) and is left out"
    (dead,) = fault_notes(check(ColumnFault(1, "dead", since=121)), "N")
    assert dead == f"{begin}e02 does not follow the touches from touch 121 on (dead) and is left out"
    (loose,) = fault_notes(check(ColumnFault(1, "loose", 0.333)), "N")
    assert loose == f"{begin}e02 reads nothing of 33 % of the touches near it (loose contact) and is left out"
    other = fault_notes(check(ColumnFault(4, "stuck"), ColumnFault(2, "unlike")), "N")
    assert "force sensor does not follow the touches (stuck) and is left out: loads are inferred" in other[0]
    assert other[1] == f"{begin}e03 does not agree with the other elements and is left out"


def test_wires_in_words() -> None:
    swapped = check(order=[0, 3, 2, 1])
    assert fault_notes(swapped, "N")[0].endswith("e02 and e04 are swapped: their readings are exchanged back")
    assert fault_settings(swapped) == {"touches_checked": 200.0, "element_order": "e01 e04 e03 e02"}
    turned = check(order=[1, 2, 3, 0])
    assert fault_notes(turned, "N")[0].endswith("than in the calibration, read as e02, e03, e04, e01")
    assert fault_notes(check(), "N") == () and fault_settings(check()) == {"touches_checked": 200.0}
    unchecked = replace(check(), touches=0)
    assert fault_notes(unchecked, "N") == (
        "the sensor is not checked: that needs at least 8 touches with two readings more than unknowns (a measured "
        "load is a reading)",
    )
    assert check().sound and not swapped.sound and not check(excess=1.5).sound
    assert _exchanged(4, (1, 3)).tolist() == [0, 3, 2, 1]


@pytest.mark.parametrize(("size", "faulty"), [(0.24, False), (0.255, True)])
def test_differences_among_sound_elements_count(size: float, faulty: bool) -> None:
    """Offsets of ±2 % in turn: 4 % from their median, a robust sd of 5.9 %; beside that a fault stands out at 25 %."""
    shift, n = np.array([0.02, -0.02, 0.02, -0.02, 0.02, -0.02, size, 0.0]), 10_000
    sign = np.where(np.arange(n) % 2, -1.0, 1.0)[:, None]
    made = misfit(
        n,
        score=(sign + shift / 0.2) * 5,
        information=np.full((n, 8), 25.0),
        signal=np.zeros((n, 8)),
        signal_sd=np.zeros((n, 8)),
        shared=lambda direction: np.zeros(8),
        discrepancy=np.zeros(8),
        scale=np.ones(8),
    )
    found = fault_tests.tested(made)
    np.testing.assert_allclose(found.offset[:7], shift[:7])
    assert found.differ and not found.agree and found.faulty.tolist() == [False] * 6 + [faulty, False]


def test_scatter_that_is_less_than_noise_counts_as_noise() -> None:
    made = misfit(20)
    made.score[:] *= 0.1
    found = fault_tests.tested(made)
    assert found.usual == 1.0
    np.testing.assert_allclose(found.scatter, 0.1 / 0.6744897501960817)
    np.testing.assert_allclose(found.offset_sd[:2], 0.01 / np.sqrt(20))


def test_readings_that_hardly_anything_tells_count() -> None:
    """Information far below one: the unit of the readings is of no account."""
    made = misfit(20, information=np.full((20, 3), 1e-6), score=np.full((20, 3), 2e-3))
    np.testing.assert_allclose(fault_tests.tested(made).drop, 20 * 4.0)
    value, sd = fault_tests._coefficient(made, np.zeros((20, 3)), 1.0)
    assert not value.any() and np.isinf(sd).all()
    # About -0.3 the values are ±1: their robust sd is 1.48.
    found, _ = fault_tests._excess(np.array([-1.3, 0.7, -0.3, 0.7, -1.3]), np.full(5, 0.3))
    assert found == pytest.approx(np.sqrt((1 / 0.6744897501960817) ** 2 - 0.09))
