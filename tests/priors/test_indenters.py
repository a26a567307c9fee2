"""Touches under other priors over indenters, against dense quadrature: densities, known tips, edge against round."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from known_fingers import dataset, known_touches
from touch_quadrature import PROBABILITIES, OneTouch, integrate

import bayestouch
from bayestouch import EdgeOrRound, IndenterDistribution, KnownTips, UniformCurvature, UniformRadius
from bayestouch.contact import composite_radius
from bayestouch.data.touches import Touches, touches_from
from bayestouch.errors import InputError
from bayestouch.finger.calibration import finger_chain
from bayestouch.priors.parameters import LogNormal
from bayestouch.results.reading import load_touches

OUTER = 12.7
TIPS = (0.0, 0.5, 2.0, np.inf)
METHODS = ("emcee", "importance")
# r_c (mm), location (degree), samples, force reading: of a tip, between tips, at the array's end, beyond it.
CASES = [
    (0.5, 0.0, 1, True),
    (0.2, 4.4, 1, False),
    (np.inf, -10.0, 1, True),
    (2.0, 27.0, 1, False),
    (1.0, 13.0, 8, True),
    (8.0, 31.0, 1, True),
]


@dataclass(frozen=True, eq=False)
class Read:
    """Touches of a calibrated finger, as a table and one by one for the oracle."""

    calibration: bayestouch.Calibration
    table: Touches
    single: list[OneTouch]


@pytest.fixture(scope="module")
def read() -> Read:
    calibration = bayestouch.calibrate(dataset(known_touches(1, step=3.0)), draws=200)
    chain = finger_chain(calibration)
    rng = np.random.default_rng(8)
    touch, readings, loads, single = [], [], [], []
    for number, (r_c, angle, samples, force) in enumerate(CASES):
        clean = chain.predict(composite_radius(r_c, OUTER), np.radians(angle), 200.0)
        sd = calibration.noise.mean_sd(np.ones(clean.shape), clean)
        rows = clean + sd * rng.standard_normal((samples, len(clean)))
        load = 200.0 + calibration.noise.force_sd * rng.standard_normal(samples) if force else np.full(samples, np.nan)
        touch += [number] * samples
        readings.append(rows)
        loads.append(load)
        single.append(OneTouch.of(calibration, rows.mean(axis=0), samples, float(load.mean())))
    table = touches_from(touch=np.array(touch), readings=np.concatenate(readings), load=np.concatenate(loads))
    return Read(calibration, table, single)


def infer(read: Read, indenter: object, method: str, draws: int = 32768) -> bayestouch.TouchPosteriors:
    options = {"method": method, "draws": draws, "seed": 4, "workers": 1, "check_sensor": False}
    return bayestouch.infer(read.table, read.calibration, indenter=indenter, plug_in=True, **options)


def check(result: bayestouch.TouchPosteriors, touch: int, name: str, expected: np.ndarray, where: str) -> None:
    """Mean and shares below the 5 and 95 % quantiles within 4 Monte Carlo standard errors, sd within 3 %."""
    draws = result.posterior[name][:, :, touch].ravel()
    mean, sd, *ends = expected
    ess = result.sample_stats["ess_bulk"][touch]
    # plus 0.002 sd for the reading table: it is off by up to 0.02 in the log likelihood
    assert abs(draws.mean() - mean) < 4 * sd / np.sqrt(ess) + 0.002 * sd, where
    assert draws.std() == pytest.approx(sd, rel=0.03), where
    for end, probability in zip(ends, PROBABILITIES, strict=True):
        assert abs((draws < end).mean() - probability) < 4 * np.sqrt(0.05 * 0.95 / ess) + 0.001, where


@pytest.mark.parametrize("indenter", [UniformCurvature(0.3), IndenterDistribution(LogNormal(2.0, 0.7))], ids=str)
def test_densities_of_the_user_agree_with_quadrature(read: Read, indenter: UniformCurvature) -> None:
    results = [infer(read, indenter, method) for method in METHODS]
    prior = indenter.radius_prior(OUTER)
    for number, single in enumerate(read.single):
        expected = integrate(single, prior).statistics
        for name in {"R", "theta_c", "P"} & set(expected):
            for result in results:
                check(result, number, name, expected[name], f"touch {number} {name}")


@pytest.mark.parametrize("method", METHODS)
def test_known_tips_agree_with_quadrature(read: Read, method: str) -> None:
    weights = (0.4, 0.3, 0.2, 0.1)
    result = infer(read, KnownTips(TIPS, weights), method)
    assert result.tips is not None
    assert result.tips.names == ("0", "0.5", "2", "inf")
    probability = result.tips.probability
    np.testing.assert_allclose(probability.sum(axis=1), 1.0, atol=1e-12)
    for number, single in enumerate(read.single):
        parts = [integrate(single, radius_mm=float(composite_radius(tip, OUTER))) for tip in TIPS]
        log_weight = np.array([part.log_evidence for part in parts]) + np.log(weights)
        expected = np.exp(log_weight - np.logaddexp.reduce(log_weight))
        # Evidence by 512 lattice points and by table, where it matters.
        matters = expected > 1e-6
        np.testing.assert_allclose(
            result.tips.log_probability[number, matters], np.log(expected[matters]), atol=0.02, err_msg=str(number)
        )
        ess = result.sample_stats["ess_bulk"][number]
        for k, tip in enumerate(TIPS):
            drawn = result.posterior["r_c"][:, :, number] == tip
            np.testing.assert_array_equal(drawn, result.posterior["R"][:, :, number] == composite_radius(tip, OUTER))
            error = np.sqrt(max(expected[k] * (1 - expected[k]), 1e-4) / ess)
            assert abs(drawn.mean() - expected[k]) < 4 * error, (number, tip)
        for name in ("theta_c", "P"):
            means, sds = np.array([part.statistics[name][:2] for part in parts]).T
            mean = expected @ means
            sd = np.sqrt(expected @ (sds**2 + means**2) - mean**2)
            draws = result.posterior[name][:, :, number]
            assert abs(draws.mean() - mean) < 4 * sd / np.sqrt(ess) + 0.002 * sd, (number, name)
            assert draws.std() == pytest.approx(sd, rel=0.03), (number, name)


@pytest.mark.parametrize("indenter", [EdgeOrRound(0.3), EdgeOrRound(0.5, UniformCurvature(0.3))], ids=str)
def test_edge_against_round_agrees_with_quadrature(read: Read, indenter: EdgeOrRound) -> None:
    results = [infer(read, indenter, method) for method in METHODS]
    prior = indenter.round.radius_prior(OUTER)
    for number, single in enumerate(read.single):
        edge = integrate(single, radius_mm=0.0).log_evidence + np.log(indenter.edge_probability)
        round_ = integrate(single, prior).log_evidence + np.log(1 - indenter.edge_probability)
        probability = 1 / (1 + np.exp(round_ - edge))
        for result in results:
            assert result.tips is not None
            assert result.tips.names == ("0", "round")
            # Far below any use, the evidence comes from a tail of a fit: there it need not be good to hundredths.
            allowed = 0.03 if abs(edge - round_) < 15 else 0.5
            assert result.tips.log_odds[number, 0] == pytest.approx(edge - round_, abs=allowed), number
            drawn = result.posterior["R"][:, :, number] == 0.0
            error = np.sqrt(max(probability * (1 - probability), 1e-4) / result.sample_stats["ess_bulk"][number])
            assert abs(drawn.mean() - probability) < 4 * error, number


def test_probabilities_of_tips_are_calibrated(read: Read) -> None:
    """Tips drawn from their prior, touches read: what has probability p happens in a share p of the touches."""
    calibration, chain = read.calibration, finger_chain(read.calibration)
    rng = np.random.default_rng(2)
    n, weights = 400, np.array([0.4, 0.3, 0.2, 0.1])
    tip = rng.choice(4, n, p=weights)
    angle, load = rng.uniform(-30, 30, n), rng.uniform(20, 300, n)
    clean = chain.predict(composite_radius(np.array(TIPS)[tip], OUTER), np.radians(angle), load)
    sd = calibration.noise.mean_sd(np.ones(clean.shape), clean)
    table = touches_from(
        touch=np.arange(n),
        readings=clean + sd * rng.standard_normal(clean.shape),
        load=load + calibration.noise.force_sd * rng.standard_normal(n),
    )
    result = bayestouch.infer(
        table, calibration, indenter=KnownTips(TIPS, tuple(weights)), plug_in=True, draws=512, check_sensor=False
    )
    assert result.tips is not None
    p = result.tips.probability
    happened = np.arange(4) == tip[:, None]
    assert p[happened].std() > 0.1, "every tip was plain to see: nothing is tested"
    # Sum of independent zero-mean differences of variance p (1 - p): four of its sds.
    assert np.all(np.abs((happened - p).sum(axis=0)) < 4 * np.sqrt((p * (1 - p)).sum(axis=0)))
    # Weighted by p, which sees over- and underconfidence.
    assert np.all(np.abs((p * (happened - p)).sum(axis=0)) < 4 * np.sqrt((p**3 * (1 - p)).sum(axis=0)))


def test_tips_are_saved_and_read(read: Read, tmp_path: Path) -> None:
    import xarray

    result = infer(read, EdgeOrRound(), "importance", draws=256)
    result.save(tmp_path / "tips.nc")
    again = load_touches(tmp_path / "tips.nc")
    assert again.tips is not None
    assert result.tips is not None
    assert again.tips.names == ("0", "round")
    np.testing.assert_array_equal(again.tips.log_probability, result.tips.log_probability)
    assert again.settings["indenter"] == "edge-or-round:0.5"
    with xarray.open_datatree(tmp_path / "tips.nc", engine="h5netcdf") as tree:
        group = tree["tips"]
        assert group["tip_probability"].dims == ("touch", "tip")
        assert group["r_c"].attrs["units"] == "mm"
        np.testing.assert_allclose(group["tip_probability"].sel(tip="0"), result.tips.probability[:, 0])
    assert "r_c" in set(infer(read, KnownTips((np.inf,)), "emcee", draws=64).to_dataframe()["parameter"])


def test_infinite_radii_can_be_summarised(read: Read) -> None:
    result = infer(read, KnownTips((1.0, np.inf)), "emcee", draws=256)
    low, high = result.interval("r_c", 0.9)
    assert not np.isnan(np.concatenate([low, high])).any()
    assert np.isinf(result.mean("r_c")[2])
    assert np.isnan(result.sd("r_c")[2])


def test_what_is_no_prior_is_refused(read: Read) -> None:
    with pytest.raises(InputError, match="KnownTips"):
        infer(read, (0, 2), "emcee")
    with pytest.raises(InputError, match=r"^indenter: expected a prior over indenters such as .*, got <class"):
        infer(read, KnownTips, "emcee")
    with pytest.raises(InputError, match=r"^indenter: expected a density of round indenters, got <class"):
        EdgeOrRound(0.5, UniformRadius)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"^indenter: expected a prior such as LogNormal\(2.0, 0.5\), got <class"):
        IndenterDistribution(LogNormal)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (lambda: KnownTips(3.0), "radius_mm: expected a list of numbers, got 3.0"),  # type: ignore[arg-type]
        (lambda: KnownTips(("a",)), "radius_mm: expected a list of numbers, got ('a',)"),  # type: ignore[arg-type]
        (lambda: KnownTips(TIPS, weights=1.0), "weights: expected a list of numbers, got 1.0"),  # type: ignore[arg-type]
        (lambda: UniformCurvature("a"), "sharpest_mm: expected a number, got 'a'"),  # type: ignore[arg-type]
        (lambda: EdgeOrRound(None), "edge_probability: expected a number, got None"),  # type: ignore[arg-type]
    ],
)
def test_what_is_no_number_is_refused(made: Callable[[], object], message: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(message)}$"):
        made()
