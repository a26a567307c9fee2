"""The model of a finger: its quick evaluator and its chain against a finger that is written out on its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from independent.finger import SMALL
from model_cases import REFERENCE, Case, three_times

from bayestouch.effects.catalogue import effect_classes
from bayestouch.effects.listing import FINGER
from bayestouch.finger.model import FingerModel
from bayestouch.model.observations import UntimedTouches

# Of the peak. The finger written out solves contacts on nodes of its own; the series is within 5e-7 of it, and the
# chain, which looks readings up in a table, within 1e-5.
QUICK, CHAIN = 3e-6, 3e-5
# The effects that a finger can have and that change predictions; memory needs the times of touches.
ACTING = [
    name
    for name, kind in effect_classes().items()
    if kind.suited(FINGER) is not None and kind.stage != "noise" and not kind.random and name != "memory"
]


@pytest.fixture(scope="module")
def case() -> Case:
    return three_times()


def test_readings_are_those_of_a_finger_written_out(case: Case) -> None:
    exact = case.finger.signal(case.press)
    for model, error in ((case.quick, QUICK), (case.chain, CHAIN)):
        found = model.predict(case.vector).touches
        assert np.abs((found - exact) / case.finger.peak).max() < error


def test_derivative_over_the_load_is_that_of_a_finger_written_out(case: Case) -> None:
    press, step = case.press, 1.0
    up, down = (case.finger.signal(replace(press, load=press.load + sign * step)) for sign in (1, -1))
    exact = (up - down) / (2 * step)
    for model in (case.quick, case.chain):
        error = np.abs(model.by_load(case.vector) - exact) / np.abs(exact).max()
        # The quick one takes a step of 2 %: contacts grow with the load, which bends readings by so much.
        assert error.max() < 2e-3


def test_derivatives_are_those_of_a_finger_written_out(case: Case) -> None:
    finger, press, m = case.finger, case.press, SMALL.n_elements

    def moved(**changes: np.ndarray | float) -> np.ndarray:
        # What a finger is made of keeps its response: reading for each N/m of an edge right above the element.
        other = replace(finger, **changes)
        return other.signal(press) * finger.peak / other.peak

    depth = (moved(depth=finger.depth + 1e-2) - moved(depth=finger.depth - 1e-2)) / 2e-2
    angle = (moved(angle=finger.angle + 0.02) - moved(angle=finger.angle - 0.02)) / np.radians(0.04)
    log_mu = (moved(modulus=finger.modulus * 1.01) - moved(modulus=finger.modulus / 1.01)) / (2 * np.log(1.01))
    for model in (case.quick, case.chain):
        found = model.derivatives(case.vector)[0]
        assert found.shape == (3 * m + 2, len(press.tip), m)
        for e in range(m):
            for block, exact in enumerate((finger.signal(press), depth, angle)):
                one = found[block * m + e]
                # Steps are central: their error is far below the share of the largest derivative that is asked.
                assert np.abs(one[:, e] - exact[:, e]).max() < 2e-3 * np.abs(exact).max()
                assert not one[:, np.arange(m) != e].any()
        assert np.abs(found[3 * m + 1] - log_mu).max() < 5e-3 * np.abs(log_mu).max()


@pytest.mark.parametrize("name", ["crosstalk", "saturation", "gain_nonlinearity", "creep"])
def test_effects_on_readings_act_alike_on_both_evaluators(case: Case, name: str) -> None:
    effect = effect_classes()[name].suited(FINGER)
    assert effect is not None
    quick, chain = (model.with_effects((effect,)) for model in (case.quick, case.chain))
    vector = quick.extended(case.vector, effect.probes[0])
    peak = case.finger.peak
    assert quick.signal(vector).signal.tobytes() == case.quick.signal(case.vector).signal.tobytes()
    assert np.abs((quick.predict(vector).touches - chain.predict(vector).touches) / peak).max() < 2 * CHAIN
    by_load = quick.by_load(vector), chain.by_load(vector)
    assert np.abs(by_load[0] - by_load[1]).max() < 2e-3 * np.abs(by_load[1]).max()
    for one, other in zip(quick.derivatives(vector)[0], chain.derivatives(vector)[0], strict=True):
        assert np.abs(one - other).max() < 5e-3 * max(np.abs(other).max(), 1e-3 * peak.max())


@pytest.mark.parametrize(("name", "value"), [("aperture", 2.0), ("tangential_load", -0.2)])
def test_effects_on_the_strain_of_elements_are_those_of_a_finger_written_out(
    case: Case, name: str, value: float
) -> None:
    """By the series and by the chain; the response is that of the element with its width."""
    effect = effect_classes()[name].suited(FINGER)
    assert effect is not None
    finger, press = case.finger, case.press
    press = replace(
        press, **{"aperture": {"width": value}, "tangential_load": {"tangential": np.full(len(press.tip), value)}}[name]
    )
    edge = replace(
        press, tip=np.zeros(finger.angle.size), angle=finger.angle, load=np.full(finger.angle.size, REFERENCE)
    )
    peak = np.diagonal(finger.signal(replace(edge, tangential=np.zeros(finger.angle.size))))
    for model, error in ((case.quick, QUICK), (case.chain, CHAIN)):
        model = model.with_effects((effect,))
        found = model.predict(model.extended(case.vector, (value,))).touches
        assert np.abs(found / case.finger.peak - finger.signal(press) / peak).max() < error
    assert np.abs(finger.signal(press) / peak - finger.signal(case.press) / finger.peak).max() > 1e-2


def test_each_element_has_its_own_aperture(case: Case) -> None:
    """Element e reads as if all elements were as wide as it is; sides that are exponential make a difference."""
    plain = effect_classes()["aperture"].suited(FINGER)
    assert plain is not None
    own = np.linspace(-0.6, 0.8, SMALL.n_elements)
    loose = plain.looser(SMALL.n_elements)
    assert loose is not None
    model, one = (case.quick.with_effects((effect,)) for effect in (loose, plain))
    found = model.predict(model.extended(case.vector, (2.0, *own, 0.0))).touches
    for e, more in enumerate(own):
        alike = one.predict(one.extended(case.vector, (2.0 * (1 + more),))).touches
        np.testing.assert_allclose(found[:, e], alike[:, e], rtol=1e-12)
    sides = model.predict(model.extended(case.vector, (2.0, *own, 1.0))).touches
    assert np.abs((sides - found) / case.finger.peak).max() > 2e-4


def test_a_surface_out_of_round_is_that_of_the_chain(case: Case) -> None:
    effect = effect_classes()["surface_profile"].suited(FINGER)
    assert effect is not None
    quick, chain = (model.with_effects((effect,)) for model in (case.quick, case.chain))
    vector = quick.extended(case.vector, effect.probes[0])
    assert quick.predict(vector).touches.tobytes() == chain.predict(vector).touches.tobytes()
    assert np.abs(quick.predict(vector).touches - case.quick.predict(case.vector).touches).max() > 1


def test_slopes_over_the_load_have_the_finite_strain(case: Case) -> None:
    """The step of the series is 2 % of the load."""
    effect = effect_classes()["finite_strain"].suited(FINGER)
    assert effect is not None and case.quick.evaluator is not None
    model, load = case.quick.with_effects((effect,)), case.press.load
    vector = model.extended(case.vector, (0.8,))
    signal, slope = case.quick.evaluator.with_strain_of([model.chain(vector)])(case.vector[None])
    np.testing.assert_allclose(signal[0], model.predict(vector).touches, rtol=1e-12)
    up, down = (model.predict(vector, share * load).touches for share in (1.02, 0.98))
    np.testing.assert_allclose(slope[0], (up - down) / (0.04 * load[:, None]), atol=1e-9 * np.abs(slope).max())


@pytest.mark.parametrize("others", [{}, {"prober_eccentricity": 0.4, "load_offset": 9.0}])
def test_finite_strain_adds_what_the_chain_adds(case: Case, others: dict[str, float]) -> None:
    """To signals, to derivatives of the chain, and at loads other than those read; also where the rig is off."""
    rig = tuple(effect for name in others if (effect := effect_classes()[name].suited(FINGER)) is not None)
    off = np.concatenate([np.full(len(each.parameters), others[each.name]) for each in rig] or [np.empty(0)])
    more = effect_classes()["finite_strain"].suited(FINGER)
    assert more is not None

    def added(model: FingerModel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        plain, start = model.with_effects(rig), np.append(case.vector, off)
        strained, vector = model.with_effects((*rig, more)), np.append(start, 0.8)
        load, n = 1.1 * case.press.load, case.vector.size
        return (
            strained.predict(vector).touches - plain.predict(start).touches,
            strained.predict(vector, load).touches - plain.predict(start, load).touches,
            strained.derivatives(vector)[0][:n] - plain.derivatives(start)[0][:n],
        )

    peak = case.finger.peak.max()
    for found, wanted in zip(added(case.quick), added(case.chain), strict=True):
        assert np.abs(wanted).max() > 0.02 * peak
        # The steps over log μ differ in the third order, by so much where a knot of the table lies between them.
        np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-6 * np.abs(wanted).max())


def test_beyond_the_parameters_that_it_was_made_for_the_chain_is_used(case: Case) -> None:
    far = case.vector.copy()
    far[-1] += 1.0
    assert case.quick.predict(far).touches.tobytes() == case.chain.predict(far).touches.tobytes()


def test_other_touches_are_those_of_the_chain(case: Case) -> None:
    radius, angle, load = np.array([[3.0, 12.7], [0.1, -0.2], [150.0, 250.0]])
    quick, chain = (model.observing(UntimedTouches(2)).at(radius, angle, load) for model in (case.quick, case.chain))
    assert quick.predict(case.vector).touches.tobytes() == chain.predict(case.vector).touches.tobytes()


@pytest.mark.parametrize("others", [(), ("gain_nonlinearity",), ("proximity", "crosstalk")])
@pytest.mark.parametrize("name", ACTING)
def test_derivatives_over_values_are_those_of_one_value_at_a_time(
    case: Case, name: str, others: tuple[str, ...]
) -> None:
    """Values of all elements together, and from the signal before an effect: as the whole prediction for each value."""
    setting = replace(FINGER, n_elements=SMALL.n_elements)
    suited = [effect_classes()[each].suited(setting) for each in dict.fromkeys((name, *others))]
    effects = tuple(effect.looser(SMALL.n_elements) or effect for effect in suited if effect is not None)
    model = case.quick.with_effects(effects)
    shape = model.value_priors
    near = np.clip(shape[:, 0] + shape[:, 1] * np.linspace(-0.3, 0.4, len(shape)), *shape[:, 2:].T)
    vector = np.concatenate([case.vector, near])
    recording = model.signal(vector)
    # One difference for all values of a basis has the error of its step, 1 % of their sd.
    basis = [each.by_place(recording) is not None for each in effects for _ in each.parameters]
    for number, (found, by_place) in enumerate(zip(model.of_values(vector, recording), basis, strict=True)):
        wanted = model.of_value(vector, case.vector.size + number).touches
        error = 3e-3 * np.abs(wanted).max() if by_place else 1e-9 * case.finger.peak.max()
        assert np.abs(found.touches - wanted).max() <= error
