"""The paper to first order, and unknowns inferred from it: against searched fits and written-out densities."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import study_modules  # noqa: F401  # it makes nicolson_fearing known
from nicolson_fearing.explained_fit import KEYS, OF_TIPS, Emulator, Explanation, printed, read_slopes
from nicolson_fearing.finger_errors import AT, EDGES_DEG
from nicolson_fearing.flats_and_edges import flat_errors
from nicolson_fearing.linear_finger import LinearFinger
from nicolson_fearing.linear_touches import LOAD, MODES, PER_KAPPA, R_B, TouchFits, best_ellipse
from nicolson_fearing.many_fits import fit_many_touches
from nicolson_fearing.paper_finger import LOCATIONS_DEG
from nicolson_fearing.published_fits import TIP_SHARE
from nicolson_fearing.unknowns import TAIL_FROM_DEG, Unknowns, tail_window
from scipy.special import expit
from scipy.stats import multivariate_normal

from bayestouch.contact.hertz import elliptic_spectrum

MODULUS = 0.1


class EllipseReader:
    """A finger that reads touches by Hertz's ellipse, written out: strains in % of the peak."""

    outer_radius_mm, largest_load = R_B, 3 * LOAD

    def __init__(self, finger: LinearFinger) -> None:
        self.weights, self.angle = finger.weights, np.radians(finger.angle_deg)
        self.gain = np.ones(len(self.angle))

    def predict(self, radius_mm: np.ndarray, angle: np.ndarray, load: np.ndarray) -> np.ndarray:
        width = np.sqrt(PER_KAPPA * load / 1000 * np.maximum(radius_mm, 0) / MODULUS)
        spectrum = elliptic_spectrum(width / R_B, MODES)
        shape = np.cos((angle[:, None] - self.angle)[..., None] * MODES) * self.weights * spectrum[:, None]
        return np.asarray(100 * load[:, None] / LOAD * shape.sum(axis=-1))


def test_small_errors_go_through_fits_as_through_searches() -> None:
    finger = LinearFinger.of(3)
    reader = EllipseReader(finger)
    radius = np.array([1.3, 4.0, 7.0])
    width = np.sqrt(PER_KAPPA * LOAD / 1000 * radius / MODULUS)
    turns = [t[AT] for t in finger.turns]
    fits = TouchFits.of(finger.weights, turns, width, np.ones(3))
    rng = np.random.default_rng(1)
    errors = 0.05 * rng.standard_normal((2, 3, len(LOCATIONS_DEG), len(finger.levels)))
    found = fits.fit(errors, np.zeros(errors.shape[1:3]))
    tip, place = (g.ravel() for g in np.meshgrid(radius, np.radians(LOCATIONS_DEG), indexing="ij"))
    silent = reader.predict(tip, place, np.full(len(tip), LOAD))
    searched = fit_many_touches(reader, silent + errors[0].reshape(silent.shape))  # type: ignore[arg-type]
    error_of_r = found.radius_mm(MODULUS, 0.0)[0].ravel() - tip
    assert searched.composite_radius_mm - tip == pytest.approx(error_of_r, abs=0.1 * error_of_r.std())
    assert searched.load - LOAD == pytest.approx(found.load_error[0].ravel(), abs=0.1 * found.load_error.std())
    off = searched.angle_deg - np.degrees(place)
    assert off == pytest.approx(found.angle_error_deg[0].ravel(), abs=0.1 * off.std())


def test_no_contact_is_narrower_than_an_edge() -> None:
    finger = LinearFinger.of(0)
    fits = TouchFits.of(finger.weights, [t[AT] for t in finger.turns], np.zeros(1), np.ones(1))
    errors = np.random.default_rng(0).standard_normal((2, 1, len(LOCATIONS_DEG), len(finger.levels)))
    found = fits.fit(errors, np.zeros((1, len(LOCATIONS_DEG))))
    assert found.width_mm.min() == 0 < found.width_mm.max()
    # held there, P and θ_c are those of least squares without the width
    held = np.argwhere(found.width_mm[0, 0] == 0)[0, 0]
    turn = np.radians(LOCATIONS_DEG[held] - finger.angle_deg)[:, None] * MODES
    by_angle = -100 * np.pi / 180 * (np.sin(turn) * finger.weights * MODES).sum(axis=1)
    by_load = 100 / LOAD * (np.cos(turn) * finger.weights).sum(axis=1)
    expected, *_ = np.linalg.lstsq(np.stack([by_angle, by_load], axis=1), errors[0, 0, held], rcond=None)
    assert [found.angle_error_deg[0, 0, held], found.load_error[0, 0, held]] == pytest.approx(expected, rel=1e-3)


