"""What an effect is, and the list of them; their formulas are in `rig`, `elements`, `readout`, `errors`, `unlisted`.

An effect has one value. It acts on the recording before the finger is pressed (pose, load, contact, width of the
elements), on the signals, or as an error. `name` is the catalogue's name of what it is physically; `form` names the
formula that is used here, and `in_catalogue` says whether the catalogue's formula can do the same.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from .finger import Recording

Apply = Callable[[Recording, float, np.random.Generator], Recording]


@dataclass(frozen=True)
class Effect:
    """One effect.

    `when` is "before" or "after" the finger is pressed, or "error"; `start` is a value of common size, `largest` one
    that a person would see by eye before calibrating anything. `in_catalogue` is true where some plausible values of
    the catalogue's formula do the same, to 1 % of the change in the readings at size 2
    (`tests/simulator/test_forms.py`), and `reason` says why it is so or not.
    """

    name: str
    form: str
    when: str
    start: float
    largest: float
    apply: Apply
    listed: bool = True
    in_catalogue: bool = False
    reason: str = ""

    @property
    def key(self) -> str:
        """Name and form."""
        return f"{self.name}: {self.form}"


def forms_of(effects: Mapping[str, Effect], name: str) -> list[Effect]:
    """Every form of the effect called `name` in a registry of effects by their keys."""
    return [effect for effect in effects.values() if effect.name == name]
