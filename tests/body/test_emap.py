"""E maps: layout, identification from touches, condition numbers, and the frequency response."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from study_modules import study

from bayestouch.body.emap import (
    condition_number,
    empirical_e_matrix,
    fourier_basis,
    model_e_matrix,
    singular_values,
    traction_coefficients,
)
from bayestouch.body.finger import radial_strain_response
from bayestouch.body.frequency import cut_off, frequency_response_db, sensing_radius_for_cut_off
from bayestouch.errors import InputError

BODY = {"core_radius_mm": 9.4, "outer_radius_mm": 12.7}
FINGER = BODY | {"sensing_radius_mm": 10.3, "poisson_ratio": 0.46}
ELEMENTS = -66 + 8.8 * np.arange(16)


def _edge_touches(n_touches: int, n_coefficients: int) -> np.ndarray:
    angles = 360 / n_touches * np.arange(n_touches)
    return traction_coefficients(np.ones(n_coefficients + 1), angles, np.full(n_touches, 0.2), outer_radius_mm=12.7)


def test_layout_of_equation_1() -> None:
    angle = 25.0
    matrix = model_e_matrix([angle], 3, **FINGER, shear_modulus_MPa=0.3)
    response = radial_strain_response(np.arange(4), 10.3, poisson_ratio=0.46, **BODY) / 0.3
    k = np.array([1, 1, 2, 2, 3, 3])
    phase = k * np.radians(angle)
    expected = response[k] * np.where(np.arange(6) % 2 == 0, np.sin(phase), np.cos(phase))
    np.testing.assert_allclose(matrix, np.append(response[0], expected)[np.newaxis], rtol=1e-12)


@given(st.floats(-180, 180), st.floats(-180, 180), st.floats(0.01, 1.0), st.integers(0, 30), st.integers(0, 99))
@settings(max_examples=50, deadline=None)
def test_product_is_the_series_about_the_contact(
    element: float, contact: float, load: float, order: int, seed: int
) -> None:
    """``E p`` depends on element and contact through their difference only, as in the shared pressure series."""
    q = np.append(1.0, np.random.default_rng(seed).uniform(0, 1, order))
    coefficients = traction_coefficients(q, [contact], [load], outer_radius_mm=12.7)
    strain = (model_e_matrix([element], order, **FINGER) @ coefficients)[0, 0]
    response = radial_strain_response(np.arange(order + 1), 10.3, poisson_ratio=0.46, **BODY)
    waves = np.where(np.arange(order + 1) == 0, 1, 2) * np.cos(np.arange(order + 1) * np.radians(element - contact))
    # Cancelling terms: rounding relative to the sum of their sizes.
    size = load / (2 * np.pi * 12.7)
    assert strain == pytest.approx(-size * np.sum(response * q * waves), rel=1e-9, abs=1e-13)


def test_elements_may_differ() -> None:
    radii, sigmas = np.linspace(9.8, 10.7, 16), np.linspace(0.41, 0.48, 16)
    matrix = model_e_matrix(ELEMENTS, 12, sensing_radius_mm=radii, poisson_ratio=sigmas, **BODY)
    assert matrix.shape == (16, 25)
    alone = model_e_matrix(ELEMENTS[4:5], 12, sensing_radius_mm=float(radii[4]), poisson_ratio=float(sigmas[4]), **BODY)
    np.testing.assert_allclose(matrix[4:5], alone, rtol=1e-13)


def test_singular_values_of_a_full_ring_are_the_responses() -> None:
    """Closed form: elements all around see each pair of coefficients with gain ``E_k √(n_s/2)``, the mean with √n_s."""
    ring, order = 360 / 41 * np.arange(41), 12
    response = radial_strain_response(np.arange(order + 1), 10.3, poisson_ratio=0.46, **BODY)
    gains = np.append(response[0] * np.sqrt(41), np.repeat(response[1:] * np.sqrt(41 / 2), 2))
    matrix = model_e_matrix(ring, order, **FINGER)
    np.testing.assert_allclose(singular_values(matrix), np.sort(gains)[::-1], rtol=1e-10)
    assert condition_number(matrix) == pytest.approx(gains.max() / gains.min(), rel=1e-10)


def test_identification_recovers_the_model() -> None:
    order = 20
    truth = model_e_matrix(ELEMENTS, order, **FINGER)
    touches = _edge_touches(2 * order + 1, order)  # the fewest that suffice
    np.testing.assert_allclose(empirical_e_matrix(touches, truth @ touches), truth, atol=1e-12)


def test_identification_is_the_normal_equation_of_the_paper() -> None:
    """Equation (6) as printed, on noisy readings that no E fits exactly."""
    rng, order = np.random.default_rng(5), 6
    touches = _edge_touches(60, order) * rng.uniform(0.5, 1.5, 60)
    readings = rng.normal(size=(4, 60))
    gain = np.diag([1.0, 2.0, 0.5, 3.0])
    printed = (np.linalg.inv(touches @ touches.T) @ touches @ readings.T @ gain.T).T
    np.testing.assert_allclose(empirical_e_matrix(touches, gain @ readings), printed, rtol=1e-9)


def test_missing_readings_are_left_out_for_their_element_only() -> None:
    rng, order = np.random.default_rng(6), 4
    touches = _edge_touches(30, order)
    readings = rng.normal(size=(3, 30))
    holes = readings.copy()
    holes[1, [2, 17]] = np.nan
    matrix = empirical_e_matrix(touches, holes)
    whole = empirical_e_matrix(touches, readings)
    np.testing.assert_allclose(matrix[[0, 2]], whole[[0, 2]], rtol=1e-12)
    kept = np.isfinite(holes[1])
    np.testing.assert_allclose(matrix[1:2], empirical_e_matrix(touches[:, kept], readings[1:2, kept]), rtol=1e-9)


def test_too_few_touches_say_how_many_are_needed() -> None:
    with pytest.raises(InputError, match="at least 41 touches"):
        empirical_e_matrix(_edge_touches(40, 20), np.zeros((16, 40)))
    half_way_around = traction_coefficients(np.ones(21), np.arange(180.0), np.full(180, 0.2), outer_radius_mm=12.7)
    with pytest.raises(InputError, match="all the way around"):
        empirical_e_matrix(half_way_around, np.zeros((16, 180)))
    with pytest.raises(InputError, match="same touches"):
        empirical_e_matrix(_edge_touches(40, 2), np.zeros((16, 39)))
    with pytest.raises(InputError, match="finite"):
        empirical_e_matrix(np.full((3, 9), np.nan), np.zeros((16, 9)))


def test_what_lies_above_the_highest_coefficient_is_folded_down() -> None:
    """With 2 n_c + 1 touches mode ``k`` beyond n_c lands on ``2 n_c + 1 - k``; many touches keep it out."""
    order, true_order = 20, 60
    truth = model_e_matrix(ELEMENTS, true_order, **FINGER)
    few, many = _edge_touches(41, true_order), _edge_touches(360, true_order)
    clean = empirical_e_matrix(many[: 2 * order + 1], truth @ many)
    folded = empirical_e_matrix(few[: 2 * order + 1], truth @ few)
    np.testing.assert_allclose(clean, truth[:, : 2 * order + 1], atol=1e-12)
    response = radial_strain_response(np.arange(42), 10.3, poisson_ratio=0.46, **BODY)
    # Mode 21 on the touches is mode 20 with the sine reversed.
    basis = fourier_basis(ELEMENTS, 21)
    expected = response[20] * basis[:, -3] + response[21] * basis[:, -1]
    np.testing.assert_allclose(folded[:, -1], expected, atol=1e-10)


def test_condition_numbers_of_the_paper() -> None:
    """Which settings give about 2.7 (model) and 3.3 (empirical): the study's main lines."""
    conditions = study("nicolson_fearing/condition_numbers")
    model, empirical = conditions.model_condition, conditions.empirical_condition
    # All around and n_c = 15, with Table 1's spread of elements: 2.6.
    assert 2.5 < np.median([model("41 all around", 15, seed) for seed in range(20)]) < 2.75
    # The 16 elements of the arc need n_c of 20 or more to be well conditioned at all.
    assert model("16 on an arc", 15) > 100
    assert 3.5 < model("16 on an arc", 25) < 4.0
    assert model("16 on an arc", 40) == pytest.approx(model("16 on an arc", 25), rel=2e-3)
    # One touch per element spacing, n_c = 20, folding included: 3.3.
    assert 3.0 < np.median([empirical("16 on an arc", 20, 41, seed) for seed in range(20)]) < 3.6
    assert empirical("16 on an arc", 25, 360) == pytest.approx(model("16 on an arc", 25), rel=1e-6)


