"""``model.toml``: which effects a sensor has, for calibrations to come."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bayestouch.data.sensor import BODIES
from bayestouch.data.toml_text import read_toml_text, tables_from_toml
from bayestouch.effects.catalogue import effect_classes
from bayestouch.errors import InputError, shown

#: No parameter of an effect has a value beyond this.
LARGEST = 1e100
_HEAD = """\
# What the chain of this sensor holds beyond the base model, as a diagnosis found it.
# bayestouch calibrate DATASET --model model.toml fits the values anew, starting from these.

"""


@dataclass(frozen=True)
class StatedModel:
    """A chain with effects, by name.

    Attributes
    ----------
    body : str
        Kind of body, as in ``sensor.toml``.
    contact : str
        Base contact model of a finger; ``""`` on a pad.
    effects : tuple of (name, mapping of parameter to value)
        Effects in the order in which they are added, with the values that a fit starts from; a value that is not
        stated is found.
    correction : bool
        Whether a correction by element and location, which has no cause, comes on top.
    """

    body: str
    contact: str
    effects: tuple[tuple[str, Mapping[str, float]], ...]
    correction: bool = False

    def to_toml(self) -> str:
        """As text."""
        import tomli_w

        content: dict[str, Any] = {"body": self.body}
        if self.contact:
            content["contact"] = self.contact
        content["correction"] = self.correction
        content["effect"] = [
            {"name": name, "stage": effect_classes()[name].stage, "start": dict(values)}
            for name, values in self.effects
        ]
        return _HEAD + tomli_w.dumps({key: value for key, value in content.items() if value != []})

    @classmethod
    def from_toml(cls, text: str) -> StatedModel:
        """From text.

        Raises
        ------
        InputError
            It is no TOML, names an effect that is not known, or a value is no number.
        """
        content = tables_from_toml(text)
        unknown = sorted(set(content) - {"body", "contact", "correction", "effect"})
        if unknown:
            raise InputError("not known here; expected body, contact, correction and [[effect]]", column=unknown[0])
        listed = content.get("effect", [])
        if not isinstance(listed, list) or not all(isinstance(each, dict) for each in listed):
            raise InputError("expected tables [[effect]]", column="effect")
        correction = content.get("correction", False)
        if not isinstance(correction, bool):
            raise InputError(f"expected true or false, got {shown(correction)}", column="correction")
        body = content.get("body", next(iter(BODIES)))
        if body not in tuple(BODIES):
            kinds = " or ".join(f'"{kind}"' for kind in BODIES)
            raise InputError(f"expected {kinds}, got {shown(body)}", column="body")
        contact = content.get("contact", BODIES[body].default_contact)
        return cls(body, str(contact), tuple(_effect(each) for each in listed), correction)


def _effect(table: dict[str, Any]) -> tuple[str, dict[str, float]]:
    name, known = table.get("name"), effect_classes()
    if not isinstance(name, str) or name not in known:
        raise InputError(f"unknown effect {shown(name)}; known are {', '.join(known)}", column="effect.name")
    start = table.get("start", {})
    numbers = isinstance(start, dict) and all(
        isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < LARGEST
        for value in start.values()
    )
    if not numbers:
        raise InputError(f"expected numbers by the names of the parameters of {name}", column="effect.start")
    return name, {key: float(value) for key, value in start.items()}


def read_model(path: str | Path) -> StatedModel:
    """Read ``model.toml``.

    Raises
    ------
    InputError
        As `StatedModel.from_toml`, with the file; or it cannot be read.
    """
    text, _ = read_toml_text(path)
    try:
        return StatedModel.from_toml(text)
    except InputError as error:
        raise InputError(error.message, file=path, row=error.row, column=error.column) from None
