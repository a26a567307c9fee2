"""What is made of a fit of a pad with effects."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
from pad_simulation import line

from bayestouch.data.touches import touches_from
from bayestouch.effects import NoiseEffect, RandomEffect
from bayestouch.model.added import added_effects
from bayestouch.model.correction import corrected_fit
from bayestouch.model.fitting import fit
from bayestouch.model.split_data import SplitData
from bayestouch.pad.beginning import PadEvaluation, begin


def test_no_residuals_where_no_touch_could_be_held_out() -> None:
    """Too few touches leave none aside: the answer is that there is nothing, whatever was fitted."""
    unused = cast(Any, None)
    evaluation = PadEvaluation(unused, unused, None, None, 8, 0, np.ones(1))
    assert evaluation.held_out(unused, None) is None


def test_models_of_the_start_are_used_again_and_change_no_bit() -> None:
    pad = line()
    touches = pad.touch(np.linspace(6, 32, 53)[:, None], np.random.default_rng(0))
    data = SplitData.of(replace(pad.dataset(touches), calibration=None))
    started = begin(data, kernel="gaussian", draws=64, seed=0)
    evaluation = cast(PadEvaluation, started.evaluation)
    assert {"gaussian", "gaussian with map"} <= set(evaluation.earlier)
    again, anew = (each.calibration(started.fitted, (), None) for each in (evaluation, replace(evaluation, earlier={})))
    assert again.settings == anew.settings and again.notes == anew.notes
    for name, draws in anew.posterior.items():
        np.testing.assert_array_equal(again.posterior[name], draws)
    for name, table in anew.extra.items():
        np.testing.assert_array_equal(again.extra[name], table)


def test_a_correction_changes_the_map_and_no_draw_of_a_parameter() -> None:
    """The parameters are not fitted again with a correction: with it, the density has its mode elsewhere."""
    rng, pad = np.random.default_rng(2), line()
    x, load = rng.uniform(6.0, 32.0, 120), rng.uniform(0.5, 6.0, 120)
    clean = pad.chain.predict(x[:, None], load / (1 + 0.4 * load))
    wrong = clean * (1 + 0.04 * np.sin(x / 3) * np.log(load))[:, None]
    table = touches_from(np.arange(120), wrong + 0.02 * rng.standard_normal(clean.shape), x_mm=x, load=load)
    data = SplitData.of(replace(pad.dataset(table), calibration=None))
    started = begin(data, kernel="gaussian", draws=64, seed=0)
    evaluation, model = cast(PadEvaluation, started.evaluation), started.fitted.model
    effect = next(each for each in started.effects if each.name == "load_nonlinearity")
    assert not isinstance(effect, RandomEffect | NoiseEffect)
    model = model.with_effects((effect,))
    fitted = fit(model, model.extended(started.fitted.vector, (0.4, 1.0)), started.fitted.noise)
    corrected = corrected_fit(fitted)
    assert corrected is not None
    with_it, correction = corrected
    slope = with_it.linear.gradient() * np.sqrt(np.diag(with_it.linear.covariance()))
    assert np.abs(slope).max() > 1, "no test: the mode is the same with the correction"
    plain = evaluation.calibration(fitted, tuple(added_effects(fitted)), None)
    finer = evaluation.calibration(with_it, tuple(added_effects(with_it)), correction)
    for name, draws in plain.posterior.items():
        np.testing.assert_array_equal(finer.posterior[name], draws)
    assert any(not np.array_equal(finer.extra[name], each) for name, each in plain.extra.items())
