"""Maps of what a finger will read well, and how they are scored."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from nicolson_fearing.many_fits import fit_many_touches
from posterior_cases import FINGER
from scipy import stats

from bayestouch import InputError, calibrate, infer, simulate
from bayestouch.chain.finger import FingerChain
from bayestouch.contact import composite_radius
from bayestouch.data.averages import TouchMeans
from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import Pad, Sensor
from bayestouch.data.touches import Touches, touches_from
from bayestouch.pad.reading.reader import PadReader
from bayestouch.priors.parameters import Parameter, Uniform
from bayestouch.reliability import (
    KnownFinger,
    TouchEstimator,
    TouchPlaces,
    attainable,
    covered,
    draw_bias,
    expected_coverage,
    expected_finger,
    explained_sign,
    explained_size,
    known_bias,
    observed_bias,
    pad_known_bias,
    pad_spots,
    place_bias,
    shared_by_indenters,
    sweet_spots,
    touch_information,
    variance_split,
)
from bayestouch.results.data import TouchRows
from bayestouch.results.objects import TouchPosteriors
from bayestouch.simulation import FingerDesign, PadDesign

DESIGN = FingerDesign(shear_modulus_MPa=0.08, samples_per_touch=4, edge_step_deg=6.0, flat_step_deg=12.0)
TIPS, PLACES = [1.59, 6.01, 12.3], [-3.0, 0.0, 2.0, 4.4]


@pytest.fixture(scope="module")
def known() -> KnownFinger:
    return expected_finger(DESIGN, seed=2)


def test_estimates_follow_the_touch(known: KnownFinger) -> None:
    """What moves the touch moves its estimate as much; noise gives the inverse of the information."""
    touches = TouchPlaces.grid(np.array([3.0, 6.0]), np.radians(PLACES), 200.0)
    estimator = TouchEstimator.of(known, touches)
    moved = estimator.weights @ known.touch_jacobian(touches)
    moved[:, :, 2] += estimator.load_weights  # the force sensor sees the load too
    # R in mm, θ_c in degree per rad, P in N/m
    assert moved == pytest.approx(np.broadcast_to(np.diag([1, 180 / np.pi, 1]), moved.shape), abs=1e-8)
    exact = replace(known, errors=None)
    information = touch_information(exact, touches, samples=3)
    bound = np.sqrt(np.einsum("tii->ti", np.linalg.inv(information))) * [1, 180 / np.pi, 1]
    assert TouchEstimator.of(exact, touches, samples=3).noise_sd() == pytest.approx(bound, rel=1e-9)


def test_elements_sum_to_the_whole(known: KnownFinger) -> None:
    spots = sweet_spots(known, TIPS, PLACES, samples=4, use_load=False)
    for name in ("R", "theta_c", "P"):
        assert spots.bias_by_element[name].sum(axis=-1) == pytest.approx(spots.bias_rms[name] ** 2, rel=1e-9)
        assert spots.noise_by_element[name].sum(axis=-1) == pytest.approx(spots.noise_sd[name] ** 2, rel=1e-9)
    nearest = np.abs(known.chain.angle - np.radians(4.4)).argmin()
    assert spots.noise_by_element["R"][1, 3].argmax() in (nearest - 1, nearest, nearest + 1)


def test_calibration_and_model_error_add_up(known: KnownFinger) -> None:
    """Independent model errors of the elements, of a tenth of the noise; those of drawn calibrations have none."""
    size = 0.1 * known.noise.tactile_sd
    wrong = replace(known, noise=replace(known.noise, discrepancy_sd=size))
    spots = sweet_spots(wrong, TIPS, PLACES, samples=4)
    touches = TouchPlaces.grid(
        np.asarray(composite_radius(TIPS, known.outer_radius_mm)), np.radians(PLACES), known.typical_load
    )
    of_model = ((TouchEstimator.of(wrong, touches, samples=4).weights * size) ** 2).sum(axis=-1)
    for i, name in enumerate(("R", "theta_c", "P")):
        both = spots.calibration_rms[name] ** 2 + of_model[:, i].reshape(len(TIPS), len(PLACES))
        np.testing.assert_allclose(spots.bias_rms[name] ** 2, both, rtol=1e-9)
    drawn = draw_bias(wrong, TIPS, PLACES, samples=4, draws=2000)
    assert drawn["R"].std(axis=0) == pytest.approx(spots.calibration_rms["R"], rel=0.08)  # as below


def test_maps_are_the_root_mean_square_of_drawn_calibrations(known: KnownFinger) -> None:
    drawn = draw_bias(known, TIPS, PLACES, samples=4, draws=2000)
    spots = sweet_spots(known, TIPS, PLACES, samples=4)
    # 2000 draws leave a standard deviation uncertain by 1.6 %; five of those
    assert drawn["R"].std(axis=0) == pytest.approx(spots.bias_rms["R"], rel=0.08)
    # one calibration errs alike at places and tips that are near each other
    assert shared_by_indenters(drawn["R"][:, :, 0].T) > 0.5
    blind = sweet_spots(known, TIPS, PLACES, samples=4, plug_in=True)
    assert np.all(blind.sd("R") >= spots.sd("R") * (1 - 1e-9))  # least squares with the right weights is the best


def test_known_bias_is_what_a_fit_finds(known: KnownFinger) -> None:
    """An element that answers 1 % more than the calibration says, against the paper's fit of exact readings."""
    chain = known.chain
    assert isinstance(chain, FingerChain)
    element = int(np.abs(chain.angle).argmin())
    stronger = chain.response * np.where(np.arange(chain.n_elements) == element, 1.01, 1.0)
    better = replace(known, chain=chain.with_(response=stronger))
    # The paper's fit weighs strains, readings over gain; so does noise in proportion to the gain.
    noise = replace(known.noise, tactile_sd=0.02 * chain.gain / chain.gain.mean())
    predicted = known_bias(replace(known, noise=noise), better, TIPS, PLACES, use_load=False, plug_in=True)
    radius = composite_radius(np.repeat(TIPS, len(PLACES)), known.outer_radius_mm)
    place = np.tile(PLACES, len(TIPS))
    found = fit_many_touches(chain, better.chain.predict(radius, np.radians(place), np.full(len(place), 200.0)))
    error = found.composite_radius_mm - radius
    # 1 % moves R by a tenth of a millimetre, over which it is linear to a few per cent; tables are linear in κ between
    # knots, which the step of the derivative smooths
    assert predicted["R"].ravel() == pytest.approx(error, abs=0.1 * np.abs(error).max())
    assert predicted["theta_c"].ravel() == pytest.approx(found.angle_deg - place, abs=0.002)


