"""Effects of the contact: the pressure on the surface differs from that of the base model."""

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
    """The rubber is a thin layer on a rigid core; the base model assumes a half-space (Hertz).

    It is tried with another contact model than the default, `layer`, which has the rigid core already. The layer is
    stiffer, so contacts are narrower. `share` = 0 is the pressure spectrum of the contact model, `share` = 1 is the
    exact one on a bonded layer; between them it is interpolated.

    Reference: Nicolson and Fearing (1995), section 2.3; K. L. Johnson, Contact Mechanics (1985), chapter 5.
    """

    parameters: tuple[EffectParameter, ...] = (
        EffectParameter("share", "", "share of the layer's contact", Uniform(-0.5, 2.0), (0.1,), 0.0),
    )

    name: ClassVar[str] = "rigid_core"
    stage: ClassVar[Stage] = "contact"
    summary: ClassVar[str] = "contact on a layer over a rigid core, instead of a half-space"
    mixes: ClassVar[bool] = False

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        return cls() if setting.finger and setting.contact not in ("layer", "") else None

    def finger(self, chain: FingerChain, values: Values) -> FingerChain:
        return chain.with_(layer_share=values[0])


@dataclass(frozen=True)
class BluntEdge(Effect):
    """The knife edge has a radius: touches with r_c = 0 are computed as touches of a cylinder of this radius.

    Reference: Nicolson and Fearing (1995), section 3.1, which treats an edge as a line load.
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

    A positive share pulls the surface towards larger angles. The strain of the pressure is even about the contact,
    that of the shear is odd: elements on one side read more, those on the other side less. The share is the same in
    all touches.

    Reference: K. L. Johnson, Contact Mechanics (1985), chapter 7; N. I. Muskhelishvili, Some Basic Problems, §59.
    """

    parameters: tuple[EffectParameter, ...] = (
        EffectParameter("share", "", "shear traction over pressure", Normal(0.0, 0.3), (0.02,), 0.0),
    )

    name: ClassVar[str] = "tangential_load"
    stage: ClassVar[Stage] = "contact"
    summary: ClassVar[str] = "friction under the probe"
    mixes: ClassVar[bool] = False
    changes_strain: ClassVar[bool] = True

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        return cls() if setting.finger else None

    def finger(self, chain: FingerChain, values: Values) -> FingerChain:
        return chain.with_(friction=values[0])
