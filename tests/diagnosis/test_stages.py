"""Models with fewer effects than were found: which of them is returned, with numbers that are worked out by hand."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.diagnosis.stages import EvaluatedStage, Stages, choose, effects_as_added, rounds_used

N = 40
#: Deviations of touches with mean 0 and a standard error of their sum of 1.
SHAPE = np.tile([1.0, -1.0], N // 2) / np.sqrt(N * N / (N - 1))


def test_effects_in_the_order_in_which_they_were_added() -> None:
    """Drifts with their own standard deviations; one that was dropped later is not among them."""

    def effect(name: str) -> Any:
        return SimpleNamespace(name=name, parameters=(SimpleNamespace(logarithmic=False),))

    first, drift = effect("first"), effect("drift")
    model = SimpleNamespace(effects=(first,), value_places=(slice(0, 1),), values=lambda vector: ((1.0,),))
    fitted: Any = SimpleNamespace(
        model=model, vector=None, linear=SimpleNamespace(covariance=lambda: np.eye(1)), drifts=((drift, (2.0,)),)
    )
    names = (drift, effect("dropped"), first, None)
    rounds = tuple(
        SimpleNamespace(
            before=None, added=None if each is None else SimpleNamespace(effect=each, noise=None, found_noise=())
        )
        for each in names
    )
    found = effects_as_added(rounds, fitted, {"drift": (0.3,)})  # type: ignore[arg-type]
    assert [(each.effect.name, each.values, each.sd) for each in found] == [
        ("drift", (2.0,), (0.3,)),
        ("first", (1.0,), (1.0,)),
    ]


def left(gain: float) -> Any:
    """Held-out touches whose log densities have this sum, with a standard error of 1; each sum has its own scatter."""
    scatter = np.random.default_rng(int(1e4 + gain)).permutation(SHAPE)
    return SimpleNamespace(log_density=gain / N + scatter, present=np.ones((N, 2), dtype=bool))


@pytest.mark.parametrize(
    ("gains", "used"),
    [
        ([0.0], 0),
        ([0.0, 10.0], 1),
        # Neither is clearly better: what the search found stands.
        ([0.0, -2.9], 1),
        ([0.0, -3.1], 0),
        ([0.0, 50.0, 52.0, 51.0], 3),
        # The last effect repairs a part of what the one before it does wrong.
        ([0.0, 80.0, 90.0, -500.0, 70.0], 2),
        ([0.0, 80.0, 76.0, 70.0], 1),
    ],
)
def test_effects_without_which_held_out_touches_are_predicted_clearly_better(gains: list[float], used: int) -> None:
    steps = [left(0.0) for _ in gains]
    for step, gain in zip(steps, gains, strict=True):
        # Differences between two steps scatter by one standard error around their mean.
        step.log_density = gain / N + SHAPE * len([each for each in gains if each < gain])
    assert rounds_used(steps) == used


def read_with(location: float, gain: float, name: str) -> Any:
    """A model that reads each location with an error of this size, mm; touches scatter a little."""
    error = location * (1 + 0.01 * np.random.default_rng(0).standard_normal(N))
    read = SimpleNamespace(
        by_touch={"location_rms_mm": error}, by_touch_corrected={"location_rms_mm": error}, with_edge=None
    )
    return SimpleNamespace(held_out=left(gain), read=read, fitted=SimpleNamespace(drifts=()), name=name)


@dataclass(frozen=True, eq=False)
class Made(Stages):
    """Stages that are evaluated already; the names of those that were asked for are kept."""

    stage: tuple[EvaluatedStage, ...] = ()
    asked: list[int] = field(default_factory=list)

    def plain(self, n_rounds: int) -> Any:
        return SimpleNamespace(
            evaluated=lambda: self.stage[n_rounds].plain, evaluation=SimpleNamespace(uses_correction=lambda each: True)
        )

    def corrected(self, n_rounds: int, plain: Any) -> Any:
        found: Any = self.stage[n_rounds].corrected
        return found and SimpleNamespace(held_out=found.held_out, evaluated=lambda: self._ask(n_rounds).corrected)

    def evaluated(self, n_rounds: int) -> EvaluatedStage:
        return self._ask(n_rounds)

    def _ask(self, n_rounds: int) -> EvaluatedStage:
        self.asked.append(n_rounds)
        return self.stage[n_rounds]


def stages_of(*models: tuple[Any, Any]) -> Made:
    made = tuple(EvaluatedStage(plain, corrected and replace_calibration(corrected)) for plain, corrected in models)
    rounds: Any = (None,) * len(made)
    found: Any = None
    return Made(rounds, found, made[0].plain, in_place=True, stage=made)


def replace_calibration(model: Any) -> Any:
    model.calibration = model.name
    return model


BEFORE, ONE, TWO = (1.4, 0.0, "before"), (0.96, 900.0, "one"), (5.0, -4000.0, "two")


def test_the_last_effect_is_left_out_where_with_it_all_are_refused() -> None:
    """With two effects locations are read with 5 mm instead of 1.4 mm, with the first of them with 0.96 mm."""
    stages = stages_of((read_with(*BEFORE), None), (read_with(*ONE), None), (read_with(*TWO), None))
    for used in (1, 2):
        chosen = choose(stages, stages.stage[2], lambda: None, used, believed=False)
        assert chosen.model is stages.stage[1].plain
        (refused,) = chosen.refused
        assert refused.model is stages.stage[2].plain
        worse = {each.key: (each.before, each.after) for each in refused.worse}
        # Not used by its predictions, it is compared with what is returned; else with the model without effects.
        assert worse["location_rms_mm"] == pytest.approx((0.96 if used == 1 else 1.4, 5.0), rel=0.01)
    # A model that predicts no better than that without effects is not tried; one that reads worse is not returned.
    for other, refusals in (((0.5, -1.0, "unclear"), 1), ((1.6, 900.0, "worse"), 2)):
        less = stages_of((stages.before, None), (read_with(*other), None), (stages.stage[2].plain, None))
        chosen = choose(less, less.stage[2], lambda: None, 2, believed=False)
        assert chosen.model is less.before and len(chosen.refused) == refusals


def test_fewer_effects_with_a_correction_come_first() -> None:
    corrected = read_with(0.83, 950.0, "one with a correction")
    stages = stages_of((read_with(*BEFORE), None), (read_with(*ONE), corrected), (read_with(*TWO), None))
    chosen = choose(stages, stages.stage[2], lambda: None, 1, believed=False)
    assert chosen.model is corrected
    # The correction is reported with the model that is corrected.
    assert (chosen.stage.plain, chosen.stage.corrected) == (stages.stage[1].plain, corrected)


@pytest.mark.parametrize(
    ("location", "gain", "taken"),
    # Read better, whatever is predicted; not read better; predicted worse than without effects.
    [(0.82, 998.0, True), (0.82, 500.0, True), (1.54, 1000.0, False), (0.82, -500.0, False)],
)
def test_a_correction_in_place_of_the_last_effect(location: float, gain: float, taken: bool) -> None:
    """Two effects are harmless: 1.54 mm. The first of them with a correction reads better."""
    found, corrected = read_with(1.54, 1000.0, "two"), read_with(location, gain, "one with a correction")
    stages = stages_of((read_with(4.3, 0.0, "before"), None), (read_with(3.0, 600.0, "one"), corrected), (found, None))
    chosen = choose(stages, stages.stage[2], lambda: None, 2, believed=False)
    assert chosen.model is (corrected if taken else found)
    assert [each.model for each in chosen.refused] == ([found] if taken else [])
    assert chosen.stage.plain is stages.stage[1 if taken else 2].plain


def test_a_correction_in_place_of_the_last_effect_that_is_used() -> None:
    """The third effect is not used; a correction in place of the second reads 0.77 mm instead of 2.18 mm."""
    corrected = read_with(0.77, 830.0, "one with a correction")
    plain = (read_with(2.5, 0.0, "before"), read_with(1.0, 820.0, "one"), read_with(2.18, 900.0, "two"))
    stages = stages_of((plain[0], None), (plain[1], corrected), (plain[2], None), (read_with(*TWO), None))
    chosen = choose(stages, stages.stage[3], lambda: None, 2, believed=False)
    assert chosen.model is corrected and chosen.stage.plain is plain[1] and stages.asked == [2, 1]


def test_nothing_more_is_evaluated_where_nothing_was_refused() -> None:
    """With a correction beside all effects, or where the search found no effect."""
    models = (read_with(4.3, 0.0, "before"), None), (read_with(1.5, 900.0, "one"), read_with(1.0, 999.0, "corrected"))
    stages = stages_of(*models)
    assert choose(stages, stages.stage[1], lambda: None, 1, believed=False).model is stages.stage[1].corrected
    alone = stages_of(models[0])
    assert choose(alone, alone.stage[0], lambda: None, 0, believed=False).model is alone.before
    assert stages.asked == alone.asked == []