@pytest.mark.parametrize(("alpha", "cycles", "above_core"), [(0.70, 4.5, 0.0558), (0.90, 25.0, 0.0540)])
def test_cut_offs_of_figure_2(alpha: float, cycles: float, above_core: float) -> None:
    body = {"core_radius_mm": alpha * 12.7, "outer_radius_mm": 12.7, "poisson_ratio": 0.46}
    radius = sensing_radius_for_cut_off(cycles, **body)
    assert radius / 12.7 - alpha == pytest.approx(above_core, abs=1e-4)
    assert cut_off(sensing_radius_mm=radius, **body) == pytest.approx(cycles, abs=1e-6)
    # By the definition: from mode k on, never above -40 dB of the largest response, and just before it above.
    k = cycles * 2 * np.pi
    response = frequency_response_db(np.array([k * 0.999, k * 1.001, 1.1 * k, 2 * k]), sensing_radius_mm=radius, **body)
    assert response[0] > -40 > response[1] > response[2] > response[3]
    assert frequency_response_db(np.arange(200), sensing_radius_mm=radius, **body).max() == pytest.approx(0)


@pytest.mark.parametrize("share", [0.05, 0.3, 0.6])
def test_cut_off_where_the_response_rises_from_below_the_level(share: float) -> None:
    """A thin layer of incompressible rubber: low modes hardly strain it. The last mode above it is just below."""
    body = {
        "core_radius_mm": 9.9,
        "outer_radius_mm": 10.0,
        "poisson_ratio": 0.5,
        "sensing_radius_mm": 9.9 + 0.1 * share,
    }
    response = frequency_response_db(np.arange(2500), **body)
    assert response[2] < -40 < response[200]
    last = int(np.flatnonzero(response > -40)[-1])
    assert last / (2 * np.pi) < cut_off(**body) < (last + 1) / (2 * np.pi)


def test_figure_2_slopes() -> None:
    """Displacement falls by 20 dB a decade, strain by more than 100 (section 2.1)."""
    body = {"core_radius_mm": 0.7 * 12.7, "outer_radius_mm": 12.7, "poisson_ratio": 0.46}
    displacement = frequency_response_db([100, 1000], **body)
    assert displacement[0] - displacement[1] == pytest.approx(20, abs=0.1)
    strain = frequency_response_db([20, 200], sensing_radius_mm=9.6, **body)
    assert strain[0] - strain[1] > 100


def test_impossible_cut_offs_are_refused() -> None:
    body = BODY | {"poisson_ratio": 0.46}
    with pytest.raises(InputError, match="no sensing radius"):
        sensing_radius_for_cut_off(1.0, **body)
    with pytest.raises(InputError, match="below 0 dB"):
        cut_off(level_db=0.0, **body)
    with pytest.raises(InputError, match="incompressible"):
        frequency_response_db([3], sensing_radius_mm=9.4, **BODY, poisson_ratio=0.5)
    with pytest.raises(InputError, match="shear modulus"):
        model_e_matrix([0.0], 3, **FINGER, shear_modulus_MPa=0.0)
