"""Simulated data sets: the truth is what the readings hold, and each effect does what it says."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from same_touches import same_touches

from bayestouch.body.layer import layer_kernel_2d
from bayestouch.chain.finger import FingerChain
from bayestouch.contact import composite_radius
from bayestouch.data.dataset import load_dataset
from bayestouch.data.sensor import Finger, Pad
from bayestouch.data.touches import Touches
from bayestouch.errors import InputError
from bayestouch.simulation import (
    FingerDesign,
    PadDesign,
    SimulatedDataSet,
    embedded_dataset,
    save_simulated,
    simulate,
)

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
    # In the order in which they are drawn; an error that all elements share is drawn once a sample.
    draws["common_mode_noise"] = draws["common_mode_noise"][:, 0]
    draws["signal_dependent_noise"] /= np.abs(signals(plain))
    # only the drift of 10 min has memory; n independent pairs correlate by 1/√n
    draws["baseline_drift"] = np.diff(draws["baseline_drift"], axis=0)
    n = min(value.size for value in draws.values())
    correlations = np.corrcoef([value.ravel()[:n] for value in draws.values()])[np.triu_indices(4, 1)]
    assert np.abs(correlations).max() < 4 / np.sqrt(n)
    # a sensor with fewer elements is touched in the same way
    np.testing.assert_array_equal(loads(simulate(replace(SILENT, n_elements=5), seed=8)), loads(plain))


@pytest.mark.parametrize("line", [False, True])
def test_pad_is_the_kernel_of_its_layer(line: bool) -> None:
    design = replace(QUIET_PAD, element_x_mm=(0.0, 6.0, 12.0, 18.0), element_y_mm=None) if line else QUIET_PAD
    simulated = simulate(design, seed=1)
    body, truth = simulated.dataset.sensor.body, simulated.truth
    assert isinstance(body, Pad)
    assert body.dimensions == (1 if line else 2)
    above = layer_kernel_2d(0.0, 6.0, 0.48, 1.0, quantity="mean_stress")
    for name, table in zip(("calibration", "touches"), tables(simulated), strict=True):
        assert (table.y_mm is None) == line
        square = (table.x_mm[:, None] - np.array(truth["x"])) ** 2  # type: ignore[index]
        if not line:
            square += (table.y_mm[:, None] - np.array(truth["y"])) ** 2  # type: ignore[index]
            np.testing.assert_array_equal(np.array(truth[name]["y"])[table.touch], table.y_mm)
        kernel = layer_kernel_2d(np.sqrt(square), 6.0, 0.48, 1.0, quantity="mean_stress")
        expected = table.load[:, None] * np.array(truth["gain"]) * kernel / above
        np.testing.assert_allclose(table.readings, expected, rtol=1e-12)
    assert truth["response"] == truth["gain"]  # reading per N right above, as the gain of a pad's calibration
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
    assert truth["effect_values"] == {"outliers.probability": 0.01, "outliers.size": 0.58}
    assert truth["gain"] == simulated.truth["gain"]
    save_simulated(simulated, tmp_path / "blind")
    save_simulated(simulated, tmp_path / "blind", truth=False)
    assert not (tmp_path / "blind" / "truth.json").exists()


def test_numbers_of_numpy_are_written(tmp_path: Path) -> None:
    design = replace(QUIET_PAD, element_x_mm=np.array(QUIET_PAD.element_x_mm))
    save_simulated(simulate(design, effects={"crosstalk": np.float32(0.04)}, seed=np.int64(3)), tmp_path)
    truth = json.loads((tmp_path / "truth.json").read_text(encoding="utf-8"))
    assert truth["seed"] == 3 and truth["effects"]["crosstalk"] == pytest.approx(0.04)
    assert truth["design"]["element_x_mm"] == list(QUIET_PAD.element_x_mm)


def test_a_folder_named_truth_stops_before_anything_is_written(tmp_path: Path) -> None:
    (tmp_path / "truth.json").mkdir()
    with pytest.raises(InputError, match=r"truth\.json: expected no folder of this name"):
        save_simulated(simulate(FingerDesign(n_elements=4), seed=3), tmp_path, truth=False)
    assert [each.name for each in tmp_path.iterdir()] == ["truth.json"]


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
        ({"seed": -1}, "seed: expected a whole number"),
        ({"seed": 3.0}, "seed: expected a whole number"),
        ({"design": "pad"}, r"^expected a design, got 'pad'; make one: bayestouch.FingerDesign\(\) or "),
        ({"design": PadDesign}, r"^expected a design, got type; make one: "),
        ({"effects": {"creep": "x"}}, "effect creep: expected a number"),
        ({"effects": ["creep"]}, r"effects: expected sizes by name, such as \{'creep': 0.05\}, got \['creep'\]"),
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
        (FingerDesign, {"load_range": (0.0, 160.0)}, "load_range"),
        (FingerDesign, {"load_range": (100.0,)}, "load_range"),
        (FingerDesign, {"n_elements": np.nan}, "n_elements"),
        (FingerDesign, {"samples_per_touch": 2.0}, "samples_per_touch"),
        (FingerDesign, {"core_radius_mm": 10.0}, "core_radius_mm < sensing_radius_mm"),
        (FingerDesign, {"edge_step_deg": 0.0}, "edge_step_deg"),
        (FingerDesign, {"touch_radii_mm": ()}, "touch_radii_mm"),
        (FingerDesign, {"touch_radii_mm": (-1.0,)}, "touch_radii_mm"),
        (FingerDesign, {"shear_modulus_MPa": np.nan}, "shear_modulus_MPa"),
        (FingerDesign, {"poisson_ratio": np.nan}, "poisson_ratio: expected a ratio from 0 to 0.5, got nan"),
        (FingerDesign, {"contact": "x"}, "unknown contact model 'x'; known are hertz, approximate frictionless, layer"),
        (FingerDesign, {"load_range": 3}, "^load_range: expected a list of numbers, got 3$"),
        (FingerDesign, {"touch_radii_mm": 3.0}, "^touch_radii_mm: expected a list of numbers, got 3.0$"),
        (FingerDesign, {"touch_radii_mm": ("a",)}, r"^touch_radii_mm: expected a list of numbers, got \('a',\)$"),
        (FingerDesign, {"pitch_deg": "a"}, "^pitch_deg: expected a number, got 'a'$"),
        (FingerDesign, {"gain_spread": None}, "^gain_spread: expected a number, got None$"),
        (FingerDesign, {"outer_radius_mm": "a"}, "^outer_radius_mm: expected a number, got 'a'$"),
        (FingerDesign, {"outer_radius_mm": np.inf}, "^outer_radius_mm: expected a finite number above zero, got inf$"),
        (FingerDesign, {"poisson_ratio": "a"}, "^poisson_ratio: expected a number, got 'a'$"),
        (PadDesign, {"element_x_mm": 3.0}, "^element_x_mm: expected a list of numbers, got 3.0$"),
        (PadDesign, {"element_y_mm": "ab"}, "^element_y_mm: expected a list of numbers, got 'ab'$"),
        (PadDesign, {"poisson_ratio": 0.6}, "poisson_ratio: expected a ratio from 0 to 0.5, got 0.6"),
        (PadDesign, {"thickness_mm": -2.0}, "thickness_mm"),
        (PadDesign, {"n_touches": 0}, "n_touches"),
        (PadDesign, {"load_range": (3.0, 1.0)}, "load_range"),
        (PadDesign, {"element_y_mm": (0.0, 1.0)}, "element_y_mm: expected a finite place for each of 8 elements"),
        (PadDesign, {"element_x_mm": (0.0, np.nan), "element_y_mm": None}, "element_x_mm"),
    ],
)
def test_impossible_designs(design: type, change: dict[str, object], name: str) -> None:
    with pytest.raises(InputError, match=name):
        design(**change)
