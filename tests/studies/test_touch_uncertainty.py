"""Standard deviations of touches to first order, against mixtures of posteriors under calibrations drawn one by one."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest
from study_modules import study


@pytest.fixture(scope="module")
def nested() -> ModuleType:
    return study("touch_uncertainty")


# Draws are matched to their mean and covariance, so that what is linear has no Monte Carlo error; what is not is a few
# per cent, of which an average over eight touches keeps half. Weights and single posteriors add 2 %.
TOLERANCE = 0.06


@pytest.mark.slow
@pytest.mark.parametrize(("name", "exact"), [("crosstalk", "R"), ("gain_nonlinearity", "R"), ("load_offset", "P")])
def test_fingers_with_an_effect(nested: ModuleType, name: str, exact: str) -> None:
    """As wide as brute force, and about the same place; a calibration that counts as exact is a tenth narrower, or
    a tenth as wide: an offset of 10 ± 4 N/m is learned together with the responses.
    """
    found = nested.finger_with(name, 80)
    np.testing.assert_allclose(found.ratio, 1.0, atol=TOLERANCE)
    assert found.shift.max() < 0.15
    assert found.ratio_exact[found.names.index(exact)] < (0.2 if name == "load_offset" else 0.9)


@pytest.mark.slow
def test_a_finger_with_a_correction(nested: ModuleType) -> None:
    """Weights and parameters are drawn jointly, 116 of them, and not matched: 7 % for each touch, 2.5 % for eight."""
    found = nested.corrected_finger(120)
    np.testing.assert_allclose(found.ratio, 1.0, atol=TOLERANCE + 0.02)
    assert found.shift.max() < 0.2
    assert found.ratio_exact[0] < 0.97


@pytest.mark.slow
@pytest.mark.parametrize(("name", "before"), [("creep", None), ("gain_nonlinearity", 0.8), ("load_nonlinearity", 0.85)])
def test_pads_with_an_effect(nested: ModuleType, name: str, before: float | None) -> None:
    """Under each value the calibration is made anew from corrected readings; values that count as exact give less."""
    found = nested.pad_with(name, 24)
    np.testing.assert_allclose(found.ratio, 1.0, atol=TOLERANCE)
    # Its Monte Carlo error: with four times as many calibrations the largest one is half as large, 0.08.
    assert found.shift.max() < 0.2
    if before is not None:
        assert found.ratio_exact[found.names.index("P")] < before


def test_its_options(nested: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        nested.main(["--help"])
    assert ended.value.code == 0 and "--calibrations" in capsys.readouterr().out
    monkeypatch.setattr(nested, "nested_table", "{} calibrations".format)
    monkeypatch.setattr(nested, "coverage_table", "{} fingers".format)
    nested.main(["--fingers", "3"])
    assert capsys.readouterr().out == "120 calibrations\n3 fingers\n"


def test_draws_that_are_matched(nested: ModuleType) -> None:
    from _nested import matched

    z = matched(np.random.default_rng(1), 30, 4)
    np.testing.assert_allclose(z.mean(axis=0), 0.0, atol=1e-12)
    np.testing.assert_allclose(z.T @ z / 30, np.eye(4), atol=1e-12)
