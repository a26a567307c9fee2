"""Text of docs/effects.md: every effect with its parameters and priors, from the classes themselves."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from typing import Any

import numpy as np

from bayestouch.effects import effect_classes
from bayestouch.effects.effect import OWN, EffectParameter
from bayestouch.effects.listing import typical
from bayestouch.simulation import SHAPES

STAGES = {
    "rig": "the machine that presses and measures",
    "contact": "what happens under the probe",
    "body": "the rubber",
    "element": "the elements in it",
    "readout": "electronics, and what time does",
    "noise": "how readings scatter",
}


def page() -> str:
    """The text of docs/effects.md."""
    out = [
        "# Effects that a diagnosis knows",
        "",
        "Made by `studies/effects_gallery.py` from the classes themselves. The pictures show the finger of",
        "[Nicolson and Fearing 1995](published.md).",
        "Left: what the effect changes in mean readings, at the size that is stated, over the quantity that shows it",
        "best. Right: what is left of that after the base parameters (gains, depths, angles, modulus and Poisson's",
        "ratio) have absorbed their part. Often little is left, so this picture has a scale of its own. What is left",
        "is all that a [diagnosis](diagnosis.md) can see. [Add an effect](add_an_effect.md) of your own in thirty",
        "lines.",
        "",
        "Each table lists the parameters. With the value in the column *does nothing at* the sensor is as without the",
        "effect. The prior says which values are probable before any data: its median, and the range that holds 90 %.",
        "",
        "Many effects have a *looser form*: the same physics with further parameters, which at zero change nothing.",
        "`own_01` is that of the first element, and each element has one. A diagnosis takes this form where it",
        "predicts left-out touches clearly better.",
        "",
        "A peak reading is what the fitted sensor would read without the effects: a finger exactly under a knife edge",
        "at the mean load, a pad under a touch at the median load. Other terms are in the [glossary](glossary.md).",
    ]
    stage = ""
    for name, cls in effect_classes().items():
        effect = typical(cls)
        assert effect is not None
        if cls.stage != stage:
            stage = cls.stage
            out += ["", f"## {stage.capitalize()}: {STAGES[stage]}"]
        out += ["", f"### {name}", "", inspect.getdoc(cls) or "", "", f"![{cls.summary}](effects/{name}.png)", ""]
        out += ["| parameter | unit | meaning | does nothing at | prior |", "|---|---|---|---|---|"]
        out += [_row(name, each) for each in _without_repeats(effect.parameters)]
        looser = effect.looser(2)
        more = () if looser is None else looser.parameters[len(effect.parameters) :]
        if more:
            out += [
                "",
                "The looser form has these, too:",
                "",
                "| parameter | unit | meaning | prior |",
                "|---|---|---|---|",
            ]
            out += [
                f"| `{name}_{each.name}` | {each.unit} | {each.description} | {_prior(each.prior)} |"
                for each in _without_repeats(more)
            ]
    return "\n".join([*out, *simulated()]) + "\n"


def _without_repeats(parameters: Sequence[EffectParameter]) -> list[EffectParameter]:
    """Parameters, of those of the elements only the first, which stands for all."""
    return [each for each in parameters if not each.name.startswith(OWN) or each.name == f"{OWN}01"]


def _row(name: str, each: EffectParameter) -> str:
    """A parameter in the table of its effect."""
    null = "" if each.null is None else f"{each.null:g}"
    return f"| `{name}_{each.name}` | {each.unit} | {each.description} | {null} | {_prior(each.prior)} |"


def simulated() -> list[str]:
    """What `simulate` takes an effect to be."""
    shapes = [
        f"| `{name}` | {', '.join(f'`{parameter}` {value:g}' for parameter, value in each.items())} |"
        for name, each in SHAPES.items()
    ]
    return [
        "",
        "## Effects in a simulation",
        "",
        "`bayestouch simulate --effect NAME=VALUE` adds an effect to a simulated sensor, by the formula above.",
        "VALUE is the first parameter of its table; `NAME.PARAMETER=VALUE` states any of them:",
        "",
        "    bayestouch simulate -o my-finger --effect creep=0.05 --effect creep.time=3",
        "",
        "State at least one parameter that has a value in the column *does nothing at* (an amplitude); the first",
        "parameter always has one. Any other such parameter has that value if you do not state it. A parameter without",
        "such a value has the one of the table below (times in s). If the table does not have it, it is the middle one",
        "of the values at which the diagnosis looks for the effect. `truth.json` has them all.",
        "",
        "| effect | shape where none is stated |",
        "|---|---|",
        *shapes,
        "",
        "The tables have the commanded places and the loads that the force sensor read. An effect of the rig changes",
        "the true places and loads; `truth.json` has them. An effect on the finger itself leaves the gains (reading",
        "per strain) as they are.",
    ]


def _prior(prior: Any) -> str:
    low, middle, high = (round(float(v), 12) + 0.0 for v in prior.quantile(np.array([0.05, 0.5, 0.95])))
    return f"{type(prior).__name__}: {middle:.3g}, 90 % within {low:.3g} to {high:.3g}"
