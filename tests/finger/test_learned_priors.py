"""Priors learned from earlier fingers of a build; the fingers are of the independent simulator."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from build_of_fingers import SAMPLES, Build, Built
from scipy.stats import t as student

import bayestouch
from bayestouch.commands.cli import main
from bayestouch.data.dataset import DataSet, save_dataset
from bayestouch.errors import InputError
from bayestouch.finger.learned_priors import evidence_of, learned_priors, student_of
from bayestouch.finger.same_build import check_other_touches, check_same_build
from bayestouch.model.body import body_of_kind
from bayestouch.priors.parameters import Normal, Prior, StudentT

BUILD = Build()
FEW = 9


@pytest.fixture(scope="module")
def earlier() -> list[bayestouch.Calibration]:
    """Calibrations of five fingers with 45 touches each."""
    rng = np.random.default_rng(11)
    datasets = [BUILD.draw(rng).dataset(rng) for _ in range(5)]
    return [bayestouch.calibrate(dataset, draws=400, seed=seed) for seed, dataset in enumerate(datasets)]


@pytest.fixture(scope="module")
def learned(earlier: list[bayestouch.Calibration]) -> tuple[dict[str, Prior], tuple[str, ...]]:
    """Priors of the sixth finger, and notes."""
    return learned_priors([(str(i), each) for i, each in enumerate(earlier)], BUILD.sensor, "layer", SAMPLES)


def sixth(seed: int, **how: float) -> tuple[Built, DataSet]:
    """Another finger, and few touches."""
    rng = np.random.default_rng([seed, 6])
    finger = BUILD.draw(rng, **how)
    return finger, finger.dataset(rng, FEW)


def errors(calibration: bayestouch.Calibration, finger: Built, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Errors of the posterior means over their sds, and the sds."""
    draws = calibration.posterior[name]
    mean, sd = np.atleast_1d(draws.mean(axis=(0, 1))), np.atleast_1d(draws.std(axis=(0, 1)))
    return (mean - finger.truth[name]) / sd, sd


def test_own_prior_is_divided_out() -> None:
    """Draws of the posterior of a known likelihood give this likelihood; of the third value the data say nothing."""
    rng = np.random.default_rng(0)
    data = np.array([[40.0, 12.0, 0.0], [12.0, 9.0, 0.0], [0.0, 0.0, 0.0]])
    estimate, centre, prior = np.array([0.5, -0.4, 0.0]), np.array([0.2, 0.1, -0.3]), np.array([1.0, 2.0, 4.0])
    covariance = np.linalg.inv(data + np.diag(prior))
    mean = covariance @ (data @ estimate + prior * centre)
    # 40,000 draws: elements of a precision scatter by 1 %
    evidence = evidence_of(rng.multivariate_normal(mean, covariance, 40_000), np.inf, centre, prior)
    np.testing.assert_allclose(evidence.precision[0], data, atol=0.9)
    np.testing.assert_allclose(evidence.shift[0], data @ estimate, atol=0.5)
    assert np.linalg.eigvalsh(evidence.precision[0]).min() >= -1e-9


@pytest.mark.parametrize("dof", [5.0, 12.0])
def test_student_of_samples(dof: float) -> None:
    """Quantiles at equal steps of probability, so that only the shape is asked."""
    samples = 3 + 0.5 * student.ppf((np.arange(100_000) + 0.5) / 100_000, dof)
    assert student_of(samples) == pytest.approx((3.0, 0.5, dof), rel=1e-3)


def test_too_heavy_tails_keep_the_central_95_percent() -> None:
    samples = student.ppf((np.arange(100_000) + 0.5) / 100_000, 2.5)
    centre, scale, dof = student_of(samples)
    assert dof == 4
    assert centre + scale * student.ppf(0.975, 4) == pytest.approx(student.ppf(0.975, 2.5), rel=1e-3)


