"""Fits are repeated with the peaks that they find until these stay."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.model import peaks
from bayestouch.model.noise import AddedNoise, NoiseModel


@dataclass(frozen=True)
class Model:
    """Finds these peaks, fit after fit."""

    peak: np.ndarray
    found: tuple[float, ...]

    def peak_at(self, vector: Any) -> np.ndarray:
        return np.array([self.found[min(int(vector), len(self.found)) - 1], 2.0])


def fitted(monkeypatch: pytest.MonkeyPatch, *found: float) -> list[Any]:
    """The models, starts and noises of the fits, from peaks of 1 and 2."""
    calls: list[Any] = []

    def fit(model: Any, start: Any, noise: Any, drifts: Any) -> Any:
        calls.append((model, start, noise))
        return Found(model, len(calls))

    monkeypatch.setattr(peaks, "fit", fit)
    added = AddedNoise(share=0.1, power=0.5, common=0.2, common_touch=0.3)
    noise = NoiseModel(np.ones(2), np.ones(1), np.array([1.0, 2.0]), added)
    last = peaks.fit_with_own_peaks(Model(np.array([1.0, 2.0]), found), 0, noise, ())  # type: ignore[arg-type]
    assert last.vector == len(calls)
    return calls


@dataclass(frozen=True)
class Found:
    model: Model
    vector: int


@pytest.mark.parametrize(("found", "fits"), [((1.00019,), 1), ((0.99979, 0.99979), 2), ((1.5, 1.2, 1.2), 3)])
def test_until_they_stay(monkeypatch: pytest.MonkeyPatch, found: tuple[float, ...], fits: int) -> None:
    """To 0.02 %."""
    assert len(fitted(monkeypatch, *found)) == fits


def test_no_more_than_six(monkeypatch: pytest.MonkeyPatch) -> None:
    assert len(fitted(monkeypatch, *range(2, 20))) == 6


def test_noise_stays_as_large_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """Mean peaks of 1.5 become 3: shares are halved, and those that go with the root of the peak by its root."""
    _, (model, start, noise) = fitted(monkeypatch, 4.0, 4.0)
    np.testing.assert_array_equal(model.peak, [4.0, 2.0])
    np.testing.assert_array_equal(noise.peak, [4.0, 2.0])
    assert start == 1
    assert noise.added == AddedNoise(share=pytest.approx(0.1 * 0.5**0.5), power=0.5, common=0.1, common_touch=0.15)


def test_noise_is_what_effects_leave_within_touches(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three samples of one touch: the mean square of whitened deviations over two degrees of freedom.

    The last element was read in the other touch, too: 8 + 2 over 2 + 1.
    """
    nan = np.nan
    deviation = np.array([[2.0, nan, 2.0], [-2.0, nan, -2.0], [0.0, nan, 0.0], [nan, nan, 1.0], [nan, nan, -1.0]])
    known = SimpleNamespace(row_touch=np.array([0, 0, 0, 1, 1]), n_touches=3, deviation=deviation)
    noise = SimpleNamespace(sd=np.array([0.5, 0.3, 0.5]))
    noise.with_ = lambda **changes: SimpleNamespace(**changes)
    linear = SimpleNamespace(deviation_jacobian=np.zeros((6, 1)), deviation=np.nan_to_num(deviation))
    fitted: Any = SimpleNamespace(
        noise=noise, linear=linear, model=SimpleNamespace(load_noise=None, known=known), vector=0, drifts=()
    )
    monkeypatch.setattr(peaks, "fit_with_own_peaks", lambda model, vector, noise, drifts: noise)
    # (4 + 4)/(3 - 1) = 4: twice the noise; the element that was not read keeps its own.
    np.testing.assert_allclose(peaks.settled(fitted).sd, [1.0, 0.3, 0.5 * np.sqrt(10 / 3)])
    linear.deviation_jacobian = None
    assert peaks.settled(fitted) is noise


@pytest.mark.parametrize(
    ("found", "used"),
    [
        # The noise of the loads falls with each fit to half of what it was, but not below 1.
        (lambda now: np.maximum(0.5 * now, 1.0), [4.0, 2.0, 1.0]),
        (lambda now: 0.96 * now, [0.96 * 8.0]),
        (lambda now: 1.5 * now, [12.0]),
        (lambda now: 0.5 * now, [4.0, 2.0, 1.0, 0.5, 0.25, 0.125]),
    ],
)
def test_fits_are_repeated_while_the_noise_of_the_loads_falls(
    monkeypatch: pytest.MonkeyPatch, found: Any, used: list[float]
) -> None:
    """By more than 5 %, and six times at the most."""
    model, linear = SimpleNamespace(load_noise="prior"), SimpleNamespace(deviation_jacobian=None)
    fits: list[float] = []

    def again(model: Any, vector: Any, noise: NoiseModel, drifts: Any) -> Any:
        fits.append(float(noise.load_sd[0]))
        return SimpleNamespace(model=model, vector=vector, noise=noise, drifts=drifts, linear=linear)

    monkeypatch.setattr(peaks, "fit_with_own_peaks", again)
    monkeypatch.setattr(peaks, "load_noise_again", lambda fitted, known: found(fitted.noise.load_sd))
    begun = again(model, 0, NoiseModel(np.ones(2), np.full(3, 8.0), np.ones(2)), ())
    fits.clear()
    last = peaks.settled(begun)
    assert fits == pytest.approx(used) and last.noise.load_sd[0] == fits[-1]
