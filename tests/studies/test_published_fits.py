"""Fits of many touches at once, the simulated paper finger, and the modulus inferred from Table 3."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
import study_modules  # noqa: F401  # it makes nicolson_fearing known
from nicolson_fearing.many_fits import fit_many_touches
from nicolson_fearing.modulus import infer_modulus
from nicolson_fearing.paper_finger import (
    DESIGN,
    LOCATIONS_DEG,
    MISFIT_PERCENT,
    TIPS_MM,
    PaperFinger,
    model_error,
    simulated,
)
from nicolson_fearing.paper_physics import Physics, TrueFinger
from nicolson_fearing.published_fits import (
    R_B,
    BiasCurves,
    bias_curves,
    columns,
    infer_from_table_3,
    printed,
)
from nicolson_fearing.published_predictions import (
    distinguished_radius,
    flat_from_edge_noise,
    profile_difference,
)
from nicolson_fearing.simulated_fits import HERTZ, simulate_fits
from nicolson_fearing.table_3_effects import squeezed

from bayestouch.contact import composite_radius
from bayestouch.data.averages import average
from bayestouch.paper.simplex import fit_touches


@lru_cache(maxsize=1)
def finger() -> PaperFinger:
    return PaperFinger.of(simulated(0.1, 0))


@lru_cache(maxsize=1)
def curves() -> BiasCurves:
    return bias_curves(np.geomspace(0.03, 0.25, 5), fingers=1, errors=12)


@pytest.mark.parametrize("contact", ["hertz", "layer"])
def test_many_fits_find_the_simplex_minimum(contact: str) -> None:
    modulus = 0.06
    reader = finger().reader("model", contact, modulus)
    touches = simulated(modulus, 0, tips_mm=np.array([0.0, 1.59, 6.01, np.inf])).dataset.touches
    readings = touches.readings[::137]
    readings = np.vstack([average(touches).readings[::9], readings])  # quiet and noisy ones
    found = fit_many_touches(reader, readings)
    simplex = fit_touches(reader, readings)

    def cost(radius: np.ndarray, angle: np.ndarray, load: np.ndarray) -> np.ndarray:
        off = (readings - reader.predict(radius, np.radians(angle), load)) / reader.gain
        return (off**2).sum(axis=1)

    ours = cost(found.composite_radius_mm, found.angle_deg, found.load)
    theirs = cost(
        *(np.array([getattr(fit, n) for fit in simplex]) for n in ("composite_radius_mm", "angle_deg", "load"))
    )
    # Tables are linear between knots of κ: Gauss-Newton may stop beside a kink, 0.005 mm and 2e-5 of the cost away.
    assert np.all(ours < theirs * (1 + 5e-5))
    radius = np.array([fit.composite_radius_mm for fit in simplex])
    inside = (radius > 0) & (radius < 0.98 * R_B)
    assert inside.sum() > 20
    assert found.composite_radius_mm[inside] == pytest.approx(radius[inside], abs=0.01)
    assert np.all((found.composite_radius_mm >= 0) & (found.composite_radius_mm <= R_B))


def test_map_of_the_element_fits_predicts_what_was_simulated() -> None:
    """Noise of the calibration alone: both maps read silent touches of the layer back by the layer's contact."""
    modulus = 0.1
    touches = simulated(modulus, 0).dataset.touches.averaged()
    for calibration in ("model", "empirical"):
        found = fit_many_touches(finger().reader(calibration, "layer", modulus), touches.readings)
        off = found.composite_radius_mm - composite_radius(touches.indenter_radius_mm, R_B)
        by_tip = off.reshape(len(TIPS_MM), -1).mean(axis=1)
        # Averages of 20 scatter by 0.15 mm a touch; the calibration's noise is shared by all touches.
        assert np.abs(by_tip).max() < 0.2
        assert np.abs(found.load - 200).max() < 8


def test_model_error_has_the_spread_and_length_it_claims() -> None:
    rng = np.random.default_rng(3)
    off = np.array([model_error(DESIGN.element_angles_deg, LOCATIONS_DEG, rng) for _ in range(60)])
    # 60 fields of 16 elements, each 40° or five lengths long: 1 % in the variance of 4800 independent values
    assert np.mean(off**2) == pytest.approx(1.0, abs=0.06)
    one_length = np.mean(off[:, 8:] * off[:, :-8])
    assert one_length == pytest.approx(np.exp(-0.5), abs=0.06)
    other_elements = np.mean(off[:, :, 0] * off[:, :, 8])
    assert abs(other_elements) < 0.15