def test_priors_hold_what_the_fingers_had_in_common(learned: tuple[dict[str, Prior], tuple[str, ...]]) -> None:
    """The build's means within 3 sds of a mean of five fingers, and every prior wider than the population."""
    priors, notes = learned
    sigma, depth = priors["sigma"], priors["r_s"]
    assert isinstance(sigma, StudentT) and isinstance(depth, StudentT)
    assert sigma.centre == pytest.approx(BUILD.sigma, abs=3 * BUILD.sigma_sd / np.sqrt(5))
    assert BUILD.sigma_sd / 2 < sigma.scale < 0.01  # the default prior has 0.02
    assert depth.centre == pytest.approx(BUILD.depth, abs=3 * 0.05 / np.sqrt(5))
    assert np.hypot(BUILD.depth_sd, BUILD.depth_within) / 1.5 < depth.scale < 0.2  # the default prior has 0.33
    low, high = np.log(priors["mu"].quantile([0.16, 0.84]))
    assert low < np.log(BUILD.mu) < high
    assert 2 * BUILD.mu_sd / 2 < high - low < np.log(1.35)
    assert len(notes) == len(priors) == 6
    assert all("5 earlier fingers" in note for note in notes)


@pytest.mark.slow
def test_sixth_finger_is_better_known_and_as_well_covered(learned: tuple[dict[str, Prior], tuple[str, ...]]) -> None:
    """Five further fingers with nine touches: smaller sds, and errors of the size of the sds.

    Of σ and μ there are 10 errors that are nearly independent: rms z is 1 ± 0.22, and 3 such sds are allowed.
    """
    z: dict[str, list[np.ndarray]] = {"sigma": [], "mu": [], "r_s": []}
    share: dict[str, list[float]] = {name: [] for name in z}
    for seed in range(5):
        finger, dataset = sixth(seed)
        alone = bayestouch.calibrate(dataset, draws=400)
        like = bayestouch.calibrate(dataset, priors=learned[0], draws=400)
        assert like.statistics["rhat"] < 1.05
        for name in z:
            error, sd = errors(like, finger, name)
            z[name].append(error)
            share[name].append(float(np.mean(sd) / np.mean(errors(alone, finger, name)[1])))
    assert np.mean(share["sigma"]) < 0.9
    assert np.mean(share["mu"]) < 0.95
    assert np.mean(share["r_s"]) < 0.95
    rubber = np.concatenate([*z["sigma"], *z["mu"]])
    assert np.sqrt(np.mean(rubber**2)) == pytest.approx(1, abs=0.66)
    assert np.sqrt(np.mean(np.concatenate(z["r_s"]) ** 2)) == pytest.approx(1, abs=0.5)


def test_finger_unlike_the_others_keeps_its_own_rubber(learned: tuple[dict[str, Prior], tuple[str, ...]]) -> None:
    """σ, log μ and depths five sds from the build: σ is that of the finger within three sds of its posterior."""
    finger, dataset = sixth(1, off=5.0)
    like = bayestouch.calibrate(dataset, priors=learned[0], draws=400)
    z, _ = errors(like, finger, "sigma")
    assert abs(z[0]) < 3
    assert like.posterior["sigma"].mean() > learned[0]["sigma"].quantile(0.9)


def test_file_and_command_say_what_was_learned(earlier: list[bayestouch.Calibration], tmp_path: Path) -> None:
    """Paths work as calibrations do, and a stated prior replaces one that is learned."""
    paths = [tmp_path / f"finger-{i}.nc" for i in range(2)]
    for path, calibration in zip(paths, earlier, strict=False):
        calibration.save(path)
    _, dataset = sixth(0)
    stated = {"sigma": Normal(0.47, 0.01)}
    bayestouch.calibrate(dataset, like=paths, priors=stated, draws=64).save(tmp_path / "sixth.nc")
    saved = bayestouch.load(tmp_path / "sixth.nc")
    assert isinstance(saved, bayestouch.Calibration)
    assert saved.settings["like"] == "finger-0.nc, finger-1.nc"
    assert [note.split()[2] for note in saved.notes if "learned" in note] == [
        "mu",
        "r_s",
        "response",
        "noise_sd",
        "discrepancy_sd",
    ]
    kinds = {each.name: type(each.prior).__name__ for each in saved.parameters}
    assert kinds["sigma"] == "Normal"
    assert (kinds["r_s"], kinds["mu"], kinds["noise_sd"]) == ("StudentT", "LogStudentT", "LogStudentT")
    with pytest.raises(InputError, match=r"sixth\.nc was itself calibrated with like"):
        bayestouch.calibrate(sixth(1)[1], like=[tmp_path / "sixth.nc"])


