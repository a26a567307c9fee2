"""Causes of Table 4's noise rows: propagation against fits, moments against quadrature, evidence against a sum."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
import study_modules  # noqa: F401  # it makes nicolson_fearing known
from nicolson_fearing import noise_mixtures, stopped_simplex
from nicolson_fearing.many_fits import fit_many_touches
from nicolson_fearing.noise_causes import (
    LOAD,
    MODULI_MPA,
    PLACES_DEG,
    R_B,
    READERS,
    SAMPLES,
    TIPS_MM,
    Propagated,
    cut_moments,
    noise_levels,
    reader_model,
)
from nicolson_fearing.noise_mixtures import Mixture
from nicolson_fearing.paper_run import paper_run
from scipy.integrate import quad
from scipy.stats import norm

from bayestouch.contact import composite_radius
from bayestouch.paper.published import TABLE_1

MODULUS = float(MODULI_MPA[3])  # a knot: nothing is interpolated


@lru_cache(maxsize=2)
def propagated(reader: str) -> Propagated:
    return Propagated.of(READERS[reader], fingers=1, levels=8)


def test_levels_are_those_of_table_1() -> None:
    rng = np.random.default_rng(0)
    drawn = np.array([noise_levels(rng) for _ in range(50)])
    row = TABLE_1[3]
    assert drawn.min(axis=1) == pytest.approx(row.minimum)
    assert drawn.max(axis=1) == pytest.approx(row.maximum)
    assert drawn.mean(axis=1) == pytest.approx(row.average)
    assert len(set(drawn.argmax(axis=1))) > 8  # any element may be the noisy one


def test_moments_beyond_limits_are_integrals() -> None:
    sd, low, high = 0.7, -0.3, 0.9

    def mean_of(power: int) -> float:
        def beyond(e: float) -> float:
            return (e - min(max(e, low), high)) ** power * float(norm.pdf(e, scale=sd))

        return sum(quad(beyond, *ends)[0] for ends in ((-8, low), (high, 8)))

    mean, square, probability = cut_moments(np.array(sd), np.array(low), np.array(high))
    assert mean == pytest.approx(mean_of(1), abs=1e-8)
    assert square == pytest.approx(mean_of(2), abs=1e-8)
    assert probability == pytest.approx(mean_of(0), abs=1e-8)


def scatter_of_fits(reader: str, relative_noise: float, *, share: float, gain: float) -> np.ndarray:
    """What fits of noisy strains scatter by about the fit to their mean, in units of the noise: (3,)."""
    model = reader_model(READERS[reader], MODULUS)
    calibrated = paper_run(0).finger
    finger = calibrated.reader("model", model or "layer", MODULUS)
    radius, angle = (
        g.ravel() for g in np.meshgrid(propagated(reader).radius_mm[3], np.radians(PLACES_DEG), indexing="ij")
    )
    silent = finger.predict(radius, angle, np.full(len(radius), LOAD)) / finger.gain
    rng = np.random.default_rng(4)
    shape = (SAMPLES, *silent.shape)
    level = propagated(reader).levels[0] / 100 * LOAD * relative_noise
    noise = level * np.sqrt(1 - share) * rng.standard_normal(shape)
    noise += level * np.sqrt(share) * rng.standard_normal((*shape[:2], 1))
    jitter = 1 + gain * relative_noise / 100 * rng.standard_normal((*shape[:2], 1))
    strain = silent * jitter + noise
    single = fit_many_touches(finger, strain.reshape(-1, shape[-1]) * finger.gain)
    mean = fit_many_touches(finger, strain.mean(axis=0) * finger.gain)
    names = ("angle_deg", "load", "composite_radius_mm")
    off = [getattr(single, name).reshape(SAMPLES, -1) - getattr(mean, name) for name in names]
    return np.array([np.std(each) for each in off]) / relative_noise


@pytest.mark.parametrize("share, gain", [(0.0, 0.0), (0.6, 3.0)])
def test_propagation_agrees_with_fits(share: float, gain: float) -> None:
    """A fifth of the noise, where first order is exact: 1200 samples tell an sd to 2 % where errors are independent."""
    rows = propagated("squeezed, all elements").rows(
        MODULUS, {"independent": 1 - share, "common_readings": share, "gain": gain**2}
    )
    found = scatter_of_fits("squeezed, all elements", 0.2, share=share, gain=gain)
    assert rows[0, 0] == pytest.approx(found, rel=0.07)


def test_limits_hold_back_as_they_do_in_fits() -> None:
    """Printed noise, R held between edge and flat: most of the flat's scatter is cut."""
    free = propagated("layer, all elements").rows(MODULUS, {"independent": 1.0})[0, 0]
    held = propagated("layer, R held, all elements").rows(MODULUS, {"independent": 1.0})[0, 0]
    found = scatter_of_fits("layer, R held, all elements", 1.0, share=0.0, gain=0.0)
    assert held == pytest.approx(found, rel=0.07)
    assert held[2] < 0.93 * free[2]  # what would fail if nothing were held


def test_a_jitter_of_the_load_moves_the_load_alone() -> None:
    row = propagated("layer, all elements").rows(MODULUS, {"load": 9.0})[0, 0]
    assert row == pytest.approx([0.0, 0.03 * LOAD * np.sqrt(0.95), 0.0], abs=1e-9)
    # a gain turns into load; PR/μ is as it was, so that R goes down by as much
    gain = propagated("layer, all elements").rows(MODULUS, {"gain": 9.0})[0, 0]
    radius = np.sqrt(np.mean(composite_radius(TIPS_MM, R_B) ** 2))
    assert gain[2] == pytest.approx(0.03 * radius * np.sqrt(0.95), rel=1e-6)


def test_a_planted_mixture_is_found_and_its_evidence_is_the_integral(monkeypatch: pytest.MonkeyPatch) -> None:
    made = propagated("squeezed, all elements")
    mixture = Mixture(("ridge",), made)
    planted = {"ridge": 1.5, "modulus": 0.06}
    rows = mixture.rows(planted)
    assert rows is not None
    numbers = np.exp(np.log(rows).mean(axis=0))
    monkeypatch.setattr(noise_mixtures, "printed", lambda: (numbers, np.full((2, 3), [0.005, 0.05, 0.005])))
    found = mixture.inferred()
    for name, true in planted.items():
        low, high = np.quantile(found.of(name), [0.01, 0.99])
        assert low < true < high, name
    assert mixture.misfit(planted) < 1e-6
    # fine enough for the logistic and the normal: a sum over a grid is the integral
    ridge, modulus = np.linspace(-6, 6, 61), np.linspace(-4, 4, 41)
    total = np.array([[mixture.log_posterior(np.array([r, m])) for m in modulus] for r in ridge])
    cell = (ridge[1] - ridge[0]) * (modulus[1] - modulus[0])
    assert found.log_evidence == pytest.approx(np.logaddexp.reduce(total, axis=None) + np.log(cell), abs=0.15)


def test_more_than_all_noise_is_never_common() -> None:
    mixture = Mixture(("share", "strain"), propagated("squeezed, all elements"))
    assert mixture.rows({"share": 0.5, "strain": 0.9, "modulus": 0.06}) is None
    assert mixture.rows({"share": 0.0, "strain": 0.9, "modulus": 0.06}) is not None


def test_a_stopped_simplex_scatters_all_three_alike() -> None:
    found = stopped_simplex.added_scatter((0.1, 0.01), samples=1)
    assert np.all(found[0] > 2 * found[1])
    # 60 touches tell each to a tenth; along the ridge of R and P alone θ_c would have a tenth of the others
    assert found[0].min() > 0.6 * found[0].max()
