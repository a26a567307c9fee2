"""Effects of the contact: what presses on the surface is not what the base model presses with."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from bayestouch.chain.finger import FingerChain
from bayestouch.chain.recording import Recording
from bayestouch.effects.effect import Effect, EffectParameter, Setting, Stage, Values
from bayestouch.priors.parameters import Normal, Uniform


@dataclass(frozen=True)
class RigidCore(Effect):
    """The rubber is a thin layer on a rigid core, where the base model takes a half-space (Hertz).

    The layer is stiffer, so that contacts are narrower: the pressure spectrum goes from that of Hertz to the exact one
    on the bonded layer as `share` goes from 0 to 1.

    Reference: Nicolson and Fearing (1995), section 2.3; K. L. Johnson, Contact Mechanics (1985), chapter 5.
    """

    parameters: tuple[EffectParameter, ...] = (
        EffectParameter("share", "", "share of the layer's contact", Uniform(-0.5, 2.0), (0.1,), 0.0),
    )

    name: ClassVar[str] = "rigid_core"
    stage: ClassVar[Stage] = "contact"
    summary: ClassVar[str] = "contact on a layer over a rigid core, in place of a half-space"
    mixes: ClassVar[bool] = False

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        return cls() if setting.finger and setting.contact not in ("layer", "") else None

    def finger(self, chain: FingerChain, values: Values) -> FingerChain:
        return chain.with_(layer_share=values[0])


@dataclass(frozen=True)
class BluntEdge(Effect):
    """The knife edge has a radius: touches made with r_c = 0 are those of a small cylinder.

    Reference: Nicolson and Fearing (1995), section 3.1, where edges stand for line loads.
    """

    parameters: tuple[EffectParameter, ...] = (
        EffectParameter("radius", "mm", "radius of the knife edge", Normal(0.0, 1.0, 0.0), (0.1,), 0.0),
    )

    name: ClassVar[str] = "blunt_edge"
    stage: ClassVar[Stage] = "contact"
    summary: ClassVar[str] = "knife edges that are not sharp"
    mixes: ClassVar[bool] = False

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        return cls() if setting.finger and setting.has_edges else None

    def pose(self, recording: Recording, values: Values) -> Recording:
        radius = recording.indenter_radius_mm
        return replace(recording, indenter_radius_mm=np.where(radius == 0, values[0], radius))


@dataclass(frozen=True)
class TangentialLoad(Effect):
    """The probe also drags along the surface: a shear traction of `share` times the pressure.

    Above zero it pulls the surface towards larger angles. Its strain is odd about the contact where that of the
    pressure is even, so that elements on one side read more and on the other less. Only a steady share, the same in
    all touches, is looked for.

    Reference: K. L. Johnson, Contact Mechanics (1985), chapter 7; N. I. Muskhelishvili, Some Basic Problems, §59.
    """

    parameters: tuple[EffectParameter, ...] = (
        EffectParameter("share", "", "shear traction over pressure", Normal(0.0, 0.3), (0.02,), 0.0),
    )

    name: ClassVar[str] = "tangential_load"
    stage: ClassVar[Stage] = "contact"
    summary: ClassVar[str] = "friction under the probe"
    mixes: ClassVar[bool] = False

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        return cls() if setting.finger else None

    def finger(self, chain: FingerChain, values: Values) -> FingerChain:
        return chain.with_(friction=values[0])