def test_calibrations_take_up_what_they_have_parameters_for() -> None:
    finger = LinearFinger.of(1)
    cos, _ = finger.turns
    deeper = 0.3 * 100 * (cos * finger._slopes[1][1]).sum(axis=-1)
    errors, absorbed = finger._table_1(deeper)
    assert errors.max() < 1e-6
    assert absorbed[0] == pytest.approx(30 * finger._slopes[1][1], abs=1e-4)
    smooth = 2 * np.cos(5 * np.radians(EDGES_DEG[:, None] - finger.angle_deg))
    residual, _ = finger._table_2(smooth)
    assert np.abs(residual[20:-20]).max() < 0.05  # of 2
    assert np.all(tail_window([0, TAIL_FROM_DEG, -TAIL_FROM_DEG]) == 0)


def test_shorter_tips_have_narrower_contacts_and_edges_none() -> None:
    kappa = np.array([0.0, 5.0, 20.0])
    long, short = (best_ellipse(kappa, 0.46, length)[0] for length in (np.inf, 4.0))
    assert long[0] == short[0] == 0
    assert np.all(short[1:] < long[1:]) and np.all(long[1:] < np.sqrt(PER_KAPPA * kappa[1:]))


def test_flats_of_the_assumed_width_leave_nothing_over() -> None:
    hertz, layer = flat_errors(Unknowns(modulus_MPa=0.054), 2.0)
    assert layer == pytest.approx(2.0, abs=1e-6)
    assert hertz > 3.5  # the full simulation has 3.6 to 4.3


def test_the_posterior_is_the_density_written_out() -> None:
    fixed = Unknowns(length_mm=4.0)
    explanation = Explanation("two", ("modulus_MPa", "tip_sd_mm"), fixed, ("table_3",))
    shares = np.random.default_rng(0).uniform(0.2, 0.6, (40, 2))
    emulator = Emulator.of(explanation, shares, explanation.simulated(shares))
    x = np.array([-0.4, 0.3])
    share = expit(x)
    unknowns = explanation.unknowns(share)
    middle = explanation.unknowns(shares.mean(axis=0))
    slopes = read_slopes(middle, np.array([_radius(key) for key in KEYS if key.endswith("hertz_model")]))
    tips = np.concatenate([np.tile(slopes[0], 2), np.tile(slopes[1], 2)])
    tip = np.tile(np.arange(9), 4)
    shared = TIP_SHARE * np.outer(tips, tips) * (tip[:, None] == tip) + (1 - TIP_SHARE) * np.eye(36)
    covariance = emulator.covariance[np.ix_(OF_TIPS, OF_TIPS)] + unknowns.tip_sd_mm**2 * shared
    mean = emulator.mean(share[None])[0][OF_TIPS]
    expected = multivariate_normal(mean, covariance).logpdf(printed()[0][OF_TIPS])
    prior = np.log(share * (1 - share)).sum()
    assert emulator.log_posterior(x[None])[0] == pytest.approx(expected + prior)


def test_the_emulator_follows_what_fingers_print() -> None:
    explanation = Explanation("one", ("modulus_MPa",), Unknowns(length_mm=4.0))
    shares = np.random.default_rng(1).uniform(0.3, 0.7, (80, 1))
    emulator = Emulator.of(explanation, shares, explanation.simulated(shares))
    at = np.full((60, 1), 0.5)
    found = explanation.simulated(at)
    sd = np.sqrt(emulator.covariance.diagonal())
    assert np.abs((found.mean(axis=0) - emulator.mean(at[:1])[0]) / sd).max() < 4 / np.sqrt(60) + 0.3
    assert np.median(found.std(axis=0) / sd) == pytest.approx(1, abs=0.25)


def test_unknowns_are_read_off_their_shares() -> None:
    explanation = Explanation("two", ("tail", "drift"), Unknowns())
    assert explanation.unknowns(np.array([0.0, 1.0])) == replace(Unknowns(), tail=0.0, drift=5.0)


def _radius(key: str) -> float:
    from bayestouch.contact import composite_radius

    return float(composite_radius(float(key.split("[")[1].split("]")[0]), R_B))
