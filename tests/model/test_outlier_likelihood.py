"""The likelihood of outliers with the mean of a touch integrated out, against normal integrals in closed form."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest

from bayestouch.model.noise_search import TouchScatter
from bayestouch.model.outlier_likelihood import OutlierLikelihood


def scatter(z: list[float]) -> Any:
    """One touch of one element, whose noise is 0.5 of the peak."""
    n = len(z)
    made = object.__new__(TouchScatter)
    values = {"z": np.array(z)[:, None], "sd": np.array([0.5]), "weight": np.ones(n), "touch": np.zeros(n, dtype=int)}
    for name, value in values.items():
        object.__setattr__(made, name, value)
    return made


def integral(z: np.ndarray, variances: np.ndarray) -> float:
    """Of the product of exp(-(z - mean)²/2v)/sqrt(v) over the mean: sqrt(2π/Σ1/v) exp(-Σ(z - weighted mean)²/2v)."""
    weight = 1 / variances
    about = z - weight @ z / weight.sum()
    return float(np.sqrt(weight.prod()) * np.sqrt(2 * np.pi / weight.sum()) * np.exp(-0.5 * weight @ about**2))


@pytest.mark.parametrize("probability", [0.0, 0.1])
def test_mean_of_a_touch_is_integrated_out(probability: float) -> None:
    """Each of five samples is usual, or wrong with the variance 0.8 + (1/0.5)² = 4.8: all 32 ways, summed."""
    z = [-1.2, 0.3, 0.1, 0.9, -0.4]
    wanted = 0.0
    for wrong in product((False, True), repeat=5):
        share = np.where(wrong, probability, 1 - probability).prod()
        wanted += float(share) * integral(np.array(z), np.where(wrong, 4.8, 0.8))
    found = OutlierLikelihood.of(scatter(z))((probability, 1.0), np.array([0.8]))
    assert found == pytest.approx(np.array([np.log(wanted)]), abs=1e-4)


@pytest.mark.parametrize("others", [0.3, 6.0])
def test_noise_of_other_effects_is_noise_of_right_and_of_wrong_readings(others: float) -> None:
    """Variance of five samples: 0.8 and that of other effects; of a wrong one (1/0.5)² = 4 more."""
    z = [-1.2, 0.3, 0.1, 0.9, -0.4]
    wanted = 0.0
    for wrong in product((False, True), repeat=5):
        share = np.where(wrong, 0.1, 0.9).prod()
        wanted += float(share) * integral(np.array(z), np.where(wrong, 4.8, 0.8) + others)
    found = OutlierLikelihood.of(scatter(z), np.array([[others]]))((0.1, 1.0), np.array([0.8]))
    assert found == pytest.approx(np.array([np.log(wanted)]), abs=1e-4)


def test_true_mean_of_a_touch_is_that_of_all_ways_to_be_wrong() -> None:
    """One of five readings is off by so little that it may be usual: moments of the mixture of all 32 ways."""
    z, probability = np.array([-3.0, 0.2, 0.4, -0.5, 0.9]), 0.2
    mass, means, variances = [], [], []
    for wrong in product((False, True), repeat=5):
        v = np.where(wrong, 0.8 + 36.0, 0.8)
        mass.append(float(np.where(wrong, probability, 1 - probability).prod()) * integral(z, v))
        means.append(float((z / v).sum() / (1 / v).sum()))
        variances.append(float(1 / (1 / v).sum()))
    share = np.array(mass) / np.sum(mass)
    mean = float(share @ means)
    variance = float(share @ (np.array(variances) + np.square(means))) - mean**2
    found = OutlierLikelihood.of(scatter(z.tolist())).true_means(
        (probability, 3.0), np.array([0.8]), np.zeros(1), np.full(1, np.inf)
    )
    assert found.mean == pytest.approx(np.array([mean]), abs=1e-4)
    assert found.variance == pytest.approx(np.array([variance]), rel=1e-3)


@pytest.mark.parametrize("expected", [-3.5, -1.0, 0.2, 6.0])
@pytest.mark.parametrize("spread", [0.002, 0.2, 5.0])
def test_product_with_an_expected_mean_is_that_of_all_ways_to_be_wrong(expected: float, spread: float) -> None:
    """Integral, mean and variance of the product of both densities, from the sum over all 16 ways."""
    z, probability = np.array([-3.2, -0.6, 0.3, 0.9]), 0.3
    z = z - z.mean()
    log_mass, means, variances = [], [], []
    for wrong in product((False, True), repeat=4):
        v = np.where(wrong, 0.8 + 36.0, 0.8)
        every, at = np.append(v, spread), np.append(z, expected)
        share = float(np.where(wrong, probability, 1 - probability).prod())
        log_mass.append(np.log(share * integral(at, every) / np.sqrt(2 * np.pi)))
        means.append(float((at / every).sum() / (1 / every).sum()))
        variances.append(float(1 / (1 / every).sum()))
    mass = np.exp(log_mass)
    share = mass / mass.sum()
    mean = float(share @ means)
    variance = float(share @ (np.array(variances) + np.square(means))) - mean**2
    made = OutlierLikelihood.of(scatter(z.tolist()))
    found = made.true_means((probability, 3.0), np.array([0.8]), np.array([expected]), np.array([spread]))
    # The normal density that replaces that of the samples, times that of the expectation.
    weight = 1 / found.variance + 1 / spread
    total = found.variance + spread
    log_product = found.log_samples + found.gained
    log_product -= 0.5 * (np.log(2 * np.pi * total) + (found.mean - expected) ** 2 / total)
    assert log_product == pytest.approx(np.array([np.log(mass.sum())]), abs=1e-3)
    assert (found.mean / found.variance + expected / spread) / weight == pytest.approx(np.array([mean]), abs=1e-3)
    if variance < spread:
        # The trapezoidal rule at the ends of the nodes.
        assert 1 / weight == pytest.approx(np.array([variance]), rel=3e-3)
