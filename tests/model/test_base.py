"""What every model of a sensor does with its effects, on a sensor that reads load times place."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.chain.recording import Recording
from bayestouch.effects.effect import Effect, EffectParameter
from bayestouch.model.base import FAR_FROM_PRIOR, LOAD_STEP, VALUE_STEP, Predicted, SensorModel, difference
from bayestouch.priors.parameters import LogNormal, Normal

LOAD, PLACE = np.array([2.0, np.nan, 6.0]), np.array([[1.0, 2.0], [3.0, -1.0], [2.0, 0.5]])


class Plain(SensorModel):
    """Readings are load · place · the one base parameter."""

    n_base = 1

    def poses(self, vector: Any, load: Any = None) -> Any:
        raise NotImplementedError

    def signal(self, vector: Any, load: Any = None) -> Recording:
        load = self.load if load is None else load
        return Recording(
            indenter_radius_mm=np.zeros(3),
            place=(np.zeros(3),),
            load=load,
            time_s=np.zeros(3),
            held_s=np.zeros(3),
            element_place=(np.zeros(2),),
            peak=self.peak,
            reference_load=self.reference_load,
            signal=vector[0] * load[:, None] * PLACE,
        )

    def prior(self) -> Any:
        raise NotImplementedError

    def reset_to_nominal(self, vector: Any) -> Any:
        raise NotImplementedError

    def with_derivatives(self, vector: Any) -> Any:
        raise NotImplementedError

    def correction_basis(self, vector: Any) -> Any:
        raise NotImplementedError

    def correction_inputs(self, vector: Any) -> Any:
        raise NotImplementedError


class Square(Effect):
    """Adds amount · signal² · exp(log size)."""

    name, stage, summary = "square", "readout", ""
    parameters = (
        EffectParameter("amount", "", "", Normal(0.0, 0.5, -0.2, 0.7), (0.1,), 0.0),
        EffectParameter("size", "", "", LogNormal(2.0, 0.3), (1.0,)),
    )

    def signal(self, recording: Recording, values: Any) -> np.ndarray:
        return recording.signal + values[0] * values[1] * recording.signal**2


class Twice(Effect):
    name, stage, summary, parameters = "twice", "element", "", ()

    def signal(self, recording: Recording, values: Any) -> np.ndarray:
        return 2 * recording.signal


class Rising(Twice):
    """Grows with the time within a touch."""

    name, stage, needs_samples = "rising", "element", True

    def signal(self, recording: Recording, values: Any) -> np.ndarray:
        return recording.signal * (1 + recording.held_s[:, None])


def observed() -> Any:
    """Three touches of two, one and one samples; the first is weighed 1 to 3."""
    weight, row = np.array([1.0, 3.0, 1.0, 1.0]), np.array([0, 0, 1, 2])

    def of_touches(values: np.ndarray) -> np.ndarray:
        total = np.zeros((3, values.shape[1]))
        np.add.at(total, row, values * weight[:, None])
        return total / np.array([4.0, 1.0, 1.0])[:, None]

    held = np.array([0.0, 4.0, 0.0, 1.0])
    return SimpleNamespace(load=LOAD, row_touch=row, time_s=np.zeros(4), held_s=held, of_touches=of_touches)


def made(*effects: Effect) -> Plain:
    return Plain(observed=observed(), peak=np.array([10.0, 20.0]), reference_load=5.0, effects=effects)


VECTOR = np.array([0.5, 0.1, np.log(3.0)])
LOADS = np.array([2.0, 4.0, 6.0])
SIGNAL = 0.5 * LOADS[:, None] * PLACE


def test_steps() -> None:
    assert (VALUE_STEP, LOAD_STEP, FAR_FROM_PRIOR) == (0.01, 1e-4, 1.2)


def test_loads_that_were_not_read_are_the_mean_of_the_others() -> None:
    np.testing.assert_array_equal(made().load, LOADS)
    # The reference load, 5, where no touch has one.
    unread: Any = SimpleNamespace(load=np.full(3, np.nan))
    np.testing.assert_array_equal(made().observing(unread).load, [5.0, 5.0, 5.0])
    assert made().n_elements == 2
    np.testing.assert_array_equal(made().zero(VECTOR), [0.0, 0.0])


def test_values_of_effects() -> None:
    model = made(Twice(), Square())
    assert model.values(VECTOR) == ((), (0.1, pytest.approx(3.0)))
    np.testing.assert_allclose(model.value_priors, [[0, 0.5, -0.2, 0.7], [np.log(2), 0.3, -np.inf, np.inf]])
    np.testing.assert_allclose(model.extended(np.array([0.5]), (0.2, 4.0)), [0.5, 0.2, np.log(4)])


def test_effects_act_in_the_order_of_the_stages() -> None:
    """Elements before the readout, whatever the order of the effects."""
    wanted = 2 * SIGNAL + 0.3 * (2 * SIGNAL) ** 2
    for effects in ((Twice(), Square()), (Square(), Twice())):
        found = made(*effects).predict(VECTOR)
        np.testing.assert_allclose(found.touches, wanted)
        assert found.samples is None and not made(*effects).by_sample
    assert [each.name for each, _ in made(Square(), Rising(), Twice()).in_order(VECTOR)] == [
        "twice",
        "rising",
        "square",
    ]


def test_samples_that_differ() -> None:
    """The first touch reads once and five times its signal, weighed 1 to 3: four times on the mean."""
    found = made(Rising()).predict(VECTOR[:1])
    np.testing.assert_allclose(found.touches, SIGNAL * np.array([4.0, 1.0, 2.0])[:, None])
    assert found.samples is not None
    np.testing.assert_allclose(found.samples, [-3 * SIGNAL[0], SIGNAL[0], 0 * SIGNAL[1], 0 * SIGNAL[2]])


def test_derivative_over_the_load() -> None:
    """Quadratic in it: d/dP (s + 0.3 s²) = (s + 0.6 s²)/P, and 0.5 · place without an effect."""
    np.testing.assert_allclose(made().by_load(VECTOR), 0.5 * PLACE, rtol=1e-9)
    wanted = (SIGNAL + 0.6 * SIGNAL**2) / LOADS[:, None]
    np.testing.assert_allclose(made(Square()).by_load(VECTOR), wanted, rtol=1e-9)


def test_derivative_over_a_value() -> None:
    """Linear in the amount; exponential in the log of the size, where a step is 1 % of its sd."""
    model = made(Square())
    np.testing.assert_allclose(model.of_value(VECTOR, 1).touches, 3 * SIGNAL**2, rtol=1e-9)
    np.testing.assert_allclose(model.of_value(VECTOR, 2).touches, 0.3 * SIGNAL**2, rtol=1e-4)


class Shared(Effect):
    """Multiplies each element by a factor of its own."""

    name, stage, mixes = "shared", "element", False
    parameters = tuple(EffectParameter(f"own_{e}", "", "", Normal(0.0, 0.5), (0.0,), of_element=True) for e in (1, 2))

    def signal(self, recording: Recording, values: Any) -> np.ndarray:
        return recording.signal * np.exp(np.array(values))


class Leaking(Shared):
    """Then a tenth of each element also appears in the other."""

    mixes = True

    def signal(self, recording: Recording, values: Any) -> np.ndarray:
        own = super().signal(recording, values)
        return own + 0.1 * own[:, ::-1]


@pytest.mark.parametrize("effect", [Shared(), Leaking()])
def test_derivatives_over_the_values_of_elements(effect: Effect) -> None:
    """Each factor moves its own element, and, where elements mix, a tenth of it the other; then 0.3 s² is added."""
    model, vector = made(effect, Square()), np.array([0.5, 0.2, -0.1, 0.1, np.log(3.0)])
    factor = np.exp([0.2, -0.1])
    leak = 0.1 if effect.mixes else 0.0
    before = SIGNAL * factor + leak * (SIGNAL * factor)[:, ::-1]
    found = model.of_values(vector, model.signal(vector))
    for e in range(2):
        moves = np.array([1.0, leak]) if e == 0 else np.array([leak, 1.0])
        wanted = SIGNAL[:, [e]] * factor[e] * moves * (1 + 0.6 * before)
        np.testing.assert_allclose(found[e].touches, wanted, rtol=1e-4, atol=1e-9)
    np.testing.assert_allclose(found[2].touches, 3 * before**2, rtol=1e-9)


def test_elements_that_mix_before_an_effect_are_differenced_together() -> None:
    """The factors act on what has leaked already: each moves its own element only, by one difference for both."""
    calls = list[np.ndarray]()

    class Amplified(Shared):
        name, stage = "amplified", "readout"

        def signal(self, recording: Recording, values: Any) -> np.ndarray:
            calls.append(np.array(values))
            return super().signal(recording, values)

    model, vector = made(Leaking(), Amplified()), np.array([0.5, 0.2, -0.1, 0.3, -0.4])
    own = SIGNAL * np.exp([0.2, -0.1])
    readings = (own + 0.1 * own[:, ::-1]) * np.exp([0.3, -0.4])
    found = model.of_values(vector, model.signal(vector))[2:]
    for e in range(2):
        np.testing.assert_allclose(found[e].touches, readings * (np.arange(2) == e), rtol=1e-4, atol=1e-12)
    # The rows before each effect, two values of the leaking effect, both ways, and one difference for both factors.
    assert len(calls) == 1 + 4 + 2


@pytest.mark.parametrize(
    ("amount", "low", "high"),
    # The sd is 0.5: steps of 1 % of the value, or of a tenth of the sd where the value is small, or of the sd.
    [(0.1, 0.099, 0.101), (0.001, 0.0005, 0.0015), (0.7, 0.695, 0.7), (-0.2, -0.2, -0.198), (0.6, 0.595, 0.605)],
)
def test_steps_of_a_value_stay_in_its_range(amount: float, low: float, high: float) -> None:
    model, seen = made(Square()), []

    class Watched(Plain):
        def predict(self, vector: Any, load: Any = None) -> Predicted:
            seen.append(float(vector[1]))
            return Predicted(np.zeros((3, 2)), None)

    Watched(**{name: getattr(model, name) for name in ("observed", "peak", "reference_load", "effects")}).of_value(
        np.array([0.5, amount, 0.0]), 1
    )
    np.testing.assert_allclose(sorted(seen), [low, high])


def test_central_difference() -> None:
    def at(sign: float) -> Predicted:
        return Predicted(np.array([[3 + sign]]), np.array([[5 * sign]]))

    found = difference(at, 0.25)
    assert found.touches == 4.0 and found.samples == 20.0
    assert difference(lambda sign: replace(at(sign), samples=None), 0.25).samples is None


def test_size_of_the_signal_under_the_reference_load() -> None:
    """Largest |signal/load| = 0.5 · (3, 2), at 5 N; as acting loads are twice those read, at 10 N."""
    np.testing.assert_allclose(made(Square()).peak_at(VECTOR), [7.5, 5.0])
    np.testing.assert_array_equal(made().peak_at(VECTOR), [10.0, 20.0])

    class Heavy(Plain):
        def signal(self, vector: Any, load: Any = None) -> Recording:
            return super().signal(vector, 2 * (self.load if load is None else load))

    heavy = Heavy(observed=observed(), peak=np.ones(2), reference_load=5.0, effects=(Square(),))
    np.testing.assert_allclose(heavy.peak_at(VECTOR), [15.0, 10.0])


def test_other_touches_and_effects() -> None:
    model, other = made(Square()), observed()
    assert model.observing(other).observed is other and model.observing(other).effects == model.effects
    assert model.with_effects(()).effects == () and model.with_effects(()).peak is model.peak
