"""Scores of effects on models of a few numbers: slopes, allowed sides, starts and sizes worked out by hand."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from bayestouch.effects.effect import Effect, EffectParameter
from bayestouch.effects.random import BaselineDrift, GainDrift
from bayestouch.effects.readout import RestOffset
from bayestouch.model import candidates
from bayestouch.model.base import Predicted
from bayestouch.model.candidates import DRIFT_SIZES, best_size, score_effects, score_in_form
from bayestouch.model.linear import Linearised, Score
from bayestouch.priors.parameters import LogNormal, Normal, Uniform


def one_score(slope: float, information: float) -> Score:
    return Score(np.array([slope]), np.array([[information]]), np.array([information]))


def parameter(name: str, prior: Any, probes: tuple[float, ...], null: float | None = None) -> EffectParameter:
    return EffectParameter(name, "", "", prior, probes, null)


@pytest.mark.parametrize("size", [DRIFT_SIZES[2], DRIFT_SIZES[5], DRIFT_SIZES[9]])
def test_best_size_of_a_random_function(size: float) -> None:
    """log N(s | 0, I + σ² I²) - log N(s | 0, I) is largest where σ² I = s²/I - 1."""
    information = 4e4
    slope = float(np.sqrt(information * (1 + size**2 * information)))
    found, gain = best_size(one_score(slope, information))
    assert found == size
    density = stats.norm.logpdf(slope, 0, np.sqrt(information + (size * information) ** 2))
    assert gain == pytest.approx(density - stats.norm.logpdf(slope, 0, np.sqrt(information)))


def test_best_size_of_several_functions() -> None:
    information = np.array([[900.0, 300.0], [300.0, 400.0]])
    slope = np.array([90.0, -20.0])

    def gain(size: float) -> float:
        wide = stats.multivariate_normal(np.zeros(2), information + size**2 * information @ information)
        return float(wide.logpdf(slope) - stats.multivariate_normal(np.zeros(2), information).logpdf(slope))

    found, most = best_size(Score(slope, information, np.diag(information)))
    assert found == max(DRIFT_SIZES, key=gain) and most == pytest.approx(gain(found))


def test_sizes_that_are_tried() -> None:
    """Ten from 0.1 to 30 %, each 1.88 times the one before."""
    assert len(DRIFT_SIZES) == 10 and DRIFT_SIZES[0] == pytest.approx(1e-3) and DRIFT_SIZES[-1] == pytest.approx(0.3)
    np.testing.assert_allclose(np.diff(np.log(DRIFT_SIZES)), np.log(300) / 9)


@pytest.mark.parametrize(
    ("prior", "null", "one_sided"),
    [
        (Normal(0.0, 1.0), 0.0, False),
        (Normal(0.0, 1.0, 0.0), 0.0, True),
        (Uniform(-1.0, 1.0), 0.0, False),
        (Uniform(0.0, 1.0), 0.0, True),
        (Normal(1.0, 1.0, 0.0), 1.0, False),
        (LogNormal(3.0, 1.0), np.inf, True),
    ],
)
def test_amplitudes_that_would_leave_their_support(prior: Any, null: float, one_sided: bool) -> None:
    """A slope of -6 with variance 9 is a chi-square of 4, unless the amplitude cannot go that way."""
    effect = Effect()
    effect.parameters = (parameter("size", prior, (0.1,), null),)
    assert candidates._allowed(effect, one_score(6.0, 9.0)) == pytest.approx(4.0)
    assert candidates._allowed(effect, one_score(-6.0, 9.0)) == pytest.approx(0.0 if one_sided else 4.0)
    assert candidates._allowed(effect, one_score(0.0, 9.0)) == 0.0
    effect.parameters *= 2
    two = Score(np.array([-6.0, 0.0]), np.diag([9.0, 9.0]), np.array([9.0, 9.0]))
    assert candidates._allowed(effect, two) == pytest.approx(4.0)


class Model:
    """Touches that read size · place^power, and samples -size; t = 3, m = 1."""

    def __init__(self, effects: tuple[Effect, ...] = ()) -> None:
        self.effects, self.known, self.n_elements = effects, SimpleNamespace(n_touches=3), 1

    def with_effects(self, effects: tuple[Effect, ...]) -> Model:
        return Model(effects)

    def extended(self, vector: np.ndarray, values: tuple[float, ...]) -> np.ndarray:
        return np.array([*vector, *values])

    def predict(self, vector: np.ndarray) -> Predicted:
        # With a third value, what is added to each touch.
        size, power, *more = vector
        return Predicted(size * np.array([[1.0], [2.0], [3.0]]) ** power + sum(more), None)

    def signal(self, vector: np.ndarray) -> str:
        """What is before an effect on the signal, which `readings` asks for."""
        return "begun"

    def readings(self, begun: str, vector: np.ndarray) -> Predicted:
        assert begun == "begun"
        return self.predict(vector)

    def of_basis(self, effect: Effect, vector: np.ndarray) -> list[Predicted] | None:
        return [Predicted(np.array([[1.0], [4.0], [9.0]]), None)] * 2 if effect.name == "moved" else None


def fitted(residual: list[float]) -> Any:
    """Three touches of one element that are off by these; a parameter that does nothing."""
    linear = Linearised(
        residual=np.array(residual)[:, None],
        jacobian=np.zeros((3, 1)),
        deviation=np.zeros((0, 1)),
        deviation_jacobian=None,
        touch=np.zeros(0, dtype=np.int64),
        pull=np.zeros(1),
        precision=np.ones(1),
    )
    whitening = SimpleNamespace(touches=lambda rows: rows, samples=lambda rows: rows, columns=lambda rows: rows)
    return SimpleNamespace(linear=linear, whitening=whitening, model=Model(), vector=np.zeros(0), names=("known",))


@dataclass(frozen=True)
class Power(Effect):
    parameters: tuple[EffectParameter, ...] = (
        parameter("size", Uniform(-10.0, 10.0), (0.5,), 0.0),
        parameter("power", LogNormal(1.0, 1.0), (1.0, 2.0)),
    )
    name, stage, summary = "power", "rig", ""


class Known(Power):
    name = "known"


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_score_of_an_effect(sign: float) -> None:
    """Residuals of 3 · place² fit the second probe: signature (1, 4, 9)/2, squares 24.5, slope 147, amplitude 6."""
    (found,) = score_effects(fitted([3 * sign, 12 * sign, 27 * sign]), (Power(), Known()))
    assert found.effect.name == "power" and found.trials == 2
    np.testing.assert_allclose(found.start, (3 * sign, 2.0), rtol=2e-6)
    chi_square = 147**2 / 24.5
    assert found.gain == pytest.approx(0.5 * chi_square - 0.5 * np.log(3), rel=1e-6)
    assert found.z == pytest.approx(sign * np.sqrt(chi_square), rel=1e-6)
    assert found.seen == pytest.approx(1.0)


@pytest.mark.parametrize(("prior", "wanted"), [(Uniform(-2.0, 2.0), 2.0), (Normal(0.0, 0.5), 3 * 0.5)])
def test_start_stays_within_the_prior(prior: Any, wanted: float) -> None:
    """Within its support, and within three times its half width of 68 %."""
    narrow = Power((parameter("size", prior, (0.5,), 0.0), Power.parameters[1]))
    for sign in (1, -1):
        (found,) = score_effects(fitted([3.0 * sign, 12.0 * sign, 27.0 * sign]), (narrow,))
        assert found.start[0] == pytest.approx(sign * wanted, rel=2e-3)


@pytest.mark.parametrize("null", [0.0, 1.0, -2.0])
@pytest.mark.parametrize(("prior", "reach"), [(Uniform(-10.0, 10.0), 2.0), (Normal(0.0, 0.5), 3 * 0.5)])
def test_start_is_counted_from_the_null(null: float, prior: Any, reach: float) -> None:
    """Residuals of ±2 · place² are an amplitude that is 2 more or less than its null, or `reach` by the prior."""
    effect = Power((parameter("size", prior, (null + 0.5,), null), parameter("power", LogNormal(1.0, 1.0), (2.0,))))
    for sign in (1, -1):
        (found,) = score_effects(fitted([2.0 * sign, 8.0 * sign, 18.0 * sign]), (effect,))
        assert found.start == pytest.approx((null + sign * reach, 2.0), abs=5e-3)


def test_signature_of_values_that_act_through_a_basis() -> None:
    """The derivative over the value times its probe, 0.5 · (1, 4, 9), whatever the second value is."""

    class Moved(Power):
        name = "moved"

        def pose(self, recording: Any, values: Any) -> Any:
            raise AssertionError("the derivative is enough")

    (found,) = score_effects(fitted([3.0, 12.0, 27.0]), (Moved(),))
    assert found.start == pytest.approx((3.0, 1.0), rel=2e-6)


def test_an_amplitude_of_a_dead_element_is_no_degree_of_freedom() -> None:
    """Each element has an amplitude of its own, the second no readings: the score is that of the first alone."""

    class Each(Effect):
        name, stage, summary = "each", "readout", ""
        parameters = tuple(parameter(name, Uniform(-10.0, 10.0), (0.5,), 0.0) for name in ("one", "two"))

        def looser(self, n_elements: int) -> None:
            return None

    class Two(Model):
        def with_effects(self, effects: tuple[Effect, ...]) -> Two:
            return Two(effects)

        def predict(self, vector: np.ndarray) -> Predicted:
            return Predicted(np.array([[1.0], [4.0], [9.0]]) * vector, None)

    dead = fitted([3.0, 12.0, 27.0])
    dead.linear = replace(dead.linear, residual=dead.linear.residual * [1.0, 0.0], jacobian=np.zeros((6, 1)))
    dead.model, dead.whitening.touches = Two(), lambda rows: rows * [1.0, 0.0]
    (found,) = score_effects(dead, (Each(),))
    chi_square = 147**2 / 24.5
    assert found.gain == pytest.approx(0.5 * chi_square - 0.5 * np.log(3), rel=1e-6)
    assert found.z == pytest.approx(np.sqrt(chi_square), rel=1e-6)


def test_gains_are_in_order() -> None:
    class First(Power):
        name = "first"

    first = First((Power.parameters[0], parameter("power", LogNormal(1.0, 1.0), (1.0,))))
    found = score_effects(fitted([3.0, 12.0, 27.0]), (first, Power()))
    assert [each.effect.name for each in found] == ["power", "first"]
    # Signature 0.5 · (1, 2, 3), squares 3.5, slope 54.
    assert found[1].gain == pytest.approx(0.5 * 54**2 / 3.5 - 0.5 * np.log(3), rel=1e-6)


def test_an_effect_that_another_one_contains_is_not_looked_for_beside_it() -> None:
    class Contained(Power):
        name, contained_in = "contained", "known"

    class Free(Power):
        name, contained_in = "free", "power"

    found = score_effects(fitted([3.0, 12.0, 27.0]), (Contained(), Free()))
    assert [each.effect.name for each in found] == ["free"]
    assert RestOffset.contained_in == BaselineDrift.name


class WithConstant(Power):
    """Its looser form adds a constant, as an amplitude or not."""

    amplitude = True

    def further_parameters(self, n_elements: int) -> tuple[EffectParameter, ...]:
        return (parameter("constant", Uniform(-10.0, 10.0), (0.5,), 0.0 if self.amplitude else None),)


class WithShape(WithConstant):
    amplitude = False


def test_the_looser_form_is_scored_where_its_amplitudes_gain_more() -> None:
    """Residuals of 3 · place² + 6 are fitted by both amplitudes: half their squares, less log t for one more."""
    (found,) = score_effects(fitted([9.0, 18.0, 33.0]), (WithConstant(),))
    assert found.trials == 4 and len(found.effect.parameters) == 3
    np.testing.assert_allclose(found.start, (3.0, 2.0, 6.0), rtol=1e-4)
    assert found.gain == pytest.approx(0.5 * (81 + 324 + 1089) - np.log(3), rel=1e-5)
    # An effect that a user states is in the form that was stated. With power 1, Σ place r = 144, Σ place² = 14.
    stated = score_in_form(fitted([9.0, 18.0, 33.0]), WithConstant())
    assert stated.effect == WithConstant() and len(stated.start) == 2
    assert found.gain > stated.gain == pytest.approx(0.5 * 144**2 / 14 - 0.5 * np.log(3), rel=1e-5)
    # Nothing of a constant: the form with fewer amplitudes gains more.
    (found,) = score_effects(fitted([3.0, 12.0, 27.0]), (WithConstant(),))
    assert found.trials == 4 and len(found.effect.parameters) == 2
    # Without another amplitude, only a fit shows what the form can do.
    (found,) = score_effects(fitted([9.0, 18.0, 33.0]), (WithShape(),))
    assert found.trials == 2 and len(found.effect.parameters) == 2


def drifting(monkeypatch: pytest.MonkeyPatch, sizes: dict[float, float]) -> GainDrift:
    """A drift of three times and two kinds; what it does grows with time and kind by `sizes`."""
    effect = GainDrift(
        (
            parameter("sd", Normal(0.0, 0.05, 0.0), (0.01,), 0.0),
            parameter("time", LogNormal(5.0, 1.0), (9.0, 5.0, 2.0)),
            parameter("own", Uniform(0.0, 1.0), (0.0, 1.0)),
        )
    )

    def columns(model: Any, vector: Any, drifts: Any) -> np.ndarray:
        ((_, (unit, time, own)),) = drifts
        assert unit == 1.0
        return np.array([[[sizes[own + time / 10]]]])

    class Scorer:
        def __init__(self, linear: Any) -> None:
            pass

        def of_columns(self, raw: np.ndarray) -> Score:
            return one_score(float(raw[0, 0, 0]), 1e4)

    monkeypatch.setattr(candidates, "drift_columns", columns)
    monkeypatch.setattr(candidates, "Scorer", Scorer)
    return effect


def test_score_of_a_random_function(monkeypatch: pytest.MonkeyPatch) -> None:
    """The middle of its times stands for all; of its kinds the one that gains more."""
    effect = drifting(monkeypatch, {0.5: 500.0, 1.5: 2000.0})
    (found,) = score_effects(fitted([0.0, 0.0, 0.0]), (effect,))
    size, gain = best_size(one_score(2000.0, 1e4))
    assert found.start == (size, 5.0, 1.0) and found.gain == gain and found.trials == 2
    assert found.z == pytest.approx(20.0)


def test_refined_values_of_a_random_function(monkeypatch: pytest.MonkeyPatch) -> None:
    """All times and kinds are tried."""
    effect = drifting(monkeypatch, {0.9: 9.0, 0.5: 10.0, 0.2: 3000.0, 1.9: 20.0, 1.5: 50.0, 1.2: 2000.0})
    size, _ = best_size(one_score(3000.0, 1e4))
    assert candidates.refine_drift(fitted([0.0, 0.0, 0.0]), effect) == (size, 2.0, 0.0)
