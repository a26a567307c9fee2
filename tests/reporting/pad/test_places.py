"""Expected errors over a pad: which places count as inside the array."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from report_cases import PLANE, small

import bayestouch
from bayestouch.pad.reading.reader import PadReader
from bayestouch.reliability import pad_spots
from bayestouch.reporting.pad import places


@dataclass(frozen=True)
class Reader:
    load_measured: bool = True
    load_reads: float | None = None
    map: Any = field(default_factory=lambda: SimpleNamespace(low=[0.0], high=[120.0]))


def test_places_right_above_the_outermost_elements_are_inside(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a line of 0 … 120 mm with elements at 30 and 90 mm and an error of x/10 the best and worst are at these.

    The root mean square over 30, 31 … 90 mm is written out.
    """
    reader = Reader()
    rows = SimpleNamespace(load=np.array([5.0, np.nan]), load_reads=np.array([1.0, 20.0]), usual_load_reads=1.0)
    evidence: Any = SimpleNamespace(calibration=None, posteriors=SimpleNamespace(rows=rows))

    def spots(of: Reader, where: np.ndarray, *, reads: float, use_load: bool) -> SimpleNamespace:
        assert reads in (4, np.inf) and use_load and of.load_reads == 1
        sd = where / 10 * (1.0 if reads == 4 else 0.8)
        return SimpleNamespace(sd=sd[:, 0], bias_rms=0.5 * sd, of_none=0.25 * sd**2)

    monkeypatch.setattr(PadReader, "from_calibration", lambda _calibration: reader)
    monkeypatch.setattr("bayestouch.reliability.pad_spots", spots)
    monkeypatch.setattr(places, "element_places", lambda _evidence: np.array([[30.0], [90.0]]))
    monkeypatch.setattr(places, "typical_samples", lambda _evidence: 20)
    monkeypatch.setattr(places, "typical_reads", lambda _evidence: 4)
    found = places.about_places(evidence)
    assert (found["best"]["x_mm"], found["worst"]["x_mm"]) == pytest.approx((30.0, 90.0))
    assert found["within"] == "the array of elements" and found["samples"] == 20 and found["use_load"]
    assert found["inside_rms_mm"] == pytest.approx(np.sqrt(np.mean(np.arange(30, 91) ** 2)) / 10)
    # a standard deviation of 0.8 of the error is left of infinitely many samples
    assert found["shared_percent"] == pytest.approx(64.0)
    # of which a quarter is of the calibration, a quarter of no reading, and the other half of the model
    assert (found["calibration_percent"], found["model_percent"]) == pytest.approx((16.0, 32.0))
    columns = {name: np.array(values, dtype=float) for name, values in found["by_location"].items()}
    np.testing.assert_allclose(columns["shared_mm"], 0.08 * columns["x_mm"], rtol=1e-4)  # saved with five digits
    np.testing.assert_allclose(columns["noise_mm"], 0.06 * columns["x_mm"], rtol=1e-4)
    # between two steps there is no place that is inside of the array
    monkeypatch.setattr(places, "element_places", lambda _evidence: np.array([[30.5]]))
    found = places.about_places(evidence)
    assert found["within"] == "the calibrated region"
    assert (found["best"]["x_mm"], found["worst"]["x_mm"]) == pytest.approx((0.0, 120.0))


def test_errors_that_no_averaging_lowers_are_no_noise() -> None:
    """A pad whose noise is all discrepancy (a calibration without repeats): all of the variance stays.

    With noise of single readings beside it, what stays is the error without this noise.
    """
    dataset = small(PLANE).dataset
    assert dataset.calibration is not None
    once = replace(dataset, calibration=dataset.calibration.select(dataset.calibration.sample == 0))
    calibration = bayestouch.calibrate(once, kernel="gaussian", e_map="model", draws=8)
    # Averaging lowers the error of a measured load, too.
    posteriors = bayestouch.infer(dataset.touches, calibration, draws=64, use_load=False)
    evidence: Any = SimpleNamespace(sensor=dataset.sensor, calibration=calibration, posteriors=posteriors)
    found = places.about_places(evidence)
    assert found["shared_percent"] == pytest.approx(100.0) and max(found["by_location"]["noise_mm"]) < 1e-5
    noise = replace(calibration.noise, tactile_sd=3 * calibration.noise.discrepancy_sd)
    evidence.calibration = replace(calibration, noise=noise)
    noisy = places.about_places(evidence)
    where = np.stack([noisy["by_location"][name] for name in ("x_mm", "y_mm")], axis=1)
    without = replace(calibration, noise=replace(noise, tactile_sd=np.zeros(3)))
    now, later = (
        pad_spots(PadReader.from_calibration(each), where, reads=2, use_load=False).sd
        for each in (evidence.calibration, without)
    )
    inside = ((where >= noisy["elements_mm"].min(axis=0)) & (where <= noisy["elements_mm"].max(axis=0))).all(axis=1)
    stays = 100 * np.mean(later[inside] ** 2) / np.mean(now[inside] ** 2)
    assert 5 < stays < 95 and noisy["shared_percent"] == pytest.approx(stays)


@pytest.mark.parametrize(
    ("measured", "load", "used"),
    [(True, [5.0, np.nan, np.nan], False), (True, [np.nan, 5.0], True), (False, [5.0], False)],
)
def test_the_load_is_read_if_most_touches_have_one(
    measured: bool, load: list[float], used: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    reader = Reader(measured)
    n = len(load)
    rows = SimpleNamespace(
        load=np.array(load), counts=np.full((n, 1), 3), samples=np.full(n, 3.0), load_reads=np.full(n, 3.0)
    )
    rows.usual_load_reads = None
    evidence: Any = SimpleNamespace(calibration=None, posteriors=SimpleNamespace(rows=rows))

    def spots(of: Reader, where: np.ndarray, *, reads: float, use_load: bool) -> SimpleNamespace:
        assert use_load is used
        # The reads of the force sensor are as many as those of the elements, without end too.
        assert (reads, of.load_reads) in ((3, 3 if np.isfinite(load).any() else 1), (np.inf, None))
        return SimpleNamespace(sd=np.ones(len(where)), bias_rms=np.ones(where.shape), of_none=np.zeros(where.shape))

    monkeypatch.setattr(PadReader, "from_calibration", lambda _calibration: reader)
    monkeypatch.setattr("bayestouch.reliability.pad_spots", spots)
    monkeypatch.setattr(places, "element_places", lambda _evidence: np.array([[30.0], [90.0]]))
    assert places.about_places(evidence)["use_load"] is used
