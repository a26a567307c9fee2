"""A surface out of round: the process of its weights, and touches on it as an independent simulator has them."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from independent import shape
from independent.dataset import Simulated, write
from independent.finger import SMALL, build, record
from independent.sizes import applied

import bayestouch
from bayestouch.data.dataset import load_dataset
from bayestouch.effects.listing import FINGER, PAD
from bayestouch.effects.surface import LENGTH_DEG, SPREAD, SurfaceProfile

EFFECT = SurfaceProfile.suited(FINGER)
DESIGN = replace(SMALL, noise_sd=8.0, samples=8)


def test_only_a_finger_that_is_touched_at_places_has_one() -> None:
    assert SurfaceProfile.suited(PAD) is None
    assert SurfaceProfile.suited(replace(FINGER, place_range=((0.0, 0.0),))) is None
    narrow = SurfaceProfile.suited(replace(FINGER, place_range=((-10.0, 10.0),)))
    assert isinstance(narrow, SurfaceProfile)
    assert narrow.knots_deg == pytest.approx((-10.0, -10 / 3, 10 / 3, 10.0))


def test_the_process_has_a_matern_correlation_without_a_mean_and_a_first_wave() -> None:
    """Between knots too; the first waves that a closed curve has not hold `power` of the process with all waves."""
    assert isinstance(EFFECT, SurfaceProfile)
    place = np.linspace(-85, 85, 18)
    sd = np.array([float(each.prior.quantile(0.841)) for each in EFFECT.parameters])
    columns = EFFECT.departures(place) * sd
    lag = np.radians(place[:, None] - place)
    waves = np.arange(0, 3000)
    power = (1 + (waves * np.radians(LENGTH_DEG)) ** 2 / 5) ** -3.0
    power[0] /= 2
    scaled = np.sqrt(5) * np.abs(lag) / np.radians(LENGTH_DEG)
    whole = power.sum() * (1 + scaled + scaled**2 / 3) * np.exp(-scaled)
    expected = (whole - power[0] - power[1] * np.cos(lag)) / power[2:].sum() * (SPREAD / FINGER.radii_mm[1]) ** 2
    # Halfway between knots the spline of a process with two derivatives has up to 9 % less of the variance.
    np.testing.assert_allclose(columns @ columns.T, expected, atol=0.1 * expected[0, 0])
    at = EFFECT.departures(np.array(EFFECT.knots_deg)[3:18]) * sd
    np.testing.assert_allclose((at**2).sum(axis=1), expected[0, 0], rtol=0.01)


@pytest.mark.slow
def test_a_diagnosis_names_it_and_reads_right_with_it() -> None:
    """Bells in the radius, which nobody declared: the curvature is found, and touches lose the bias."""
    effect, seed = shape.EFFECTS[0], 3
    streams = [np.random.default_rng([seed, stream]) for stream in range(3)]
    recording = applied(record(DESIGN, build(DESIGN, streams[0]), streams[1]), [(effect, 0.012)], seed)
    noise = DESIGN.noise_sd * streams[2].standard_normal(recording.signal.shape)
    made = Simulated(DESIGN, recording, recording.signal + noise, recording.read_load, {})
    with tempfile.TemporaryDirectory() as folder:
        found = bayestouch.diagnose(load_dataset(write(made, Path(folder))), draws=200)
        found.save(Path(folder) / "out")
        assert any("surface-profile" in path.name for path in (Path(folder) / "out").rglob("*.png"))
        again = bayestouch.load(Path(folder) / "out" / "calibration_after.nc")
    assert found.effects == ("surface_profile",)
    assert found.verdict == "explained"
    press, span = recording.press, np.abs(recording.press.angle) < 30
    listed = SurfaceProfile.suited(replace(FINGER, place_range=((-90.0, 90.0),)))
    assert isinstance(listed, SurfaceProfile)
    weights = [float(again.mode[each.name]) for each in listed.public_parameters()]
    left = listed.departures(press.angle[span]) @ weights - np.asarray(press.hump)[span]
    # Over the elements the profile is known to 0.0015 /mm: one part in eight.
    assert left.std() < 0.25 * np.asarray(press.hump)[span].std()
