"""Calibration of a finger: recovery of known truth, covariance against repetition, and what cannot be identified."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import emcee
import numpy as np
import pytest
from known_fingers import ANGLES, SAMPLES, dataset, known_touches, sensor, true_chain
from plain_sampler import sample_plain
from scipy.special import logsumexp

import bayestouch
from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import Finger
from bayestouch.effects.stated import StatedModel
from bayestouch.errors import InputError
from bayestouch.finger.calibration import _noise_notes
from bayestouch.finger.density import FingerDensity
from bayestouch.finger.fit import fit_finger
from bayestouch.finger.known_touches import KnownTouches
from bayestouch.finger.priors import FingerPriors
from bayestouch.finger.sampling import sample_fit
from bayestouch.priors.parameters import LogNormal, Normal, Prior, Uniform
from bayestouch.priors.prior_text import priors_from_text
from bayestouch.results.reading import load_calibration
from bayestouch.sampling import ensembles

PLAIN_STEPS = 3_000


@pytest.fixture(scope="module")
def calibration() -> bayestouch.Calibration:
    return bayestouch.calibrate(dataset(known_touches(1)), draws=2000, seed=3)


def test_noiseless_touches_return_the_truth() -> None:
    priors, _ = FingerPriors.of(sensor())
    # Noise small enough that priors do not pull: their pull is (noise/prior)² of the distance, below 1e-4.
    means = known_touches(0, noise=1e-3).averaged()
    fit, used = fit_finger(means, sensor().body, replace(priors, force_noise=LogNormal(1e-3, 0.1)))
    truth = true_chain()
    assert used.all()
    np.testing.assert_allclose(fit.chain.response, truth.response, rtol=2e-4)
    np.testing.assert_allclose(fit.chain.sensing_radius_mm, truth.sensing_radius_mm, atol=2e-3)
    np.testing.assert_allclose(fit.chain.angle, truth.angle, atol=2e-5)
    assert fit.chain.poisson_ratio == pytest.approx(truth.poisson_ratio, abs=2e-4)
    assert fit.chain.shear_modulus_MPa == pytest.approx(truth.shear_modulus_MPa, rel=3e-3)


def test_sd_of_a_reading_has_the_error_of_the_load() -> None:
    """Standardised residuals of large readings are about 1 with a noisy force sensor; above 2.8 without its part."""
    design = bayestouch.FingerDesign(
        n_elements=5,
        calibration_span_deg=30.0,
        edge_step_deg=1.0,
        flat_step_deg=3.0,
        touch_step_deg=20.0,
        noise_percent_peak=1.0,
        force_noise_sd=10.0,
        samples_per_touch=5,
    )
    made = bayestouch.simulate(design, seed=0).dataset
    means = made.calibration.averaged()
    fit, used = fit_finger(means, made.sensor.body, FingerPriors.of(made.sensor)[0])
    large = np.abs(fit.predicted) > 0.5 * np.abs(fit.predicted).max(axis=0)
    z = ((means.readings[used] - fit.predicted) / fit.sd)[large]
    assert 0.6 < np.sqrt(np.mean(z**2)) < 1.2


def test_posterior_covers_the_truth(calibration: bayestouch.Calibration) -> None:
    """Standardised errors of 23 parameters: their mean square is 1 ± sqrt(2/23); 5 such sds are allowed."""
    truth = true_chain()
    expected = {
        "response": truth.response,
        "r_s": truth.sensing_radius_mm,
        "theta_s": np.degrees(truth.angle),
        "sigma": truth.poisson_ratio,
        "mu": truth.shear_modulus_MPa,
    }
    z = np.concatenate(
        [
            np.atleast_1d((draws.mean(axis=(0, 1)) - expected[name]) / draws.std(axis=(0, 1)))
            for name, draws in calibration.posterior.items()
            if name in expected
        ]
    )
    assert len(z) == 23
    assert np.mean(z**2) == pytest.approx(1, abs=5 * np.sqrt(2 / 23))
    assert calibration.statistics["rhat"] < 1.02
    # 58 touches x 7 elements, less 23 parameters: the mean square scatters by sqrt(2/465)
    assert calibration.statistics["lack_of_fit"] == pytest.approx(1, abs=5 * np.sqrt(2 / 465))


def test_the_fit_of_readings_in_a_small_unit_goes_on_until_its_errors_settle() -> None:
    """Readings of 1e-12, as of farads: the same finger. A change of errors by 1e-8 ended the fit after one round."""
    table, priors = known_touches(1), FingerPriors.of(sensor())[0]
    counts, farads = (
        fit_finger(table.with_(readings=unit * table.readings).averaged(), sensor().body, priors)[0]
        for unit in (1.0, 1e-15)
    )
    np.testing.assert_allclose(farads.chain.shear_modulus_MPa, counts.chain.shear_modulus_MPa, rtol=1e-8)
    np.testing.assert_allclose(farads.chain.response, 1e-15 * counts.chain.response, rtol=1e-8)


@pytest.mark.parametrize("model", [None, StatedModel("finger", "layer", (("load_offset", {}),))])
def test_elements_without_readings_spend_no_parameters_in_the_lack_of_fit(model: StatedModel | None) -> None:
    """Two of seven dead: as a finger of five. Six more parameters of 69 x 5 readings would make it 2 % larger."""
    table, read = known_touches(1), [0, 1, 3, 4, 6]
    dead = np.where(np.isin(np.arange(len(ANGLES)), read), table.readings, np.nan)
    five = replace(sensor(), body=Finger(9.4, 12.7, 9.9, tuple(ANGLES[e] for e in read)))
    few = table.with_(readings=table.readings[:, read])
    found, expected = (
        bayestouch.calibrate(data, model=model, discrepancy="touch", draws=8).statistics["lack_of_fit"]
        for data in (dataset(table.with_(readings=dead)), DataSet(five, few, few))
    )
    assert found == pytest.approx(expected, rel=1e-3)


def test_few_draws_that_are_kept_do_not_change_what_touches_are_read_with() -> None:
    """Covariance and noise are those of 200 draws of the same chains: 8 draws alone have a rank of 7."""
    data = dataset(known_touches(1))
    few, many = (bayestouch.calibrate(data, draws=draws, seed=2) for draws in (8, 200))
    assert few.posterior["sigma"].shape == (4, 2)
    np.testing.assert_array_equal(few.posterior["r_s"], many.posterior["r_s"][:, ::25])
    of_draws = {name: values.reshape(200, -1) for name, values in many.posterior.items()}
    linear = [of_draws["response"], of_draws["r_s"], np.radians(of_draws["theta_s"])]
    expected = np.cov(np.column_stack([*linear, of_draws["sigma"], np.log(of_draws["mu"])]).T)
    sd = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(few.covariance / np.outer(sd, sd), expected / np.outer(sd, sd), atol=1e-9)
    np.testing.assert_allclose(few.noise.tactile_sd, np.sqrt((of_draws["noise_sd"] ** 2).mean(axis=0)))


def test_density_is_the_posterior_sample_by_sample() -> None:
    """Every sample's reading and load with its noise and the touch's true load integrated over numerically.

    The quick series against the tables (1e-4 of the peak), sums of squares against samples, and a chain that is
    linear over the load's error against quadrature: differences of the log density within 0.05.
    """
    priors, _ = FingerPriors.of(sensor())
    raw = known_touches(2, step=6.0)
    fit, _ = fit_finger(raw.averaged(), sensor().body, priors)
    density, at = FingerDensity.of(fit), fit.likelihood.layout
    rng = np.random.default_rng(4)
    chains = fit.laplace.mode + rng.standard_normal((6, at.n_chain)) @ np.linalg.cholesky(fit.laplace.covariance).T
    noise = fit.noise_shape.mean + 0.2 * rng.standard_normal((6, at.size - at.n_chain))
    vectors = np.concatenate([chains, noise], axis=1)
    nodes, weights = np.polynomial.hermite_e.hermegauss(9)
    known = fit.likelihood.known
    reading, load = (values.reshape(len(known.load), SAMPLES, -1) for values in (raw.readings, raw.load))

    def slow(vector: np.ndarray) -> float:
        chain = fit.likelihood.chain(vector)
        s, force = np.exp(vector[at.noise]), np.exp(vector[at.force_noise])
        d = np.exp(vector[at.log_discrepancy]) * s / np.sqrt(SAMPLES)
        # the samples of a touch share its discrepancy
        shared = np.linalg.inv(np.eye(SAMPLES)[None] * s[:, None, None] ** 2 + d[:, None, None] ** 2)
        total = -0.5 * len(load) * np.linalg.slogdet(np.linalg.inv(shared))[1].sum()
        by_node = []
        for node in nodes:
            true = load.mean(axis=(1, 2)) + node * force / np.sqrt(SAMPLES)
            miss = reading - chain.predict(known.radius_mm, known.angle, true)[:, None]
            quadratic = np.einsum("tie,eij,tje->t", miss, shared, miss)
            by_node.append(-0.5 * quadratic)
        total += logsumexp(np.stack(by_node), b=weights[:, None], axis=0).sum()
        about = load[..., 0] - load.mean(axis=(1, 2))[:, None]
        total -= about.size * (1 - 1 / SAMPLES) * np.log(force) + 0.5 * (about**2).sum() / force**2
        prior = (vector - fit.likelihood.prior.mean) / fit.likelihood.prior.spread
        return float(total - 0.5 * prior @ prior)

    quick = density(vectors)
    exact = np.array([slow(vector) for vector in vectors])
    assert np.ptp(exact) > 10
    np.testing.assert_allclose(quick - quick[0], exact - exact[0], atol=0.05)


def test_missing_readings_cost_information_and_nothing_else() -> None:
    touches = known_touches(6)
    readings = touches.readings.copy()
    readings[::5, 2] = np.nan
    full = bayestouch.calibrate(dataset(touches), draws=400, seed=0)
    part = bayestouch.calibrate(dataset(touches.with_(readings=readings)), draws=400, seed=0)
    sd = part.posterior["r_s"].std(axis=(0, 1))
    assert sd[2] > full.posterior["r_s"].std(axis=(0, 1))[2] * 0.95
    np.testing.assert_allclose(part.mode["r_s"], full.mode["r_s"], atol=4 * sd.max())


def test_a_dead_element_is_left_out() -> None:
    touches = known_touches(7)
    readings = touches.readings.copy()
    readings[:, 4] = np.nan
    result = bayestouch.calibrate(dataset(touches.with_(readings=readings)), draws=200, seed=0)
    others = np.delete(np.arange(len(ANGLES)), 4)
    np.testing.assert_allclose(result.mode["r_s"][others], true_chain().sensing_radius_mm[others], atol=0.15)
    # nothing is known of the dead one but its prior
    assert result.posterior["r_s"].std(axis=(0, 1))[4] > 0.1


def test_error_and_noise_leave_out_an_element_that_always_reads_the_same() -> None:
    """In percent of the peak they are means over the others, from their residuals and peaks; as if it was missing."""
    touches, stuck = known_touches(7), np.arange(len(ANGLES)) == 4
    made = [
        bayestouch.calibrate(dataset(touches.with_(readings=np.where(stuck, value, touches.readings))), draws=200)
        for value in (5.0, np.nan)
    ]
    rows, others = made[0].rows, ~stuck
    assert (np.isnan(rows.observed) == stuck).all()
    assert (rows.counts[:, stuck] == 0).all()
    rms = np.sqrt(((rows.observed - rows.predicted)[:, others] ** 2).mean(axis=0))
    peak = np.abs(true_chain().response[others]) * np.nanmean(rows.load)
    found = made[0].statistics
    # The responses are fitted to about 1 %.
    assert found["error_percent_peak"] == pytest.approx(100 * (rms / peak).mean(), rel=0.05)
    assert found["noise_percent_peak"] == pytest.approx(
        100 * (made[0].noise.tactile_sd[others] / peak).mean(), rel=0.05
    )
    assert found == made[1].statistics


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"indenter_radius_mm": np.nan}, "known indenter"),
        ({"load": np.nan}, "measured load"),
        ({"load": 0.0}, "no calibration touch is in contact"),
        ({"load": -1.0}, "no touch has a load above zero"),
    ],
)
def test_what_cannot_be_identified_is_said(change: dict[str, float], words: str) -> None:
    touches = known_touches(8)
    filled = {name: np.full(touches.n_rows, value) for name, value in change.items()}
    with pytest.raises(InputError, match=words) as caught:
        bayestouch.calibrate(dataset(touches.with_(**filled)))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        ({"sigma": Uniform(0.5, 0.6)}, "prior of sigma: nothing of the prior .* lies between 0 and 0.4999"),
        ({"sigma": Normal(0.55, 0.01)}, "prior of sigma: nothing of the prior"),
        ({"r_s": Uniform(12.8, 13.0)}, "prior of r_s: nothing of the prior"),
        ({"r_s": Uniform(10.5, 11.0)}, "excludes the sensing radius as built, 9.9 mm"),
        ({"r_s": Normal(11.5, 0.1)}, "excludes the sensing radius as built, 9.9 mm"),
        ({"theta_s": Uniform(1.0, 2.0)}, "excludes the angles as built"),
        ({"theta_s": LogNormal(1.0, 1.0)}, "expected a normal or uniform prior"),
        ({"mu": Uniform(-2.0, -1.0)}, "prior of mu: nothing of the prior"),
        ({"gain": LogNormal(1.0, 1.0)}, "it follows from response"),
        ({"nu": Normal(0.4, 0.1)}, "expected one of sigma, mu"),
    ],
)
def test_contradictory_priors_are_refused(stated: dict[str, Prior], words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        bayestouch.calibrate(dataset(known_touches(1)), priors=stated)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("sigma=normal:0.47,0", "sd > 0"),
        ("sigma=uniform:0.48,0.46", "low < high"),
        ("mu=log-normal:0.15,0.9", "factor above 1"),
        ("mu=log-normal:-1,2", "median"),
        ("mu=gamma:1,2", "expected normal:MEAN,SD"),
        ("mu=normal:1", "expected normal:MEAN,SD"),
        ("mu=normal:a,b", "expected normal:MEAN,SD"),
        ("mu", "expected NAME=normal"),
    ],
)
def test_priors_that_say_nothing_are_refused(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        priors_from_text([text])
    assert "\n" not in str(caught.value)


def test_priors_as_text() -> None:
    found = priors_from_text(["sigma=normal:0.47,0.01", "r_s=uniform:9.6,10.4", "mu=log-normal:0.15,1.35"])
    assert found == {"sigma": Normal(0.47, 0.01), "r_s": Uniform(9.6, 10.4), "mu": LogNormal(0.15, np.log(1.35))}
    with pytest.raises(InputError, match="twice"):
        priors_from_text(["mu=normal:1,2", "mu=normal:1,2"])


def test_a_stated_prior_is_used() -> None:
    """So narrow a prior of σ, five data standard deviations off, moves it there and others along; a uniform one holds.

    With data N(0.465, 0.0007²) and a prior N(0.4685, 0.0002²) the posterior is at 0.4682 ± 0.0002.
    """
    data = dataset(known_touches(1))
    free = bayestouch.calibrate(data, draws=200)
    held = bayestouch.calibrate(data, draws=400, priors={"sigma": Normal(0.4685, 0.0002), "mu": Uniform(0.05, 0.12)})
    s, m = free.posterior["sigma"].std(), free.posterior["sigma"].mean()
    expected = (m / s**2 + 0.4685 / 0.0002**2) / (1 / s**2 + 1 / 0.0002**2)
    # the two parameters are correlated, and the uniform prior cuts μ off: a third of the way is left to that
    assert abs(held.posterior["sigma"].mean() - expected) < 0.3 * abs(expected - m)
    assert held.posterior["mu"].max() < 0.12 and held.posterior["mu"].min() > 0.05
    named = {parameter.name: parameter for parameter in held.parameters}
    assert str(named["sigma"].prior) == "normal, 0.4685 ± 0.0002, within 0 to 0.4999"


def test_an_element_nobody_touched_is_named() -> None:
    touches = known_touches(9)
    with pytest.raises(InputError, match="e07"):
        bayestouch.calibrate(dataset(touches.select(touches.angle_deg < 5)))


def test_a_table_without_angles_is_refused() -> None:
    for e_map in ("model", "empirical"):
        with pytest.raises(InputError, match=r"^no calibration touch has a location: angle_deg needed$"):
            bayestouch.calibrate(dataset(known_touches(9).with_(angle_deg=None)), e_map=e_map)


def test_touches_without_load_are_left_out_and_said() -> None:
    touches = known_touches(1)
    load = np.where(touches.touch == 3, -0.4, touches.load)
    result = bayestouch.calibrate(dataset(touches.with_(load=load)), draws=40)
    assert 3 not in result.rows.touch and len(result.rows.touch) == touches.n_touches - 1
    assert any("1 calibration touches without" in note for note in result.notes)


def test_fewer_samples_than_parameters() -> None:
    """Three touches above e04, read by the three elements near them: nine numbers for eleven unknowns."""
    touches = known_touches(1)
    few = touches.select(np.isin(touches.angle_deg, [-1.0, 1.0]))
    reach = np.abs(few.angle_deg[:, None] - np.array(ANGLES)) < 15
    with pytest.raises(InputError, match=r"9 mean readings for 11 parameters .*add touches") as caught:
        bayestouch.calibrate(dataset(few.with_(readings=np.where(reach, few.readings, np.nan))))
    assert "\n" not in str(caught.value)


def test_an_element_read_twice_is_named() -> None:
    touches = known_touches(1)
    readings = touches.readings.copy()
    readings[~np.isin(touches.touch, [20, 21]), 3] = np.nan
    with pytest.raises(InputError, match=r"fewer than 3 calibration touches were read by element e04.*3 places"):
        bayestouch.calibrate(dataset(touches.with_(readings=readings)))


def test_options_of_the_other_body_are_refused() -> None:
    with pytest.raises(InputError, match="pads"):
        bayestouch.calibrate(dataset(known_touches(1)), kernel="layer")


def test_an_identified_map_reads_touches_as_the_model_does_where_the_model_is_right(tmp_path: Path) -> None:
    """Both maps read the same touches: estimates differ by less than what either leaves uncertain; and it is saved."""
    data = dataset(known_touches(12))
    model = bayestouch.calibrate(data, draws=200)
    identified = bayestouch.calibrate(data, draws=200, e_map="empirical")
    identified.save(tmp_path / "identified.nc")
    loaded = load_calibration(tmp_path / "identified.nc")
    a, b = bayestouch.infer(data.touches, model), bayestouch.infer(data.touches, loaded)
    for name in ("R", "theta_c", "P"):
        z = (a.mean(name) - b.mean(name)) / np.hypot(a.sd(name), b.sd(name))
        assert np.sqrt(np.mean(z**2)) < 0.5, name


@pytest.mark.slow
def test_moves_of_emcee_draw_the_same_calibration(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three elements, 18 unknowns, by differential evolution: means and sds within Monte Carlo error.

    The sd of 1,000 draws of independent walkers scatters by 1/sqrt(2 ESS), 3 %.
    """
    # 1,400 steps: walkers are independent after some 50 in these coordinates.
    monkeypatch.setattr(ensembles, "STEPS", 48)
    few = slice(2, 5)
    touches = known_touches(11, step=3.0)
    part = touches.with_(readings=touches.readings[:, few])
    data = DataSet(replace(sensor(), body=Finger(9.4, 12.7, 9.9, ANGLES[few])), part, part, None, ())
    usual = bayestouch.calibrate(data, draws=4000, seed=1)
    moved = bayestouch.calibrate(data, draws=1000, seed=1, moves=emcee.moves.DEMove())
    assert moved.statistics["rhat"] < 1.02 and moved.statistics["ess_bulk"] > 400
    for name, a in usual.posterior.items():
        b = moved.posterior[name]
        sd = a.std(axis=(0, 1))
        assert np.all(np.abs(a.mean(axis=(0, 1)) - b.mean(axis=(0, 1))) < 4.5 * sd * np.sqrt(1 / 400 + 1 / 2000)), name
        assert np.all(np.abs(b.std(axis=(0, 1)) / sd - 1) < 4.5 * np.sqrt(1 / 800 + 1 / 4000)), name
    with pytest.raises(InputError, match="moves is an option of fingers"):
        bayestouch.calibrate(
            bayestouch.simulate(bayestouch.PadDesign(n_touches=30), seed=0).dataset, moves=emcee.moves.DEMove()
        )


