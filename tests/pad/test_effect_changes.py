"""Changes by the uncertain values of effects: of corrected touches in closed form, of the map by fits made anew."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pad_simulation import line

from bayestouch.data.touches import touches_from
from bayestouch.effects import Setting, effect_classes
from bayestouch.model.effect_list import EffectList
from bayestouch.model.noise import AddedNoise
from bayestouch.pad.choice import choose_model
from bayestouch.pad.corrected import PadEffects
from bayestouch.pad.effect_changes import changes_of_load, corrected_means, with_changes
from bayestouch.pad.fit import fit_chain
from bayestouch.pad.problem import pad_problem
from bayestouch.pad.table import tabulate

PLACE = (np.array([0.0, 5.0, 10.0]),)
SHARE, THRESHOLD, OFFSET = 0.4, 0.05, 0.1


def with_effects(root: np.ndarray, **values: tuple[float, ...]) -> PadEffects:
    setting = Setting(False, 3, PLACE, ((0.0, 10.0),), 1.0, "N", "", False, 5.0, 5.0, 100.0)
    suited = [effect_classes()[name].suited(setting) for name in values]
    effects = tuple(effect for effect in suited if effect is not None)
    assert len(effects) == len(values)
    return PadEffects(EffectList(setting, effects, AddedNoise()), values, np.ones(3), np.zeros(3), PLACE, root)


def test_changes_of_readings_that_are_corrected_for_creep() -> None:
    """y/(1 + s (1 - exp(-t/T))) for s and log T, whose sds are 0.02 and 0.3 with a correlation of -0.6."""
    share, time, held = 0.2, 2.0, np.array([0.0, 1.0, 4.0])
    root = np.linalg.cholesky([[0.02**2, -0.6 * 0.02 * 0.3], [-0.6 * 0.02 * 0.3, 0.3**2]])
    effects = with_effects(root, creep=(share, time))
    readings = np.array([[0.5, 0.8, 0.1], [0.6, 0.9, 0.2], [0.7, 1.0, 0.3]])
    touches = touches_from(
        np.zeros(3), readings, sample=np.arange(3), time_s=held, x_mm=np.full(3, 2.0), load=np.ones(3)
    )
    found = corrected_means(effects, touches, 1, "mean")
    risen = 1 - np.exp(-held / time)
    grown = (1 + share * risen)[:, None]
    np.testing.assert_allclose(found.readings[0], (readings / grown).mean(axis=0), rtol=1e-6)
    by_share = (-readings * risen[:, None] / grown**2).mean(axis=0)
    by_time = (readings * share * (np.exp(-held / time) * held / time)[:, None] / grown**2).mean(axis=0)
    assert found.changes is not None
    # central differences with a tenth of the sd: the third derivative over log T is of the size of the first
    wanted = root.T @ np.stack([by_share, by_time])
    np.testing.assert_allclose(found.changes[0, :, :3], wanted, rtol=2e-3, atol=1e-6)
    np.testing.assert_array_equal(found.changes[0, :, 3], 0.0)
    assert found.select(np.array([0, 0])).changes.shape == (2, 2, 4)  # type: ignore[union-attr]


def test_changes_of_loads() -> None:
    """An offset moves the load that acts by minus the slope of what the contact takes; a share of that moves none.

    The contact: p/(1 + share p), p = P - threshold; of a measured load P is what is the same under other shares.
    """
    root = np.diag([0.03, 0.05, 0.01])
    effects = with_effects(root, load_offset=(OFFSET,), load_nonlinearity=(SHARE, THRESHOLD))
    load = np.array([0.7, 1.5, np.nan])
    touches = touches_from(np.arange(3), np.ones((3, 3)), x_mm=np.full(3, 2.0), load=load + OFFSET)
    found = corrected_means(effects, touches, 1, "mean").changes
    assert found is not None
    p = load - THRESHOLD
    slope = 1 / (1 + SHARE * p) ** 2
    np.testing.assert_allclose(found[:2, 0, 3], -0.03 * slope[:2], rtol=1e-3)
    # the inverse of the contact is interpolated between loads a hundredth of the reference load apart
    np.testing.assert_allclose(found[:2, 1:, 3], 0.0, atol=1e-4)
    np.testing.assert_array_equal(found[2, :, 3], 0.0)
    acting = p[:2] / (1 + SHARE * p[:2])
    changes = changes_of_load(effects, acting)
    wanted = [0 * p[:2], -0.05 * p[:2] ** 2 * slope[:2], -0.01 * slope[:2]]
    np.testing.assert_allclose(changes, wanted, rtol=2e-3, atol=1e-9)


@pytest.mark.parametrize("empirical", [False, True])
def test_the_map_follows_its_touches(empirical: bool) -> None:
    """Fitted anew to readings and loads that are changed, kernel and empirical map differ by what was said before.

    The changes are a thousandth of the readings; the fit is non-linear, so that they agree to a few thousandths.
    """
    rng = np.random.default_rng(3)
    pad = line(floor=0.02, share=0.0)
    place, load = rng.uniform(8.0, 30.0, (60, 1)), rng.uniform(0.5, 1.5, 60)
    touches = pad.touch(place, rng, load=load, measured=True, samples=2)
    if empirical:
        touches = touches.with_(readings=touches.readings * (1 + 0.1 * np.cos(np.repeat(place, 2, axis=0))))
    problem, _ = pad_problem(pad.sensor, touches, samples="mean", seed=0)
    model, _ = choose_model(problem, pad.dataset(touches), "gaussian", empirical)
    assert model.has_map == empirical
    map_ = tabulate(model)
    known = model.fit.known
    readings = 1e-3 * known.readings * np.stack([np.ones(4), np.arange(4)])[:, None]
    moved_load = 1e-3 * np.stack([known.load**2, np.zeros(known.n_touches)])
    found = with_changes(map_, model, readings, moved_load)
    assert found.by_effect is not None and found.offset_by_effect is not None
    # at grid points: changes are linear between them, the map is not
    where = map_.origin + map_.step * np.arange(8, map_.sensitivity.shape[0] - 8)[:, None]
    changes = found.changes(where)
    assert changes.shape == (len(where), 2, 4)
    between = found.changes(where[:-1] + 0.25 * map_.step)
    np.testing.assert_allclose(between, 0.75 * changes[:-1] + 0.25 * changes[1:], atol=1e-12)
    for cause in range(2):
        tables = []
        for sign in (1, -1):
            other = replace(
                known, readings=known.readings + sign * readings[cause], load=known.load + sign * moved_load[cause]
            )
            misfit = replace(model.fit.misfit, load=other.load)
            fit = fit_chain(model.fit.chain, problem.priors.of(model.kernel), other, misfit)
            tables.append((tabulate(replace(model, fit=fit)).at(where)[0], fit.chain.offset))
        wanted = (tables[0][0] - tables[1][0]) / 2
        scale = np.abs(wanted).max()
        np.testing.assert_allclose(changes[:, cause], wanted, atol=0.01 * scale)
        offset = (tables[0][1] - tables[1][1]) / 2
        np.testing.assert_allclose(found.offset_by_effect[cause], offset, atol=0.01 * scale)
    again = type(found).from_arrays(found.arrays())
    np.testing.assert_array_equal(again.changes(where), changes)
    assert found.exact().n_causes == 0 and map_.n_causes == 0
