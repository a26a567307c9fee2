"""Made-up candidates and rounds of the search for effects."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from bayestouch.diagnosis.rounds import SearchRound, Tried
from bayestouch.effects.random import BaselineDrift

DRIFT = BaselineDrift(())


def effect(name: str) -> Any:
    kinds = dict.fromkeys(("needs_samples", "random", "remembers", "follows_time"), False)
    return SimpleNamespace(name=name, parameters=(), looser=lambda m: None, **kinds)


def tried(name: str = "one", **changes: Any) -> Tried:
    """A candidate that is real: it gains 60 ± 10, explains half and is far from chance."""
    values = {"z": 9.0, "seen": 0.5, "start": (), "gain": 60.0, "clear": True, "of_means": 50.0, "share": 0.5}
    values |= {"effect": effect(name), "fitted": SimpleNamespace()}
    return Tried(**{**values, **changes})


def one_round(added: Tried | None, possible: float = 100.0, **changes: Any) -> SearchRound:
    values = {"before": SimpleNamespace(excess=0.0, n_readings=100), "tried": (), "correction": None}
    values |= {"correction_gain": 0.0, "correction_se": 0.0}
    return SearchRound(added=added, possible=possible, **{**values, **changes})


def paired(*differences: float) -> dict[str, Any]:
    return {"difference": np.array(differences)}


def priced(name: str, cost: float, count: int = 1, **changes: Any) -> Tried:
    fitted = SimpleNamespace(
        linear=SimpleNamespace(cost=lambda: cost),
        model=SimpleNamespace(known=SimpleNamespace(n_touches=100)),
        excess=10.0,
        n_readings=1000,
    )
    kind = effect(name)
    kind.parameters = (None,) * count
    shape = np.array([1.0, -1, 1, -1, 1, -1, 1, -1, 0])
    return tried(**{"effect": kind, "fitted": fitted, "difference": shape * changes.pop("sign", 1.0), **changes})
