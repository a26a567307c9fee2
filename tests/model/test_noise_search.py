"""Effects of the noise: scatter of a few samples, and maxima, by closed forms."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from bayestouch.effects.effect import EffectParameter
from bayestouch.effects.noise import NoiseEffect
from bayestouch.model.base import Predicted
from bayestouch.model.noise_search import TouchScatter, maximum, score_noise
from bayestouch.priors.parameters import LogNormal, Uniform


class Wider(NoiseEffect):
    """Readings scatter by `size` times as much: the most probable one is their root mean square."""

    name, stage, summary = "wider", "noise", ""
    parameters = (EffectParameter("size", "", "", Uniform(0.01, 50.0), (0.5, 3.0), 1.0),)

    def terms(self, scatter: Any, values: tuple[float, ...], own: np.ndarray) -> np.ndarray:
        return np.asarray(stats.norm.logpdf(scatter.z, 0, values[0]))


def fitted(deviation: list[list[float]], touch: list[int], samples: Any = None, freedom: Any = None) -> Any:
    """Touches with these deviations; noise 2, peaks 10 and 30, predictions 5 and 6."""
    row = np.array(touch)
    n_touches = int(row.max()) + 1
    freedom = np.ones(2) if freedom is None else np.array(freedom)
    means = SimpleNamespace(pure_error_dof=freedom)
    known = SimpleNamespace(row_touch=row, n_touches=n_touches, deviation=np.array(deviation), means=means)
    predicted = Predicted(np.array([[5.0, 6.0]] * n_touches), samples)
    model = SimpleNamespace(known=known, predict=lambda vector: predicted, peak=np.array([10.0, 30.0]))
    whitening = SimpleNamespace(samples=lambda rows: np.nan_to_num(rows) / 2)
    return SimpleNamespace(
        model=model, vector=None, whitening=whitening, noise=SimpleNamespace(sd=np.array([2.0, 2.0]))
    )


def test_scatter_of_touches() -> None:
    """Touches of two, one and three samples: k samples hold k - 1 independent deviations."""
    deviation = [[4.0, 1.0], [-4.0, -1.0], [0.0, 0.0], [2.0, np.nan], [-2.0, np.nan], [0.0, np.nan]]
    found = TouchScatter.of(fitted(deviation, [0, 0, 1, 2, 2, 2]))
    assert found is not None
    np.testing.assert_array_equal(found.touch, [0, 0, 2, 2, 2])
    np.testing.assert_allclose(found.weight, [1 / 2, 1 / 2, 2 / 3, 2 / 3, 2 / 3])
    # Squares of the whitened deviations: 2·4 + 2·1 = 10 over 1 + 2 of the first element, 2/4 over 1 of the second.
    size = np.sqrt([10 / 3, 0.5])
    np.testing.assert_allclose(found.sd, size * 2 / [10, 30])
    np.testing.assert_allclose(found.peak, [0.5, 1.5])
    np.testing.assert_allclose(found.signal, [[0.5, 0.2]] * 5)
    wanted = np.array([[2.0, 0.5], [-2.0, -0.5]]) / np.sqrt(0.5)
    np.testing.assert_allclose(found.z[:2], wanted / size)
    np.testing.assert_allclose(found.z[2:, 0], np.array([1, -1, 0]) / np.sqrt(2 / 3) / size[0])
    assert np.isnan(found.z[2:, 1]).all()
    assert TouchScatter.of(fitted([[1.0, 1.0], [2.0, 2.0]], [0, 1])) is None
    # An element whose samples are all equal is left out, and there is no scatter if all are.
    known = TouchScatter.of(fitted(deviation, [0, 0, 1, 2, 2, 2], freedom=[3.0, 0.0]))
    assert known is not None and np.isnan(known.z[:, 1]).all()
    np.testing.assert_allclose(known.z[:, 0], found.z[:, 0])
    equal = fitted([[1e-17, 0.0], [0.0, 0.0]], [0, 0], freedom=[0.0, 0.0])
    assert TouchScatter.of(equal) is None and score_noise(equal, (Wider(),)) == ()
    moved = fitted(deviation, [0, 0, 1, 2, 2, 2], samples=np.array(deviation) - [[2.0, 2.0]])
    again = TouchScatter.of(moved)
    assert again is not None
    np.testing.assert_allclose(again.sd[1], np.sqrt(2 * 1.0 / 1) * 2 / 30)


def test_only_readings_count_as_samples() -> None:
    """Four rows: one is empty, and the second element lacks one more; another touch has one reading of each."""
    nan = np.nan
    deviation = [[4.0, 1.0], [-6.0, -1.0], [2.0, nan], [nan, nan], [0.0, nan], [nan, 0.0]]
    found = TouchScatter.of(fitted(deviation, [0, 0, 0, 0, 1, 1]))
    assert found is not None and found.share is not None
    np.testing.assert_array_equal(found.touch, [0, 0, 0])
    np.testing.assert_allclose(found.share, [[2 / 3, 1 / 2], [2 / 3, 1 / 2], [2 / 3, 0]])
    np.testing.assert_allclose(found.weight, [7 / 12, 7 / 12, 2 / 3])
    # Squares of the whitened deviations 14 over 2 free ones, and 1/2 over 1.
    size = np.sqrt([7.0, 0.5])
    np.testing.assert_allclose(found.sd, size * 2 / [10, 30])
    np.testing.assert_allclose(found.z[:3, 0], np.array([2, -3, 1]) / np.sqrt(2 / 3) / size[0])
    assert np.isnan(found.z[2, 1])
    density = found.log_density(Wider(), (1.0,), found.part(np.array([True, True, False])))
    np.testing.assert_allclose(density, (stats.norm.logpdf(found.z) * found.share).sum(axis=1)[:2])


def test_empty_rows_change_nothing() -> None:
    nan, deviation = np.nan, [[4.0, 1.0], [-6.0, -2.0], [2.0, 1.0]]
    whole = TouchScatter.of(fitted(deviation, [0, 0, 0]))
    found = TouchScatter.of(fitted([*deviation, [nan, nan], [nan, nan]], [0] * 5))
    assert whole is not None and found is not None and found.share is None
    for name in ("z", "weight", "signal"):
        np.testing.assert_array_equal(getattr(found, name)[:3], getattr(whole, name))
    np.testing.assert_array_equal(found.sd, whole.sd)


def test_an_element_that_never_scatters_keeps_its_size() -> None:
    found = TouchScatter.of(fitted([[4.0, 0.0], [-4.0, 0.0]], [0, 0]))
    assert found is not None
    np.testing.assert_allclose(found.sd, [np.sqrt(8) * 2 / 10, 2 / 30])


def test_halves_are_blocks_of_eight_touches() -> None:
    touch = np.repeat(np.arange(20), 2)
    found = TouchScatter.of(fitted(np.tile([[1.0, 1.0], [-1.0, -1.0]], (20, 1)).tolist(), touch.tolist()))
    assert found is not None
    np.testing.assert_array_equal(found.half, np.repeat([0] * 8 + [1] * 8 + [0] * 4, 2))


def test_what_an_effect_of_the_noise_gains() -> None:
    """Each half of the touches is judged by the size of the other half; scaled, all have variance one."""
    one, two = 1.0, 3.0
    pairs = np.concatenate([np.full(8, one), np.full(8, two)])
    deviation = np.repeat(pairs, 2)[:, None] * np.tile([[1.0], [-1.0]], (16, 1)) * np.ones(2)
    scores = score_noise(fitted(deviation.tolist(), np.repeat(np.arange(16), 2).tolist()), (Wider(),))
    (found,) = scores
    scale = np.sqrt((one**2 + two**2) / 2)

    def gain(z: float, size: float) -> float:
        # two samples of two elements, each sample of weight a half
        return float(2 * (stats.norm.logpdf(z, 0, size) - stats.norm.logpdf(z)))

    # Deviations are compared at the limits of the search for a maximum, 0.02 in log likelihood.
    np.testing.assert_allclose(found.difference[:8], gain(one / scale, two / scale), rtol=2e-3)
    np.testing.assert_allclose(found.difference[8:], gain(two / scale, one / scale), rtol=2e-3)
    assert found.values == (pytest.approx(1.0, rel=1e-3),) and found.z == pytest.approx(0.0, abs=0.05)


def test_score_is_that_of_the_likelihood_ratio() -> None:
    class Other(Wider):
        parameters = (EffectParameter("size", "", "", Uniform(0.01, 50.0), (0.5, 3.0), 2.0),)

    deviation = np.tile([[1.0, 1.0], [-1.0, -1.0]], (16, 1)).tolist()
    (found,) = score_noise(fitted(deviation, np.repeat(np.arange(16), 2).tolist()), (Other(),))
    ratio = 2 * 32 * (stats.norm.logpdf(1.0) - stats.norm.logpdf(1.0, 0, 2.0))
    assert found.z == pytest.approx(np.sqrt(ratio), rel=1e-4)
    # Schwarz: one value, 16 touches.
    assert found.gain == pytest.approx(0.5 * ratio - 0.5 * np.log(16), rel=1e-4)


def test_the_largest_gain_comes_first() -> None:
    class Null(Wider):
        name = "null"

        def terms(self, scatter: Any, values: tuple[float, ...], own: np.ndarray) -> np.ndarray:
            return np.zeros((len(scatter.z), 1))

    deviation = [[1.0, 1.0], [-1.0, -1.0], [1.0, 1.0], [-1.0, -1.0]] * 8
    touch = np.repeat(np.arange(16), 2).tolist()

    class Far(Wider):
        parameters = (EffectParameter("size", "", "", Uniform(0.01, 50.0), (0.5, 3.0), 2.0),)

    assert [each.effect.name for each in score_noise(fitted(deviation, touch), (Null(), Far()))] == ["wider", "null"]
    assert score_noise(fitted([[1.0, 1.0]], [0]), (Far(),)) == ()


@pytest.mark.parametrize(("at", "end"), [((0.7, 2.0), 0.7), ((0.3, 40.0), 0.3), ((1.4, 0.5), 1.0), ((-0.2, 3.0), 0.0)])
def test_maximum_of_a_likelihood(at: tuple[float, float], end: float) -> None:
    """Of a bell in (share, log size); at an end of the range where its middle is beyond."""

    class Two(NoiseEffect):
        name, stage, summary = "two", "noise", ""
        parameters = (
            EffectParameter("share", "", "", Uniform(0.0, 1.0), (0.0, 1.0), 0.0),
            EffectParameter("size", "", "", LogNormal(1.0, 1.0), (0.5, 2.0)),
        )

    def likelihood(values: tuple[float, ...]) -> float:
        return -50 * (values[0] - at[0]) ** 2 - 50 * (np.log(values[1]) - np.log(at[1])) ** 2

    values, best = maximum(Two(), likelihood)
    assert values == (pytest.approx(end, abs=0.03), pytest.approx(at[1], rel=0.03))
    assert best == pytest.approx(-50 * (end - at[0]) ** 2, abs=0.05)
