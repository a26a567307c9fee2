"""Loads behind effects of the rig, and what their errors have to do with the readings: by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from bayestouch.effects.effect import Effect, EffectParameter
from bayestouch.finger.reading import true_load as module
from bayestouch.finger.reading.covariance import spread_of
from bayestouch.priors.parameters import Normal

# Times of two touches after the calibration.
LATER = np.full(2, np.inf)


class Shift(Effect):
    """The force sensor reads `amount` less than what acts, more with the angle."""

    name, stage, summary = "shift", "rig", ""
    parameters = (EffectParameter("amount", "N/m", "", Normal(0.0, 1.0), (0.1,), 0.0),)

    def pose(self, recording: Any, values: Any) -> Any:
        return SimpleNamespace(load=recording.load + values[0] * (1 + recording.place[0]), place=recording.place)


class Turn(Shift):
    """The prober shifts every location, but no load."""

    name = "turn"

    def pose(self, recording: Any, values: Any) -> Any:
        return SimpleNamespace(load=recording.load, place=(recording.place[0] + values[0],))


class Nothing(Effect):
    name, stage, summary, parameters = "nothing", "rig", "", ()


def chain_with(*effects: Effect) -> Any:
    """One base parameter, then a value of each of two effects, 3 ± 0.5 and 7 ± 100."""
    model = SimpleNamespace(
        effects=effects,
        n_base=1,
        n_elements=2,
        peak=np.ones(2),
        reference_load=1.0,
        finger=SimpleNamespace(element_angles_deg=(0.0, 1.0)),
        values=lambda vector: tuple((value,) for value in vector[1 : 1 + len(effects)]),
    )
    return SimpleNamespace(model=model, vector=np.array([9.0, 3.0, 7.0]), covariance=np.diag([16.0, 0.25, 1e4]))


def loads(*effects: Effect, load: np.ndarray, exact: bool = False) -> module.TrueLoads:
    angle, sd = np.array([0.0, 1.0]), np.array([0.3, 0.4])
    return module.true_loads(chain_with(*effects), LATER, angle, load, sd, exact=exact)


def test_loads_as_they_really_are() -> None:
    """What the effect's value leaves open adds to the variance of the reading: (0.5 (1 + angle))²."""
    found = loads(Shift(), Nothing(), load=np.array([10.0, np.nan]))
    np.testing.assert_allclose(found.load, [13.0, np.nan])
    np.testing.assert_allclose(found.sd, [np.hypot(0.3, 0.5), 0.4])
    found = loads(Shift(), Nothing(), load=np.array([10.0, 20.0]))
    np.testing.assert_allclose(found.load, [13.0, 26.0])
    np.testing.assert_allclose(found.sd, np.hypot([0.3, 0.4], [0.5, 1.0]))
    np.testing.assert_allclose(found.slope, [[0, 0], [1, 2], [0, 0]], atol=1e-9)
    exact = loads(Shift(), Nothing(), load=np.array([10.0, 20.0]), exact=True)
    np.testing.assert_allclose(exact.load, [13.0, 26.0])
    np.testing.assert_array_equal(exact.sd, [0.3, 0.4])


def test_loads_are_corrected_at_the_true_locations() -> None:
    """Locations of a posterior are true ones: a shift of the prober before the load's effect is not made again."""
    found = loads(Turn(), Shift(), load=np.array([10.0, 20.0]))
    np.testing.assert_allclose(found.load, [10 + 7, 20 + 2 * 7])
    np.testing.assert_allclose(found.slope, [[0, 0], [0, 0], [1, 2]], atol=1e-9)
    np.testing.assert_allclose(found.sd, np.hypot([0.3, 0.4], [100, 200]))


def test_values_that_are_known_together_change_a_load_together() -> None:
    """Two shifts of 1 and 2 N/m a unit, covariance [[0.25, -0.1], [-0.1, 0.04]]: 0.25 - 0.4 + 0.16 of variance."""

    class Second(Shift):
        def pose(self, recording: Any, values: Any) -> Any:
            return SimpleNamespace(load=recording.load + 2 * values[0], place=recording.place)

    class First(Second):
        def pose(self, recording: Any, values: Any) -> Any:
            return SimpleNamespace(load=recording.load + values[0], place=recording.place)

    chain = chain_with(First(), Second())
    chain.covariance = np.array([[1.0, 0, 0], [0, 0.25, -0.1], [0, -0.1, 0.04]])
    found = module.true_loads(chain, LATER[:1], np.zeros(1), np.array([10.0]), np.array([0.3]), exact=False)
    np.testing.assert_allclose(found.sd**2, [0.09 + 0.25 - 0.4 + 0.16])


def test_readings_given_a_load_that_is_wrong_for_the_same_reason() -> None:
    """Two touches, two readings, three parameters: conditional normal of what the readings miss given the load's miss.

    The load's miss is (corrected load - true load), which a parameter beyond its mode makes smaller by its slope. The
    load of the second touch was not measured.
    """
    rng = np.random.default_rng(1)
    jacobian, root = rng.normal(size=(3, 2, 2)), np.linalg.cholesky(np.cov(rng.normal(size=(3, 9))))
    slope = rng.normal(size=(3, 2))
    covariance = root @ root.T
    sd = np.sqrt(0.2**2 + np.einsum("at,ab,bt->t", slope, covariance, slope))
    loads = module.TrueLoads(np.array([21.0, np.nan]), sd, slope, np.zeros((2, 2)))
    along = loads.along(root, spread_of(jacobian, root))
    j, towards = jacobian[:, 0].T, slope[:, 0]
    cross = -j @ covariance @ towards
    np.testing.assert_allclose(np.outer(along[0], along[0]), np.outer(cross, cross) / sd[0] ** 2)
    np.testing.assert_array_equal(along[1], [0, 0])
    found = loads.with_gain(along)
    touch = np.array([0, 0, 1])
    expected = cross / sd[0] ** 2
    np.testing.assert_allclose(
        found.readings(np.array([20.0, 22.0, 5.0]), touch), [expected * (21 - 20), expected * (21 - 22), [0, 0]]
    )
    some = found.select(np.array([0]))
    again = some.joined([found, some])
    np.testing.assert_array_equal(again.gain, np.vstack([found.gain, found.gain[:1]]))
    np.testing.assert_array_equal(again.slope, slope[:, [0, 1, 0]])
    np.testing.assert_array_equal(again.load, [21.0, np.nan, 21.0])


def test_which_effects_change_loads() -> None:
    class Elsewhere(Shift):
        stage = "contact"

    for effects, changes in (
        ((Shift(),), True),
        ((Nothing(),), False),
        ((Turn(),), False),
        ((Turn(), Shift()), True),
        ((Elsewhere(),), False),
        ((), False),
    ):
        assert module.changes_load(chain_with(*effects)) == changes
