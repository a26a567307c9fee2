"""Models with effects of the noise in them: what is left of each element's own noise, written out."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from bayestouch.effects.noise import CommonModeNoise, Outliers, SignalDependentNoise
from bayestouch.model import noise_fit
from bayestouch.model.noise import AddedNoise, NoiseModel
from bayestouch.model.noise_posterior import FoundNoise

NO_CHANGE = SimpleNamespace(samples=None, touches=None)
WITHOUT_TABLE = SimpleNamespace(known=SimpleNamespace(table=None), predict=lambda vector: NO_CHANGE)
SD, PEAK = np.array([1.0, 0.5]), np.array([100.0, 40.0])


def fitted(model: Any) -> Any:
    return SimpleNamespace(noise=NoiseModel(SD, np.ones(2), PEAK), model=model, vector=0.0, drifts=(), drifted=0.0)


@pytest.fixture(autouse=True)
def no_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    """The fit gives back the noise that it was given; samples are not looked at."""
    monkeypatch.setattr(noise_fit, "from_prediction", lambda table, samples: table)
    monkeypatch.setattr(noise_fit, "fit", lambda model, vector, noise, drifts: again(model, noise))


OWN = np.array([0.8, 0.3])


def again(model: Any, noise: NoiseModel, within: bool = False) -> Any:
    linear = SimpleNamespace(deviation_jacobian=np.zeros((1, 1)) if within else None)
    return SimpleNamespace(model=model, noise=noise, linear=linear)


def found(effect: Any, values: tuple[float, float]) -> FoundNoise:
    return FoundNoise(effect, values, (0.0, 0.0), OWN)


def test_noise_that_grows_with_the_signal() -> None:
    effect = SignalDependentNoise()
    noise = noise_fit.with_noise(fitted(WITHOUT_TABLE), found(effect, (0.01, 0.5))).noise
    assert noise.added == AddedNoise(share=0.01, power=0.5)
    assert noise.effects == ((effect, (0.01, 0.5)),)
    np.testing.assert_array_equal(noise.sd, OWN)


def test_readings_that_are_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    """They are left out; own noise is what the others scatter by, or as before where nothing tells it."""
    cleaned = SimpleNamespace(means=SimpleNamespace(pure_error_variance=np.array([0.09, np.nan])))
    known = SimpleNamespace(table="table", without=lambda wrong: cleaned if wrong == "wrong" else None)
    model = SimpleNamespace(
        known=known, with_readings=lambda observed: ("model of", observed), predict=lambda vector: NO_CHANGE
    )
    seen: list[Any] = []
    monkeypatch.setattr(noise_fit, "from_prediction", lambda table, samples: f"from {table}")
    monkeypatch.setattr(Outliers, "wrong", lambda self, *given: seen.append(given) or "wrong")
    moved = noise_fit.with_noise(fitted(model), found(Outliers(), (0.01, 0.06)))
    assert moved.model == ("model of", cleaned)
    np.testing.assert_allclose(moved.noise.sd, [0.3, 0.5])
    deviation, own, peak, values = seen[0]
    assert deviation == "from table" and values == (0.01, 0.06) and peak is PEAK and own is OWN


def test_a_large_deviation_is_not_wrong_where_the_noise_is_large(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each sample has the sd of its touch: own noise, and what grows with the signal. Own noise is that of the fit.

    An error of a whole touch is in all of its samples, and in their median.
    """
    signal = np.array([[0.0, 20.0], [100.0, 40.0]])
    cleaned = SimpleNamespace(means=SimpleNamespace(pure_error_variance=np.array([9.0, 9.0])))
    known = SimpleNamespace(table=None, without=lambda wrong: cleaned, row_touch=np.array([0, 1, 1]))
    predicted = SimpleNamespace(samples=None, touches=signal)
    model = SimpleNamespace(known=known, with_readings=lambda observed: "cleaned", predict=lambda vector: predicted)
    given = fitted(model)
    given.noise = given.noise.with_(added=AddedNoise(share=0.006, common_touch=0.5))
    seen: list[Any] = []
    monkeypatch.setattr(Outliers, "wrong", lambda self, *given: seen.append(given) or "wrong")
    noise = noise_fit.with_noise(given, found(Outliers(), (0.01, 0.06))).noise
    # Sds of the touches: 0.8 and √(0.3² + 0.12²), then √(0.8² + 0.6²) = 1 and √(0.3² + 0.24²).
    first, second = [0.8, np.hypot(0.3, 0.12)], [1.0, np.hypot(0.3, 0.24)]
    np.testing.assert_allclose(seen[0][1], [first, second, second])
    np.testing.assert_array_equal(noise.sd, OWN)