def test_bias_of_a_place_is_foretold_by_edges_there(known: KnownFinger) -> None:
    """Errors of a place, the same for every indenter, against the errors that the estimate's weights make of them."""
    rng = np.random.default_rng(4)
    angles = np.arange(-10.0, 11.0, 1.0)
    error = 3 * known.noise.tactile_sd * rng.standard_normal((len(angles), known.n_elements))
    edges = TouchPlaces(np.zeros(len(angles)), np.radians(angles), np.full(len(angles), 200.0))
    n, m = len(angles), known.n_elements
    means = TouchMeans(
        touch=np.arange(n),
        indenter_radius_mm=np.zeros(n),
        angle_deg=angles,
        x_mm=None,
        y_mm=None,
        readings=known.predict(edges) + error,
        counts=np.full((n, m), 10_000),
        pure_error_variance=known.noise.tactile_sd**2,
        pure_error_dof=np.full(m, 1.0),
        load=edges.load,
        depth_mm=np.full(n, np.nan),
        time_s=np.full(n, np.nan),
    )
    places = [-3.0, 0.0, 2.5]
    predicted = place_bias(known, means, TIPS, places, load=200.0)
    there = np.stack([error[7], error[10], (error[12] + error[13]) / 2])
    touches = TouchPlaces.grid(composite_radius(TIPS, known.outer_radius_mm), np.radians(places), 200.0)
    expected = TouchEstimator.of(known, touches).errors(np.tile(there, (len(TIPS), 1)))
    assert predicted["R"].ravel() == pytest.approx(expected[:, 0], rel=1e-3)  # shrunk by a 10,000th or so
    # Edges at one place count as their mean, in any order.
    rows = np.random.default_rng(0).permutation(np.repeat(np.arange(n), 2))
    sign = np.zeros(2 * n)
    sign[[int(np.flatnonzero(rows == each)[0]) for each in range(n)]] = 1.0
    sign[sign == 0] = -1.0
    apart = 5 * known.noise.tactile_sd * sign[:, None]
    twice = replace(means.select(rows), readings=means.readings[rows] + apart)
    assert place_bias(known, twice, TIPS, places, load=200.0)["R"] == pytest.approx(predicted["R"], rel=1e-3)
    # nothing is foretold where noise explains what is left
    noisy = replace(means, counts=np.full((n, m), 1), readings=means.readings - 0.9 * error)
    assert np.all(place_bias(known, noisy, TIPS, places)["R"] == 0)
    # what a better model says is part of the bias
    assert isinstance(known.chain, FingerChain)
    better = replace(known, chain=known.chain.with_(response=known.chain.response * 1.01))
    both = place_bias(known, replace(means, readings=better.predict(edges)), TIPS, places, better=better)
    assert both["R"] == pytest.approx(known_bias(known, better, TIPS, places)["R"], abs=1e-6)
    with pytest.raises(InputError, match="two knife edges"):
        place_bias(known, replace(means, indenter_radius_mm=np.ones(n)), TIPS, places)