def test_model_error_is_what_the_paper_left_over() -> None:
    assert MISFIT_PERCENT["model"] == pytest.approx(np.sqrt(2.16**2 - 0.41))
    assert MISFIT_PERCENT["empirical"] == pytest.approx(np.sqrt(1.41**2 - 0.41))


@pytest.mark.slow
def test_softer_rubber_is_read_sharper_by_hertz() -> None:
    means = curves().tables.mean(axis=1)[:, 0]
    assert np.all(np.diff(means[:, :, 3:], axis=0) > 0)
    truth = composite_radius(TIPS_MM, R_B)
    assert np.all(means[0, :, 3:] < 0.75 * truth[3:])


@pytest.mark.slow
@pytest.mark.parametrize("modulus", [0.05, 0.12])
def test_modulus_of_a_simulated_table_is_found(modulus: float) -> None:
    """Tables drawn from the emulator: the truth is in the 90 % interval about that often."""

    def emulator(moduli: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return columns(curves().means(moduli), [0], [0, 1]), curves().covariance(moduli, [0], [0, 1])

    means, covariance = emulator(np.array([modulus]))
    rng = np.random.default_rng(1)
    inside = 0
    for _ in range(40):
        table = rng.multivariate_normal(means[0], covariance[0])
        posterior = infer_modulus(table, emulator, (0.03, 0.25), tau_scale=0.05)
        low, high = posterior.interval(0.9)
        inside += low <= modulus <= high
    # 36 expected; the prior of τ makes intervals a little wide. Below 31 has a chance of 1 %.
    assert inside >= 31


def test_one_fit_serves_all_elliptic_readers() -> None:
    """Radii from the widths of Hertz fits are those that a fit by the squeezed model itself finds."""
    modulus, physics = 0.06, Physics(noisy=False)
    fits = simulate_fits([modulus], physics, fingers=1, errors=1)
    true = TrueFinger.of(physics, DESIGN, modulus, 0)
    reader = PaperFinger.calibrated(true, 0).reader("model", squeezed(0.3), modulus)
    tips, where = (g.ravel() for g in np.meshgrid(TIPS_MM, LOCATIONS_DEG, indexing="ij"))
    direct = fit_many_touches(reader, true.readings(tips, where, np.full(len(tips), 200.0)))
    radii = fits.radii(squeezed(0.3))[0, 0, 0].ravel()
    # Spectra are linear between knots of κ, on which the squeezed ellipse has a kink: 0.02 mm
    assert direct.composite_radius_mm == pytest.approx(radii, abs=0.03)
    assert np.ptp(radii) > 5
    doubled = fits.read_with(2 * modulus).radii(HERTZ)
    assert doubled == pytest.approx(np.minimum(2 * fits.radii(HERTZ), R_B), rel=1e-6)


def test_further_datum_updates_the_posterior() -> None:
    """A normal datum of log μ, against weights worked out by hand."""
    posterior = infer_from_table_3(curves())
    log_likelihood = -0.5 * ((np.log(posterior.modulus_MPa) - np.log(0.05)) / 0.1) ** 2
    updated = posterior.updated(log_likelihood)
    expected = posterior.weight * np.exp(log_likelihood)
    assert updated.weight == pytest.approx(expected / expected.sum(), rel=1e-9)
    assert updated.log_evidence == pytest.approx(posterior.log_evidence + np.log(expected.sum()))


def test_table_3_wants_a_soft_rubber() -> None:
    posterior = infer_from_table_3(curves())
    low, high = posterior.interval()
    assert 0.035 < low < 0.054 < high < 0.08
    predicted = curves().means(posterior.mean_MPa)[0]
    assert np.sqrt(np.mean((predicted[0] - printed("hertz", "model")) ** 2)) < 0.4


def test_figure_4_of_the_posterior_mean() -> None:
    """Both numbers of Figure 4 at one modulus, if the mean square is over the whole circle."""
    assert flat_from_edge_noise(0.054, "circle") == pytest.approx(3.7, abs=0.2)
    assert distinguished_radius(0.054, "circle") == pytest.approx(0.16, abs=0.01)
    assert flat_from_edge_noise(0.054, "touched half") > 5
    # The mean over half the circle doubles the square, but for what is left of the difference behind.
    whole, half = (float(profile_difference(4.0, 5.0, mean_over=over)) for over in ("circle", "touched half"))
    assert half == pytest.approx(np.sqrt(2) * whole, rel=2e-3)


def test_implied_numbers_follow_the_posterior() -> None:
    posterior = infer_from_table_3(curves())
    moduli = curves().moduli_MPa
    mean, low, high = posterior.implied(moduli, np.log(moduli))
    assert low < mean < high
    assert [np.exp(low), np.exp(high)] == pytest.approx(posterior.interval(), rel=0.01)
