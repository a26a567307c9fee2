"""The posterior of functions of place against the normal distribution of parameters and weights that is written out."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from place_cases import MAP, SURFACE, missed_finger, missed_fit, touches

from bayestouch.chain.neighbours import calibration_jacobian
from bayestouch.errors import InputError
from bayestouch.finger.density import FingerDensity
from bayestouch.finger.fit import FingerFit
from bayestouch.finger.local_series import LARGEST_ERROR, LocalSeries
from bayestouch.finger.place import fit as fits
from bayestouch.finger.place import functions
from bayestouch.finger.place.chain import FingerWithPlaces
from bayestouch.finger.place.fit import fit_of_places, fit_with_places
from bayestouch.finger.place.functions import PlaceFunctions, Process
from bayestouch.finger.place.posterior import PlacePosterior
from bayestouch.finger.reading.places import CovarianceWithPlaces

CASES = {MAP: PlaceFunctions(functions.MAP, Process(9.0, 0.02)), SURFACE: PlaceFunctions(surface=Process(14.0, 0.15))}


def own_blocks(columns: np.ndarray) -> np.ndarray:
    """Columns (t, m, k) of each element's own weights as (m k, t, m)."""
    t, m, k = columns.shape
    out = np.zeros((m, k, t, m))
    for e in range(m):
        out[e, :, :, e] = columns[:, e].T
    return out.reshape(m * k, t, m)


def written_out(fit: FingerFit, places: PlacePosterior, wanted: PlaceFunctions) -> np.ndarray:
    """Covariance (t, m, m) of readings of new touches: information of parameters and all weights, inverted."""
    likelihood, chain = fit.likelihood, places.reference(fit.chain)
    known, at = likelihood.known, likelihood.layout
    spread = likelihood.standard_errors(fit.vector)
    _, slope = likelihood.predicted(fit.laplace.mode)
    assert likelihood.at_places is not None

    def rows(elastic: np.ndarray, touch: tuple[np.ndarray, ...], surface: np.ndarray) -> np.ndarray:
        own = own_blocks(wanted.own_columns(chain, *touch))
        return np.concatenate([elastic, own, np.moveaxis(surface, -1, 0)])

    data = rows(
        likelihood.derivatives(fit.laplace.mode),
        (known.radius_mm, known.angle, known.load),
        likelihood.at_places.surface,
    )
    information = np.diag(
        np.concatenate([likelihood.prior.spread[: at.n_chain] ** -2.0, np.ones(len(data) - at.n_chain)])
    )
    for t in range(len(known.load)):
        push = slope[t] * spread.load_sd[t]
        precision = np.linalg.inv(np.diag(spread.sd[t] ** 2) + np.outer(push, push))
        information += data[:, t] @ precision @ data[:, t].T
    covariance = np.linalg.inv(information)
    finger = FingerWithPlaces(fit.chain, places)
    radius, angle, load = touches(6)
    new = (finger.effective_radius(radius, angle), angle, load)
    own = calibration_jacobian(fit.chain, *new)
    own[0] *= fit.chain.response
    m = fit.chain.n_elements
    elastic = np.zeros((at.n_chain, len(load), m))
    for i in range(3):
        elastic[i * m + np.arange(m), :, np.arange(m)] = own[i].T
    elastic[[at.sigma, at.log_mu]] = own[3:]
    every = rows(elastic, new, wanted.surface_columns(fit.chain, *new, places.log_curvature(angle)))
    return np.einsum("ati,ab,btj->tij", every, covariance, every, optimize=True)


@pytest.mark.parametrize("missed", list(CASES), ids=["map", "surface"])
def test_what_is_left_uncertain_of_readings(missed: object) -> None:
    fit, places = fit_with_places(missed_fit(missed), CASES[missed])  # type: ignore[index]
    # The fit ends when its noise has settled to 2 %: the parameters' covariance at the very noise that it ended with.
    settled = replace(fit, laplace=fit.likelihood.maximum(fit.likelihood.standard_errors(fit.vector)))
    places = places.with_model_covariance(settled.covariance)
    found = CovarianceWithPlaces(FingerWithPlaces(fit.chain, places))(*touches(6))
    wanted = written_out(fit, places, CASES[missed])  # type: ignore[index]
    sd = np.sqrt(np.einsum("tii->ti", wanted))
    # The functions are at the finger of the fit before the last, whose response differs by a few thousandths.
    np.testing.assert_allclose(np.sqrt(np.einsum("tii->ti", found)), sd, rtol=0.01)
    scale = sd[:, :, None] * sd[:, None, :]
    # What weights of two elements have in common by errors of the loads alone is left out.
    np.testing.assert_allclose(found / scale, wanted / scale, atol=0.2)


