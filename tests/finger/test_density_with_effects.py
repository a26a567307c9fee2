"""Posterior density of a finger with effects against the likelihood written out with scipy, at several points.

Differences of log densities between points of the posterior, so that constants drop out. They agree to 0.01: tables of
contacts are good to 1e-4 of the peak, and readings are taken as linear over the error of the load.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from itertools import product

import numpy as np
import pytest
from independent.catalogue_forms import surface_profile
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.stats import multivariate_normal, norm

import bayestouch
from bayestouch.calibration.with_effects import StatedFit, fit_stated
from bayestouch.chain.finger import FingerChain
from bayestouch.contact import composite_radius
from bayestouch.effects.stated import StatedModel
from bayestouch.finger import local_series
from bayestouch.finger.density_with_effects import EffectPosterior
from bayestouch.finger.fit_with_effects import effect_fit
from bayestouch.finger.local_signals import LARGEST_ERROR
from bayestouch.finger.model import FingerModel
from bayestouch.model.log_density import LogDensity

FloatArray = NDArray[np.float64]

DESIGN = bayestouch.FingerDesign(n_elements=3, edge_step_deg=4.0, flat_step_deg=8.0, touch_step_deg=20.0)
WITHIN = 0.01


@dataclass(frozen=True, eq=False)
class Case:
    """A simulated data set, its fit and the density; touches with their samples written out."""

    fit: StatedFit
    density: LogDensity
    radius_mm: FloatArray | None = None

    @property
    def samples(self) -> list[NDArray[np.intp]]:
        known = self.fit.fitted.model.known  # type: ignore[union-attr]
        return [np.flatnonzero(known.row_touch == i) for i in range(known.n_touches)]

    def points(self, n: int = 6) -> FloatArray:
        """Points that scatter as the posterior does; those outside the bounds are moved inside."""
        rng = np.random.default_rng(1)
        points = rng.multivariate_normal(self.density.start, self.density.covariance, n)
        low, high = self.density.bounds
        ends = np.where(np.isfinite(high - low), high - low, 0.0)
        return np.clip(points, low + 1e-3 * ends, high - 1e-3 * ends)


@cache
def case(name: str, size: float, samples: int = DESIGN.samples_per_touch) -> Case:
    made = bayestouch.simulate(replace(DESIGN, samples_per_touch=samples), effects={name: size}, seed=5)
    fit = fit_stated(
        made.dataset, StatedModel("finger", "layer", ((name.partition(".")[0], {}),)), draws=8, seed=0, contact="layer"
    )
    return Case(fit, fit.evaluation.log_density(fit.fitted, fit.added, fit.correction))


def predicted(case: Case, values: Mapping[str, FloatArray], load: FloatArray) -> FloatArray:
    """Readings (t, m) of the finger without effects, by its tables of contacts."""
    means = case.fit.fitted.model.known.means
    chain = FingerChain(
        9.4, 12.7, values["response"], values["r_s"], np.radians(values["theta_s"]), np.zeros(3),
        float(values["sigma"]), float(values["mu"]), float(2 * load.max()),
    )  # fmt: skip
    radius = composite_radius(means.indenter_radius_mm, 12.7) if case.radius_mm is None else case.radius_mm
    return chain.predict(radius, np.radians(means.angle_deg), load)


def shared_errors(case: Case, values: Mapping[str, FloatArray], with_effect):  # type: ignore[no-untyped-def]
    """Prediction (t, m), and the covariance of what all samples of each touch share: discrepancy and load."""
    load = case.fit.fitted.model.known.means.load
    here, up, down = (with_effect(predicted(case, values, load * (1 + h)), values) for h in (0, 1e-3, -1e-3))
    slope = (up - down) / (2e-3 * load[:, None])
    error = float(values["force_noise_sd"]) / np.sqrt([len(rows) for rows in case.samples])
    own = np.diag(values["discrepancy_sd"] ** 2)
    return here, [own + e**2 * np.outer(row, row) for e, row in zip(error, slope, strict=True)]


def force_scatter(case: Case, values: Mapping[str, FloatArray]) -> float:
    """Log density of the readings of the load about the mean of their touch."""
    table = case.fit.fitted.model.known.table.load
    return sum(
        float(norm(0, values["force_noise_sd"]).logpdf(table[rows] - table[rows].mean()).sum())
        + float(np.log(values["force_noise_sd"]))
        for rows in case.samples
    )


def written_out(case: Case, x: FloatArray, with_effect, variance) -> float:  # type: ignore[no-untyped-def]
    """Log likelihood of all samples of all touches, each touch one normal vector."""
    values, total = case.density.to_parameters(x), 0.0
    readings = case.fit.fitted.model.known.table.readings
    here, shared = shared_errors(case, values, with_effect)
    noise = variance(here, values)
    for touch, rows in enumerate(case.samples):
        k, own = len(rows), noise[touch]
        covariance = np.kron(np.ones((k, k)), shared[touch]) + np.kron(np.eye(k), np.diag(own))
        total += multivariate_normal(np.tile(here[touch], k), covariance).logpdf(readings[rows].ravel())
    return total + force_scatter(case, values)


def agree(case: Case, expected: list[float], points: FloatArray, within: float = WITHIN) -> None:
    found = case.density.log_likelihood(points)
    assert np.ptp(expected) > 1
    assert np.abs((found - found[0]) - (np.array(expected) - expected[0])).max() < within


def own_noise(here: FloatArray, values: Mapping[str, FloatArray]) -> FloatArray:
    return np.broadcast_to(values["noise_sd"] ** 2, here.shape)


def test_an_effect_of_the_readout() -> None:
    """Cross-talk: of the neighbours share (1 ± lean), and reach times that of the element beyond."""
    one = case("crosstalk", 0.04)

    def heard(clean: FloatArray, values: Mapping[str, FloatArray]) -> FloatArray:
        share, reach, lean = (float(values[f"crosstalk_{name}"]) for name in ("share", "reach", "lean"))
        out = clean.copy()
        for listener in range(3):
            for other in range(3):
                side = np.sign(listener - other)
                if side:
                    out[:, listener] += (
                        share * reach ** (abs(listener - other) - 1) * (1 + lean * side) * clean[:, other]
                    )
        return out

    points = one.points()
    agree(one, [written_out(one, x, heard, own_noise) for x in points], points)


def test_touches_of_unknown_load_do_not_say_how_large_all_gains_are() -> None:
    """Gains times c, shear modulus and loads over c: the same readings of edges, and 1/load prefers no scale."""
    made = bayestouch.simulate(DESIGN, effects={"crosstalk": 0.04}, seed=5)
    table = made.dataset.calibration
    assert table is not None
    data = replace(made.dataset, calibration=replace(table, load=np.where(table.touch % 4 > 0, np.nan, table.load)))
    fit = fit_stated(data, StatedModel("finger", "layer", (("crosstalk", {}),)), draws=8, seed=0, contact="layer")
    density = fit.evaluation.log_density(fit.fitted, fit.added, fit.correction)
    points, change = np.tile(density.start, (2, 1)), np.array([-0.02, 0.02])
    points[:, [density.names.index(f"log response[{e}]") for e in range(3)]] += change[:, None]
    points[:, density.names.index("log mu")] -= change
    means = fit.fitted.model.known.means  # type: ignore[union-attr]
    edges = np.isnan(means.load) & (means.indenter_radius_mm == 0)
    assert edges.sum() >= 5
    log = density.touch_log_likelihood(points)[:, edges]
    assert abs(log[1].mean() - log[0].mean()) < 0.1 * 0.04


def test_touches_of_unknown_load_do_not_pull_gains_with_a_drift() -> None:
    """Of all touches together, as a drift needs: slope of the log likelihood over a common factor of all gains.

    A prior that is flat in the load would have a slope of -1 for each touch of unknown load, which the four noisy
    measured loads hardly change.
    """
    made = bayestouch.simulate(replace(DESIGN, flat_step_deg=12.0, force_noise_sd=30.0), seed=1)
    table = made.dataset.calibration
    assert table is not None
    measured = np.isin(table.touch, np.unique(table.touch)[:4])
    data = replace(made.dataset, calibration=replace(table, load=np.where(measured, table.load, np.nan)))
    fit = fit_stated(data, StatedModel("finger", "layer", (("baseline_drift", {}),)), draws=8, seed=0, contact="layer")
    density = fit.evaluation.log_density(fit.fitted, fit.added, fit.correction)
    points, change = np.tile(density.start, (2, 1)), np.array([-0.02, 0.02])
    points[:, [density.names.index(f"log response[{e}]") for e in range(3)]] += change[:, None]
    points[:, density.names.index("log mu")] -= change
    slope = np.diff(density.log_likelihood(points))[0] / np.diff(change)[0]
    unknown = len(np.unique(table.touch)) - 4
    assert unknown > 40
    assert abs(slope) < unknown / 4


@pytest.mark.slow
def test_an_effect_that_moves_the_touches() -> None:
    """The angle of the prober is off by a sin θ + b cos θ, less its mean: signals by polynomials in the values, too."""
    one = case("prober_eccentricity", 0.3)
    means, points = one.fit.fitted.model.known.means, one.points()
    turn, element = np.radians(means.angle_deg), np.radians(DESIGN.element_angles_deg)
    expected = []
    for x in points:
        values = one.density.to_parameters(x)
        size = [values[f"prober_eccentricity_{name}"] for name in ("sine", "cosine")]
        error, mean = (size[0] * np.sin(at) + size[1] * np.cos(at) for at in (turn, element))
        # The same touches at other angles are those of a finger that is read there.
        moved = _moved(one, np.degrees(turn) + error - mean.mean())
        expected.append(written_out(moved, x, lambda clean, values: clean, own_noise))
    # The polynomials are good to so much, see `bayestouch.finger.local_signals`.
    agree(one, expected, points, LARGEST_ERROR)


@pytest.mark.slow
@pytest.mark.parametrize("zero", [(), (("load_offset", {"offset_wave_1": 0.0}),)])
def test_a_prober_that_slips(zero: tuple[tuple[str, dict[str, float]], ...]) -> None:
    """Angle errors change with time, by half waves over the recording: twenty-one values, one number a touch.

    The zero of the force sensor may change, too: nine further values, and a second number.
    """
    effects = {"prober_eccentricity": 0.3, **{name: 5.0 for name, _ in zero}}
    made = bayestouch.simulate(replace(DESIGN, samples_per_touch=2), effects=effects, seed=5)
    stated = StatedModel("finger", "layer", (("prober_eccentricity", {"turn_wave_1": 0.0}), *zero))
    fit = fit_stated(made.dataset, stated, draws=8, seed=0, contact="layer")
    one = Case(fit, fit.evaluation.log_density(fit.fitted, fit.added, fit.correction))
    known, points = one.fit.fitted.model.known, one.points()  # type: ignore[union-attr]
    turn, passed = np.radians(known.means.angle_deg), known.touch_time_s / known.touch_time_s.max()
    element, bluntness = np.radians(DESIGN.element_angles_deg), composite_radius(known.means.indenter_radius_mm, 12.7)
    expected = []
    for x in points:
        values = {key.removeprefix("prober_eccentricity_"): each for key, each in one.density.to_parameters(x).items()}
        error = (1 - bluntness / 12.7) * (
            values["edge"] + values["edge_sine"] * np.sin(turn) + values["edge_cosine"] * np.cos(turn)
        )
        sizes = {"sine": values["sine"], "cosine": values["cosine"]}
        for k in (1, 2, 3, 4):
            wave = np.cos(k * np.pi * passed)
            error = error + values[f"turn_wave_{k}"] * wave
            sizes = {name: each + values[f"{name}_wave_{k}"] * wave for name, each in sizes.items()}
        error = error + sizes["sine"] * (np.sin(turn) - np.sin(element).mean())
        error = error + sizes["cosine"] * (np.cos(turn) - np.cos(element).mean())
        for k in (2, 3):
            error = error + values[f"sine_{k}"] * (np.sin(k * turn) - np.sin(k * element).mean())
            error = error + values[f"cosine_{k}"] * (np.cos(k * turn) - np.cos(k * element).mean())
        offset = values.get("load_offset_offset", 0.0) + sum(
            values[f"load_offset_offset_wave_{k}"] * np.cos(k * np.pi * passed) for k in range(1, 9) if zero
        )
        moved = _moved(one, np.degrees(turn) + error, known.means.load - offset)
        expected.append(written_out(moved, x, lambda clean, values: clean, own_noise))
    agree(one, expected, points, LARGEST_ERROR)


@pytest.mark.slow
def test_a_surface_out_of_round() -> None:
    """1/R has a further part that goes with the place: signals between levels of it, each by polynomials."""
    one = case("surface_profile.weight_11", 0.02)
    means, points = one.fit.fitted.model.known.means, one.points()
    radius, expected = composite_radius(means.indenter_radius_mm, 12.7), []
    for x in points:
        values = one.density.to_parameters(x)
        weights = {f"weight_{i:02d}": float(values[f"surface_profile_weight_{i:02d}"]) for i in range(1, 22)}
        bent = replace(one, radius_mm=radius / (1 + radius * surface_profile(means.angle_deg, weights, 88.0)))
        expected.append(written_out(bent, x, lambda clean, values: clean, own_noise))
    agree(one, expected, points, LARGEST_ERROR)


def _moved(one: Case, angle_deg: FloatArray, load: FloatArray | None = None) -> Case:
    model = one.fit.fitted.model
    acting = model.known.means.load if load is None else load
    known = replace(model.known, means=replace(model.known.means, angle_deg=angle_deg, load=acting))
    return replace(one, fit=replace(one.fit, fitted=replace(one.fit.fitted, model=model.observing(known))))


def test_an_effect_of_the_noise() -> None:
    """Noise that grows with the signal: sd² = s² + (share peak |y/peak|^power)², in every sample."""
    one = case("signal_dependent_noise", 0.04)
    peak = one.fit.fitted.noise.peak

    def variance(here: FloatArray, values: Mapping[str, FloatArray]) -> FloatArray:
        share, power = (float(values[f"signal_dependent_noise_{name}"]) for name in ("share", "power"))
        return values["noise_sd"] ** 2 + (share * peak * np.abs(here / peak) ** power) ** 2

    points = one.points()
    agree(one, [written_out(one, x, lambda clean, values: clean, variance) for x in points], points)


def test_an_error_of_all_elements_where_one_lacks_samples() -> None:
    """Means of n_i and n_j samples share the errors of the fewer: covariance common²/max(n_i, n_j)."""
    made = bayestouch.simulate(DESIGN, effects={"common_mode_noise": 0.03}, seed=5)
    table = made.dataset.calibration
    lacking = (table.touch % 3 == 0) & (table.sample > 1)
    readings = np.where(lacking[:, None] & (np.arange(3) == 1), np.nan, table.readings)
    dataset = replace(made.dataset, calibration=replace(table, readings=readings))
    stated = StatedModel("finger", "layer", (("common_mode_noise", {}),))
    fit = fit_stated(dataset, stated, draws=8, seed=0, contact="layer")
    one = Case(fit, fit.evaluation.log_density(fit.fitted, fit.added, fit.correction))
    means, peak = fit.fitted.model.known.means, fit.fitted.noise.peak
    most = np.maximum(means.counts[:, :, None], means.counts[:, None])
    assert (means.counts.min(axis=1) == 2).sum() > 5
    points, expected = one.points(), []
    for x in points:
        values = one.density.to_parameters(x)
        here, shared = shared_errors(one, values, lambda clean, _: clean)
        size, unit = (float(values[f"common_mode_noise_{name}"]) for name in ("sd", "shared"))
        together = size * peak ** (1 - unit) * peak.mean() ** unit
        expected.append(
            [
                multivariate_normal(
                    here[t],
                    shared[t]
                    + np.diag(values["noise_sd"] ** 2 / means.counts[t])
                    + np.outer(together, together) / most[t],
                ).logpdf(means.readings[t])
                for t in range(len(here))
            ]
        )
    found = one.density.touch_log_likelihood(points)
    wanted = np.array(expected)
    assert np.abs((found - found[0]) - (wanted - wanted[0])).max() < WITHIN


def test_outliers() -> None:
    """Each sample is usual or wrong: the sum over all ways, at each load, and the integral over the load."""
    one = case("outliers", 0.1, samples=4)
    known, points = one.fit.evaluation.start.fitted.model.known, one.points()  # type: ignore[attr-defined]
    readings, peak = known.table.readings, one.fit.fitted.noise.peak
    node, weight = np.polynomial.hermite_e.hermegauss(21)
    expected = []
    for x in points:
        values = one.density.to_parameters(x)
        share, size = (float(values[f"outliers_{name}"]) for name in ("probability", "size"))
        usual, missed = values["noise_sd"] ** 2, values["discrepancy_sd"] ** 2
        load, total = known.means.load, force_scatter(one, values)
        here, up = (predicted(one, values, load * h) for h in (1.0, 1.001))
        for touch, rows in enumerate(one.samples):
            error = float(values["force_noise_sd"]) / np.sqrt(len(rows)) * node
            at = here[touch] + np.outer(error / (1e-3 * load[touch]), (up - here)[touch])
            wrong = np.array(list(product((0.0, 1.0), repeat=len(rows))))
            log_share = wrong @ np.full(len(rows), np.log(share / (1 - share))) + len(rows) * np.log(1 - share)
            given_load = np.log(weight / weight.sum())
            for e in range(3):
                precision = 1 / (usual[e] + wrong * (size * peak[e]) ** 2)
                left = readings[rows, e] - at[:, e, None]
                pulled = left @ precision.T
                square = (left**2) @ precision.T - pulled**2 / (1 / missed[e] + precision.sum(axis=1))
                volume = np.log(precision).sum(axis=1) - np.log1p(missed[e] * precision.sum(axis=1))
                given_load = given_load + np.logaddexp.reduce(log_share + 0.5 * (volume - square), axis=1)
            total += float(np.logaddexp.reduce(given_load))
        expected.append(total)
    agree(one, expected, points)


@pytest.mark.parametrize("name", ["baseline_drift", "gain_drift"])
def test_a_drift(name: str) -> None:
    """All mean readings one normal vector, with the Matérn covariance of smoothness 3/2 between touches."""
    one = case(name, 0.02)
    known, points = one.fit.fitted.model.known, one.points()
    t, m = known.means.readings.shape
    own = name == "baseline_drift" or one.fit.fitted.drifts[0][1][2] > 0.5
    expected = []
    for x in points:
        values = one.density.to_parameters(x)
        apart = np.sqrt(3) * np.abs(np.subtract.outer(known.touch_time_s, known.touch_time_s)) / values[f"{name}_time"]
        course = values[f"{name}_sd"] ** 2 * (1 + apart) * np.exp(-apart)
        covariance = np.zeros((t, m, t, m))
        here, shared = shared_errors(one, values, lambda clean, values: clean)
        for touch, rows in enumerate(one.samples):
            covariance[touch, :, touch, :] = shared[touch] + np.diag(values["noise_sd"] ** 2) / len(rows)
        scale = np.broadcast_to(one.fit.fitted.model.peak, here.shape) if name == "baseline_drift" else here
        elements = np.eye(m) if own else np.ones((m, m))
        covariance += np.einsum("ta,ts,sb,ab->tasb", scale, course, scale, elements)
        total = multivariate_normal(here.ravel(), covariance.reshape(t * m, t * m)).logpdf(known.means.readings.ravel())
        for rows in one.samples:
            total += norm(0, values["noise_sd"]).logpdf(known.deviation[rows]).sum() + np.log(values["noise_sd"]).sum()
        expected.append(float(total) + force_scatter(one, values))
    # The series is good to so much, see `bayestouch.finger.local_series`.
    agree(one, expected, points, local_series.LARGEST_ERROR)


def test_the_prior_is_that_of_the_parameters() -> None:
    """Of an effect's values too: normal, and the derivative of the value where the coordinate is its logarithm."""
    one = case("signal_dependent_noise", 0.04)
    x = np.repeat(one.density.start[None], 2, axis=0)
    power = one.density.names.index("log signal_dependent_noise_power")
    x[1, power] += 0.3
    # Log-normal of median 0.8: its logarithm is normal with sd 0.4.
    expected = norm(np.log(0.8), 0.4).logpdf(x[:, power])
    assert np.diff(one.density.log_prior(x)) == pytest.approx(np.diff(expected))