def test_few_calibration_touches_leave_more_open() -> None:
    many = expected_finger(replace(DESIGN, edge_step_deg=2.0, flat_step_deg=4.0))
    few = expected_finger(DESIGN)
    ratio = sweet_spots(few, TIPS, PLACES).bias_rms["R"] / sweet_spots(many, TIPS, PLACES).bias_rms["R"]
    # three times the touches, the square root of three: priors and places of touches take some of it
    assert np.median(ratio) == pytest.approx(np.sqrt(3), rel=0.15)


def test_perfect_predictions_score_as_they_should() -> None:
    rng = np.random.default_rng(0)
    rms = np.exp(rng.normal(size=(4, 60)))
    errors = rms * rng.standard_normal((200, 4, 60))
    score = explained_sign(errors[0], errors[0])
    assert score.r_squared == pytest.approx(1)
    assert score.rank_correlation == pytest.approx(1)
    assert explained_sign(0 * errors[0], errors[0]).r_squared == pytest.approx(0)
    expected = attainable(rms, errors)
    found = explained_size(rms, errors[0])
    assert expected["rank_correlation"][1] < found.rank_correlation < expected["rank_correlation"][2]
    low, high = found.rank_interval
    assert low < found.rank_correlation < high
    # the share of |error| that its root mean square explains: the variance of √(2/π) rms over the whole
    whole = (rms**2).mean() - (2 / np.pi) * rms.mean() ** 2
    # 200 draws of 240 heavy-tailed numbers: each share scatters by some 0.15
    assert expected["r_squared"][0] == pytest.approx(2 / np.pi * rms.var() / whole, abs=0.05)
    with pytest.raises(InputError, match="one shape"):
        explained_sign(np.zeros((2, 3)), np.zeros((3, 2)))


def test_angles_are_compared_around_the_circle() -> None:
    """Touches at 180°, where the reference counts from -180° and the estimates do not."""
    rng = np.random.default_rng(3)
    true = np.array([178.0, 179.5, 180.5, 182.0])
    draws = true + rng.normal(0.1, 0.3, (2, 50, 4))

    def posteriors(reference: np.ndarray) -> TouchPosteriors:
        of = np.zeros((4, 1))
        place = {"theta_c": reference}
        rows = TouchRows(np.arange(4), place, np.full(4, 3.9), np.ones(4), of, of, of + 1, of, np.zeros(4), np.ones(4))
        return TouchPosteriors(
            sensor=FINGER,
            parameters=(Parameter("theta_c", "θ", "θ", "degree", Uniform(0, 360)),),
            posterior={"theta_c": draws},
            sample_stats={},
            reference=place,
            rows=rows,
            settings={},
        )

    straight, turned = posteriors(true), posteriors(np.where(true > 180, true - 360, true))
    assert observed_bias(turned, "theta_c").error[0, [2, 3, 0, 1]] == pytest.approx(
        observed_bias(straight, "theta_c").error[0, [0, 1, 2, 3]]
    )
    np.testing.assert_array_equal(covered(turned, "theta_c"), covered(straight, "theta_c"))
    assert covered(straight, "theta_c").all()
    split = variance_split(straight, straight, "theta_c")
    assert variance_split(turned, turned, "theta_c") == pytest.approx(split)
    assert split["location"] == pytest.approx((straight.mean("theta_c") - true).std())


def test_indenters_share_what_belongs_to_the_place() -> None:
    rng, n = np.random.default_rng(1), 4000
    place, own = rng.standard_normal(n), rng.standard_normal((3, n))
    # variance 1 shared of 2 in all: correlation 1/2, which n places give to (1 - 1/4)/sqrt(n); four of those are 0.05
    assert shared_by_indenters(place + own) == pytest.approx(0.5, abs=4 * 0.75 / np.sqrt(n))
    assert np.isnan(shared_by_indenters(place[None]))


def test_coverage_of_intervals_that_know_of_noise_alone() -> None:
    assert expected_coverage(1.0, 0.0) == pytest.approx(0.9)
    wide = stats.norm(scale=np.sqrt(2))
    assert expected_coverage(1.0, 1.0) == pytest.approx(1 - 2 * wide.cdf(-stats.norm.ppf(0.95)))


