"""Regression without physics: touches of a pad whose posterior can be written out."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest
from study_modules import study

pytest.importorskip("sklearn", reason="needs the extra `baselines`")

NOISE, TOUCHES, HELD = 0.05, 300, 200


@pytest.fixture(scope="module")
def module() -> ModuleType:
    return study("_baselines")


def made(module: ModuleType, seed: int, count: int, loaded: bool) -> object:
    """Two elements that read P (1 + x/10) and P (2 - x/10), x from 0 to 10 mm, P from 1 to 3 N or 1 that is unknown."""
    rng = np.random.default_rng(seed)
    x, load = rng.uniform(0.0, 10.0, count), rng.uniform(1.0, 3.0, count) if loaded else np.ones(count)
    readings = load[:, None] * np.stack([1 + x / 10, 2 - x / 10], axis=1)
    readings += NOISE * rng.standard_normal(readings.shape)
    return module.Known(x[:, None], load if loaded else None, readings)


@pytest.mark.parametrize("way", ["gaussian_process", "polynomial"])
@pytest.mark.parametrize("loaded", [True, False])
def test_touches_are_read_as_the_true_law_would(module: ModuleType, way: str, loaded: bool) -> None:
    known, held = made(module, 0, TOUCHES, loaded), made(module, 1, HELD, loaded)
    regression = getattr(module, way)(known)
    # The law has few terms, so that what 300 touches leave open is small beside the noise.
    assert regression.left_out_percent == pytest.approx(100 * NOISE, rel=0.12)
    read = module.read(regression, known, held, force_sd=1e-6)
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


def test_a_reading_that_is_missing_says_nothing(module: ModuleType) -> None:
    known, held = made(module, 0, TOUCHES, False), made(module, 1, 40, False)
    held.readings[:, 1] = np.nan
    read = module.read(module.polynomial(known), known, held)
    inside = (held.location[:, 0] > 2) & (held.location[:, 0] < 8)
    np.testing.assert_allclose(read.location_sd[inside, 0], 10 * NOISE, rtol=0.15)
