"""Simulated data sets: the truth is what the readings hold, and each effect does what it says."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from same_touches import same_touches

from bayestouch.body.annulus import solve_annulus
from bayestouch.body.layer import layer_kernel_2d
from bayestouch.chain.finger import FingerChain
from bayestouch.contact import composite_radius, contact_model
from bayestouch.data.dataset import load_dataset
from bayestouch.data.sensor import Finger, Pad
from bayestouch.data.touches import Touches
from bayestouch.errors import InputError
from bayestouch.simulation import (
    SIMULATED_EFFECTS,
    FingerDesign,
    PadDesign,
    SimulatedDataSet,
    embedded_dataset,
    save_simulated,
    simulate,
)
from bayestouch.simulation.finger import BuiltFinger

SMALL = FingerDesign(
    samples_per_touch=3,
    edge_step_deg=10.0,
    flat_step_deg=30.0,
    touch_radii_mm=(0.0, 1.59, 12.3, np.inf),
    touch_step_deg=8.0,
)
SILENT = replace(SMALL, noise_percent_peak=0.0, force_noise_sd=0.0)
QUIET_PAD = PadDesign(noise_percent_peak=0.0, force_noise_sd=0.0, calibration_step_mm=4.0, n_touches=20)


def tables(simulated: SimulatedDataSet) -> tuple[Touches, Touches]:
    assert simulated.dataset.calibration is not None
    return simulated.dataset.calibration, simulated.dataset.touches


def signals(simulated: SimulatedDataSet) -> np.ndarray:
    """Readings of calibration and touches, one above the other."""
    return np.concatenate([table.readings for table in tables(simulated)])


def loads(simulated: SimulatedDataSet) -> np.ndarray:
    return np.concatenate([table.load for table in tables(simulated)])


def angles(simulated: SimulatedDataSet) -> np.ndarray:
    return np.concatenate([table.angle_deg for table in tables(simulated)])  # type: ignore[misc]


def peaks(simulated: SimulatedDataSet, reference_load: float = 200.0) -> np.ndarray:
    return np.array(simulated.truth["response"]) * reference_load


def true_chain(simulated: SimulatedDataSet, contact: str = "layer") -> FingerChain:
    truth, body = simulated.truth, simulated.dataset.sensor.body
    assert isinstance(body, Finger)
    return FingerChain(
        core_radius_mm=body.core_radius_mm,
        outer_radius_mm=body.outer_radius_mm,
        response=np.array(truth["response"]),
        sensing_radius_mm=np.array(truth["r_s"]),
        angle=np.radians(truth["theta_s"]),
        offset=np.zeros(body.n_elements),
        poisson_ratio=truth["sigma"],
        shear_modulus_MPa=truth["mu"],
        largest_load=300.0,
        contact=contact,
    )


@pytest.mark.parametrize("contact", ["layer", "hertz", "approximate frictionless"])
def test_readings_are_those_of_the_chain_with_the_true_parameters(contact: str) -> None:
    simulated = simulate(replace(SILENT, contact=contact), seed=1)
    chain = true_chain(simulated, contact)
    for name, table in zip(("calibration", "touches"), tables(simulated), strict=True):
        radius = composite_radius(table.indenter_radius_mm, 12.7)
        true = simulated.truth[name]
        np.testing.assert_allclose(np.array(true["P"])[table.touch], table.load, rtol=1e-12)
        np.testing.assert_allclose(np.array(true["theta_c"])[table.touch], table.angle_deg, atol=1e-9)
        predicted = chain.predict(radius, np.radians(table.angle_deg), table.load)  # type: ignore[arg-type]
        error = (table.readings - predicted) / (chain.response * table.load[:, None])
        # What the response table is off by (test_response); the simulation sums the series.
        assert np.abs(error).max() < 1.1e-4
    # A press reads positive, as a positive gain times compression.
    assert np.all(chain.gain > 0)
    np.testing.assert_allclose(simulated.truth["gain"], chain.gain, rtol=1e-5)
    assert np.all(signals(simulated).max(axis=0) > 500)


def test_series_is_summed_far_enough() -> None:
    finger = BuiltFinger(FingerDesign(), np.array([9.5, 10.7]), np.array([-3.0, 4.0]), np.ones(2))
    radius, angle, load = np.array([0.0, 0.5, np.inf]), np.array([-3.0, 4.1, 60.0]), np.full(3, 200.0)
    modes = np.arange(600)
    strain = solve_annulus(modes, core_radius_mm=9.4, outer_radius_mm=12.7, poisson_ratio=0.46).radial_strain(
        finger.sensing_radius_mm
    )
    kappa = 0.2 * composite_radius(radius, 12.7) / 0.15
    spectrum = contact_model("layer", (9.4, 12.7), 0.46).spectrum(kappa, modes)
    turn = np.radians(finger.angle_deg - angle[:, None])
    cosine = np.cos(modes * turn[..., None])
    series = np.einsum("k,mk,tk,tmk->tm", np.where(modes == 0, 1, 2), strain, spectrum, cosine)
    expected = 0.2 / 0.15 / (2 * np.pi * 12.7) * series
    # (r_s/r_b)^k at one and a half times the modes that suffice for 1e-7
    np.testing.assert_allclose(finger.strain(radius, angle, load), expected, rtol=0, atol=1e-8 * expected.max())


def test_noise_is_as_designed() -> None:
    design = replace(SMALL, samples_per_touch=20, noise_percent_peak=1.72, force_noise_sd=1.0)
    simulated = simulate(design, seed=5)
    calibration, _ = tables(simulated)
    means = calibration.averaged()
    # A variance from n degrees of freedom scatters by √(2/n) of itself; 5 standard errors for 16 elements.
    scatter = 5 * np.sqrt(2 / means.pure_error_dof)
    np.testing.assert_array_less(np.abs(means.pure_error_variance / 17.2**2 - 1), scatter)
    assert simulated.truth["tactile_sd"] == pytest.approx([17.2] * 16)
    within = calibration.load - means.load[calibration.touch]
    freedom = calibration.n_rows - means.n_touches
    assert abs((within**2).sum() / freedom - 1) < 5 * np.sqrt(2 / freedom)
    assert simulated.dataset.sensor.force_noise_sd == simulated.truth["force_sd"] == 1.0


def test_built_sensor_scatters_as_designed() -> None:
    wide = replace(SILENT, n_elements=41, pitch_deg=4.0, edge_step_deg=45.0)
    drawn = [simulate(wide, seed=seed).truth for seed in range(10)]
    design = np.array(simulate(wide, seed=0).dataset.sensor.body.element_angles_deg)  # type: ignore[union-attr]
    n = 410
    for values, sd in (
        (np.array([truth["r_s"] for truth in drawn]) - 9.9, 0.1),
        (np.array([truth["theta_s"] for truth in drawn]) - design, 0.5),
    ):
        assert abs(values.mean()) < 4 * sd / np.sqrt(n)
        assert abs(values.std() / sd - 1) < 4 / np.sqrt(2 * n)
    gain = np.log([truth["gain"] for truth in drawn])
    assert abs(gain.std() / 0.15 - 1) < 4 / np.sqrt(2 * n)
    # An element as designed reads 1000 under an edge of 200 N/m.
    exact = simulate(replace(SILENT, depth_spread_mm=0, angle_error_deg=0, gain_spread=0), seed=0)
    np.testing.assert_allclose(peaks(exact), 1000.0, rtol=1e-12)


def test_the_paper_is_the_default() -> None:
    simulated = simulate(replace(FingerDesign(), samples_per_touch=1), seed=0)
    calibration, touches = tables(simulated)
    body = simulated.dataset.sensor.body
    assert isinstance(body, Finger)
    assert (body.core_radius_mm, body.sensing_radius_mm, body.outer_radius_mm) == (9.4, 9.9, 12.7)
    assert body.element_angles_deg[0] == -66.0
    assert body.n_elements == 16
    assert FingerDesign().samples_per_touch == 20
    edges = calibration.indenter_radius_mm == 0
    np.testing.assert_array_equal(calibration.angle_deg[edges], np.arange(-90.0, 91.0))  # type: ignore[index]
    np.testing.assert_array_equal(calibration.angle_deg[~edges], np.arange(-90.0, 91.0, 3))  # type: ignore[index]
    assert np.all(calibration.indenter_radius_mm[~edges] == np.inf)
    radii, counts = np.unique(touches.indenter_radius_mm, return_counts=True)
    np.testing.assert_array_equal(radii, [0.5, 1.59, 3.9, 6.01, 7.55, 9.3, 12.3, 18.71, 25.25])
    assert set(counts) == {41}
    assert loads(simulated).min() > 155
    assert loads(simulated).max() < 245


def test_seed_decides_everything() -> None:
    one, same, other = (signals(simulate(SMALL, seed=seed)) for seed in (3, 3, 4))
    np.testing.assert_array_equal(one, same)
    assert np.abs(one - other).max() > 100


@pytest.mark.parametrize("design", [SMALL, PadDesign(calibration_step_mm=4.0, n_touches=20)])
def test_null_value_of_every_effect_changes_nothing(design: FingerDesign | PadDesign) -> None:
    plain = simulate(design, seed=2)
    effects = {
        name: effect.null
        for name, effect in SIMULATED_EFFECTS.items()
        if isinstance(design, FingerDesign) or not effect.finger_only
    }
    with_null = simulate(design, effects=effects, seed=2)
    # Up to rounding: an effect that does nothing may still multiply and add.
    np.testing.assert_allclose(signals(with_null), signals(plain), rtol=0, atol=1e-9)
    np.testing.assert_allclose(loads(with_null), loads(plain), rtol=1e-14)
    for effect, value in effects.items():  # and one by one, so that they do not undo each other
        alone = simulate(design, effects={effect: value}, seed=2)
        np.testing.assert_allclose(signals(alone), signals(plain), rtol=0, atol=1e-9, err_msg=effect)


def difference(effect: str, value: float, design: FingerDesign = SILENT) -> tuple[np.ndarray, np.ndarray]:
    """Readings without and with an effect, same seed."""
    return signals(simulate(design, seed=6)), signals(simulate(design, effects={effect: value}, seed=6))


def test_effects_on_the_rig() -> None:
    plain = simulate(SILENT, seed=6)
    offset = simulate(SILENT, effects={"load_offset": 7.0}, seed=6)
    np.testing.assert_array_equal(signals(offset), signals(plain))
    np.testing.assert_allclose(loads(offset), loads(plain) + 7.0)
    assert offset.truth["touches"]["P"] == plain.truth["touches"]["P"]
    tilted = simulate(SILENT, effects={"load_misalignment": 0.1}, seed=6)
    np.testing.assert_allclose(loads(tilted) / loads(plain), 1 + 0.1 * np.sin(np.radians(angles(plain))), rtol=1e-12)
    eccentric = simulate(SILENT, effects={"prober_eccentricity": 0.8}, seed=6)
    np.testing.assert_array_equal(angles(eccentric), angles(plain))  # what was commanded
    commanded = tables(plain)[1].angle_deg[::3]  # type: ignore[index]
    shift = np.array(eccentric.truth["touches"]["theta_c"]) - commanded
    np.testing.assert_allclose(shift, 0.8 * np.sin(np.radians(commanded - 30)), atol=1e-12)
    # The readings are those of a touch at the true place.
    table = tables(eccentric)[1]
    true = np.radians(eccentric.truth["touches"]["theta_c"])[table.touch]
    chain = true_chain(eccentric)
    predicted = chain.predict(composite_radius(table.indenter_radius_mm, 12.7), true, table.load)
    assert np.abs((table.readings - predicted) / (chain.response * table.load[:, None])).max() < 1.1e-4


def test_effects_on_contact_and_body() -> None:
    edges = replace(SILENT, touch_radii_mm=(0.0, 3.9))
    blunt = replace(SILENT, touch_radii_mm=(2.5, 3.9))
    _, reads = difference("blunt_edge", 2.5, edges)
    n = len(reads) - len(tables(simulate(blunt, seed=6))[1].readings)
    np.testing.assert_allclose(reads[n:], signals(simulate(blunt, seed=6))[n:], rtol=0, atol=1e-9)
    table = tables(simulate(edges, effects={"blunt_edge": 2.5}, seed=6))[1]
    assert set(table.indenter_radius_mm) == {0.0, 3.9}  # the table says what the tip should be
    plain, soft = difference("soft_spot", 0.3)
    angle = angles(simulate(SILENT, seed=6))
    np.testing.assert_allclose(soft, plain * (1 + 0.3 * np.exp(-0.5 * ((angle - 7) / 10) ** 2))[:, None], rtol=1e-12)


def test_aperture_is_the_mean_over_the_element() -> None:
    finger = BuiltFinger(FingerDesign(), np.array([9.7, 10.3]), np.array([-3.0, 4.0]), np.ones(2))
    touch = np.array([0.0, 3.9]), np.array([-1.0, 5.0]), np.array([200.0, 180.0])
    nodes, weights = np.polynomial.legendre.leggauss(12)
    width = 1.5
    mean = np.zeros((2, 2))
    for node, weight in zip(nodes, weights, strict=True):
        angle = finger.angle_deg + np.degrees(node * width / 2 / finger.sensing_radius_mm)
        mean += weight / 2 * replace(finger, angle_deg=angle).strain(*touch)
    # 12 Gauss nodes over a width in which the strain's highest mode turns by 3 rad: exact to 1e-9
    np.testing.assert_allclose(finger.strain(*touch, aperture_mm=width), mean, rtol=0, atol=1e-9)
    assert np.abs(finger.strain(*touch) - mean).max() > 1e-3
    plain, wide = difference("aperture", 1.5)
    assert np.abs(wide - plain).max() > 10


def test_effects_on_elements() -> None:
    simulated = simulate(SILENT, seed=6)
    peak, m = peaks(simulated), 16
    plain, leaking = difference("crosstalk", 0.05)
    neighbours = np.diag(np.ones(m - 1), 1) + np.diag(np.ones(m - 1), -1)
    np.testing.assert_allclose(leaking, plain + 0.05 * plain @ neighbours, rtol=0, atol=1e-9)
    plain, lagging = difference("channel_lag", 0.2)
    np.testing.assert_allclose(lagging[1:, 0], 0.8 * plain[1:, 0] + 0.2 * plain[:-1, -1], rtol=0, atol=1e-9)
    np.testing.assert_allclose(lagging[:, 5], 0.8 * plain[:, 5] + 0.2 * plain[:, 4], rtol=0, atol=1e-9)
    plain, near = difference("proximity", 0.04)
    turn = np.array(simulated.truth["theta_s"]) - angles(simulated)[:, None]
    np.testing.assert_allclose(near - plain, 0.04 * peak * np.exp(-0.5 * (turn / 30) ** 2), rtol=0, atol=1e-9)


def test_effects_on_the_readout() -> None:
    simulated = simulate(SILENT, seed=6)
    peak = peaks(simulated)
    sample = np.concatenate([table.sample for table in tables(simulated)])
    plain, expansive = difference("gain_nonlinearity", 0.15)
    np.testing.assert_allclose(expansive, plain * (1 + 0.15 * plain / peak), rtol=1e-12, atol=1e-9)
    plain, cut = difference("saturation", 0.6)
    np.testing.assert_allclose(cut, np.clip(plain, -0.6 * peak, 0.6 * peak), rtol=1e-12)
    assert (cut != plain).any()
    plain, drifted = difference("gain_drift", -0.2)
    share = drifted / plain
    np.testing.assert_allclose(share[0], 1.0, rtol=1e-12)
    np.testing.assert_allclose(share[-1], 0.8, rtol=1e-9)
    assert np.all(np.diff(share[:, 0]) < 0)
    plain, crept = difference("creep", 0.1)
    np.testing.assert_allclose(crept, plain * (1 + 0.1 * (1 - np.exp(-0.25 * sample)))[:, None], rtol=1e-12)
    plain, remembering = difference("memory", 0.3)
    np.testing.assert_array_equal(remembering[:3], plain[:3])
    # last sample of the touch before, 4.25 s earlier for the first sample of this one
    np.testing.assert_allclose(
        remembering[3:6] - plain[3:6],
        0.3 * plain[2] * np.exp(-(4.25 + 0.25 * np.arange(3)) / 10)[:, None],
        rtol=0,
        atol=1e-9,
    )
    design = replace(SILENT, edge_step_deg=0.2, samples_per_touch=1, n_elements=64, pitch_deg=2.0)
    plain, wandering = difference("baseline_drift", 0.02, design)
    drift = (wandering - plain) / peaks(simulate(design, seed=6))
    # 64 independent paths of about 4800 s, some 5 correlation times of 2 * 600 s each: the variance is
    # known to √(2/256) = 9 %, the sd to 4.4 %; 4 of those
    assert abs(np.sqrt((drift**2).mean()) / 0.02 - 1) < 0.18
    lag = 100
    correlation = (drift[lag:] * drift[:-lag]).mean() / (drift**2).mean()
    # exp(-425 s/600 s) = 0.49, with the same relative error on numerator and denominator
    assert abs(correlation - np.exp(-lag * 4.25 / 600)) < 0.15


def test_effects_on_the_noise() -> None:
    peak = peaks(simulate(SILENT, seed=6))
    plain, common = difference("common_mode_noise", 0.03)
    error = (common - plain) / peak
    np.testing.assert_allclose(error, error[:, :1] * np.ones(16), rtol=0, atol=1e-12)
    n = len(error)
    assert abs(error[:, 0].std() / 0.03 - 1) < 4 / np.sqrt(2 * n)
    plain, scaled = difference("signal_dependent_noise", 0.05)
    share = scaled / plain - 1
    assert abs(share.std() / 0.05 - 1) < 4 / np.sqrt(2 * share.size)
    plain, wrong = difference("outliers", 0.02)
    hit = np.abs(wrong - plain) > 1e-9
    assert abs(hit.mean() - 0.02) < 4 * np.sqrt(0.02 / hit.size)
    assert np.all(np.abs(wrong - plain) <= peak)


def test_an_effect_leaves_the_other_draws_alone() -> None:
    """Noise, plan and sensor are the same: only the effect differs."""
    noise = signals(simulate(SMALL, seed=8)) - signals(simulate(SILENT, seed=8))
    effects = {"outliers": 0.05, "crosstalk": 0.05, "baseline_drift": 0.05}
    with_effects = signals(simulate(SMALL, effects=effects, seed=8))
    np.testing.assert_allclose(
        with_effects - signals(simulate(SILENT, effects=effects, seed=8)), noise, rtol=0, atol=1e-9
    )
    # each has its own stream: one more effect does not redraw another
    drift = signals(simulate(SILENT, effects={"baseline_drift": 0.05}, seed=8)) - signals(simulate(SILENT, seed=8))
    both = signals(simulate(SILENT, effects={"baseline_drift": 0.05, "common_mode_noise": 0.01}, seed=8))
    common = signals(simulate(SILENT, effects={"common_mode_noise": 0.01}, seed=8))
    np.testing.assert_allclose(both - common, drift, rtol=0, atol=1e-9)


def test_streams_are_independent() -> None:
    plain = simulate(SILENT, seed=8)
    draws = {"noise": signals(simulate(SMALL, seed=8)) - signals(plain)}
    for effect in ("baseline_drift", "common_mode_noise", "signal_dependent_noise"):
        draws[effect] = signals(simulate(SILENT, effects={effect: 0.01}, seed=8)) - signals(plain)
    scaled = [value[:, 0] / np.abs(signals(plain)[:, 0]) ** (name[:6] == "signal") for name, value in draws.items()]
    # only the drift of 10 min has memory; n independent pairs correlate by 1/√n
    scaled[1] = np.diff(scaled[1], append=0.0)
    correlations = np.corrcoef(scaled)[np.triu_indices(4, 1)]
    assert np.abs(correlations).max() < 4 / np.sqrt(len(scaled[0]))
    # a sensor with fewer elements is touched in the same way
    np.testing.assert_array_equal(loads(simulate(replace(SILENT, n_elements=5), seed=8)), loads(plain))


@pytest.mark.parametrize("line", [False, True])
def test_pad_is_the_kernel_of_its_layer(line: bool) -> None:
    design = replace(QUIET_PAD, element_x_mm=(0.0, 6.0, 12.0, 18.0), element_y_mm=None) if line else QUIET_PAD
    simulated = simulate(design, seed=1)
    body, truth = simulated.dataset.sensor.body, simulated.truth
    assert isinstance(body, Pad)
    assert body.dimensions == (1 if line else 2)
    for name, table in zip(("calibration", "touches"), tables(simulated), strict=True):
        assert (table.y_mm is None) == line
        square = (table.x_mm[:, None] - np.array(truth["x"])) ** 2  # type: ignore[index]
        if not line:
            square += (table.y_mm[:, None] - np.array(truth["y"])) ** 2  # type: ignore[index]
            np.testing.assert_array_equal(np.array(truth[name]["y"])[table.touch], table.y_mm)
        kernel = layer_kernel_2d(np.sqrt(square), 6.0, 0.48, 1.0, quantity="mean_stress")
        expected = table.load[:, None] * np.array(truth["gain"]) * kernel
        np.testing.assert_allclose(table.readings, expected, rtol=1e-12)
    above = layer_kernel_2d(0.0, 6.0, 0.48, 1.0, quantity="mean_stress")
    np.testing.assert_allclose(truth["response"], np.array(truth["gain"]) * above, rtol=1e-12)
    noisy = simulate(replace(design, noise_percent_peak=1.0, force_noise_sd=0.01), seed=1)
    noise = signals(noisy) - signals(simulated)
    assert abs(noise.std() / 10.0 - 1) < 4 / np.sqrt(2 * noise.size)  # 1 % of 1000


@pytest.mark.parametrize("format", ["csv", "parquet"])
@pytest.mark.parametrize("design", [SMALL, QUIET_PAD])
def test_written_and_read_back(tmp_path: Path, format: str, design: FingerDesign | PadDesign) -> None:
    simulated = simulate(design, effects={"outliers": 0.01}, seed=9)
    save_simulated(simulated, tmp_path / "set", format)  # type: ignore[arg-type]
    back = load_dataset(tmp_path / "set")
    assert back.sensor == simulated.dataset.sensor
    assert back.calibration is not None
    assert same_touches(back.calibration, tables(simulated)[0])
    assert same_touches(back.touches, tables(simulated)[1])
    truth = json.loads((tmp_path / "set" / "truth.json").read_text(encoding="utf-8"))
    assert truth["seed"] == 9
    assert truth["effects"] == {"outliers": 0.01}
    assert truth["gain"] == simulated.truth["gain"]
    save_simulated(simulated, tmp_path / "blind", truth=False)
    assert not (tmp_path / "blind" / "truth.json").exists()


def test_marked_as_simulated() -> None:
    for simulated in (embedded_dataset(), simulate(QUIET_PAD, seed=3)):
        sensor = simulated.dataset.sensor
        assert "simulated" in sensor.name
        assert "simulated" in sensor.reading_quantity
        seed = simulated.truth["seed"]
        assert sensor.source["note"] == f"simulated by bayestouch, seed {seed}; not a measurement"


def test_embedded_finger_is_small() -> None:
    calibration, touches = tables(embedded_dataset())
    assert calibration.n_touches == 61 + 31
    assert touches.n_touches == 6 * 21
    assert calibration.n_rows + touches.n_rows == 3 * (92 + 126)
    assert set(touches.indenter_radius_mm) == {0.0, 1.59, 3.9, 7.55, 12.3, np.inf}
    assert calibration.readings.shape[1] == 16


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"effects": {"gremlins": 1.0}}, "unknown effect 'gremlins'; the simulator knows prober_ecc.*outliers"),
        ({"effects": {"outliers": 1.5}}, "effect outliers: expected a number from 0 to 1, got 1.5"),
        ({"effects": {"crosstalk": np.nan}}, "effect crosstalk: expected a number"),
        ({"effects": {"crosstalk": np.inf}}, "effect crosstalk: expected a number"),
        ({"effects": {"blunt_edge": -1.0}}, "effect blunt_edge: expected a number from 0 to inf"),
        ({"effects": {"aperture": 1.0}, "design": QUIET_PAD}, "effect aperture is one of fingers"),
        ({"seed": -1}, "seed: expected a whole number"),
    ],
)
def test_bad_arguments(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        simulate(**({"design": SILENT, "seed": 0} | arguments))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("design", "change", "name"),
    [
        (FingerDesign, {"n_elements": 0}, "n_elements"),
        (FingerDesign, {"samples_per_touch": 0}, "samples_per_touch"),
        (FingerDesign, {"noise_percent_peak": -1.0}, "noise_percent_peak"),
        (FingerDesign, {"load_range": (240.0, 160.0)}, "load_range"),
        (FingerDesign, {"load_range": (0.0, 160.0)}, "lowest_load"),
        (FingerDesign, {"edge_step_deg": 0.0}, "edge_step_deg"),
        (FingerDesign, {"touch_radii_mm": ()}, "touch_radii_mm"),
        (FingerDesign, {"touch_radii_mm": (-1.0,)}, "touch_radii_mm"),
        (FingerDesign, {"shear_modulus_MPa": np.nan}, "shear_modulus_MPa"),
        (PadDesign, {"thickness_mm": -2.0}, "thickness_mm"),
        (PadDesign, {"n_touches": 0}, "n_touches"),
        (PadDesign, {"load_range": (3.0, 1.0)}, "load_range"),
    ],
)
def test_impossible_designs(design: type, change: dict[str, object], name: str) -> None:
    with pytest.raises(InputError, match=name):
        design(**change)