def test_scatter_that_effects_explain_is_no_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    """With an effect within touches, the noise is estimated again from what it leaves."""
    cleaned = SimpleNamespace(means=SimpleNamespace(pure_error_variance=np.array([0.09, 0.09])))
    known = SimpleNamespace(table=None, without=lambda wrong: cleaned)
    model = SimpleNamespace(known=known, with_readings=lambda observed: "cleaned", predict=lambda vector: NO_CHANGE)
    monkeypatch.setattr(Outliers, "wrong", lambda self, *given: "wrong")
    monkeypatch.setattr(noise_fit, "fit", lambda model, vector, noise, drifts: again(model, noise, within=True))
    monkeypatch.setattr(noise_fit, "settled", lambda fitted: ("settled", fitted))
    word, of = noise_fit.with_noise(fitted(model), found(Outliers(), (0.01, 0.06)))  # type: ignore[misc]
    assert word == "settled" and of.model == "cleaned"


def test_an_error_that_all_elements_share(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(noise_fit, "_touch_size", lambda fitted, noise, predicted: 0.007)
    noise = noise_fit.with_noise(fitted(WITHOUT_TABLE), found(CommonModeNoise(), (0.02, 0.3))).noise
    assert noise.added == AddedNoise(common=0.02, common_shared=0.3, common_touch=0.007)
    np.testing.assert_array_equal(noise.sd, OWN)


def test_sizes_that_are_tried() -> None:
    sizes = noise_fit.TOUCH_SIZES
    assert len(sizes) == 41 and sizes[0] == 0 and sizes[1] == pytest.approx(2e-4) and sizes[-1] == pytest.approx(0.2)
    np.testing.assert_allclose(np.diff(np.log(sizes[1:])), np.log(1000) / 39)


@pytest.mark.parametrize("shift", [0.0, 0.5, 3.0])
def test_size_of_what_a_whole_touch_shares(shift: float) -> None:
    """The most probable of those tried, by scipy's density: own noise over the root of the reads, and one error."""
    rng = np.random.default_rng(3)
    reads = np.array([4, 1, 9])
    residual = shift * rng.standard_normal((3, 1)) * PEAK / 10 + SD / np.sqrt(reads)[:, None] * rng.standard_normal(
        (3, 2)
    )
    drifted, predicted = np.array([[1.0, 2.0]] * 3), np.array([[50.0, 10.0]] * 3)
    means = SimpleNamespace(readings=residual + drifted + predicted, counts=np.tile(reads[:, None], 2))
    empty = SimpleNamespace(
        row_touch=np.zeros(0, dtype=int), weight=np.zeros(0), deviation=np.zeros((0, 2)), means=means
    )
    model = SimpleNamespace(known=empty, by_load=lambda vector: np.zeros((3, 2)))
    given: Any = SimpleNamespace(model=model, vector=None, drifted=drifted)
    noise = NoiseModel(SD, np.ones(3), PEAK, AddedNoise(common=0.002))

    def likelihood(size: float) -> float:
        total = 0.0
        for row, k in zip(residual, reads, strict=True):
            covariance = np.diag(SD**2 / k) + (0.002**2 / k + size**2) * np.outer(PEAK, PEAK)
            total += float(stats.multivariate_normal(np.zeros(2), covariance).logpdf(row))
        return total

    assert noise_fit._touch_size(given, noise, predicted) == max(noise_fit.TOUCH_SIZES, key=likelihood)
