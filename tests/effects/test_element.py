"""Leaks between channels that reach further than the next one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from bayestouch.chain.recording import Recording
from bayestouch.effects import effect_classes
from bayestouch.effects.element import ChannelLag, Crosstalk, Proximity
from bayestouch.effects.listing import FINGER, PAD


def recording(signal: np.ndarray, place: tuple[np.ndarray, ...]) -> Recording:
    n, m = signal.shape
    zeros = np.zeros(n)
    return Recording(
        indenter_radius_mm=zeros,
        place=(zeros,),
        load=np.full(n, 200.0),
        time_s=zeros,
        held_s=zeros,
        element_place=place,
        peak=np.ones(m),
        reference_load=200.0,
        signal=signal,
    )


def test_crosstalk_reaches_on_and_leans() -> None:
    """Elements in another order than their angles: neighbours are those beside each other."""
    effect = Crosstalk.suited(FINGER)
    assert effect is not None
    angle = np.array([10.0, -10.0, 0.0, 20.0])
    alone = recording(np.array([[0.0, 0.0, 1.0, 0.0]]), (angle,))
    heard = effect.signal(alone, (0.1, 0.5, 0.2))[0]
    # Element at 0 degree speaks: that at 10 hears it from a smaller angle, that at -10 from a larger one.
    np.testing.assert_allclose(heard, [0.1 * 1.2, 0.1 * 0.8, 1.0, 0.1 * 0.5 * 1.2])


def test_crosstalk_of_a_pad_is_that_of_neighbours() -> None:
    effect = Crosstalk.suited(PAD)
    assert effect is not None and [each.name for each in effect.parameters] == ["share"]
    signal = np.random.default_rng(0).standard_normal((3, PAD.n_elements))
    heard = effect.signal(recording(signal, PAD.element_place), (0.1,)) - signal
    here, there = np.array(effect.neighbours).T
    expected = np.zeros_like(signal)
    for i, j in zip(here, there, strict=True):
        expected[:, i] += 0.1 * signal[:, j]
    np.testing.assert_allclose(heard, expected, atol=1e-15)


def test_a_lag_that_carries_as_much_as_it_leaves_is_one_capacitor() -> None:
    """What settles from channel to channel, scan after scan, until nothing is left of the beginning."""
    share, signal = 0.4, np.random.default_rng(1).uniform(0, 1, 6)
    found = ChannelLag().signal(recording(signal[None], (np.arange(6.0),)), (share, share))[0]
    settled = lfilter([1 - share], [1, -share], np.tile(signal, 40))[-6:]
    np.testing.assert_allclose(found, settled, rtol=1e-12)


def test_a_lag_that_rings_swings_back_over_the_next_channels() -> None:
    """Of each step from channel to channel the share v (-0.6)^n is left after n channels, scan after scan."""
    left, signal = 0.2, np.random.default_rng(2).uniform(0, 1, 6)
    found = ChannelLag().signal(recording(signal[None], (np.arange(6.0),)), (-left, -0.6))[0]
    scans = np.tile(signal, 40)
    ringing = scans + left * np.convolve(np.diff(scans, prepend=0.0), (-0.6) ** np.arange(200))[: len(scans)]
    np.testing.assert_allclose(found, ringing[-6:], rtol=1e-12)


def test_a_common_return_takes_the_sum_from_each() -> None:
    """With a reach of 1 all others are heard alike; in the looser form each element by its own share."""
    effect = Crosstalk.suited(FINGER)
    assert effect is not None
    signal = np.random.default_rng(3).uniform(0, 1, (5, 4))
    one = recording(signal, (np.array([10.0, -10.0, 0.0, 20.0]),))
    others = signal.sum(axis=1, keepdims=True) - signal
    np.testing.assert_allclose(effect.signal(one, (-0.1, 1.0, 0.0)), signal - 0.1 * others)
    looser = effect.looser(4)
    assert looser is not None and [each.name for each in looser.parameters[3:]] == [
        "own_01",
        "own_02",
        "own_03",
        "own_04",
    ]
    own = np.array([0.5, -0.5, 0.0, -1.0])
    np.testing.assert_allclose(looser.signal(one, (-0.1, 1.0, 0.0, *own)), signal - 0.1 * (1 + own) * others)
    # A pad has only the share.
    on_pad = Crosstalk.suited(PAD)
    assert on_pad is not None and on_pad.looser(PAD.n_elements) is None


def test_channels_that_settle_unequally() -> None:
    signal = np.random.default_rng(4).uniform(0, 1, (5, 6))
    one, own = recording(signal, (np.arange(6.0),)), np.array([1.0, -1.0, 0.0, 0.5, -0.5, 0.2])
    looser = ChannelLag().looser(6)
    assert looser is not None
    plain = ChannelLag().signal(one, (0.2, 0.3)) - signal
    np.testing.assert_allclose(looser.signal(one, (0.2, 0.3, *own)), signal + (1 + own) * plain)


def test_blunt_tips_are_felt_from_further_off_than_edges() -> None:
    """An edge, a tip as round as the finger, and a flat: R/r_b is 0, a half and 1."""
    effect = Proximity.suited(FINGER)
    assert effect is not None
    looser = effect.looser(3)
    assert looser is not None
    outer, signal, angle = FINGER.radii_mm[1], np.ones((3, 3)), np.array([-10.0, 0.0, 10.0])
    tips = replace(recording(signal, (angle,)), indenter_radius_mm=np.array([0.0, outer, np.inf]))
    own = np.array([0.0, 0.5, -0.5])
    found = looser.signal(tips, (0.02, 20.0, 0.0, 0.0, *own, 0.06)) - signal
    height = np.array([0.02, 0.05, 0.08])[:, None] * (1 + own)
    plain = effect.signal(tips, (1.0, 20.0, 0.0, 0.0)) - signal
    np.testing.assert_allclose(found, height * plain, rtol=1e-12)


@pytest.mark.parametrize("name", ["crosstalk", "channel_lag", "proximity", "gain_nonlinearity", "saturation", "creep"])
def test_elements_are_equal_at_zero(name: str) -> None:
    """The looser form with zeros is the plain one."""
    effect = effect_classes()[name].suited(FINGER)
    assert effect is not None
    looser = effect.looser(FINGER.n_elements)
    assert looser is not None and looser.parameters[: len(effect.parameters)] == effect.parameters
    signal = np.random.default_rng(5).uniform(0, 1, (5, FINGER.n_elements))
    one, values = recording(signal, FINGER.element_place), effect.probes[0]
    more = len(looser.parameters) - len(values)
    np.testing.assert_allclose(looser.signal(one, (*values, *(0.0,) * more)), effect.signal(one, values), rtol=1e-14)
    own = [each for each in looser.parameters[len(values) :] if each.null is None]
    assert own and all(each.probes == (0.0,) for each in own)
    # Either form is found again by the names of its parameters.
    assert effect.in_form_with([each.name for each in looser.parameters], FINGER.n_elements) == looser
    assert looser.looser(FINGER.n_elements) == looser
    assert effect.in_form_with([each.name for each in effect.parameters], FINGER.n_elements) == effect


def test_a_lag_that_carries_nothing_holds_the_channel_before() -> None:
    signal = np.random.default_rng(2).uniform(0, 1, (2, 6))
    found = ChannelLag().signal(recording(signal, (np.arange(6.0),)), (0.1, 0.0))
    np.testing.assert_allclose(found, 0.9 * signal + 0.1 * np.roll(signal, 1, axis=1))
