"""First guess of the noise beside functions with unknown weights."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import bayestouch
from bayestouch.calibration.with_effects import StatedFit, fit_stated
from bayestouch.effects.element import SPREAD, ChannelLag
from bayestouch.effects.stated import StatedModel
from bayestouch.finger import map_with_effects
from bayestouch.finger.density_with_effects import EffectPosterior
from bayestouch.finger.fit_with_effects import EffectFit, effect_fit
from bayestouch.finger.linear_chain import LinearChain, degrees_spent, linearised_chain
from bayestouch.finger.map_with_effects import _Start
from bayestouch.finger.noise import Residuals
from bayestouch.finger.sampling import NO_RIDGES
from bayestouch.sampling.rank_one import inverse_root


def posterior_of(stated: StatedFit) -> EffectPosterior:
    start = stated.evaluation.start
    return EffectPosterior.of(stated.fitted, start.priors, start.fitted.model.known)


def test_degrees_of_freedom_are_those_of_each_reading_as_it_is() -> None:
    """Not of whitened readings, which mix the elements of a touch: by inverses of whole covariances, written out."""
    rng = np.random.default_rng(3)
    t, m, c = 7, 4, 5
    own, by_load = rng.uniform(0.5, 2.0, (t, m)), 3 * rng.standard_normal((t, m))
    columns = rng.standard_normal((c, t, m))
    root = inverse_root(own, (by_load,), np.ones((t, m), dtype=bool))
    white = np.einsum("tij,ctj->cti", root, columns)
    gram = np.eye(c) + white.reshape(c, -1) @ white.reshape(c, -1).T
    half = np.linalg.solve(np.linalg.cholesky(gram), white.reshape(c, -1)).reshape(c, t, m)
    without = np.zeros((t * m, t * m))
    for i in range(t):
        part = slice(i * m, (i + 1) * m)
        without[part, part] = np.diag(own[i]) + np.outer(by_load[i], by_load[i])
    flat = columns.reshape(c, -1)
    less = np.linalg.inv(without) - np.linalg.inv(without + flat.T @ flat)
    expected = (np.diag(less).reshape(t, m) * own).sum(axis=0)
    assert degrees_spent(half, root, own) == pytest.approx(expected, rel=1e-9)
    # All together they are fewer than the columns, which the errors of the loads partly hide.
    assert expected.sum() < c


@pytest.mark.parametrize("name", ["gain_drift", "baseline_drift"])
def test_the_map_of_a_posterior_with_a_drift_follows_the_noise(name: str) -> None:
    """Log ratios of the exact posterior to the normal one scatter little where the noise and what is missed vary.

    A part of each element in the gradient that held what the drift explains would move the response of the elements
    by hundreds of standard deviations.
    """
    design = bayestouch.FingerDesign(n_elements=6, touch_step_deg=20.0)
    made = bayestouch.simulate(design, effects={name: 0.05}, seed=5)
    stated = fit_stated(made.dataset, StatedModel("finger", "layer", ((name, {}),)), draws=8, seed=0, contact="layer")
    fitted, start = stated.fitted, stated.evaluation.start
    fit = effect_fit(fitted, stated.added, EffectPosterior.of(fitted, start.priors, start.fitted.model.known))
    at, density = fit.posterior.layout, fit.density
    noise = slice(at.noise.start, at.log_discrepancy.stop)
    z = np.zeros((100, at.size))
    k = noise.stop - noise.start
    root = np.linalg.cholesky(fit.shape.covariance[:k, :k])
    normal = np.random.default_rng(2).standard_normal((100, k))
    z[:, noise] = fit.shape.centre[:k] + normal @ root.T
    vectors, log_derivative = fit.to_vectors(z)
    ratio = density(vectors) + log_derivative + 0.5 * (normal**2).sum(axis=1)
    assert np.isfinite(ratio).all()
    # Twelve coordinates: a proposal off by a third of a standard deviation in each has ratios that scatter by 1.2.
    assert ratio.std() < 1.0


@pytest.mark.parametrize("share", [-0.2, -0.35])
def test_the_map_where_the_density_falls_steeply_from_a_bound(share: float) -> None:
    """A limit fitted to a gain that bends: the sharpness of the limit is at its bound of 5.

    Without the bound its mean would be tens of standard deviations away, and all other parameters with it: all draws of
    the map were at densities hundreds of nats below that of the mode.
    """
    design = bayestouch.FingerDesign(n_elements=4, edge_step_deg=2.0, flat_step_deg=4.0, touch_step_deg=20.0)
    made = bayestouch.simulate(design, effects={"gain_nonlinearity": share}, seed=3)
    model = StatedModel("finger", "layer", (("saturation", {}),))
    stated = fit_stated(made.dataset, model, draws=8, seed=0, contact="layer")
    posterior = posterior_of(stated)
    fit = effect_fit(stated.fitted, stated.added, posterior)
    at, density = fit.posterior.layout, fit.density
    centre, covariance = np.zeros(at.size), np.eye(at.size)
    centre[at.n_chain :], covariance[at.n_chain :, at.n_chain :] = fit.shape.centre, fit.shape.covariance
    normal = np.random.default_rng(4).standard_normal((400, at.size))
    vectors, log_derivative = fit.to_vectors(centre + normal @ np.linalg.cholesky(covariance).T)
    knee = vectors[:, at.values.start + 1]
    assert (knee >= 5.0).all() and knee.max() < 5.5
    ratio = density(vectors) + log_derivative + 0.5 * (normal**2).sum(axis=1)
    inside = np.isfinite(ratio)
    assert inside.mean() > 0.95
    # Effective share of the draws as a sample of the posterior; a few hundredths would already serve a chain.
    weight = np.exp(ratio[inside] - ratio[inside].max())
    assert weight.sum() ** 2 / (weight**2).sum() > 0.1 * len(weight)


def test_a_coordinate_at_a_steep_bound_is_independent_with_the_width_that_is_left() -> None:
    """Three coordinates, of which the last is at its lower bound; pulls are in its standard deviations given none."""
    precision = np.array([[2.0, 0.3, 0.8], [0.3, 1.0, 0.5], [0.8, 0.5, 1.5]])
    marginal = 1 / np.linalg.inv(precision)[2, 2]
    none, prior = np.zeros((0, 1)), np.full(3, 1e6)
    ends = np.array([-np.inf, -np.inf, 5.0]), np.full(3, np.inf)

    def moved(pull: float, value: float = 5.0) -> np.ndarray:
        gradient = np.array([[0.0, 0.0, pull * np.sqrt(marginal)]])
        linear = LinearChain(Residuals(none, none, np.zeros(1)), precision[None], gradient, None, np.zeros(3), 0.0)
        start = _Start(np.array([0.0, 0.0, value]), linear, prior)
        return start.with_bounds_reached(NO_RIDGES, ends).linear.hessian

    for same in (moved(-2.9), moved(3.1), moved(-3.1, 5.1)):
        np.testing.assert_allclose(same, precision)
    apart = moved(-3.1)
    np.testing.assert_allclose(apart[:2, :2], precision[:2, :2])
    np.testing.assert_allclose(apart[2], [0.0, 0.0, marginal], atol=1e-9)


def test_a_map_whose_centre_has_no_density_gives_way_to_the_first_that_has() -> None:
    design = bayestouch.FingerDesign(n_elements=4, edge_step_deg=20.0, flat_step_deg=20.0, touch_step_deg=20.0)
    made = bayestouch.simulate(design, effects={"crosstalk": 0.05}, seed=1)
    stated = fit_stated(
        made.dataset, StatedModel("finger", "layer", (("crosstalk", {}),)), draws=8, seed=0, contact="layer"
    )
    posterior = posterior_of(stated)
    fit = effect_fit(stated.fitted, stated.added, posterior)
    good = fit.to_vectors
    # An element deeper than the core, and one that is half a radian from where its readings are.
    deep, far = good.vector.copy(), good.vector.copy()
    deep[posterior.layout.n_elements] = 0.0
    far[2 * posterior.layout.n_elements] += 0.5
    none, little = replace(good, vector=deep), replace(good, vector=far)
    assert fit.with_usable_map((none,)) is fit
    for bad in (none, little):
        assert replace(fit, to_vectors=bad).with_usable_map((none, good, little)).to_vectors is good
    # None is usable: the last one, which is the simplest.
    assert replace(fit, to_vectors=little).with_usable_map((little, none)).to_vectors is none


def test_a_bend_is_looked_for_where_readings_are_possible(monkeypatch: pytest.MonkeyPatch) -> None:
    """Hardly anything says how steep the gain bends: its logarithm is looked at within six of its prior sds."""
    design = bayestouch.FingerDesign(n_elements=4, edge_step_deg=20.0, flat_step_deg=20.0, touch_step_deg=20.0)
    made = bayestouch.simulate(design, effects={"gain_nonlinearity": 0.001}, seed=1)
    stated = fit_stated(
        made.dataset, StatedModel("finger", "layer", (("gain_nonlinearity", {}),)), draws=8, seed=0, contact="layer"
    )
    posterior = posterior_of(stated)
    seen: list[np.ndarray] = []

    def bent(step: Any, centre: np.ndarray, *others: Any) -> None:
        seen.clear()
        monkeypatch.setattr(map_with_effects, "linearised_chain", noted)
        # As far to both sides as rounding allows: 100 sds of the prior.
        far = 100 * posterior.prior.spread[posterior.layout.values]
        for values in (centre + far, centre - far):
            shift, length = step(values)
            assert np.isfinite(shift).all() and np.isfinite(length)

    def noted(fitted: Any, posterior: Any, vector: np.ndarray, **options: Any) -> Any:
        seen.append(vector)
        return linearised_chain(fitted, posterior, vector, **options)

    monkeypatch.setattr(map_with_effects.Bend, "of", bent)
    fit = effect_fit(stated.fitted, stated.added, posterior)
    at = posterior.layout
    reach = np.abs(np.array(seen)[:, : at.n_chain] - fit.vector[: at.n_chain]) / posterior.prior.spread[: at.n_chain]
    # The centre of the map differs a little from the mode.
    assert len(seen) == 2 and reach[:, at.values].max() > 5.8 and reach.max() < 6.2


def test_no_bend_of_many_values(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ten values at most: a share of each of eight elements, and the two that all of them have."""
    asked: list[int] = []
    monkeypatch.setattr(map_with_effects.Bend, "of", lambda step, centre, *others: asked.append(len(centre)))
    for n in (8, 9):
        design = bayestouch.FingerDesign(n_elements=n, edge_step_deg=20.0, flat_step_deg=20.0, touch_step_deg=20.0)
        data = bayestouch.simulate(design, effects={"channel_lag": 0.05, "channel_lag.own_02": 0.5}, seed=1).dataset
        model = StatedModel("finger", "layer", (("channel_lag", {"own_02": 0.4}),))
        stated = fit_stated(data, model, draws=8, seed=0, contact="layer")
        effect_fit(stated.fitted, stated.added, posterior_of(stated))
    assert asked == [10]


