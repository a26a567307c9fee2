"""The paper's own fits, on simulated touches of known truth and on a practice finger."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bayestouch.body.emap import model_e_matrix, traction_coefficients
from bayestouch.chain.finger import FingerChain
from bayestouch.contact import CONTACT_MODELS, composite_radius, contact_model
from bayestouch.data.averages import TouchMeans
from bayestouch.data.dataset import load_dataset
from bayestouch.errors import InputError
from bayestouch.paper.simplex import (
    EmpiricalFinger,
    fit_element,
    fit_touch,
    fit_touches,
    table_1,
    table_2,
)
from bayestouch.paper.simplex.empirical import coefficients_needed
from bayestouch.paper.simplex.pressure import KnownPressure
from bayestouch.simulation import FingerDesign, PadDesign, SimulatedDataSet, simulate

SILENT = FingerDesign(
    noise_percent_peak=0.0,
    force_noise_sd=0.0,
    samples_per_touch=1,
    touch_radii_mm=(0.5, 3.9, 12.3, 25.25, np.inf),
    touch_step_deg=10.0,
)
NOISY = replace(SILENT, noise_percent_peak=1.72, samples_per_touch=5)
MU = SILENT.shear_modulus_MPa


def calibration(simulated: SimulatedDataSet) -> TouchMeans:
    assert simulated.dataset.calibration is not None
    return simulated.dataset.calibration.averaged()


def true_chain(simulated: SimulatedDataSet, contact: str = "layer") -> FingerChain:
    truth = simulated.truth
    return FingerChain(
        core_radius_mm=9.4,
        outer_radius_mm=12.7,
        response=np.array(truth["response"]),
        sensing_radius_mm=np.array(truth["r_s"]),
        angle=np.radians(truth["theta_s"]),
        offset=np.zeros(len(truth["gain"])),
        poisson_ratio=truth["sigma"],
        shear_modulus_MPa=truth["mu"],
        largest_load=600.0,
        contact=contact,
    )


@pytest.fixture(scope="module")
def silent() -> SimulatedDataSet:
    return simulate(SILENT, seed=3)


@pytest.fixture(scope="module")
def noisy() -> SimulatedDataSet:
    return simulate(NOISY, seed=4)


@pytest.mark.parametrize("contact", [None, "layer"])
def test_noiseless_touches_give_the_element_back(silent: SimulatedDataSet, contact: str | None) -> None:
    truth = silent.truth
    for element in (0, 7):
        fit = fit_element(calibration(silent), silent.dataset.sensor, element, MU, contact=contact)
        assert fit.converged
        # The simplex stops at 1e-5 of its steps of 0.02, 0.1 mm and 1°; along the ridge it stops a little
        # earlier (misfits there differ by less than their rounding), whence a hundred times as much.
        assert fit.poisson_ratio == pytest.approx(truth["sigma"], abs=2e-5)
        assert fit.sensing_radius_mm == pytest.approx(truth["r_s"][element], abs=1e-4)
        assert fit.angle_deg == pytest.approx(truth["theta_s"][element], abs=1e-3)
        assert fit.gain == pytest.approx(truth["gain"][element], rel=1e-3)
        assert fit.error_percent_peak < 1e-3
        assert np.isnan(fit.noise_percent_peak)  # one sample a touch


def standard_errors(simulated: SimulatedDataSet, element: int) -> np.ndarray:
    """Cramér-Rao bound of σ, r_s (mm) and θ_s (degree) from edges within 25°, gain unknown too."""
    truth, sensor = simulated.truth, simulated.dataset.sensor
    means = calibration(simulated)
    pressure = KnownPressure.of(means, sensor.body, MU, None)  # type: ignore[arg-type]
    off = pressure.angle_deg - sensor.body.element_angles_deg[element]  # type: ignore[union-attr]
    strain = pressure.strain(np.abs(off) <= 25)
    centre = np.array([truth["sigma"], truth["r_s"][element], truth["theta_s"][element]])
    columns = [strain(*centre)]
    for step in np.diag([1e-4, 1e-4, 1e-3]):
        columns.append((strain(*(centre + step)) - strain(*(centre - step))) / (2 * step.sum()))
    jacobian = np.stack(columns, axis=1) * truth["gain"][element]
    sd = truth["tactile_sd"][element] / np.sqrt(5)
    return np.asarray(sd * np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))[1:])


def test_noisy_touches_scatter_as_the_noise_allows(noisy: SimulatedDataSet) -> None:
    table = table_1(calibration(noisy), noisy.dataset.sensor, MU)
    assert len(table.fits) == 16
    truth = noisy.truth
    true = np.stack([np.full(16, truth["sigma"]), truth["r_s"], truth["theta_s"]], axis=1)
    fitted = np.array([[fit.poisson_ratio, fit.sensing_radius_mm, fit.angle_deg] for fit in table.fits])
    z = (fitted - true) / np.array([standard_errors(noisy, element) for element in range(16)])
    # 16 elements are independent: a mean of z is known to 1/4, its rms to 1/√32; four of either
    assert np.all(np.abs(z.mean(axis=0)) < 1.0), z.mean(axis=0)
    assert np.all(np.abs(np.sqrt((z**2).mean(axis=0)) - 1) < 4 / np.sqrt(32)), z
    for fit in table.fits:
        # 50 touches less 4 parameters, each the mean of 5 samples; the share's error is 1/√(2·46) of it
        expected = fit.noise_percent_peak / np.sqrt(5) * np.sqrt(1 - 4 / fit.n_touches)
        assert abs(fit.error_percent_peak / expected - 1) < 4 / np.sqrt(2 * (fit.n_touches - 4))
        assert fit.noise_percent_peak == pytest.approx(
            truth["tactile_sd"][0] / (truth["response"][fit.element] * 2), rel=0.1
        )
    low, mean, high = table.summary("sensing_radius_mm")
    assert low < mean < high
    assert mean == pytest.approx(fitted[:, 1].mean())


@pytest.mark.slow
def test_hertz_fits_flats_worse_than_the_layer(noisy: SimulatedDataSet) -> None:
    """Section 3.1 found 4.2 % for edges and flats with Hertz, and 2.2 % with the frictionless layer."""
    errors = {
        contact: table_1(calibration(noisy), noisy.dataset.sensor, MU, contact=contact).summary("error_percent_peak")[1]
        for contact in ("hertz", "layer")
    }
    assert errors["layer"] == pytest.approx(
        table_1(calibration(noisy), noisy.dataset.sensor, MU).summary("error_percent_peak")[1], rel=0.1
    )
    assert errors["hertz"] > 1.5 * errors["layer"]


def test_spectra_between_solved_poisson_ratios(silent: SimulatedDataSet) -> None:
    means = calibration(silent)
    for contact in CONTACT_MODELS:
        pressure = KnownPressure.of(means, silent.dataset.sensor.body, MU, contact)  # type: ignore[arg-type]
        kappa = pressure.load * composite_radius(means.indenter_radius_mm[pressure.rows], 12.7)
        for sigma in (0.03, 0.25, 0.46, 0.483, 0.4999, 0.5):
            exact = contact_model(contact, (9.4, 12.7), sigma).spectrum(kappa, pressure.modes)
            # stated in bayestouch.paper.simplex.pressure
            assert np.abs(pressure.spectrum(sigma) - exact).max() < 2e-6


def test_criterion_as_printed_has_no_minimum_at_the_truth(noisy: SimulatedDataSet) -> None:
    """Why the readings' error is minimised: the strain's goes to zero at the core of an incompressible rubber."""
    means, sensor = calibration(noisy), noisy.dataset.sensor
    pressure = KnownPressure.of(means, sensor.body, MU, None)  # type: ignore[arg-type]
    element = 7
    near = np.abs(pressure.angle_deg - sensor.body.element_angles_deg[element]) <= 25  # type: ignore[union-attr]
    data, strain = means.readings[pressure.rows, element][near], pressure.strain(near)

    def errors(sigma: float, radius: float) -> tuple[float, float]:
        model = strain(sigma, radius, noisy.truth["theta_s"][element])
        printed = ((data * (data @ model) / (data @ data) - model) ** 2).sum()
        gain = (data @ model) / (model @ model)
        return printed, ((data - gain * model) ** 2).sum()

    truth, core = errors(0.46, noisy.truth["r_s"][element]), errors(0.4999, 9.402)
    assert core[0] < 0.3 * truth[0]
    assert core[1] > 10 * truth[1]


def test_elements_without_touches_are_left_out(noisy: SimulatedDataSet) -> None:
    calibrating = noisy.dataset.calibration
    assert calibrating is not None
    readings = calibrating.readings.copy()
    readings[:, 3] = np.nan
    near = calibrating.select(calibrating.angle_deg < 30).with_()  # type: ignore[operator]
    near = near.with_(readings=readings[calibrating.angle_deg < 30])  # type: ignore[operator]
    table = table_1(near.averaged(), noisy.dataset.sensor, MU)
    fitted = {fit.element for fit in table.fits}
    assert 3 not in fitted
    assert 15 not in fitted
    assert {0, 1, 2, 4, 5} <= fitted
    assert any(note.startswith("element e04 has 0 known touches") for note in table.left_out)
    identified = table_2(near.averaged(), noisy.dataset.sensor)
    assert np.isnan(identified.error_percent_peak[3])
    assert np.isfinite(identified.error_percent_peak[[0, 1, 2, 4]]).all()
    # reading a touch does without the element
    finger = EmpiricalFinger.of(
        identified, noisy.dataset.sensor, shear_modulus_MPa=MU, poisson_ratio=0.46, largest_load=600.0
    )
    touch = noisy.dataset.touches.averaged()
    fit = fit_touch(finger, touch.readings[7])
    assert touch.angle_deg is not None
    assert abs(fit.angle_deg - touch.angle_deg[7]) < 1.0


@pytest.mark.parametrize("load_known", [False, True])
@pytest.mark.parametrize("contact", CONTACT_MODELS)
def test_noiseless_touches_give_the_contact_back(contact: str, load_known: bool) -> None:
    simulated = simulate(replace(SILENT, contact=contact), seed=5)
    chain = true_chain(simulated, contact)
    means = simulated.dataset.touches.averaged()
    radius = composite_radius(means.indenter_radius_mm, 12.7)
    fits = fit_touches(chain, means.readings, loads=means.load if load_known else None)
    for fit, true_radius, angle, load in zip(
        fits,
        radius,
        simulated.truth["touches"]["theta_c"],
        simulated.truth["touches"]["P"],
        strict=True,
    ):
        assert fit.converged
        # The table's error of 1e-5 to 6e-5 of the peak moves R by up to 0.01 mm where the spectrum hardly
        # depends on it (R = 0.5 mm), location and load far less.
        assert fit.composite_radius_mm == pytest.approx(true_radius, abs=0.01)
        assert fit.angle_deg == pytest.approx(angle, abs=1e-3)
        assert fit.load == pytest.approx(load, abs=0.0 if load_known else 0.05)
        assert fit.error_percent_peak < 0.01
        assert 1 / fit.composite_radius_mm == pytest.approx(1 / 12.7 + 1 / fit.indenter_radius_mm)


def test_both_radii_lead_to_the_same_contact(noisy: SimulatedDataSet) -> None:
    means = noisy.dataset.touches.averaged()
    chain = true_chain(noisy)
    round_tips = np.isin(means.indenter_radius_mm, [3.9, 12.3])
    for reading in means.readings[round_tips]:
        by_composite, by_indenter = (fit_touch(chain, reading, radius=radius) for radius in ("R", "r_c"))
        assert by_indenter.composite_radius_mm == pytest.approx(by_composite.composite_radius_mm, abs=0.02)
        assert by_indenter.angle_deg == pytest.approx(by_composite.angle_deg, abs=2e-3)


def test_contact_found_is_the_minimum_of_the_strain_error(noisy: SimulatedDataSet) -> None:
    """Of the squared error of strains, not of readings: gains differ by half."""
    means = noisy.dataset.touches.averaged()
    chain = true_chain(noisy)
    for row in np.flatnonzero(np.isin(means.indenter_radius_mm, [3.9, 12.3])):

        def error(touch: np.ndarray, row: int = row) -> float:
            radius, angle_deg, load = touch
            strain = (means.readings[row] - chain.predict(radius, np.radians(angle_deg), load)) / chain.gain
            return float((strain**2).sum())

        fit = fit_touch(chain, means.readings[row])
        found = np.array([fit.composite_radius_mm, fit.angle_deg, fit.load])
        for step in np.diag([0.01, 0.005, 0.1]):  # a fortieth of the scatter by noise
            assert error(found) < min(error(found + step), error(found - step))


def test_noisy_contacts_scatter_as_the_noise_allows() -> None:
    design = replace(NOISY, touch_radii_mm=(7.55,), touch_step_deg=1.0, noise_percent_peak=1.0)
    simulated = simulate(design, seed=6)
    chain = true_chain(simulated)
    means = simulated.dataset.touches.averaged()
    radius = float(composite_radius(7.55, 12.7))
    angle, load = np.radians(simulated.truth["touches"]["theta_c"]), np.array(simulated.truth["touches"]["P"])
    fits = fit_touches(chain, means.readings)
    found = np.array([[fit.composite_radius_mm, np.radians(fit.angle_deg), fit.load] for fit in fits])
    error = found - np.stack([np.full(41, radius), angle, load], axis=1)
    steps = np.diag([1e-2, 1e-4, 1e-1])
    true = np.array([np.full(41, radius), angle, load])
    jacobian = np.stack(
        [
            (chain.predict(*(true + step[:, None])) - chain.predict(*(true - step[:, None]))) / step.sum() / 2
            for step in steps
        ],
        axis=2,
    ) / chain.gain[:, None]  # fmt: skip
    # Ordinary least squares in strain: (JᵀJ)⁻¹ Jᵀ C J (JᵀJ)⁻¹ with the strain's noise C
    noise = (10.0 / np.sqrt(5) / chain.gain) ** 2
    inverse = np.linalg.inv(jacobian.swapaxes(1, 2) @ jacobian)
    middle = np.einsum("tij,i,tik->tjk", jacobian, noise, jacobian)
    sd = np.sqrt(np.einsum("tii->ti", inverse @ middle @ inverse))
    z = error / sd
    # 41 independent touches; mean known to 1/√41, rms to 1/√82; four of either
    assert np.all(np.abs(z.mean(axis=0)) < 4 / np.sqrt(41)), z.mean(axis=0)
    assert np.all(np.abs(np.sqrt((z**2).mean(axis=0)) - 1) < 4 / np.sqrt(82)), np.sqrt((z**2).mean(axis=0))


def test_hertz_reads_blunt_tips_too_sharp(silent: SimulatedDataSet) -> None:
    """Table 3: Hertz underestimates r_c, the more the blunter the tip."""
    means = silent.dataset.touches.averaged()
    fits = fit_touches(true_chain(silent, "hertz"), means.readings)
    found = np.array([fit.indenter_radius_mm for fit in fits])
    share = [(found[means.indenter_radius_mm == r] / r).mean() for r in (3.9, 12.3, 25.25)]
    assert 1 > share[0] > share[1] > share[2]
    # Half-widths that the layer gives at this load and modulus are those of Hertz at a smaller R.
    layer, hertz = (contact_model(name, (9.4, 12.7), 0.46) for name in ("layer", "hertz"))
    kappa = 0.2 * float(composite_radius(12.3, 12.7)) / MU
    equivalent = kappa * float(layer.half_width(kappa) / hertz.half_width(kappa)) ** 2
    expected = equivalent / kappa * float(composite_radius(12.3, 12.7))
    mean_radius = np.mean(
        [f.composite_radius_mm for f, r in zip(fits, means.indenter_radius_mm, strict=True) if r == 12.3]
    )
    # the layer's pressure is no ellipse (3 % in R) and loads are not all 200 N/m (3 %)
    assert mean_radius == pytest.approx(expected, rel=0.06)


def test_missing_readings_and_impossible_touches(silent: SimulatedDataSet) -> None:
    chain = true_chain(silent)
    means = silent.dataset.touches.averaged()
    reading = means.readings[7].copy()
    reading[[0, 8]] = np.nan
    assert means.angle_deg is not None
    fit = fit_touch(chain, reading)
    assert fit.angle_deg == pytest.approx(means.angle_deg[7], abs=1e-3)
    reading[2:] = np.nan
    with pytest.raises(InputError, match="1 readings for 3 unknowns"):
        fit_touch(chain, reading)
    with pytest.raises(InputError, match="above 0, at most 600 N/m"):
        fit_touch(chain, means.readings[0], load=700.0)
    with pytest.raises(InputError, match="above 0"):
        fit_touch(chain, means.readings[0], load=np.nan)


@pytest.fixture(scope="module")
def all_around() -> SimulatedDataSet:
    return simulate(replace(SILENT, calibration_span_deg=178.0, edge_step_deg=2.0), seed=7)


def test_identified_map_is_the_model_map(all_around: SimulatedDataSet) -> None:
    truth = all_around.truth
    table = table_2(calibration(all_around), all_around.dataset.sensor, n_coefficients=75)
    model = model_e_matrix(
        truth["theta_s"],
        75,
        sensing_radius_mm=np.array(truth["r_s"]),
        core_radius_mm=9.4,
        outer_radius_mm=12.7,
        poisson_ratio=truth["sigma"],
        shear_modulus_MPa=truth["mu"],
    )
    expected = -np.array(truth["gain"])[:, None] * model  # a reading is positive for compression
    assert table.rank == 151
    # What the modes above 75 hold, (10.2/12.7)^75 = 7e-8 of the largest, is folded onto the lower ones.
    np.testing.assert_allclose(table.map, expected, rtol=0, atol=1e-6 * np.abs(expected).max())
    assert np.all(table.error_percent_peak < 1e-4)


def test_identified_finger_reads_touches(all_around: SimulatedDataSet) -> None:
    sensor = all_around.dataset.sensor
    table = table_2(calibration(all_around), sensor)
    finger = EmpiricalFinger.of(table, sensor, shear_modulus_MPa=MU, poisson_ratio=0.46, largest_load=600.0)
    chain = true_chain(all_around)
    rng = np.random.default_rng(2)
    touch = rng.uniform(0.5, 12.7, 40), rng.uniform(-np.pi, np.pi, 40), rng.uniform(160, 240, 40)
    error = (finger.predict(*touch) - chain.predict(*touch)) / (chain.response * touch[2][:, None])
    # n_c ends where the response is half a per cent of its largest, and the rest sums to a few of it
    assert np.abs(error).max() < 0.02
    # the largest on the touched part lies within 1° of the element, where the response is flat
    np.testing.assert_allclose(table.response, chain.response, rtol=0.02)
    means = all_around.dataset.touches.averaged()
    fits = fit_touches(finger, means.readings)
    radius = composite_radius(means.indenter_radius_mm, 12.7)
    found = np.array([fit.composite_radius_mm for fit in fits])
    blunt = radius > 2
    assert np.abs(found - radius)[blunt].max() < 0.3
    np.testing.assert_array_equal(finger.predict(3.0, 0.0, 0.0), np.zeros(16))
    assert finger.predict(np.full((2, 1), 3.0), np.zeros(3), 100.0).shape == (2, 3, 16)


def test_table_2_of_half_a_finger(noisy: SimulatedDataSet) -> None:
    means, sensor = calibration(noisy), noisy.dataset.sensor
    table = table_2(means, sensor)
    n = int((means.indenter_radius_mm == 0).sum())
    assert n == 181
    assert table.map.shape == (16, 2 * coefficients_needed(sensor.body) + 1)  # type: ignore[arg-type]
    # Touches cover 180°, so about half of the coefficients can be told apart, and a few more at the ends.
    assert 0.5 < table.rank / table.map.shape[1] < 0.65
    expected = table.noise_percent_peak / np.sqrt(5) * np.sqrt(1 - table.rank / n)
    assert np.all(np.abs(table.error_percent_peak / expected - 1) < 4 / np.sqrt(2 * (n - table.rank)))
    assert table.summary("error_percent_peak")[1] < table.summary("held_out_percent_peak")[1]
    assert 1 < table.condition_number < 20


def test_leave_one_out_is_what_leaving_one_out_gives() -> None:
    # all the way around, so that every coefficient is kept whichever touch is left out
    few = simulate(replace(NOISY, calibration_span_deg=174.0, edge_step_deg=6.0, samples_per_touch=2), seed=8)
    calibrating = few.dataset.calibration
    assert calibrating is not None
    edges = calibrating.select(calibrating.indenter_radius_mm == 0)
    means, sensor = edges.averaged(), few.dataset.sensor
    whole = table_2(means, sensor, n_coefficients=3)
    squares = np.zeros(16)
    assert means.angle_deg is not None
    p = traction_coefficients(np.ones(4), means.angle_deg, means.load / 1000, outer_radius_mm=12.7)
    for i in range(means.n_touches):
        without = table_2(edges.select(edges.touch != i).averaged(), sensor, n_coefficients=3)
        assert without.rank == whole.rank == 7
        squares += (means.readings[i] - without.map @ p[:, i]) ** 2
    expected = np.sqrt(squares / means.n_touches) / (whole.response * means.load.mean()) * 100
    np.testing.assert_allclose(whole.held_out_percent_peak, expected, rtol=1e-9)


def test_identification_takes_tails_that_the_model_cannot() -> None:
    """Section 3.2: the empirical map "is much better at predicting the tails of the sensor"."""
    simulated = simulate(NOISY, effects={"crosstalk": 0.08}, seed=9)
    means, sensor = calibration(simulated), simulated.dataset.sensor
    model = table_1(means, sensor, MU).summary("error_percent_peak")[1]
    empirical = table_2(means, sensor)
    assert empirical.summary("held_out_percent_peak")[1] < 0.7 * model
    # held out, it is at the noise of a mean of five, plus that of the coefficients
    noise = empirical.summary("noise_percent_peak")[1] / np.sqrt(5)
    assert empirical.summary("held_out_percent_peak")[1] < 1.4 * noise


def test_wrong_input(silent: SimulatedDataSet) -> None:
    pad = simulate(PadDesign(calibration_step_mm=6.0, n_touches=3), seed=0)
    for table in (
        lambda: table_1(calibration(pad), pad.dataset.sensor, MU),
        lambda: table_2(calibration(pad), pad.dataset.sensor),
    ):
        with pytest.raises(InputError, match="is a pad"):
            table()
    calibrating = silent.dataset.calibration
    assert calibrating is not None
    flats = calibrating.select(calibrating.indenter_radius_mm == np.inf).averaged()
    for fit in (lambda: table_1(flats, silent.dataset.sensor, MU), lambda: table_2(flats, silent.dataset.sensor)):
        with pytest.raises(InputError, match="knife edge"):
            fit()
    few = calibrating.select(np.arange(5)).averaged()
    with pytest.raises(InputError, match="no element has 6 known touches"):
        table_1(few, silent.dataset.sensor, MU)
    with pytest.raises(InputError, match="no element has more than"):
        table_2(few, silent.dataset.sensor)


def test_an_element_that_reads_zero_is_left_out(silent: SimulatedDataSet) -> None:
    means, sensor = calibration(silent), silent.dataset.sensor
    dead = means.readings.copy()
    dead[:, 3] = 0.0
    zero = replace(means, readings=dead)
    with pytest.raises(InputError, match="e04 reads zero under all touches"):
        fit_element(zero, sensor, 3, MU)
    found, expected = table_2(zero, sensor), table_2(means, sensor)
    np.testing.assert_array_equal(found.map[3], np.nan)
    others = np.arange(16) != 3
    np.testing.assert_allclose(found.map[others], expected.map[others], rtol=1e-9, atol=1e-9)
    assert np.isfinite(found.condition_number)
    with pytest.raises(InputError, match="the same as no contact in all elements"):
        fit_touch(true_chain(silent), np.zeros(16))


def test_practice_finger(shared_folder: Path) -> None:
    """Averages over the elements of finger-a against its truth."""
    dataset = load_dataset(shared_folder / "practice" / "finger-a")
    path = shared_folder / "practice" / "truth" / "finger-a" / "truth.json"
    truth = json.loads(path.read_text(encoding="utf-8"))
    assert dataset.calibration is not None
    means = dataset.calibration.averaged()
    table = table_1(means, dataset.sensor, truth["mu"])
    assert len(table.fits) == 16
    assert all(fit.converged for fit in table.fits)
    for name, true in (
        ("poisson_ratio", np.full(16, truth["nu"])),
        ("sensing_radius_mm", np.array(truth["rs_mm"])),
        ("angle_deg", np.array(truth["theta_deg"])),
    ):
        error = np.array([getattr(fit, name) for fit in table.fits]) - true
        # standard error of the mean over 16 elements, from their own scatter; Student's t at 15 degrees of
        # freedom exceeds 4 once in a thousand
        assert abs(error.mean()) < 4 * error.std(ddof=1) / 4, (name, error.mean(), error.std())
    # errors at the noise of a mean of five: nothing is missing from this finger
    noise = table.summary("noise_percent_peak")[1] / np.sqrt(5)
    assert table.summary("error_percent_peak")[1] == pytest.approx(noise, rel=0.1)
    assert table_2(means, dataset.sensor).summary("held_out_percent_peak")[1] < 1.4 * noise
