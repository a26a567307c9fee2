"""From the rounds of a search to effects and held-out residuals in their order."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from bayestouch.diagnosis.follow import _steps, effects_as_added


def test_held_out_residuals_at_the_beginning_of_each_round() -> None:
    """Before, at each round between, and with all that was found."""
    evaluate: Any = SimpleNamespace(held_out=lambda fitted, correction: f"held {fitted}")
    before, after = (SimpleNamespace(held_out=name) for name in ("first", "last"))
    rounds = tuple(SimpleNamespace(before=k) for k in range(4))
    for n, wanted in ((1, ("first",)), (2, ("first", "last")), (4, ("first", "held 1", "held 2", "last"))):
        assert _steps(rounds[:n], evaluate, before, after) == wanted  # type: ignore[arg-type]
    none: Any = SimpleNamespace(held_out=None)
    assert _steps(rounds[:2], evaluate, none, none) == ()  # type: ignore[arg-type]


def test_effects_in_the_order_in_which_they_were_added() -> None:
    """Drifts with their own standard deviations; one that was dropped later is not among them."""

    def effect(name: str) -> Any:
        return SimpleNamespace(name=name, parameters=(SimpleNamespace(logarithmic=False),))

    first, drift = effect("first"), effect("drift")
    model = SimpleNamespace(effects=(first,), n_base=0, values=lambda vector: ((1.0,),))
    fitted: Any = SimpleNamespace(
        model=model, vector=None, linear=SimpleNamespace(covariance=lambda: np.eye(1)), drifts=((drift, (2.0,)),)
    )
    names = (drift, effect("dropped"), first, None)
    rounds = tuple(
        SimpleNamespace(
            before=None, added=None if each is None else SimpleNamespace(effect=each, noise=None, found_noise=None)
        )
        for each in names
    )
    found = effects_as_added(rounds, fitted, {"drift": (0.3,)})  # type: ignore[arg-type]
    assert [(each.effect.name, each.values, each.sd) for each in found] == [
        ("drift", (2.0,), (0.3,)),
        ("first", (1.0,), (1.0,)),
    ]
