"""Calibrations with stated effects: with priors and another contact model, on fingers and on pads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from independent import catalogue_forms as forms

import bayestouch
from bayestouch.effects.stated import StatedModel
from bayestouch.priors.parameters import LogNormal, Normal, Uniform

SHARE, CREEP = 0.04, 0.2
FINGER = bayestouch.FingerDesign(n_elements=8, edge_step_deg=2.0, flat_step_deg=4.0, touch_step_deg=8.0)
CROSSTALK = StatedModel("finger", "layer", (("crosstalk", {}),))


Design = bayestouch.FingerDesign | bayestouch.PadDesign


def with_written_effect(design: Design, form: Callable[[bayestouch.Touches, dict], np.ndarray]) -> bayestouch.DataSet:
    """Touches simulated without an effect, the effect as it is written out in tests/independent, and noise on top."""
    made = bayestouch.simulate(replace(design, noise_percent_peak=0.0), seed=4)
    rng, sd = np.random.default_rng(5), design.noise_percent_peak / 100 * design.peak_reading

    def read(table: bayestouch.Touches) -> bayestouch.Touches:
        readings = form(table, dict(made.truth))
        return table.with_(readings=readings + sd * rng.standard_normal(readings.shape))

    assert made.dataset.calibration is not None
    return replace(made.dataset, calibration=read(made.dataset.calibration), touches=read(made.dataset.touches))


@pytest.fixture(scope="module")
def finger() -> bayestouch.DataSet:
    return with_written_effect(
        FINGER, lambda table, true: forms.crosstalk_finger(table.readings, np.array(true["theta_s"]), SHARE, 0.0, 0.0)
    )


@pytest.fixture(scope="module")
def pad() -> bayestouch.DataSet:
    design = bayestouch.PadDesign(samples_per_touch=8, n_touches=60)
    return with_written_effect(design, lambda table, _: forms.creep(table.readings, 0.25 * table.sample, CREEP, 1.0))


@pytest.mark.slow
def test_a_stated_prior_counts_beside_effects(finger: bayestouch.DataSet) -> None:
    """A prior of σ combines with what touches say of it as two normal densities do; the effect is found beside it."""
    mean, sd = 0.4605, 1e-4
    free = bayestouch.calibrate(finger, model=CROSSTALK, draws=2000, seed=1)
    bound = bayestouch.calibrate(finger, model=CROSSTALK, priors={"sigma": Normal(mean, sd)}, draws=2000, seed=1)
    own, spread = free.posterior["sigma"].mean(), free.posterior["sigma"].std()
    assert spread > 4 * sd
    precision = 1 / sd**2 + 1 / spread**2
    # 2000 draws know a mean to 2 % of its sd and an sd to 1.6 %: four times that
    expected = (mean / sd**2 + own / spread**2) / precision
    assert bound.posterior["sigma"].mean() == pytest.approx(expected, abs=0.1 * sd)
    assert bound.posterior["sigma"].std() == pytest.approx(precision**-0.5, rel=0.064)
    (stated,) = [each.prior for each in bound.parameters if each.name == "sigma"]
    assert isinstance(stated, Normal)
    assert (stated.mean, stated.sd) == (mean, sd)  # cut off where σ cannot be
    for calibration in (free, bound):
        share = calibration.posterior["crosstalk_share"]
        assert abs(share.mean() - SHARE) < 4 * share.std() < SHARE


@pytest.mark.parametrize("kind", ["log-normal", "uniform"])
def test_a_narrow_prior_of_the_noise_counts_beside_repeats(kind: str) -> None:
    """Stated far from what repeats say, by more than the width of the prior: quadrature over log s."""
    design = bayestouch.FingerDesign(n_elements=3, edge_step_deg=6.0, flat_step_deg=15.0, samples_per_touch=4)
    known = bayestouch.simulate(design, seed=6).dataset
    assert known.calibration is not None
    raw = known.calibration.readings.reshape(-1, 4, 3)
    dof, scatter = 3 * len(raw), ((raw - raw.mean(axis=1, keepdims=True)) ** 2).sum(axis=(0, 1))
    seen = np.sqrt(scatter / dof)
    stated = 1.25 * float(seen.mean())
    prior = LogNormal(stated, 0.02) if kind == "log-normal" else Uniform(0.98 * stated, 1.02 * stated)
    found = bayestouch.calibrate(known, priors={"noise_sd": prior}, draws=4000, seed=1).posterior["noise_sd"]
    grid = np.linspace(0.9, 1.35, 4001)[:, None] * seen.mean()
    means, sds = [], []
    # A residual of a mean says as much as a degree of freedom where there is no discrepancy, and little where there is.
    for more in (1.0, (dof + len(raw)) / dof):
        log = more * (-dof * np.log(grid) - 0.5 * scatter / grid**2) + prior.log_density(grid)
        mass = np.exp(log - log.max(axis=0))
        mass /= mass.sum(axis=0)
        means.append((grid * mass).sum(axis=0))
        sds.append(np.sqrt((grid**2 * mass).sum(axis=0) - means[-1] ** 2))
    # 4,000 draws, of which a tenth and more are independent: 5 % of an sd, four times
    high, low = means
    mean = found.mean(axis=(0, 1))
    assert (mean < high + 0.2 * sds[0]).all() and (mean > low - 0.2 * sds[1]).all()
    assert found.std(axis=(0, 1)) == pytest.approx(sds[0], rel=0.1)


def test_the_contact_model_may_be_another_than_the_models(finger: bayestouch.DataSet) -> None:
    by_hertz = bayestouch.calibrate(finger, model=CROSSTALK, contact="hertz", draws=64, seed=1)
    assert by_hertz.settings["contact"] == "hertz"
    layer = bayestouch.calibrate(finger, model=CROSSTALK, draws=64, seed=1)
    assert layer.settings["contact"] == "layer"
    # flats are wider by Hertz: another contact changes what the touches say of the modulus
    assert by_hertz.mode["mu"] != pytest.approx(layer.mode["mu"], rel=0.01)


@pytest.mark.slow
def test_a_pad_is_calibrated_with_stated_effects(pad: bayestouch.DataSet) -> None:
    model = StatedModel("pad", "", (("creep", {}),))
    calibration = bayestouch.calibrate(pad, model=model, draws=400, seed=1)
    share = calibration.posterior["creep_share"]
    assert abs(share.mean() - CREEP) < 4 * share.std() < CREEP
    read = bayestouch.infer(pad.touches, calibration, draws=256, seed=1)
    error = np.hypot(*(read.mean(axis) - read.reference[axis] for axis in ("x", "y")))
    spread = np.hypot(read.sd("x"), read.sd("y"))
    # error over its stated size: its square is 1 in the mean of 60 touches of two coordinates, ± 0.13 × 4
    assert np.mean((error / spread) ** 2) == pytest.approx(1, abs=0.52)


def test_what_cannot_go_together_is_refused_in_a_line(finger: bayestouch.DataSet, pad: bayestouch.DataSet) -> None:
    with pytest.raises(bayestouch.InputError, match="model is that of a finger, this sensor is a pad"):
        bayestouch.calibrate(pad, model=CROSSTALK)
    with pytest.raises(bayestouch.InputError, match="map of a pad has it already"):
        bayestouch.calibrate(pad, model=StatedModel("pad", "", (("soft_spot", {}),)))


def test_a_model_may_be_the_path_of_its_file(finger: bayestouch.DataSet, tmp_path: Path) -> None:
    path = tmp_path / "model.toml"
    path.write_text(CROSSTALK.to_toml(), encoding="utf-8")
    by_path, by_object = (bayestouch.calibrate(finger, model=each, draws=64, seed=1) for each in (path, CROSSTALK))
    assert np.array_equal(by_path.posterior["crosstalk_share"], by_object.posterior["crosstalk_share"])
    with pytest.raises(bayestouch.InputError, match="expected a StatedModel or the path of a model"):
        bayestouch.calibrate(finger, model={})  # type: ignore[arg-type]


def test_a_prior_that_would_not_be_used_is_refused(finger: bayestouch.DataSet) -> None:
    with pytest.raises(bayestouch.InputError, match='discrepancy "none" has no such parameter'):
        bayestouch.calibrate(finger, discrepancy="none", priors={"discrepancy_sd": Normal(1.0, 0.1)})