@pytest.mark.parametrize("of_one_element", [1, 60])
def test_functions_that_touches_share_are_integrated_out(of_one_element: int) -> None:
    """Those of a correction: of one element each, and of all. The rest of the covariance is tested above.

    Few functions, and so many that they are eliminated element by element.
    """
    one = case("crosstalk", 0.04)
    fitted, added = one.fit.fitted, one.fit.added
    rng = np.random.default_rng(2)
    t, m = fitted.model.known.means.readings.shape
    count = of_one_element + 2
    columns = fitted.model.peak * 0.02 * rng.standard_normal((count, t, m))
    for column in range(of_one_element):
        columns[column, :, np.arange(m) != (0, 0, 1, 2, 2)[column % 5]] = 0.0
    start = one.fit.evaluation.start  # type: ignore[attr-defined]
    plain = EffectPosterior.of(fitted, start.priors, start.fitted.model.known)
    vectors = one.points(4)
    alone = effect_fit(fitted, added, plain).density
    together = replace(alone, posterior=replace(plain, columns=columns))
    means, slopes = alone._errors(vectors, alone.predict(vectors))
    left, weight = means.left, means.weight
    expected = []
    for i, before in enumerate(alone(vectors)):
        blocks = [np.diag(1 / weight[i, k]) + np.outer(slopes[0, i, k], slopes[0, i, k]) for k in range(t)]
        covariance, flat = block_diag(*blocks), columns.reshape(count, -1)
        row = left[i].ravel()
        with_functions = multivariate_normal(None, covariance + flat.T @ flat).logpdf(row)
        expected.append(before + with_functions - multivariate_normal(None, covariance).logpdf(row))
    own = together._own_columns
    assert own is not None and (own.log_density(left, weight, slopes) is None) == (of_one_element == 1)
    found, wanted = together(vectors), np.array(expected)
    assert np.ptp(wanted - alone(vectors)) > 0.1
    np.testing.assert_allclose(found - found[0], wanted - wanted[0], rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    "name", ["prober_eccentricity.sine", "load_offset.offset", "load_misalignment.sine", "blunt_edge"]
)
def test_touches_that_an_effect_moves_are_summed_as_the_chain_has_them(name: str) -> None:
    """The series for moved touches, and the chain with its tables, whose own error is 1e-5 of the peak.

    The chain alone has the contact of a blunt edge.
    """
    one = case(name, 0.02)
    model, rng = one.fit.fitted.model, np.random.default_rng(2)
    assert isinstance(model, FingerModel) and model.evaluator is not None
    vector = one.fit.fitted.vector.copy()
    vector[: model.n_base] += 1e-3 * rng.standard_normal(model.n_base)
    chain = replace(model, evaluator=None)
    found, expected = model.predict(vector).touches, chain.predict(vector).touches
    assert np.abs(found - expected).max() < 3e-5 * model.peak.max()
    assert np.array_equal(found, expected) == (name == "blunt_edge")
    for one_of, other in zip(model.derivatives(vector)[0], chain.derivatives(vector)[0], strict=True):
        assert np.abs(one_of - other).max() <= 1e-2 * max(np.abs(other).max(), 1e-3 * model.peak.max())
