"""Expected errors along a finger: of touches like those that were read."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from known_fingers import sensor

from bayestouch.contact import composite_radius
from bayestouch.reliability import KnownFinger, TouchPlaces, expected_finger
from bayestouch.reporting.finger import places
from bayestouch.simulation import FingerDesign

TIPS = np.array([0.0, 3.0, np.inf])
NAN = np.nan


@pytest.fixture(scope="module")
def known() -> KnownFinger:
    """A finger whose calibration is exact."""
    return replace(
        expected_finger(FingerDesign(samples_per_touch=4, edge_step_deg=6.0, flat_step_deg=12.0), seed=2), errors=None
    )


def about(
    known: KnownFinger, load: list[float], monkeypatch: pytest.MonkeyPatch, *, once: bool = False
) -> dict[str, Any]:
    """Touches of four samples with these loads, each read once or with each sample."""
    monkeypatch.setattr(KnownFinger, "of", lambda _calibration: known)
    rows = SimpleNamespace(
        radius_mm=TIPS,
        counts=np.full((3, 1), 4),
        samples=np.full(3, 4.0),
        load=np.array(load),
        load_reads=np.full(3, 1.0 if once else 4.0),
        usual_load_reads=1.0 if once else None,
    )
    evidence: Any = SimpleNamespace(calibration=None, posteriors=SimpleNamespace(rows=rows), sensor=sensor())
    return places.about_places(evidence)


@pytest.mark.parametrize(
    ("load", "used"), [([200.0] * 3, True), ([200.0, 200.0, NAN], True), ([200.0, NAN, NAN], False), ([NAN] * 3, False)]
)
def test_the_load_is_known_if_most_touches_have_one(
    known: KnownFinger, load: list[float], used: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Noise of R by the inverse of the information, to which a measured load adds its own."""
    found = about(known, load, monkeypatch)
    assert found["use_load"] is used
    angle = np.array(found["by_location"]["angle_deg"])[::30]
    radius = np.asarray(composite_radius(TIPS, known.outer_radius_mm))
    slopes = known.touch_jacobian(TouchPlaces.grid(radius, np.radians(angle), known.typical_load))
    information = slopes.swapaxes(1, 2) @ (slopes / (known.noise.tactile_sd[:, None] ** 2 / 4))
    information[:, 2, 2] += used / (known.noise.force_sd**2 / 4)
    variance = np.linalg.inv(information)[:, 0, 0].reshape(len(TIPS), -1)
    np.testing.assert_allclose(found["by_location"]["R_noise_mm"][::30], np.sqrt(variance.mean(axis=0)), rtol=1e-4)


def test_the_noise_of_a_load_that_is_read_once_stays(known: KnownFinger, monkeypatch: pytest.MonkeyPatch) -> None:
    """The calibration is exact and fits: without the load nothing stays, however many samples are averaged.

    The part that stays is the error of R by one unit of the force sensor, times its noise.
    """
    assert about(known, [200.0] * 3, monkeypatch)["shared_percent"] == 0
    found = about(known, [200.0] * 3, monkeypatch, once=True)
    angle = np.array(found["by_location"]["angle_deg"])
    radius = np.asarray(composite_radius(TIPS, known.outer_radius_mm))
    slopes = known.touch_jacobian(TouchPlaces.grid(radius, np.radians(angle), known.typical_load))
    information = slopes.swapaxes(1, 2) @ (slopes / (known.noise.tactile_sd[:, None] ** 2 / 4))
    information[:, 2, 2] += known.noise.force_sd**-2
    inverse = np.linalg.inv(information)
    of_load = (inverse[:, 0, 2] / known.noise.force_sd) ** 2
    assert found["shared_percent"] == pytest.approx(100 * of_load.mean() / inverse[:, 0, 0].mean(), rel=1e-4)
