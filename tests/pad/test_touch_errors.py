"""Errors of held-out touches on a pad, worked out by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

from bayestouch.chain.noise import Noise
from bayestouch.pad import touch_errors
from bayestouch.pad.touch_errors import inside, read_held_out

STATED = np.array([2.0, np.nan, 4.0])


def reading(monkeypatch: pytest.MonkeyPatch, stated: np.ndarray, force_sd: float = 0.2, effects: Any = None) -> Any:
    """Of three touches at 0 mm, read at 3, 0 and 4 mm, with loads of 2.5, 3 and 4 N.

    The posterior of a load is two draws at 0.1 N from its mean, in two chains; four reads of the force sensor a touch.
    """
    means = {"x": np.array([3.0, 0.0, 4.0]), "P": np.array([2.5, 3.0, 4.0])}
    read = SimpleNamespace(
        mean=means.__getitem__,
        posterior={"P": means["P"] + np.array([-0.1, 0.1])[:, None, None]},
        sample_stats={"reference_level": np.array([0.5, 0.95, 0.2])},
    )
    monkeypatch.setattr(touch_errors, "_to_be_read", lambda *given: None)
    monkeypatch.setattr(touch_errors, "rows_of_held_out", lambda *given: np.arange(3))
    monkeypatch.setattr(touch_errors.PadEffects, "of", lambda calibration: effects)
    noise = Noise(np.ones(1), np.zeros(1), force_sd=force_sd)
    calibration: Any = SimpleNamespace(settings={"load_measured": 1.0}, noise=noise)
    calibration.with_rest_reading = lambda rest: calibration
    observed = SimpleNamespace(means=SimpleNamespace(reads_of_load=np.full(3, 4.0)))
    held: Any = SimpleNamespace(stated={"x": np.zeros(3), "P": stated}, observed=observed)
    return read_held_out(lambda *given, **options: read, calibration, None, held, seed=0)  # type: ignore[arg-type]


def test_a_touch_without_a_load_leaves_the_others_theirs(monkeypatch: pytest.MonkeyPatch) -> None:
    found = reading(monkeypatch, STATED)
    np.testing.assert_allclose(found.by_touch["P_rms_N"], [0.5, np.nan, 0.0])
    np.testing.assert_allclose(found.by_touch["P_coverage_90"], [0.0, np.nan, 1.0])
    assert found.errors["P_rms_N"] == pytest.approx(0.5 / np.sqrt(2))
    assert found.errors["P_coverage_90"] == 0.5
    assert found.errors["location_rms_mm"] == pytest.approx(5 / np.sqrt(3))
    assert found.errors["coverage_90"] == pytest.approx(2 / 3)


def test_without_a_load_there_is_no_error_of_the_load(monkeypatch: pytest.MonkeyPatch) -> None:
    found = reading(monkeypatch, np.full(3, np.nan))
    assert np.isnan([found.errors["P_rms_N"], found.errors["P_coverage_90"]]).all()


def test_the_interval_of_a_load_counts_the_noise_of_the_force_sensor(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first load is read 0.4 and 0.6 N below the two draws, with 0.7 N in one of four reads: 1.14 and 1.71 sd.

    So 8.5 % of what they predict is below it; with 0.5 N, at 1.6 and 2.4 sd, 3.2 %. With effects that halve
    loads as they act, the noise of the acting load is half of it.
    """
    for force_sd, expected in ((0.7, 1.0), (0.5, 0.0)):
        found = reading(monkeypatch, STATED, force_sd=force_sd)
        np.testing.assert_allclose(found.by_touch["P_coverage_90"], [expected, np.nan, 1.0])
    effects = SimpleNamespace(pressed=lambda read: read - 0.3, load_slope=0.5)
    for force_sd, expected in ((0.35, 1.0), (0.1, 0.0)):
        found = reading(monkeypatch, STATED, force_sd=force_sd, effects=effects)
        np.testing.assert_allclose(found.by_touch["P_coverage_90"], [expected, np.nan, 1.0])
        np.testing.assert_allclose(found.by_touch_corrected["P_coverage_90"], [0.0, np.nan, expected])


@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_what_normal_draws_predict(noise: float) -> None:
    """Central 90 %: 1.645 sd, where the sd is that of the draws and the noise together."""
    quantiles = norm.ppf((np.arange(4001) + 0.5) / 4001)
    draws = np.repeat(2.0 + 0.4 * quantiles[:, None], 4, axis=1)
    measured = 2.0 + np.array([-1.655, -1.635, 1.635, 1.655]) * np.hypot(0.4, noise)
    assert inside(measured, draws, np.full(4, noise)).tolist() == [0.0, 1.0, 1.0, 0.0]
