"""Planned touches on a finger: derivatives against changed calibrations, and sds against calibrations that are made."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from place_cases import MAP, SURFACE, missed_data

import bayestouch
from bayestouch.array_types import FloatArray
from bayestouch.chain.neighbours import calibration_jacobian
from bayestouch.contact import composite_radius
from bayestouch.data.finger import Finger
from bayestouch.finger.calibration import finger_chain
from bayestouch.finger.layout import FlatLayout
from bayestouch.finger.model import FingerModel
from bayestouch.finger.place.chain import FingerWithPlaces
from bayestouch.finger.place.posterior import PlacePosterior
from bayestouch.finger.planned import planned, touch_slopes
from bayestouch.finger.reading.covariance import reading_covariance
from bayestouch.model.observations import UntimedTouches
from bayestouch.model.split_data import joined_tables
from bayestouch.reliability import KnownFinger, TouchPlaces

DESIGN = bayestouch.FingerDesign(
    n_elements=4,
    calibration_span_deg=20.0,
    edge_step_deg=5.0,
    flat_step_deg=10.0,
    touch_step_deg=5.0,
    touch_radii_mm=(0.0, 3.9, 12.3, np.inf),
)


@cache
def made(**effects: float) -> bayestouch.DataSet:
    return bayestouch.simulate(DESIGN, effects=effects, seed=5).dataset


@cache
def calibrated(draws: int = 400) -> bayestouch.Calibration:
    return bayestouch.calibrate(made(), discrepancy="none", draws=draws)


def grid(calibration: bayestouch.Calibration) -> bayestouch.Touches:
    return bayestouch.candidate_touches(calibration, places=[-15.0, 2.0, 9.0], tips_mm=[0.0, 3.9, np.inf])


def moved(calibration: bayestouch.Calibration, name: str, step: float, element: int | None = None) -> FloatArray:
    """Expected readings of the grid with one parameter of the calibration changed."""
    value = np.array(calibration.mode[name], dtype=float)
    value[... if element is None else element] += step
    # With the same share of the modulus, the contact has the same table: its knots do not move.
    share = float(value / calibration.mode[name]) if name == "mu" else 1.0
    settings = {**calibration.settings, "largest_load": share * float(calibration.settings["largest_load"])}
    changed = replace(calibration, mode={**calibration.mode, name: value}, settings=settings)
    return planned(changed, grid(calibration)).readings.mean


@pytest.mark.parametrize(
    ("name", "row", "step", "unit"),
    [
        ("response", "response[1]", 1e-3, 1.0),
        ("r_s", "r_s[1]", 1e-3, 1.0),
        ("theta_s", "theta_s_rad[1]", 1e-3, np.pi / 180),
        ("sigma", "sigma", 1e-4, 1.0),
        ("mu", "log_mu", 1.5e-4, 0.0),
    ],
)
def test_columns_are_derivatives_over_the_parameters(name: str, row: str, step: float, unit: float) -> None:
    one = calibrated()
    element = 1 if row.endswith("[1]") else None
    change = moved(one, name, step, element) - moved(one, name, -step, element)
    unit = unit or 1 / float(one.mode["mu"])
    column = planned(one, grid(one)).readings.columns[:, :, one.layout.index(row)]
    # Central differences err by the square of the step: below a thousandth of the largest derivative.
    np.testing.assert_allclose(change / (2 * step * unit), column, atol=2e-3 * np.abs(column).max())


def test_columns_with_an_effect_are_derivatives_over_its_value_too() -> None:
    one = bayestouch.calibrate(
        made(crosstalk=0.05), model=bayestouch.effects.StatedModel("finger", "layer", (("crosstalk", {}),)), draws=200
    )
    for name, row, step in (("crosstalk_share", "crosstalk_share", 1e-4), ("sigma", "sigma", 1e-4)):
        change = moved(one, name, step) - moved(one, name, -step)
        column = planned(one, grid(one)).readings.columns[:, :, one.layout.index(row)]
        np.testing.assert_allclose(change / (2 * step), column, atol=2e-3 * np.abs(column).max())


@pytest.mark.parametrize("missed", [MAP, SURFACE])
def test_with_functions_of_place_the_covariance_is_that_of_touches_that_are_read(missed: object) -> None:
    one = bayestouch.calibrate(missed_data(missed), discrepancy="place", draws=200)
    chain, places = finger_chain(one), PlacePosterior.from_arrays(one.extra)
    assert places is not None
    table = grid(one)
    radius = composite_radius(table.indenter_radius_mm, chain.outer_radius_mm)
    angle = np.radians(table.angle_deg)
    touch = FingerWithPlaces(chain, places).effective_radius(radius, angle), angle, table.load
    jacobian, own = places.jacobian(calibration_jacobian(chain, *touch), chain, touch)
    expected = reading_covariance(jacobian, places.covariance) + own[:, :, None] * np.eye(chain.n_elements)
    readings = planned(one, table).readings
    found = readings.columns @ readings.covariance @ readings.columns.swapaxes(1, 2)
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-8 * np.abs(expected).max())


def test_noise_is_that_of_the_mean_with_the_error_of_the_load() -> None:
    one, samples = calibrated(), 7
    table = bayestouch.candidate_touches(one, places=[3.0], tips_mm=[3.9], samples=samples)
    chain = finger_chain(one)
    radius = composite_radius(np.array([3.9]), chain.outer_radius_mm)
    angle, load = np.radians([3.0]), table.load
    slope = (chain.predict(radius, angle, load + 0.1) - chain.predict(radius, angle, load - 0.1))[0] / 0.2
    expected = np.diag(one.noise.tactile_sd**2 / samples + one.noise.discrepancy_sd**2)
    expected += np.outer(slope, slope) * one.noise.force_sd**2 / samples
    np.testing.assert_allclose(planned(one, table).readings.noise[0], expected, rtol=1e-3, atol=1e-3)


def test_the_bias_of_a_place_is_that_of_the_sweet_spots() -> None:
    """R is read with the weights of generalised least squares; the bias is the part that the calibration leaves."""
    one = calibrated()
    table = grid(one)
    (bias,) = planned(one, table).biases(np.arange(table.n_touches))
    known = KnownFinger.of(one)
    radius = composite_radius(table.indenter_radius_mm, known.outer_radius_mm)
    touches = TouchPlaces(radius, np.radians(table.angle_deg), table.load)
    slopes = known.touch_jacobian(touches)
    weighted = np.linalg.solve(known.covariance(touches, 20), slopes)
    information = slopes.swapaxes(1, 2) @ weighted
    # What is known before: a tip between edge and flat, a place in the calibrated range of 40°, a load as measured.
    prior = [12 / known.outer_radius_mm**2, 12 / np.radians(40.0) ** 2, known.load_sd(20, use_load=True) ** -2]
    information += np.diag(prior)
    weights = np.linalg.solve(information, weighted.swapaxes(1, 2))[:, 0]
    assert known.errors is not None
    expected = np.einsum("ti,tij,tj->t", weights, known.errors.covariance(touches), weights)
    found = np.einsum("td,de,te->t", bias.rows, one.covariance, bias.rows)
    np.testing.assert_allclose(found, expected, rtol=1e-4)


def test_the_sds_are_those_of_a_calibration_with_the_chosen_touches() -> None:
    """Draws of two calibrations, without and with the touches that are chosen from those to be read."""
    dataset, draws = made(), 6000
    chosen = bayestouch.next_touches(calibrated(draws), dataset.touches, count=8)
    ids = np.unique(dataset.touches.touch)[chosen.chosen]
    more = dataset.touches.select(np.isin(dataset.touches.touch, ids))
    assert dataset.calibration is not None
    with_more = replace(dataset, calibration=joined_tables(dataset.calibration, more))
    again = bayestouch.calibrate(with_more, discrepancy="none", draws=draws)
    # The Monte Carlo error of an sd is 1.5 % (ESS 2,000). The noise is estimated anew, which moves it by 2 %.
    np.testing.assert_allclose(chosen.before, _sds(calibrated(draws)), rtol=1e-3)
    np.testing.assert_allclose(chosen.after[-1], _sds(again), rtol=0.045)
    assert (chosen.after[-1] < 0.83 * chosen.before).all()


def _sds(calibration: bayestouch.Calibration) -> FloatArray:
    drawn = calibration.posterior
    depth = np.sqrt(drawn["r_s"].var(axis=(0, 1)).mean())
    return np.array([drawn["sigma"].std(), drawn["mu"].std(), depth])


def test_bad_touches_are_named() -> None:
    one = calibrated()
    table = grid(one)
    for changed, words in (
        (table.with_(indenter_radius_mm=np.full(table.n_rows, np.nan)), "indenter"),
        (table.with_(angle_deg=None), "location"),
        (table.with_(load=np.full(table.n_rows, -1.0)), "loads above zero"),
        (table.with_(contact=np.zeros(table.n_rows)), "no touch to choose from"),
        (table.with_(readings=np.zeros((table.n_rows, 3))), "4 elements"),
    ):
        with pytest.raises(bayestouch.InputError, match=words):
            planned(one, changed)
    with pytest.raises(bayestouch.InputError, match="identified E map"):
        planned(replace(one, settings={**one.settings, "e_map": "empirical"}), table)


def test_slopes_at_a_flat_are_the_same_with_a_model_of_effects() -> None:
    """Steps in R go beyond that of a flat, to a hollow: the model with effects predicts it as the chain does."""
    finger = Finger(9.4, 12.7, 9.9, (-4.0, 0.0, 4.0))
    model = FingerModel(
        observed=UntimedTouches(2),
        finger=finger,
        layout=FlatLayout(3, discrepancy=False),
        flat_prior=None,
        sign=np.ones(3),
        contact="layer",
        peak=np.ones(3),
        reference_load=200.0,
        largest_load=640.0,
        effects=(),
    )
    vector = np.concatenate([np.zeros(3), np.full(3, 9.9), np.radians(finger.element_angles_deg), [0.46, np.log(0.3)]])

    def with_effects(radius: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
        return model.observing(UntimedTouches(len(load))).at(radius, angle, load).predict(vector).touches

    touches = np.array([12.7, 12.3]), np.zeros(2), np.full(2, 200.0)
    found = touch_slopes(with_effects, *touches)
    np.testing.assert_allclose(found, touch_slopes(model.chain(vector).predict, *touches), rtol=1e-6, atol=1e-9)


def test_the_error_of_a_load_counts_once_in_the_errors_of_touches() -> None:
    """The load is an unknown of the touch, with its reading as prior; it is not in the noise of the readings, too."""
    data = made()
    noisy = replace(data, sensor=replace(data.sensor, force_noise_sd=10.0))
    one = bayestouch.calibrate(noisy, discrepancy="none", draws=200)
    touches = planned(one, grid(one))
    (found,) = touches.biases(np.arange(9), ["P"])
    readings, slopes = touches.readings, touches.slopes
    counts = np.full(readings.mean.shape, np.median(one.rows.counts))
    total = readings.columns @ readings.covariance @ readings.columns.swapaxes(1, 2)
    total += one.noise.mean_variance(counts, readings.mean)[:, :, None] * np.eye(4)
    for t in range(9):
        weighted = np.linalg.solve(total[t], slopes[t])
        errors = np.linalg.solve(slopes[t].T @ weighted + np.diag(touches.precision[t]), weighted.T)
        np.testing.assert_allclose(found.rows[t], errors[2] @ readings.columns[t], rtol=1e-6, atol=1e-9)
