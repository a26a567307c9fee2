"""Which touches may be at a distant location: the rule written out."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.chain.finger import FingerChain
from bayestouch.chain.noise import Noise
from bayestouch.data.arrays import turned
from bayestouch.finger.reading import elsewhere
from bayestouch.finger.reading.draws import FingerSampler
from bayestouch.finger.reading.elsewhere import across_the_element, distant_places, fits_as_well
from bayestouch.finger.reading.live import FingerLive
from bayestouch.finger.reading.live_elsewhere import ELSEWHERE
from bayestouch.finger.reading.misfit import FingerMisfit
from bayestouch.finger.reading.modes import find_modes, matches, other_places
from bayestouch.finger.reading.reader import FingerPosterior, IndenterPriors, TouchReadings, noise_whitener
from bayestouch.finger.reading.reading_table import ReadingTable
from bayestouch.finger.reading.touch_reader import FingerTouchReader
from bayestouch.priors.parameters import Uniform
from bayestouch.reading.draws import DrawPlan, draw
from bayestouch.reading.live import AT_AN_END, HeldTouch, LiveTouch
from bayestouch.reading.options import Options


def test_settings() -> None:
    assert (pytest.approx(np.radians(6)), 8.0) == (elsewhere.APART, elsewhere.AS_WELL)


def test_a_place_that_fits_about_as_well() -> None:
    """Half the sum of squares of readings and load may be larger by less than eight."""
    # Residual of the one reading: w of the place.
    posterior: Any = SimpleNamespace(
        residual=lambda x, blocks: x[..., :1],
        touches=SimpleNamespace(load=np.array([10.0, 10.0, np.nan, np.nan]), load_sd=np.full(4, 2.0)),
    )
    mode = np.tile([1.0, 0.0, 12.0], (4, 1))
    place = np.array([[np.sqrt(17.9), 1.0, 10.0], [np.sqrt(18.1), 1.0, 10.0], [np.sqrt(16.9), 1.0, 50.0], [4.2, 1, 0]])
    np.testing.assert_array_equal(fits_as_well(posterior, mode, place), [True, False, True, False])


def test_the_best_of_the_distant_places() -> None:
    """Of a finger with two elements and a touch between them: none within 6° of the mode, and the best of the others.

    The readings are those of a touch at -20°, which is distant, so that it is the one that fits best.
    """
    one = np.ones(2)
    chain = FingerChain(9.4, 12.7, 5.0 * one, 9.9 * one, np.radians([-20.0, 20.0]), 0 * one, 0.46, 0.15, 300.0)
    radius = 12.7 * 0.35
    # 150 N/m is the load of the templates, half the largest one.
    readings = chain.predict(np.full(2, radius), np.radians([-20.0, 15.0]), np.full(2, 150.0))
    touches = TouchReadings(readings, np.ones((2, 2), dtype=np.int64), np.full(2, 150.0), one)
    posterior = FingerPosterior(chain, touches, IndenterPriors.of(chain, 100.0), np.full((2, 2), 0.01))
    modes = np.array([[0.0, np.radians(5), 150.0], [0.0, np.radians(15), 150.0]])
    found = distant_places(posterior, modes, list(matches(posterior)))
    np.testing.assert_allclose(found[0], [np.log(0.35 / 0.65), np.radians(-20), 150.0], rtol=1e-6)
    assert abs(np.degrees(found[1, 1]) - 15) > 6


def test_both_ends_of_a_full_ring_are_one_place() -> None:
    angles, one = np.radians(np.arange(-180, 180, 30.0)), np.ones(12)
    chain = FingerChain(9.4, 12.7, 5.0 * one, 9.9 * one, angles, 0 * one, 0.46, 0.15, 300.0)
    priors = IndenterPriors.of(chain, 100.0)
    low, high = priors.location.support
    assert high - low == pytest.approx(2 * np.pi)
    readings = chain.predict(6.0, low + 0.01, 100.0)[None]
    touches = TouchReadings(readings, np.ones((1, 12), dtype=np.int64), np.array([100.0]), np.ones(1))
    posterior = FingerPosterior(chain, touches, priors, np.full((1, 12), 0.01))
    found = distant_places(posterior, np.array([[0.0, low + 0.01, 100.0]]), list(matches(posterior)))
    assert abs(turned(np.degrees(found[0, 1] - low - 0.01))) > 6


# R (mm) and location (degree) of touches beside an element of three; a force sensor reads them, with an sd of 1 N/m.
BESIDE_AN_ELEMENT = np.array([(11.5, 2.5), (4.0, 4.0), (7.0, 4.0), (9.5, 4.0), (11.5, 4.0)])
LOAD, NOISE_SHARE = 150.0, 0.005


def finger_of(m: int, spacing: float) -> FingerChain:
    one = np.ones(m)
    angles = np.radians((np.arange(m) - (m - 1) / 2) * spacing)
    return FingerChain(9.4, 12.7, 5 * one, 9.9 * one, angles, 0 * one, 0.46, 0.15, 300.0)


def read_on(chain: FingerChain) -> tuple[FingerSampler, TouchReadings]:
    """Touches without errors, and what draws them; the noise is 0.5 % of the peak reading."""
    m = chain.n_elements
    peak = chain.predict(0.5, chain.angle[m // 2], 200.0).max()
    noise = Noise(np.full(m, NOISE_SHARE * peak), np.zeros(m), 0.0, 1.0)
    radius, angle = BESIDE_AN_ELEMENT.T
    load, one = np.full(len(radius), LOAD), np.ones(len(radius))
    readings = chain.predict(radius, np.radians(angle), load)
    priors = IndenterPriors.of(chain, 200.0)
    sampler = FingerSampler(chain, priors, ReadingTable.of(chain, *priors.location.support), noise, None)
    return sampler, TouchReadings(readings, np.ones(readings.shape, dtype=np.int64), load, one)


def locations_by_quadrature(
    sampler: FingerSampler, touches: TouchReadings, points: int = 800
) -> tuple[np.ndarray, np.ndarray]:
    """Locations (a,), degree, and the probability of each, (t, a): sums over R, and over P in closed form.

    Over the sd of the load, readings are linear in it.
    """
    low, high = sampler.priors.location.support
    radius = 12.7 * (np.arange(100) + 0.5) / 100
    location = low + (high - low) * (np.arange(points) + 0.5) / points
    r, a = np.meshgrid(radius, location, indexing="ij")
    one = np.ones(r.shape)
    clean = sampler.chain.predict(r, a, LOAD * one)
    slope = (sampler.chain.predict(r, a, (LOAD + 1) * one) - clean) / sampler.noise.tactile_sd
    curvature = (slope**2).sum(axis=-1) + 1.0
    out = []
    for readings in touches.readings:
        z = (clean - readings) / sampler.noise.tactile_sd
        log = -0.5 * (z**2).sum(axis=-1) + 0.5 * (slope * z).sum(axis=-1) ** 2 / curvature - 0.5 * np.log(curvature)
        mass = np.exp(log - log.max()).sum(axis=0)
        out.append(mass / mass.sum())
    return np.degrees(location), np.array(out)


@pytest.mark.parametrize("method", ["importance", "emcee"])
def test_touches_at_either_side_of_an_element_agree_with_quadrature(method: str) -> None:
    """Three elements hardly tell one side from the other: the other side has up to half of the probability."""
    sampler, touches = read_on(finger_of(3, 20.0))
    location, mass = locations_by_quadrature(sampler, touches)
    mean = mass @ location
    sd = np.sqrt(mass @ location**2 - mean**2)
    other = mass[:, location < 0].sum(axis=1)
    assert other.max() > 0.45
    assert np.sort(other)[-4] > 0.2
    drawn = draw(sampler, touches, DrawPlan(4096, seed=1, method=method), workers=1)
    draws = drawn["theta_c"].reshape(-1, touches.n_touches)
    np.testing.assert_array_equal(drawn["grade"], 1)
    np.testing.assert_allclose((draws < 0).mean(axis=0), other, rtol=0, atol=0.04)
    np.testing.assert_allclose(draws.mean(axis=0), mean, rtol=0, atol=0.08 * sd.max())
    np.testing.assert_allclose(draws.std(axis=0), sd, rtol=0.05)


def test_other_places_are_across_the_element_on_a_finger_with_few_elements_only() -> None:
    for chain, few in ((finger_of(3, 20.0), True), (finger_of(16, 8.8), False)):
        sampler, touches = read_on(chain)
        whitener = noise_whitener(sampler.noise, touches)
        posterior = FingerPosterior(chain, touches, sampler.priors, whitener, sampler.table)
        # Of 16 elements two are 4.4° beside the middle.
        mode = find_modes(posterior)
        places = other_places(posterior, mode, list(matches(posterior)))
        if few:
            assert (places[:, 0, 1] * mode[:, 1] < 0).all()
            np.testing.assert_allclose(np.degrees(np.abs(places[1:, 0, 1])), 4.0, rtol=0, atol=2.5)
        else:
            assert np.isnan(places).all()


def test_a_better_mode_at_another_place_is_found() -> None:
    """Touches without errors 6° to the inside of an element, whose two best templates are on its outside.

    A search from these two ended at -26.7°, 26.7° and -25.1°, where the sum of squares is above 60.
    """
    sampler, touches = read_on(finger_of(3, 20.0))
    radius, angle = np.array([2.168, 2.841, 2.890]), np.radians([-13.394, 13.392, -14.547])
    readings = sampler.chain.predict(radius, angle, np.full(3, LOAD))
    touches = TouchReadings(readings, touches.counts[:3], touches.load[:3], touches.load_sd[:3])
    whitener = 2 * noise_whitener(sampler.noise, touches)
    posterior = FingerPosterior(sampler.chain, touches, sampler.priors, whitener, sampler.table)
    mode = find_modes(posterior)
    np.testing.assert_allclose(mode[:, 1], angle, rtol=0, atol=np.radians(0.1))
    np.testing.assert_allclose(posterior.radius(mode[:, 0]), radius, rtol=0, atol=0.2)


# Locations (degree) near the end of the row of a full ring; it ends at 180°, halfway between two elements.
NEAR_THE_END = np.array([179.0, 179.9, 180.0, -179.9, -178.5])


def on_a_ring(angle_deg: np.ndarray) -> tuple[FingerSampler, TouchReadings]:
    """Touches without errors on a full ring of 24 elements, and what draws them."""
    sampler, _ = read_on(chain := finger_of(24, 15.0))
    load = np.full(len(angle_deg), LOAD)
    readings = chain.predict(np.full(len(angle_deg), 6.0), np.radians(angle_deg), load)
    one = np.ones(len(angle_deg))
    return sampler, TouchReadings(readings, np.ones(readings.shape, dtype=np.int64), load, one)


def test_touches_at_the_end_of_a_full_ring_are_read_like_those_at_its_middle() -> None:
    """Draws of a touch were on both sides of the end: mean -2.8° at 180°, an interval of 360°, and grade 0."""
    (sampler, end), (_, middle) = on_a_ring(NEAR_THE_END), on_a_ring(NEAR_THE_END - 180)
    there, here = (draw(sampler, each, DrawPlan(1024, seed=1), workers=1) for each in (end, middle))
    np.testing.assert_array_equal(there["grade"], 1)
    angle, centre = there["theta_c"].mean(axis=(0, 1)), here["theta_c"].mean(axis=(0, 1))
    assert (np.abs(angle) <= 180).all()
    np.testing.assert_allclose(np.abs(angle - centre), 180, rtol=0, atol=0.03)
    spread = here["theta_c"].std(axis=(0, 1))
    assert spread.max() < 0.3
    np.testing.assert_allclose(there["theta_c"].std(axis=(0, 1)), spread, rtol=0.2)
    assert np.ptp(there["theta_c"], axis=(0, 1)).max() < 3
    assert not sampler.priors.cut_off(np.radians(there["theta_c"]), there["P"]).any()


def test_the_live_reader_has_no_end_of_the_prior_on_a_full_ring() -> None:
    (sampler, end), (_, middle) = on_a_ring(NEAR_THE_END), on_a_ring(NEAR_THE_END - 180)
    live = live_reader(sampler)
    for there, here in zip(read_live(live, end), read_live(live, middle), strict=True):
        assert AT_AN_END not in there.flags and abs(there.mean[1]) <= 180
        turn = there.mean[1] - here.mean[1]
        np.testing.assert_allclose(abs(turn), 180, rtol=0, atol=1e-3)
        np.testing.assert_allclose(there.sd, here.sd, rtol=1e-3)
        np.testing.assert_allclose(there.quantiles[1] - turn, here.quantiles[1], rtol=0, atol=1e-3)


def test_the_check_of_the_sensor_counts_touches_at_the_end_of_a_full_ring() -> None:
    sampler, touches = on_a_ring(NEAR_THE_END)
    jacobian = np.zeros((len(NEAR_THE_END), 24, 24))
    fits = FingerMisfit(
        sampler.chain,
        sampler.table,
        sampler.priors,
        sampler.noise,
        lambda *_: jacobian,
        touches,
        LOAD,
        np.arange(len(NEAR_THE_END)),
    )(np.zeros(25, dtype=bool))
    assert (fits.information.max(axis=1) > 0).all()
    assert np.abs(fits.score / np.sqrt(np.maximum(fits.information, 1e-300))).max() < 0.1


def live_reader(sampler: FingerSampler) -> FingerLive:
    """Reader of single touches that takes the calibration as exact."""
    assert sampler.reading_covariance is None
    options, noise = Options(plug_in=True), sampler.noise
    reader = FingerTouchReader(options, sampler, lambda *_: np.zeros(0), 200.0, noise, effects_chain=None)
    return FingerLive.with_templates(reader, None)


def read_live(live: FingerLive, touches: TouchReadings) -> list[LiveTouch]:
    one = HeldTouch.none(live.n_elements)
    return [live.read(one.after(*each))[0] for each in zip(touches.readings, touches.load.tolist(), strict=True)]


def test_the_live_reader_flags_touches_at_either_side_of_an_element() -> None:
    """Also where both sides come together at one radius: one mode, but two locations for a sharper indenter.

    Before, 9 of the 32 touches whose summary is wrong had this flag.
    """
    rng = np.random.default_rng(5)
    chain, t = finger_of(3, 20.0), 60
    sampler, _ = read_on(chain)
    radius, angle, load = rng.uniform(0.5, 12.0, t), np.radians(rng.uniform(-25, 25, t)), np.full(t, LOAD)
    readings = chain.predict(radius, angle, load)
    touches = TouchReadings(readings, np.ones(readings.shape, dtype=np.int64), load, np.ones(t))
    live = read_live(live_reader(sampler), touches)
    location, mass = locations_by_quadrature(sampler, touches, points=3200)
    mean = mass @ location
    sd = np.sqrt(mass @ location**2 - mean**2)
    off = np.abs(np.array([each.mean[1] for each in live]) - mean) / sd
    narrow = np.abs(np.array([each.sd[1] for each in live]) / sd - 1)
    flagged = np.array([ELSEWHERE in each.flags for each in live])
    # The reader promises 0.1 sd and 5 %. The steps of the quadrature are 0.1 mm and 0.025 degree.
    wrong, right = (off > 0.2) | (narrow > 0.15), (off < 0.05) & (narrow < 0.02)
    assert wrong.sum() > 20 and right.sum() > 10
    assert flagged[wrong].all()
    assert not flagged[right].any()


def test_the_live_reader_flags_a_touch_where_a_ring_closes_as_any_other() -> None:
    """As the same touches at the opposite place: twelve equal elements, so that their readings are only seen.

    Before, 29 of the 300 were flagged that fit at one location only: the other end of the prior counted as distant.
    """
    rng, t, m = np.random.default_rng(3), 300, 12
    one, location = np.ones(m), np.radians(rng.uniform(-203, -187, t))
    chain = FingerChain(9.4, 12.7, 5 * one, 9.9 * one, np.radians(np.arange(-180, 180, 30.0)), 0 * one, 0.46, 0.15, 300)
    noise = Noise(NOISE_SHARE * chain.predict(0.5, 0.0, 200.0).max() * one, 0 * one, 0.0, 1.0)
    radius, load = rng.uniform(0.5, 11, t), np.full(t, LOAD)
    readings = chain.predict(radius, location, load) + noise.tactile_sd * rng.standard_normal((t, m))
    ends = np.radians([-195.0, 165.0])
    priors = replace(IndenterPriors.of(chain, 200.0), location=Uniform(*ends))
    sampler = FingerSampler(chain, priors, ReadingTable.of(chain, *ends), noise, None)
    read = []
    for seen in (readings, np.roll(readings, m // 2, axis=1)):
        touches = TouchReadings(seen, np.ones(readings.shape, dtype=np.int64), load, np.ones(t))
        read.append(read_live(live_reader(sampler), touches))
    closing, beside = ([ELSEWHERE in each.flags for each in live] for live in read)
    assert closing == beside and 0 < sum(closing) < t
    assert not any(AT_AN_END in each.flags for each in read[0])
    (mean, sd), (true, wide) = (np.array([(each.mean[1], each.sd[1]) for each in live]).T for live in read)
    off = np.abs((mean - true) % 360 - 180) / wide
    # Templates are a fraction of a degree apart, and not at the same fractions at both places.
    assert off[~np.array(closing)].max() < 0.1
    np.testing.assert_allclose(sd[~np.array(closing)], wide[~np.array(closing)], rtol=0.05)


def test_a_place_across_the_element() -> None:
    """As far from the element as the mode, half a degree at least, if it fits; else across from the other place."""
    sampler, _ = read_on(finger_of(3, 20.0))
    mode = np.array([[0.0, 0.8, LOAD], [0.0, 20.1, LOAD], [0.0, -0.2, LOAD], [0.0, 2.0, LOAD], [0.0, 7.0, LOAD]])
    mode[:, 1] = np.radians(mode[:, 1])
    readings = sampler.chain.predict(np.full(5, 6.35), mode[:, 1], np.full(5, LOAD))
    touches = TouchReadings(readings, np.ones(readings.shape, dtype=np.int64), np.full(5, LOAD), np.ones(5))
    # A tenth of the noise for the fourth one, which then does not fit at the other side.
    whitener = noise_whitener(sampler.noise, touches) * np.array([1.0, 1, 1, 10, 1])[:, None]
    posterior = FingerPosterior(sampler.chain, touches, sampler.priors, whitener, sampler.table)
    places = np.full((5, 3, 3), np.nan)
    places[2, 0] = [-1.0, np.radians(3.0), LOAD]
    found = across_the_element(posterior, mode, places)
    assert found.shape == (5, 4, 3)
    np.testing.assert_allclose(np.degrees(found[[0, 1, 2, 2], [0, 0, 0, 1], 1]), [-0.8, 19.5, 3.0, -3.0], atol=1e-4)
    np.testing.assert_array_equal(found[2, 0], places[2, 0])
    assert np.isfinite(found[..., 0]).sum() == 4


def test_sides_of_an_element_that_nearly_come_together_agree_with_quadrature() -> None:
    """Sharp indenters near an element: the sides are too near for the templates.

    One of them had up to 13 % too little, and the sd was 16 % too small, with grade 1.
    """
    rng = np.random.default_rng(1)
    chain, t = finger_of(3, 20.0), 40
    sampler, _ = read_on(chain)
    radius, angle, load = rng.uniform(0.3, 2.5, t), np.radians(rng.uniform(-1.2, 1.2, t)), np.full(t, LOAD)
    readings = chain.predict(radius, angle, load) + sampler.noise.tactile_sd * rng.standard_normal((t, 3))
    touches = TouchReadings(readings, np.ones(readings.shape, dtype=np.int64), load, np.ones(t))
    location, mass = locations_by_quadrature(sampler, touches, points=1600)
    mean = mass @ location
    sd = np.sqrt(mass @ location**2 - mean**2)
    drawn = draw(sampler, touches, DrawPlan(4096, seed=1, method="importance"), workers=1)
    draws = drawn["theta_c"].reshape(-1, t)
    np.testing.assert_array_equal(drawn["grade"], 1)
    np.testing.assert_allclose((draws < 0).mean(axis=0), mass[:, location < 0].sum(axis=1), rtol=0, atol=0.05)
    np.testing.assert_allclose(draws.std(axis=0), sd, rtol=0.1)
