"""The catalogue of effects as tables for `bayestouch effects` and the documentation."""

from __future__ import annotations

import inspect
from dataclasses import replace
from typing import Any

import numpy as np

from bayestouch.effects.catalogue import effect_classes
from bayestouch.effects.effect import Effect, Setting
from bayestouch.errors import unknown_name


def listing() -> list[dict[str, str]]:
    """Name, stage and summary of every effect."""
    return [{"name": each.name, "stage": each.stage, "summary": each.summary} for each in effect_classes().values()]


def effect_facts(name: str) -> dict[str, Any]:
    """Name, stage, summary, physics (the docstring, with its reference) and parameters of one effect.

    Raises
    ------
    InputError
        There is no such effect.
    """
    classes = effect_classes()
    if name not in classes:
        raise unknown_name("effect", name, classes)
    cls = classes[name]
    effect = typical(cls)
    return {
        "name": name,
        "stage": cls.stage,
        "summary": cls.summary,
        "physics": inspect.getdoc(cls) or "",
        "parameters": []
        if effect is None
        else [
            {"name": each.name, "unit": each.unit, "description": each.description, "null": each.null}
            for each in effect.parameters
        ],
    }


def typical(cls: type[Effect]) -> Effect | None:
    """The effect for the paper's finger (contact on a layer, then Hertz), else for a pad; None if it suits neither."""
    suited = (cls.suited(setting) for setting in (FINGER, replace(FINGER, contact="hertz"), PAD))
    return next((effect for effect in suited if effect is not None), None)


#: The paper's finger with edges and flats all around, five samples a touch, none without contact; and a pad of three by
#: three elements.
FINGER = Setting(
    finger=True,
    n_elements=16,
    element_place=(np.linspace(-66.0, 66.0, 16),),
    place_range=((-90.0, 90.0),),
    reference_load=200.0,
    load_unit="N/m",
    contact="layer",
    has_edges=True,
    hold_s=1.0,
    gap_s=4.0,
    span_s=3600.0,
    radii_mm=(9.4, 12.7),
    any_rest=False,
)
PAD = Setting(
    finger=False,
    n_elements=9,
    element_place=(np.repeat([0.0, 5.0, 10.0], 3), np.tile([0.0, 5.0, 10.0], 3)),
    place_range=((0.0, 10.0), (0.0, 10.0)),
    reference_load=1.0,
    load_unit="N",
    contact="",
    has_edges=False,
    hold_s=1.0,
    gap_s=4.0,
    span_s=3600.0,
)
