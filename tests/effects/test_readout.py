"""Effects of the readout: each element on its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayestouch.chain.missing import MissingTouches
from bayestouch.chain.recording import History, Recording
from bayestouch.effects.effect import Effect
from bayestouch.effects.listing import FINGER, PAD
from bayestouch.effects.readout import Creep, GainNonlinearity, Memory, RestOffset, Saturation


def recording(signal: list[float], before: list[float]) -> Recording:
    """One row of two elements, 2 s into its touch, after a touch that ended 3 s before it began."""
    one = np.zeros(1)
    return Recording(
        indenter_radius_mm=one,
        place=(one,),
        load=one,
        signal=np.array([signal]),
        held_s=np.array([2.0]),
        element_place=(np.zeros(2),),
        reference_load=1.0,
        time_s=np.array([10.0]),
        peak=np.array([3.0, 4.0]),
        history=History(np.array([5.0]), np.array([before])),
    )


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        (GainNonlinearity(), (0.2, 1.5)),
        (Saturation(), (0.8, 8.0, 0.5)),
        (Creep(()), (0.3, 1.5)),
        (RestOffset(()), (0.1, -0.2)),
        (Memory((), 3.0), (0.1, 4.0, 0.5)),
    ],
)
def test_signal_of_one_element_does_not_reach_the_others(effect: Effect, values: tuple[float, ...]) -> None:
    """So says `mixes`, on which derivatives by the signal rely that are taken for all elements at once."""
    first = effect.signal(recording([2.0, 3.0], [1.0, 2.0]), values)[0]
    second = effect.signal(recording([2.0, 1.0], [1.0, 0.5]), values)[0]
    assert first[0] == second[0] != 2.0
    assert first[1] != second[1]
    assert not effect.mixes


def test_what_missing_touches_leave() -> None:
    """Of one missing touch, which ended a pause ago: the share of it, and the gain that it changes."""
    memory, peak = Memory((), 3.0), np.array([4.0, 5.0])
    missing = MissingTouches(np.array([7.0]), np.zeros(0), np.array([[3.0, 2.0], [1.0, 0.0]]))
    found = memory.left_by_missing(
        (0.1, 4.0, 0.0, 0.0, 0.0, 0.0, 0.3), np.array([[2.0, np.nan]]), np.array([10.0]), missing, peak
    )
    # Squared correlations with the two touches of the calibration; one more touch may be like either.
    like = np.array([9 / 16 / (9 / 16 + 4 / 25), 1.0]) + 1 / 2
    square = like[0] * np.outer([1.0, 0.0], [1.0, 0.0]) + like[1] * np.outer([3.0, 2.0], [3.0, 2.0])
    share = np.array([0.1 + 0.3 * 2.0 / 4.0, 0.1])
    np.testing.assert_allclose(found, [np.outer(share, share) * square / like.sum()])
    assert not Creep(()).left_by_missing((0.3, 1.5), np.ones((1, 2)), np.array([10.0]), missing, peak).any()


def test_an_offset_is_looked_for_on_fingers_without_rest_readings_alone() -> None:
    assert not FINGER.any_rest and PAD.any_rest
    found = RestOffset.suited(FINGER)
    assert found is not None and len(found.amplitudes) == FINGER.n_elements
    for setting in (replace(FINGER, any_rest=True), replace(PAD, any_rest=False)):
        assert RestOffset.suited(setting) is None


def test_limits_that_are_unequal_and_fall() -> None:
    """A sharp limit: the smaller of the reading and of 0.5 peak e^own (1 - fall t/T), here at t = 10 s of 40 s."""
    looser = Saturation(span_s=40.0).looser(2)
    assert looser is not None and [each.name for each in looser.parameters[3:]] == ["own_01", "own_02", "fall"]
    found = looser.signal(recording([2.0, 3.0], [1.0, 2.0]), (0.5, 400.0, 0.0, np.log(0.8), np.log(2.0), 0.4))[0]
    np.testing.assert_allclose(found, [0.5 * 3.0 * 0.8 * 0.9, 3.0], rtol=1e-3)
    # Far beyond the limit, and after the recording, where all has fallen.
    after = replace(recording([200.0, -300.0], [100.0, 200.0]), time_s=np.full(1, np.inf))
    found = looser.signal(after, (0.5, 8.0, 0.0, np.log(0.8), np.log(2.0), 0.4))[0]
    np.testing.assert_allclose(found, [0.5 * 3.0 * 0.8 * 0.6, -0.5 * 4.0 * 2 * 0.6], rtol=1e-9)
    # Without times nothing can fall.
    timeless = Saturation().looser(2)
    assert timeless is not None and [each.name for each in timeless.parameters[3:]] == ["own_01", "own_02"]
    found = timeless.signal(recording([2.0, 3.0], [1.0, 2.0]), (0.5, 400.0, 0.0, np.log(0.8), 0.0))[0]
    np.testing.assert_allclose(found, [0.5 * 3.0 * 0.8, 0.5 * 4.0], rtol=1e-3)


def test_gains_that_bend_unequally() -> None:
    looser = GainNonlinearity().looser(2)
    assert looser is not None
    found = looser.signal(recording([2.0, 3.0], [1.0, 2.0]), (0.2, 2.0, 0.5, -1.0, *np.zeros(8)))[0]
    np.testing.assert_allclose(found, [2.0 * (1 + 0.2 * 1.5 * (2 / 3) ** 2), 3.0])
    # With half the power the curve of a pad has an inflection.
    looser = GainNonlinearity(on_finger=False).looser(2)
    assert looser is not None and looser.parameters[-1].name == "second"
    found = looser.signal(recording([2.0, 3.0], [1.0, 2.0]), (0.2, 2.0, 0.5, -1.0, -0.1))[0]
    np.testing.assert_allclose(found, [2.0 * (1 + 0.3 * (2 / 3) ** 2 - 0.1 * 2 / 3), 3.0 * (1 - 0.1 * 3 / 4)])


def test_a_gain_curve_of_any_smooth_form() -> None:
    """Over the prior of its weights it has an sd of 0.1 and a Matérn correlation over 0.3 peak, for either sign."""
    looser = GainNonlinearity().looser(2)
    assert looser is not None
    # the first element at each seventh of its peak, where the knots are
    share = np.arange(8) / 7
    rows = replace(recording([0.0, 0.0], [1.0, 2.0]), signal=np.stack([3.0 * share, -4.0 * share], axis=1))
    changes = []
    for k, each in enumerate(looser.parameters[4:]):
        values = (0.0, 2.0, 0.0, 0.0, *(each.prior.quantile(0.8413447) * (np.arange(8) == k)))
        changes.append((looser.signal(rows, values) - rows.signal)[1:] / rows.signal[1:])
    assert [each.name for each in looser.parameters[4:]] == [f"curve_{k}" for k in range(1, 9)]
    first, second = np.array(changes).transpose(2, 0, 1)
    np.testing.assert_allclose(first, second, atol=1e-12)
    distance = np.sqrt(3) * np.abs(share[1:, None] - share[1:]) / 0.3
    np.testing.assert_allclose(first.T @ first, 0.01 * (1 + distance) * np.exp(-distance), rtol=1e-4)


def test_touches_before_change_the_gain() -> None:
    """By 0.2 times what is left of them over the peak, and not by what they leave in the reading."""
    memory = Memory.suited(FINGER)
    assert isinstance(memory, Memory)
    looser = memory.looser(2)
    assert looser is not None and looser.parameters[-1].name == "gain"
    on_pad = Memory.suited(PAD)
    assert on_pad is not None and "gain" not in on_pad.looser(2).names  # type: ignore[union-attr]
    left = (memory.signal(recording([2.0, 3.0], [1.0, 2.0]), (0.1, 4.0, 0.5))[0] - [2.0, 3.0]) / 0.1
    found = looser.signal(recording([2.0, 3.0], [1.0, 2.0]), (0.0, 4.0, 0.5, 0.0, 0.0, 0.0, 0.2))[0]
    np.testing.assert_allclose(found, [2.0 * (1 + 0.2 * left[0] / 3), 3.0 * (1 + 0.2 * left[1] / 4)])


def test_creep_and_memory_that_grow_with_the_strain() -> None:
    """By the power 1 of the reading over the peak, which is 2/3 and 3/4, and by each element's own share."""
    own, power = np.array([0.5, -0.5]), 1.0
    creep = Creep.suited(FINGER)
    assert creep is not None
    looser = creep.looser(2)
    assert looser is not None and [each.name for each in looser.parameters[2:]] == ["own_01", "own_02", "strain_power"]
    found = looser.signal(recording([2.0, 3.0], [1.0, 2.0]), (0.3, 1.5, *own, power))[0]
    gained = 0.3 * (1 - np.exp(-2 / 1.5))
    np.testing.assert_allclose(found, [2.0 * (1 + gained * 1.5 * 2 / 3), 3.0 * (1 + gained * 0.5 * 3 / 4)])
    memory = Memory.suited(FINGER)
    assert isinstance(memory, Memory)
    looser = memory.looser(2)
    assert looser is not None
    # The earlier readings over the peak are 1/3 and 1/2.
    plain = memory.signal(recording([2.0, 3.0], [1.0, 2.0]), (0.1, 4.0, 0.5))[0] - [2.0, 3.0]
    found = looser.signal(recording([2.0, 3.0], [1.0, 2.0]), (0.1, 4.0, 0.5, *own, power, 0.0))[0]
    np.testing.assert_allclose(found, [2.0 + plain[0] * 1.5 / 3, 3.0 + plain[1] * 0.5 / 2])