def test_command(earlier: list[bayestouch.Calibration], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`--like` twice; a file that is no calibration is one line and status 2."""
    for i in range(2):
        earlier[i].save(tmp_path / f"{i}.nc")
    save_dataset(sixth(0)[1], tmp_path / "sixth")
    like = ["--like", str(tmp_path / "0.nc"), "--like", str(tmp_path / "1.nc")]
    command = ["calibrate", str(tmp_path / "sixth"), "-o", str(tmp_path / "sixth.nc"), "--draws", "64", *like]
    assert main(command) == 0
    assert "learned from 2 earlier fingers" in "".join(capsys.readouterr())
    (tmp_path / "0.nc").write_text("nothing")
    (tmp_path / "sixth.nc").unlink()
    assert main(command) == 2
    said = "".join(capsys.readouterr())
    assert "0.nc" in said and "Traceback" not in said
    assert not (tmp_path / "sixth.nc").exists()


def test_other_builds_are_refused(earlier: list[bayestouch.Calibration]) -> None:
    one, (_, dataset) = earlier[0], sixth(0)
    body = replace(one.sensor.body, outer_radius_mm=13.0)
    deeper = replace(one.sensor.body, sensing_radius_mm=10.5)
    turned = replace(one.sensor.body, element_angles_deg=tuple(BUILD.angles + 1))
    fewer = replace(one.sensor.body, element_angles_deg=tuple(BUILD.angles[1:]))
    for changed, text in (
        (replace(one, sensor=replace(one.sensor, body=body)), "outer_radius_mm is 13, here 12.7"),
        (replace(one, sensor=replace(one.sensor, body=deeper)), "sensing_radius_mm is 10.5, here 9.9"),
        (replace(one, sensor=replace(one.sensor, body=turned)), "the angles of its elements"),
        (replace(one, sensor=replace(one.sensor, body=fewer)), "has 3 elements, this finger 4"),
        (replace(one, sensor=replace(one.sensor, reading_unit="mV")), "has readings in mV, this finger in counts"),
        (replace(one, settings={**one.settings, "contact": "hertz"}), "contact model 'hertz'"),
        (replace(one, posterior={"sigma": one.posterior["sigma"][:, :5]}), "has 20 draws; expected 30 or more"),
    ):
        with pytest.raises(InputError, match=f"^like: finger of a build .*{text}"):
            bayestouch.calibrate(dataset, like=[changed])
    with pytest.raises(InputError, match="are the same calibration"):
        bayestouch.calibrate(dataset, like=[one, one])


@pytest.mark.parametrize("shift", [0.0, 0.123])
def test_touches_that_are_calibrated_now_are_refused(earlier: list[bayestouch.Calibration], shift: float) -> None:
    """Also beside further touches and after another estimate of the rest reading; other readings are taken."""
    table = BUILD.draw(rng := np.random.default_rng(11)).dataset(rng).calibration
    assert table is not None
    one = replace(earlier[0], rows=replace(earlier[0].rows, observed=earlier[0].rows.observed - shift))
    first = one.rows.touch[:20]
    part = {name: getattr(one.rows, name)[:20] for name in ("observed", "touch")}
    for each in (one, replace(one, rows=replace(one.rows, **part))):
        with pytest.raises(InputError, match=r"^like: a\.nc was made from the touches that are calibrated now"):
            check_other_touches([("b.nc", earlier[1]), ("a.nc", each)], table)
        with pytest.raises(InputError, match="would count twice"):
            bayestouch.calibrate(DataSet(BUILD.sensor, table, table), like=[each])
    moved = table.with_(readings=table.readings * (1 + 1e-3 * (table.touch == first[0]))[:, None])
    check_other_touches([("a.nc", one)], moved)
    check_other_touches([("a.nc", one)], table.with_(readings=table.readings[:, :3]))
    with pytest.raises(InputError, match=r"a\.nc and b\.nc are the same calibration"):
        check_same_build([("b.nc", earlier[0]), ("a.nc", one)], BUILD.sensor, "layer")


def test_pads_are_refused() -> None:
    with pytest.raises(InputError, match="like is an option of fingers; this sensor is a pad"):
        body_of_kind("pad").own({"like": ("finger.nc",)})
