"""Effects of the rubber body: response that depends on location, and finite strain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.body.finite_strain import is_tabulated
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.recording import Recording
from bayestouch.data.arrays import nearest_turn
from bayestouch.effects.bell import TAILS, bell
from bayestouch.effects.effect import Effect, EffectParameter, Setting, Stage, Values
from bayestouch.priors.parameters import LogNormal, Normal, Uniform

# Least load over the reference load, and most that a power of it can be: they prevent overflow.
LEAST, MOST = 0.01, 100.0


@dataclass(frozen=True)
class SoftSpot(Effect):
    """The response is larger or smaller in one region of the surface: signal (1 + share g(θ_c)), with a bell g.

    Bubbles, thickness and cure vary over a moulded part. The factor depends on the location of the touch, so it is the
    same for all elements that read this touch. The gains of the elements cannot represent it. In the looser form the
    share grows with the power `load_power` of the load: a void closes, a crack opens.

    Reference: Nicolson and Fearing (1995), section 3.2, on errors that depend on location, not on the element.
    """

    parameters: tuple[EffectParameter, ...]
    around: bool = False

    name: ClassVar[str] = "soft_spot"
    stage: ClassVar[Stage] = "body"
    summary: ClassVar[str] = "response that depends on where the touch is"
    mixes: ClassVar[bool] = False

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        unit = "degree" if setting.finger else "mm"
        spans = [high - low for low, high in setting.place_range]
        if min(spans) <= 0:
            return None
        width = max(spans)
        widths = tuple(width * share for share in (0.035, 0.07, 0.14))
        # The distance between trial centres is the width of the narrowest bell, in the plane twice this width.
        count = 18 if len(spans) == 1 else 8
        centres = [
            EffectParameter(
                name,
                unit,
                "middle of the region",
                Uniform(low - 0.1 * width, high + 0.1 * width),
                tuple(np.linspace(low, high, count).tolist()),
            )
            for name, (low, high) in zip(("centre", "centre_y"), setting.place_range, strict=False)
        ]
        return cls(
            (
                EffectParameter("share", "", "share of the response added", Normal(0.0, 0.2), (0.01,), 0.0),
                EffectParameter("width", unit, "half width at half the height", LogNormal(widths[1], 0.7), widths),
                TAILS,
                *centres,
            ),
            setting.finger,
        )

    def further_parameters(self, n_elements: int) -> tuple[EffectParameter, ...]:
        return (EffectParameter("load_power", "", "power of the load", Normal(0.0, 1.0), (0.0,)),)

    def signal(self, recording: Recording, values: Values) -> FloatArray:
        share, width, tails, *centre = values
        growth = np.ones(1)
        if len(centre) > self.coordinates:
            load = np.maximum(recording.load, LEAST * recording.reference_load) / recording.reference_load
            growth = np.minimum(load ** centre.pop(), MOST)
        away = [place - c for place, c in zip(recording.place, centre, strict=True)]
        if self.around:
            away = [nearest_turn(each, 0.0) for each in away]
        squares = np.sum([each**2 for each in away], axis=0)
        return np.asarray(recording.signal * (1 + share * growth * bell(squares / width**2, tails))[:, None])

    @property
    def coordinates(self) -> int:
        """Number of coordinates of a place."""
        return sum(each.name.startswith("centre") for each in self.parameters)


@dataclass(frozen=True)
class FiniteStrain(Effect):
    """The strain is large, so that it is no longer proportional to the load.

    A finite-element table for the paper's finger gives the difference between a neo-Hookean and a linear annulus.
    `share` of this difference is added: 0 is linear rubber, 1 is neo-Hookean rubber of the finger's shear modulus.

    Reference: `bayestouch.body.finite_strain`.
    """

    parameters: tuple[EffectParameter, ...] = (
        EffectParameter("share", "", "share of the neo-Hookean nonlinearity", Uniform(-0.5, 2.0), (0.1,), 0.0),
    )

    name: ClassVar[str] = "finite_strain"
    stage: ClassVar[Stage] = "body"
    summary: ClassVar[str] = "strain that is not in proportion to the load"
    mixes: ClassVar[bool] = False
    adds_strain: ClassVar[bool] = True

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        return cls() if setting.finger and is_tabulated(*setting.radii_mm) else None

    def finger(self, chain: FingerChain, values: Values) -> FingerChain:
        return chain.with_(finite_strain=values[0])
