"""Statistics that the calibration of a pad states, worked out by hand."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import bayestouch
from bayestouch.pad.result import _lack_of_fit, _model_notes


def lack_of_fit(pure: list[float], load_share: float = 0.0, load_spread: float = np.nan) -> float:
    """Of three touches of two elements; the last reading of the first element is missing."""
    left_out = SimpleNamespace(
        residual=np.array([[2.0, 9.0], [5.0, 9.0], [np.nan, 9.0]]),
        variance=np.array([[3.0, 1.0], [1.0, 1.0]] * 2)[:3],
        signal=np.array([[1.0, 3.0], [2.0, 4.0], [np.nan, 5.0]]),
    )
    counts = np.array([[4, 1], [1, 1], [0, 1]])
    known = SimpleNamespace(pure_error_variance=np.array(pure), counts=counts)
    problem: Any = SimpleNamespace(known=known, load_share=np.full(3, load_share))
    model: Any = SimpleNamespace(left_out=left_out, load_spread=load_spread)
    return _lack_of_fit(problem, model)


def test_lack_of_fit_is_of_elements_with_repeats() -> None:
    """The first element alone: 2²/(4/4 + 3) = 1 and 5²/(4 + 1) = 5."""
    assert lack_of_fit([4.0, 0.0]) == pytest.approx(3.0)
    assert lack_of_fit([4.0, np.nan]) == pytest.approx(3.0)


@pytest.mark.parametrize("of_load", [{"load_share": 0.5}, {"load_share": np.nan, "load_spread": 0.5}])
def test_elements_share_the_error_of_a_load(of_load: dict[str, float]) -> None:
    """Of a measured load and of one that was not: squared distances of the touches, with covariances written out."""
    first = np.diag([4 / 4 + 3, 2.0 + 1]) + 0.25 * np.outer([1.0, 3.0], [1.0, 3.0])
    second = np.diag([4.0 + 1, 2.0 + 1]) + 0.25 * np.outer([2.0, 4.0], [2.0, 4.0])
    squares = [row @ np.linalg.inv(each) @ row for row, each in (([2.0, 9.0], first), ([5.0, 9.0], second))]
    third = 81 / (2.0 + 1 + 0.25 * 25)
    assert lack_of_fit([4.0, 2.0], **of_load) == pytest.approx((sum(squares) + third) / 5)


@pytest.mark.parametrize("force_sd", [None, 0.2])
def test_lack_of_fit_is_one_of_a_right_model(force_sd: float | None) -> None:
    """Loads of 1 to 3 N: not measured, or read with a noise of 0.2 N: ten times that of the readings at the peak."""
    dataset = bayestouch.simulate(bayestouch.PadDesign(n_touches=1), seed=1).dataset
    assert dataset.calibration is not None
    table = dataset.calibration
    noise = np.random.default_rng(2).normal(0.0, force_sd or np.nan, table.n_rows)
    table = table.with_(load=table.load + np.where(table.in_contact, noise, 0.0))
    dataset = replace(dataset, sensor=replace(dataset.sensor, force_noise_sd=force_sd))
    calibration = bayestouch.calibrate(replace(dataset, calibration=table), kernel="layer", e_map="model", draws=8)
    # Monte Carlo error of a mean of 1296 squares of standard normals, at 4 standard errors: 0.16. It holds a bias of
    # -0.07 (12 seeds): predictions, a quarter of the variance, count as independent, but share the loads of others.
    assert calibration.rows.observed.shape == (162, 8)
    assert calibration.statistics["lack_of_fit"] == pytest.approx(1.0, abs=4 * np.sqrt(2 / 1296))


def test_lack_of_fit_is_not_known_without_repeats() -> None:
    assert np.isnan(lack_of_fit([0.0, np.nan]))


def test_a_note_names_samples_that_are_all_equal() -> None:
    """Copies of one sample are no repeats: the noise of one reading is not known, and no error is compared with it."""
    dataset = bayestouch.simulate(bayestouch.PadDesign(n_touches=1, samples_per_touch=1), seed=1).dataset
    assert dataset.calibration is not None
    rows = np.repeat(np.arange(dataset.calibration.n_rows), 2)
    for copies, said in ((rows, "the samples of each touch are all equal: "), (rows[::2], "no touch was read twice: ")):
        table = replace(dataset, calibration=dataset.calibration.select(copies))
        calibration = bayestouch.calibrate(table, kernel="gaussian", e_map="model", draws=8)
        assert any(
            note.startswith(f"{said}noise and model error cannot be distinguished") for note in calibration.notes
        )
        assert np.isnan(calibration.statistics["lack_of_fit"]) and not calibration.noise.tactile_sd.any()


def test_scores_of_the_other_models_have_no_minus_zero() -> None:
    scores = {"layer": 7.0, "layer with map": 6.6, "gaussian": 6.4, "map alone": 9.0}
    rivals: Any = {name: SimpleNamespace(score=score) for name, score in scores.items()}
    kernel = SimpleNamespace(parameters=())
    chain = SimpleNamespace(values=())
    fit = SimpleNamespace(chain=chain)
    model: Any = SimpleNamespace(score=7.0, place_error=0.0, kernel=kernel, fit=fit, has_map=False)
    problem: Any = SimpleNamespace(known=SimpleNamespace(pure_error_variance=np.ones(1)))
    (note,) = _model_notes(problem, model, "layer", rivals)
    assert note.endswith("against it: layer with map +0, gaussian -1, map alone +2)")


@pytest.mark.parametrize(
    ("value", "high", "said"),
    [
        (0.0003008, np.inf, "ends at the bound of its prior, 0 mm"),
        (0.9999, 1.0, "ends at the bound of its prior, 1 mm"),
        (0.0001, 1.0, "ends at the bound of its prior, 0 mm"),
        (0.5, 1.0, None),
    ],
)
def test_the_bound_of_a_prior_is_stated_and_not_the_value_beside_it(
    value: float, high: float, said: str | None
) -> None:
    prior = SimpleNamespace(support=(0.0, high))
    width = SimpleNamespace(prior=prior, description="half-width of the contact", unit="mm")
    kernel = SimpleNamespace(parameters=(width,))
    chain = SimpleNamespace(values=(value,))
    fit = SimpleNamespace(chain=chain)
    model: Any = SimpleNamespace(score=7.0, place_error=0.0, kernel=kernel, fit=fit, has_map=True)
    priors = SimpleNamespace(moved="")
    problem: Any = SimpleNamespace(known=SimpleNamespace(pure_error_variance=np.ones(1)), priors=priors)
    expected = [] if said is None else [f"half-width of the contact {said}"]
    assert _model_notes(problem, model, "layer", {"layer": model}) == expected
