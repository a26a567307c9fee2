"""Leaks between channels that reach further than the next one."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from bayestouch.chain.recording import Recording
from bayestouch.effects.element import ChannelLag, Crosstalk
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


def test_a_lag_that_carries_nothing_holds_the_channel_before() -> None:
    signal = np.random.default_rng(2).uniform(0, 1, (2, 6))
    found = ChannelLag().signal(recording(signal, (np.arange(6.0),)), (0.1, 0.0))
    np.testing.assert_allclose(found, 0.9 * signal + 0.1 * np.roll(signal, 1, axis=1))