@pytest.mark.slow  # minutes: plain emcee needs millions of evaluations for 18 correlated parameters
def test_three_elements_agree_with_a_long_plain_emcee_run() -> None:
    """Noise, discrepancies and force noise among the parameters; the plain run knows no proposal and no transform.

    Means within 4 Monte Carlo standard errors, sds within 4.5 %, 5 and 95 % quantiles within 0.13 sd. Both runs are so
    long (ESS of 7,000 and 10,000) that Monte Carlo error alone breaks none of these: an sd scatters by 1.1 %, a
    quantile by 2.1 sqrt(1/7,000 + 1/10,000) = 0.033 sds.
    """
    few = slice(2, 5)
    touches = known_touches(11, step=3.0)
    body = Finger(9.4, 12.7, 9.9, ANGLES[few])
    part = touches.with_(readings=touches.readings[:, few])
    priors, _ = FingerPriors.of(sensor())
    fit, _ = fit_finger(part.averaged(), body, priors)
    quick = sample_fit(fit, 12_000, 1)
    rng = np.random.default_rng(0)
    chains = rng.multivariate_normal(fit.laplace.mode, fit.laplace.covariance, size=(4, 64))
    noise = fit.noise_shape.mean + 0.1 * rng.standard_normal((4, 64, len(fit.noise_shape.mean)))
    start = np.concatenate([chains, noise], axis=-1)
    # it starts at the normal approximation, and 800 steps are sixteen times its autocorrelation time of 50
    plain = sample_plain(FingerDensity.of(fit), start, steps=PLAIN_STEPS, left_out=800, thin=10, seed=2)
    assert plain.rhat.max() < 1.01 and quick.rhat.max() < 1.01
    for i in range(fit.likelihood.layout.size):
        a, b = quick.draws[:, :, 0, i], plain.draws[..., i]
        error = a.std() * np.sqrt(1 / quick.ess_bulk[0, i] + 1 / plain.ess_bulk[i])
        assert abs(a.mean() - b.mean()) < 4 * error, i
        assert a.std() == pytest.approx(b.std(), rel=0.045), i
        for probability in (0.05, 0.95):
            assert abs(np.quantile(a, probability) - np.quantile(b, probability)) < 0.13 * b.std(), i


def test_a_note_names_repeats_that_are_all_equal() -> None:
    """Every element was read twice, and one of them has the same number in all samples of a touch."""
    table = known_touches(1, step=6.0)
    readings = table.readings.copy()
    readings[:, 2] = np.repeat(readings[::SAMPLES, 2], SAMPLES)
    priors, _ = FingerPriors.of(sensor())
    for values, noted in ((table.readings, False), (readings, True)):
        known, _ = KnownTouches.of(table.with_(readings=values).averaged(), sensor().body)
        assert known.repeated != noted
        said = any("or its samples are all equal" in note for note in _noise_notes(known, priors))
        assert said == noted
