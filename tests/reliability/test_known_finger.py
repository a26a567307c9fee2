"""A calibrated finger before any touch: the same prediction and covariance as where touches are read."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import bayestouch
from bayestouch.chain.finger import FingerChain
from bayestouch.finger.reading.touch_reader import FingerTouchReader
from bayestouch.reading.options import Options
from bayestouch.reliability import (
    KnownFinger,
    RadiusScale,
    TouchPlaces,
    averaging_effort,
    distinguished,
    expected_finger,
    sweet_spots,
    threshold_radii,
    trial,
)
from bayestouch.reliability.known_finger import ElasticErrors
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.finger.numbers import _prediction
from bayestouch.reporting.peak_table import element_peak

DESIGN = bayestouch.FingerDesign(
    n_elements=5,
    calibration_span_deg=30.0,
    edge_step_deg=2.0,
    flat_step_deg=6.0,
    touch_step_deg=10.0,
    samples_per_touch=4,
)
TOUCHES = TouchPlaces.grid(np.array([0.0, 3.0, 12.7]), np.radians([-8.0, 1.0]), 200.0)


@cache
def dataset() -> bayestouch.DataSet:
    return bayestouch.simulate(DESIGN, effects={"soft_spot": 0.1}, seed=3).dataset


@cache
def calibrated(discrepancy: str) -> bayestouch.Calibration:
    return bayestouch.calibrate(dataset(), discrepancy=discrepancy, draws=100)


@pytest.mark.parametrize("discrepancy", ["place", "touch"])
def test_a_finger_is_known_as_it_is_read(discrepancy: str) -> None:
    one = calibrated(discrepancy)
    known, reader = KnownFinger.of(one), FingerTouchReader.from_calibration(one, Options())
    touch = TOUCHES.radius_mm, TOUCHES.angle, TOUCHES.load
    np.testing.assert_array_equal(known.predict(TOUCHES), reader.sampler.chain.predict(*touch))
    assert known.errors is not None
    covariance = known.errors.covariance(TOUCHES)
    np.testing.assert_array_equal(covariance, reader.covariance(*touch))
    drawn = known.errors.draw(TOUCHES, 4000, np.random.default_rng(0))
    scale = np.sqrt(np.einsum("tii->ti", covariance))
    found = np.einsum("nti,ntj->tij", drawn, drawn) / len(drawn)
    # Correlations from 4000 draws have errors of 1/sqrt(4000) = 0.016; five of those.
    assert np.abs((found - covariance) / (scale[:, :, None] * scale[:, None])).max() < 0.08


def test_functions_of_place_are_part_of_what_a_report_predicts() -> None:
    one = calibrated("place")
    read = bayestouch.infer(dataset().touches, one, draws=64)
    found = _prediction(Evidence(dataset(), one, read, None, False, {}, seed=0, draws=64, plug_in=False))
    rows = read.rows
    chain = FingerTouchReader.from_calibration(one, Options()).sampler.chain
    predicted = chain.predict(read.reference["R"], np.radians(rows.location["theta_c"]), rows.load)
    expected = 100 * np.sqrt(((rows.observed - predicted) ** 2).mean(axis=0)) / element_peak(one)
    assert found is not None and found["touches"] == len(rows.touch)
    assert found["percent_peak"]["average"] == pytest.approx(expected.mean(), rel=1e-9)


def test_a_calibration_with_effects_has_no_maps() -> None:
    stated = bayestouch.effects.StatedModel("finger", "layer", (("crosstalk", {}),))
    with_effects = bayestouch.calibrate(dataset(), model=stated, draws=100)
    with pytest.raises(bayestouch.InputError, match=r"calibration with effects.*next_touches"):
        KnownFinger.of(with_effects)


def test_the_covariance_of_few_draws_is_drawn_from_too() -> None:
    """It is singular: all draws are in the space of the few that it was computed from."""
    known = expected_finger(DESIGN)
    errors = known.errors
    assert isinstance(errors, ElasticErrors)
    few = (
        np.random.default_rng(1).standard_normal((6, len(errors.parameters))) @ np.linalg.cholesky(errors.parameters).T
    )
    singular = replace(errors, parameters=np.cov(few.T))
    with pytest.raises(np.linalg.LinAlgError):
        np.linalg.cholesky(singular.parameters)
    drawn = singular.draw(TOUCHES, 4000, np.random.default_rng(0))
    covariance = singular.covariance(TOUCHES)
    found = np.einsum("nti,ntj->tij", drawn, drawn) / len(drawn)
    scale = np.sqrt(np.einsum("tii->ti", covariance))
    assert np.abs((found - covariance) / (scale[:, :, None] * scale[:, None])).max() < 0.08


def test_too_few_readings_are_refused() -> None:
    tips, places = [0.0, 3.9], [0.0, 2.0]
    for elements, use_load, enough in ((1, True, False), (2, False, False), (2, True, True), (3, False, True)):
        known = expected_finger(replace(DESIGN, n_elements=elements))
        if enough:
            assert np.isfinite(sweet_spots(known, tips, places, use_load=use_load).sd("R")).all()
        else:
            with pytest.raises(bayestouch.InputError, match=f"has {elements + use_load} readings"):
                sweet_spots(known, tips, places, use_load=use_load)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"samples": 0}, "samples: expected 1 or more"),
        ({"load": 0.0}, "load: expected above zero"),
        ({"load": np.nan}, "load: expected above zero"),
    ],
)
def test_impossible_touches_are_refused(options: dict[str, float], words: str) -> None:
    known = expected_finger(DESIGN)
    with pytest.raises(bayestouch.InputError, match=words):
        sweet_spots(known, [3.9], [0.0], **options)  # type: ignore[arg-type]
    with pytest.raises(bayestouch.InputError, match="one number at least"):
        averaging_effort(known, [0.0], [])


def test_a_load_beyond_the_contact_table_is_refused() -> None:
    known = expected_finger(bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0))
    most = f"load: expected above zero, at most {known.largest_load:g}, in N/m, got 2000"
    with pytest.raises(bayestouch.InputError, match=most):
        sweet_spots(known, [0.0, 3.9], [0.0], load=2000.0)


@pytest.mark.parametrize(
    ("tips", "places", "words"),
    [
        ([], [0.0], "one indenter at least"),
        ([0.0], [], "finite locations, and one"),
        ([0.0], [0.0, np.nan], "finite locations, and one"),
        ([0.0], [np.inf], "finite locations, and one"),
    ],
)
def test_maps_of_no_touches_are_refused(tips: list[float], places: list[float], words: str) -> None:
    known = expected_finger(DESIGN)
    with pytest.raises(bayestouch.InputError, match=words):
        sweet_spots(known, tips, places)
    with pytest.raises(bayestouch.InputError, match=words):
        trial(known, tips, places, touches=2)
    if tips:
        for asked in (threshold_radii, averaging_effort):
            with pytest.raises(bayestouch.InputError, match=words):
                asked(known, places)
    with pytest.raises(bayestouch.InputError, match=words):
        distinguished(known, tips, places)


def test_an_estimate_that_there_is_not_is_refused() -> None:
    known = expected_finger(bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0))
    with pytest.raises(bayestouch.InputError, match="unknown estimate 'r'; known are R, theta_c, P"):
        averaging_effort(known, [0.0], (1, 2), name="r")


def test_a_load_that_is_stated_once_is_one_reading_of_the_force_sensor() -> None:
    """The maps of a touch of 4 samples have the error of one reading, or of four with a load for each sample."""
    one = calibrated("touch")
    rows = replace(one.rows, load_reads=np.ones(len(one.rows.touch)))
    each, once = KnownFinger.of(one), KnownFinger.of(replace(one, rows=rows))
    assert each.load_sd(4, use_load=True) == pytest.approx(one.noise.force_sd / 2)
    assert once.load_sd(4, use_load=True) == pytest.approx(one.noise.force_sd)
    # P is read to a precision that the elements and the force sensor add up to.
    apart = sweet_spots(once, [3.0], [1.0], samples=4, use_load=False).sd("P")[0, 0]
    expected = (apart**-2 + one.noise.force_sd**-2) ** -0.5
    assert sweet_spots(once, [3.0], [1.0], samples=4).sd("P")[0, 0] == pytest.approx(expected)


@pytest.mark.parametrize("use_load", [True, False])
def test_nothing_is_read_from_an_element_without_readings(use_load: bool) -> None:
    data, dead = dataset(), 3

    def without(table: bayestouch.Touches) -> bayestouch.Touches:
        readings = table.readings.copy()
        readings[:, dead] = np.nan
        return table.with_(readings=readings)

    assert data.calibration is not None
    data = replace(data, calibration=without(data.calibration), touches=without(data.touches))
    known = KnownFinger.of(bayestouch.calibrate(data, discrepancy="touch", draws=100))
    chain, errors, m = known.chain, known.errors, known.n_elements
    assert isinstance(chain, FingerChain)
    assert isinstance(errors, ElasticErrors)
    # The same finger without that element.
    kept = np.flatnonzero(np.arange(m) != dead)
    own = {name: getattr(chain, name)[kept] for name in ("response", "sensing_radius_mm", "angle", "offset")}
    fewer = chain.with_(**own)
    rows = np.concatenate([kept, m + kept, 2 * m + kept, [3 * m, 3 * m + 1]])
    noise = replace(
        known.noise, tactile_sd=known.noise.tactile_sd[kept], discrepancy_sd=known.noise.discrepancy_sd[kept]
    )
    other = replace(
        known,
        chain=fewer,
        noise=noise,
        errors=ElasticErrors(fewer, errors.parameters[np.ix_(rows, rows)]),
        responds=known.read_elements[kept],
    )
    angle = np.array([-8.0, 4.0, 9.0])
    spots, expected = (sweet_spots(each, (0.0, 3.9, np.inf), angle, use_load=use_load) for each in (known, other))
    for name in ("R", "theta_c", "P"):
        np.testing.assert_allclose(spots.noise_sd[name], expected.noise_sd[name], rtol=1e-5)
        np.testing.assert_allclose(spots.bias_rms[name], expected.bias_rms[name], rtol=1e-5)
        np.testing.assert_allclose(
            spots.bias_by_element[name][..., dead], 0.0, atol=1e-5 * spots.bias_rms[name].max() ** 2
        )
    thresholds = (RadiusScale.of(each, np.radians(angle), use_load=use_load).threshold() for each in (known, other))
    np.testing.assert_allclose(*thresholds, rtol=1e-5)


def test_elements_without_readings_do_not_count_as_readings_of_a_touch() -> None:
    known = replace(expected_finger(DESIGN), responds=np.array([True, True, False, False, False]))
    with pytest.raises(bayestouch.InputError, match="a touch has 2 readings"):
        sweet_spots(known, (0.0,), [0.0], use_load=False)