def test_pads_locate_as_well_as_predicted() -> None:
    """On a line of elements: size of errors, and bias of a reader that takes one element for weaker than it is."""
    design = PadDesign(element_x_mm=(0.0, 6.75, 13.5, 20.25), element_y_mm=None, n_touches=120, calibration_step_mm=1.0)
    simulated = simulate(design, seed=3)
    calibration = calibrate(simulated.dataset, kernel="layer", draws=64)
    reader = PadReader.from_calibration(calibration)
    posteriors = infer(simulated.dataset.touches, calibration, draws=256)
    x = posteriors.reference["x"]
    inside = (x > 0) & (x < 20.25)
    spots = pad_spots(reader, x[inside, None], reads=design.samples_per_touch)
    # each touch at its own load, from 1 to 3 N
    load = posteriors.rows.load[inside]
    sd = np.array(
        [
            pad_spots(reader, np.array([[at]]), load=p, reads=design.samples_per_touch).sd[0]
            for at, p in zip(x[inside], load, strict=True)
        ]
    )
    z = (posteriors.mean("x") - x)[inside] / sd
    # a mean square of n squares, four standard errors
    assert np.mean(z**2) == pytest.approx(1.0, abs=4 * np.sqrt(2 / len(z)))
    assert (spots.by_element.sum(axis=-1) + spots.of_none)[:, 0] == pytest.approx(spots.sd**2, rel=1e-9)
    place = np.array([[4.0], [9.0]])
    sensitivity = reader.map.sensitivity * np.array([1.0, 1.02, 1.0, 1.0])
    stronger = replace(reader, map=replace(reader.map, sensitivity=sensitivity))
    bias = pad_known_bias(reader, stronger, place)[:, 0]
    assert bias[0] > 0 > bias[1]  # drawn towards the stronger element
    with pytest.raises(InputError, match="expected places"):
        pad_spots(reader, np.zeros((3, 2)))
    with pytest.raises(InputError, match="load: expected above zero"):
        pad_spots(reader, place, load=0.0)
    with pytest.raises(InputError, match="reads: expected 1 or more"):
        pad_spots(reader, place, reads=0)


def touches_of_line(
    rng: np.random.Generator, gain: np.ndarray, element: np.ndarray, x: np.ndarray, load: np.ndarray, noise: float
) -> Touches:
    """Three samples of touches on a line of Gaussian elements 4 mm wide; a force sensor reads loads to 0.5 N."""
    rows = np.repeat(np.arange(len(x)), 3)
    signal = load[:, None] * gain * np.exp(-0.5 * ((x[:, None] - element) / 4) ** 2)
    return touches_from(
        rows,
        signal[rows] + noise * rng.standard_normal((len(rows), len(element))),
        sample=np.tile(np.arange(3), len(x)),
        x_mm=x[rows],
        load=load[rows] + 0.5 * rng.standard_normal(len(rows)),
    )


@pytest.mark.slow
def test_pads_calibrated_with_uncertain_loads_locate_as_well_as_predicted() -> None:
    """Loads of 5 N read to 0.5 N, by 30 calibrations of 40 touches: bias and errors against those predicted.

    A load that is read wrong moves all gains near its touch together, which hardly moves a location. With errors of the
    gains that were independent, the squares would be 0.2 and 0.65 of those predicted.
    """
    stated, place, bias, error = 6.0 * np.arange(5), np.array([6.0, 9.0, 14.0]), [], []
    sensor = Sensor(
        name="simulated pad", body=Pad(tuple(stated)), reading_unit="counts", force_noise_sd=0.5, source={"note": "-"}
    )
    for seed in range(30):
        rng = np.random.default_rng(seed)
        gain, element = 100 * np.exp(0.1 * rng.standard_normal(5)), stated + 0.3 * rng.standard_normal(5)
        known = touches_of_line(rng, gain, element, np.linspace(-2, 26, 40), rng.uniform(4, 6, 40), 8.0)
        made = calibrate(DataSet(sensor, known, known), kernel="gaussian", e_map="model", draws=64)
        predicted = pad_spots(PadReader.from_calibration(made), place[:, None], load=5.0, reads=3)
        # Without noise the location is off by the bias alone.
        exact = touches_of_line(rng, gain, element, place, np.full(3, 5.0), 0.0)
        found = infer(exact, made, use_load=False, check_sensor=False, draws=512)
        bias.append((found.mean("x") - place) ** 2 / predicted.bias_rms[:, 0] ** 2)
        x = np.repeat(place, 10)
        noisy = touches_of_line(rng, gain, element, x, np.full(30, 5.0), 8.0)
        found = infer(noisy, made, check_sensor=False, draws=256)
        error.append(((found.mean("x") - x) / found.sd("x")) ** 2)
    # Standard errors of the mean squares of 90 and 900 normal numbers, of which each bias is that of ten touches.
    assert np.mean(bias) == pytest.approx(1.0, abs=3 * np.sqrt(2 / 90))
    assert np.mean(error) == pytest.approx(1.0, abs=0.15)
