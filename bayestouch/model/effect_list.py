"""The effects of a calibration as JSON text, as its file stores them."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from bayestouch.effects import Effect, NoiseEffect, RandomEffect, Setting, effect_classes
from bayestouch.effects.kinds import of_chain, of_noise, of_time
from bayestouch.errors import InputError, shown, unknown_name
from bayestouch.model.noise import AddedNoise
from bayestouch.results.data import CalibrationData
from bayestouch.results.keys import EFFECTS

#: No parameter of any effect.
NOTHING_STATED: Mapping[str, Iterable[str]] = MappingProxyType({})


@dataclass(frozen=True, eq=False)
class EffectList:
    """Effects of a calibration, and the setting in which they were fitted.

    Attributes
    ----------
    setting : Setting
        How the sensor was touched when the effects were fitted.
    effects : tuple of Effect
        Effects in the order in which they were added.
    noise : AddedNoise
        Noise that the noise effects add.
    """

    setting: Setting
    effects: tuple[Effect, ...]
    noise: AddedNoise

    @property
    def plain(self) -> tuple[Effect, ...]:
        """Effects whose values are parameters of the chain: neither drifts nor noise effects."""
        return of_chain(self.effects)

    @property
    def drifts(self) -> tuple[RandomEffect, ...]:
        """Random functions of time, with the dense knots of the final model."""
        return tuple(drift.with_dense_knots() for drift in of_time(self.effects))

    @property
    def of_noise(self) -> tuple[NoiseEffect, ...]:
        """Noise effects."""
        return of_noise(self.effects)

    def to_text(self) -> str:
        """JSON text."""
        setting = asdict(self.setting)
        setting["element_place"] = [axis.tolist() for axis in self.setting.element_place]
        parameters = {effect.name: [each.name for each in effect.parameters] for effect in self.effects}
        return json.dumps({"parameters": parameters, "noise": asdict(self.noise), "setting": setting})

    @property
    def settings(self) -> dict[str, str]:
        """The entry of a calibration's settings that `of` reads."""
        return {EFFECTS: self.to_text()}

    @classmethod
    def of(cls, calibration: CalibrationData) -> EffectList | None:
        """Effects of a calibration; None if it has no effects.

        Raises
        ------
        InputError
            For the reasons of `from_text`.
        """
        return cls.from_text(str(calibration.settings[EFFECTS])) if calibration.has_effects else None

    @classmethod
    def from_text(cls, text: str) -> EffectList:
        """Effects from the result of `to_text`.

        Raises
        ------
        InputError
            An effect is unknown (its package may not be installed) or has other parameters, or the text is damaged.
        """
        try:
            content: dict[str, Any] = json.loads(text)
            raw = dict(content["setting"])
            raw["element_place"] = tuple(np.asarray(axis, dtype=float) for axis in raw["element_place"])
            raw["radii_mm"] = tuple(raw.get("radii_mm", (0.0, 0.0)))
            raw["place_range"] = tuple((float(low), float(high)) for low, high in raw["place_range"])
            setting, noise = Setting(**raw), AddedNoise(**{k: float(v) for k, v in content["noise"].items()})
            parameters = {str(name): [str(each) for each in of] for name, of in content["parameters"].items()}
            effects = named_effects(list(parameters), setting, parameters)
        except InputError:
            raise
        except (ValueError, KeyError, TypeError, AttributeError, ArithmeticError, RecursionError) as error:
            raise InputError("expected the effects of a chain as JSON", column=EFFECTS) from error
        for effect in effects:
            names = [each.name for each in effect.parameters]
            if parameters[effect.name] != names:
                had = ", ".join(map(str, parameters[effect.name]))
                reason = f"effect {effect.name} has the parameters {', '.join(names)} here and had {shown(had)} there"
                raise InputError(f"{reason}: made by another version, calibrate again", column=EFFECTS)
        return cls(setting, effects, noise)


def stated_effects(calibration: CalibrationData) -> tuple[tuple[str, dict[str, float]], ...]:
    """Name and most probable values of each effect of a calibration, as `StatedModel.effects`."""
    listed = EffectList.of(calibration)
    return tuple(
        (
            effect.name,
            {
                own.name: float(calibration.mode[public.name])
                for own, public in zip(effect.parameters, effect.public_parameters(), strict=True)
            },
        )
        for effect in (() if listed is None else listed.effects)
    )


def named_effects(
    names: list[str], setting: Setting, stated: Mapping[str, Iterable[str]] = NOTHING_STATED
) -> tuple[Effect, ...]:
    """Effects with the given names, with priors and probes for a setting.

    An effect is in its looser form if `stated`, names of parameters by effect, has one that only this form has.

    Raises
    ------
    InputError
        A name is unknown, or the effect cannot occur in this setting.
    """
    classes, out = effect_classes(), []
    for name in names:
        if name not in classes:
            raise unknown_name("effect", name, classes)
        effect = classes[name].suited(setting)
        if effect is None:
            raise InputError(f"effect {name} cannot occur, or not be seen, in the way this sensor was touched")
        out.append(effect.in_form_with(stated.get(name, ()), setting.n_elements))
    return tuple(out)