@pytest.mark.parametrize("missed", list(CASES), ids=["map", "surface"])
def test_readings_of_touches_that_no_calibration_saw(missed: object) -> None:
    """Errors of predictions are as large as they are said to be, and far smaller than without the functions."""
    before = missed_fit(missed)
    fit, places = fit_with_places(before, CASES[missed])  # type: ignore[index]
    finger, touch = FingerWithPlaces(fit.chain, places), touches(80)
    truth = missed_finger(missed).predict(*touch)  # type: ignore[attr-defined]
    error = finger.predict(*touch) - truth
    sd = np.sqrt(np.einsum("tii->ti", CovarianceWithPlaces(finger)(*touch)))
    # Neighbours share their errors: some twenty independent ones an element.
    assert 0.7 < np.sqrt(np.mean((error / sd) ** 2)) < 1.4
    left = before.chain.predict(*touch) - truth
    assert np.sqrt(np.mean(error**2)) < 0.5 * np.sqrt(np.mean(left**2))
    observed = fit.likelihood.known.readings - fit.likelihood.at_places.shift  # type: ignore[union-attr]
    assert np.sqrt(np.mean((fit.predicted - observed) ** 2)) < 1.2 * 8.0 / 2  # noise of a mean of four
    assert fit.lack_of_fit < 1.3 < before.lack_of_fit


def test_density_has_the_shape_of_the_fit() -> None:
    """Along each parameter of the chain the log density falls as the Laplace covariance says."""
    fit, _ = fit_with_places(missed_fit(MAP), CASES[MAP])
    density, at = FingerDensity.of(fit), fit.likelihood.layout
    rng = np.random.default_rng(1)
    root = np.linalg.cholesky(fit.laplace.covariance)
    steps = rng.standard_normal((60, at.n_chain))
    moved = np.repeat(fit.vector[None], 60, axis=0)
    moved[:, : at.n_chain] += 0.25 * steps @ root.T
    fell = density(fit.vector[None])[0] - density(moved)
    # A quadratic form about a mode: the chain bends a little over a quarter of a standard deviation.
    np.testing.assert_allclose(fell, 0.03125 * (steps**2).sum(axis=1), atol=0.08)


def test_density_is_that_of_the_series() -> None:
    """Readings near the fit come from polynomials, also where functions of place widen the posterior."""
    fit, _ = fit_with_places(missed_fit(SURFACE), CASES[SURFACE])
    density = FingerDensity.of(fit)
    assert isinstance(density.predict, LocalSeries)
    exact = replace(density, predict=density.predict.series)
    steps = np.random.default_rng(2).standard_normal((40, fit.likelihood.layout.n_chain))
    moved = np.repeat(fit.vector[None], 40, axis=0)
    moved[:, : fit.likelihood.layout.n_chain] += steps @ np.linalg.cholesky(fit.laplace.covariance).T
    differences = density(moved) - exact(moved)
    # at most LARGEST_ERROR at four standard deviations in all directions at once, and far less near the fit
    assert np.abs(differences - differences.mean()).max() < LARGEST_ERROR


def test_arrays_hold_it() -> None:
    fit, places = fit_with_places(missed_fit(SURFACE), CASES[SURFACE])
    again = PlacePosterior.from_arrays(places.arrays())
    assert again is not None
    assert again.functions == places.functions
    touch = touches(5)
    one, other = (CovarianceWithPlaces(FingerWithPlaces(fit.chain, each))(*touch) for each in (places, again))
    np.testing.assert_allclose(other, one, rtol=1e-4, atol=1e-6 * one.max())


def test_a_surface_without_a_contact_is_not_an_error_of_the_data(monkeypatch: pytest.MonkeyPatch) -> None:
    """Functions that were only tried are not taken; those that were asked for are refused."""

    def refused(*_: object) -> None:
        raise InputError("more than the table's widest contact")

    fit: Any = "as it was"
    choice = SimpleNamespace(functions=None, note="better")
    monkeypatch.setattr(fits, "without_offsets", lambda fit: fit)
    monkeypatch.setattr(fits, "choose_functions", lambda fit, wanted: choice)
    monkeypatch.setattr(fits, "fit_with_places", refused)
    assert fit_of_places(fit, wanted=False) == (fit, None, (fits.NO_CONTACT,))
    with pytest.raises(InputError, match="widest contact"):
        fit_of_places(fit, wanted=True)