@pytest.mark.slow
def test_a_share_of_all_elements_is_as_open_as_the_excesses_of_the_elements_leave_it() -> None:
    """The touches determine share * (1 + excess) of each element to 2 %, and the priors all that is known of the share.

    Its density is that of the priors along constant products, by quadrature. An effective size of 300 gives the mean
    to 6 % of the sd and the sd to 4 %: three of them.
    """
    design = bayestouch.FingerDesign(n_elements=4, edge_step_deg=2.0, flat_step_deg=4.0, touch_step_deg=8.0)
    data = bayestouch.simulate(design, effects={"channel_lag": 0.05}, seed=3).dataset
    model = StatedModel("finger", "layer", (("channel_lag", {"own_01": 0.0}),))
    draws = bayestouch.calibrate(data, model=model, seed=1, draws=400).posterior
    prior = ChannelLag().parameters[0].normal_prior
    products = [float((draws["channel_lag_share"] * (1 + draws[f"channel_lag_own_0{e}"])).mean()) for e in range(1, 5)]
    share = np.linspace(0.01, 0.15, 5001)
    log_density = -0.5 * ((share - prior[0]) / prior[1]) ** 2 - 4 * np.log(share)
    log_density -= sum(0.5 * ((product / share - 1) / SPREAD) ** 2 for product in products)
    weight = np.exp(log_density - log_density.max())
    mean = np.average(share, weights=weight)
    sd = np.sqrt(np.average((share - mean) ** 2, weights=weight))
    assert draws["channel_lag_share"].mean() == pytest.approx(mean, abs=0.18 * sd)
    assert draws["channel_lag_share"].std() == pytest.approx(sd, rel=0.12)


def test_a_value_at_its_bound_is_moved_to_where_readings_have_a_slope_over_it() -> None:
    """Of values with prior sd 0.8: log density -(30 b)⁴/2 of one at its lower bound; one inside; one free at its upper.

    Halved steps of 0.8: (30 · 0.05)⁴/2 = 2.5 is below by more than 2, (30 · 0.025)⁴/2 = 0.16 is not.
    """
    posterior: Any = SimpleNamespace(
        layout=SimpleNamespace(n_base=1, n_chain=4),
        prior=SimpleNamespace(spread=np.full(5, 0.8)),
        bounds=(np.array([0.0, 0.0, 0.0, -np.inf, 0.0]), np.array([9.0, 2.0, 2.0, 1.0, 9.0])),
    )
    fit = object.__new__(EffectFit)
    values = {
        "posterior": posterior,
        "vector": np.array([0.0, 0.0, 0.4, 1.0, 0.0]),
        "density": lambda points: -0.5 * (30 * points[:, 1]) ** 4,
    }
    for name, value in values.items():
        object.__setattr__(fit, name, value)
    np.testing.assert_allclose(fit.off_bounds(), [0.0, 0.025, 0.4, 0.2, 0.0])
