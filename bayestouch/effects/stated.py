"""``model.toml``: the effects that later calibrations of a sensor use."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from bayestouch.contact import CONTACT_MODELS
from bayestouch.data.geometry import BODIES, geometries
from bayestouch.data.toml_text import read_toml_text, tables_from_toml
from bayestouch.effects.catalogue import effect_classes
from bayestouch.errors import InputError, about, shown, unknown_name

#: Bound of the absolute value of an effect's parameter.
LARGEST = 1e100
_HEAD = """\
# Effects of this sensor that are added to the base model, as found by a diagnosis.
# bayestouch calibrate DATASET --model model.toml fits the values again, starting from these.
# Values of drifts and of the noise are searched without them, but a drift is of the kind that is stated here.

"""


@dataclass(frozen=True)
class StatedModel:
    """The names and starting values of the effects in a sensor model.

    Attributes
    ----------
    body : str
        Kind of body, as in ``sensor.toml``.
    contact : str
        Base contact model of a finger; ``""`` on a pad.
    effects : tuple of (name, mapping of parameter to value)
        Effects in the order in which they are added, with the values from which a fit starts. The fit chooses a
        start for values that are not stated. Those of noise effects, and sd and time of drifts, it always searches;
        a drift is of the stated kind (``own``).
    correction : bool
        Whether an empirical correction by element and location is added.
    path : Path or None
        File that the model was read from; errors about the model name it.
    """

    body: str
    contact: str
    effects: tuple[tuple[str, Mapping[str, float]], ...]
    correction: bool = False
    path: Path | None = field(default=None, compare=False)

    def to_toml(self) -> str:
        """Text of ``model.toml``."""
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
        """Model from the text of ``model.toml``.

        Raises
        ------
        InputError
            The text is not TOML, has an unknown key, names an unknown contact model or effect or one effect twice, or
            has a value of a wrong kind.
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
        contact = _contact(content, body)
        effects = tuple(_effect(each) for each in listed)
        names = [name for name, _ in effects]
        if twice := [name for name in names if names.count(name) > 1]:
            raise InputError(f"{twice[0]} is there more than once", column="effect.name")
        return cls(body, contact, effects, correction)


def _contact(content: dict[str, Any], body: str) -> str:
    """The contact model that is stated, or the default one; empty for a body that has none."""
    default = geometries()[body].default_contact
    contact = content.get("contact", default)
    if not default and contact:
        raise InputError(f"a {body} has no contact model", column="contact")
    if default and contact not in CONTACT_MODELS:
        raise unknown_name("contact model", contact, CONTACT_MODELS, column="contact")
    return str(contact)


def _effect(table: dict[str, Any]) -> tuple[str, dict[str, float]]:
    name, known = table.get("name"), effect_classes()
    if not isinstance(name, str) or name not in known:
        raise unknown_name("effect", name, known, column="effect.name")
    if unknown := sorted(set(table) - {"name", "stage", "start"}):
        raise InputError("not known here; expected name, stage and start", column=f"effect.{unknown[0]}")
    if (stage := table.get("stage", known[name].stage)) != known[name].stage:
        expected = f'expected "{known[name].stage}", the stage of {name}'
        raise InputError(f"{expected}, got {shown(stage)}", column="effect.stage")
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
        The file cannot be read, or for the reasons of `StatedModel.from_toml`; the error names the file.
    """
    text, _ = read_toml_text(path)
    with about(path):
        return replace(StatedModel.from_toml(text), path=Path(path))
