"""Effects of the contact: the pressure on the surface differs from that of the base model."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.recording import Recording
from bayestouch.chain.surface import SurfaceProfile as Surface
from bayestouch.chain.surface import profile_basis
from bayestouch.effects.effect import Effect, EffectParameter, Setting, Stage, Values
from bayestouch.priors.parameters import Normal, Uniform

# Distance between knots of a profile, degree, at most: a flat on soft rubber averages over 10° to 20°. Splines through
# these knots follow a function with a correlation length of 10° to 4 % of its standard deviation.
KNOT_SPACING_DEG = 9.0
# Standard deviation of the departure at a knot, over 1/r_b: 0.2 mm on a finger of 12.7 mm over 20°.
SPREAD = 0.2


@dataclass(frozen=True)
class RigidCore(Effect):
    """The rubber is a thin layer on a rigid core; the base model assumes a half-space (Hertz).

    The layer is stiffer, so contacts are narrower. `share` = 0 is the pressure spectrum of Hertz, `share` = 1 is the
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

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        return cls() if setting.finger else None

    def finger(self, chain: FingerChain, values: Values) -> FingerChain:
        return chain.with_(friction=values[0])


@dataclass(frozen=True)
class SurfaceProfile(Effect):
    """The surface is out of round: 1/R = 1/r_c + 1/r_b + f(θ_c), with a smooth function f of the place touched.

    f is a cubic spline through its values at knots over the touched range, 9° apart or less. A flat feels it most and
    a knife edge does not feel it: a touch of composite radius R that is read without it is read wrong by -R² f. The
    gains, which are those of knife edges, cannot take it up.

    Reference: K. L. Johnson, Contact Mechanics (1985), section 4.2 (relative curvature); C. de Boor, A Practical Guide
    to Splines (1978).
    """

    parameters: tuple[EffectParameter, ...]
    knots_deg: tuple[float, ...]

    name: ClassVar[str] = "surface_profile"
    stage: ClassVar[Stage] = "contact"
    summary: ClassVar[str] = "curvature of the surface that depends on where the touch is"
    mixes: ClassVar[bool] = False

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        outer = setting.radii_mm[1]
        low, high = setting.place_range[0]
        if not setting.finger or not outer > 0 or not high - low > KNOT_SPACING_DEG:
            return None
        knots = np.linspace(low, high, int(np.ceil((high - low) / KNOT_SPACING_DEG)) + 1)
        prior, probe = Normal(0.0, SPREAD / outer), (0.1 * SPREAD / outer,)
        return cls(
            tuple(
                EffectParameter(f"at_{i:02d}", "1/mm", f"curvature minus 1/r_b at {knot:.4g}°", prior, probe, 0.0)
                for i, knot in enumerate(knots, start=1)
            ),
            tuple(knots.tolist()),
        )

    def finger(self, chain: FingerChain, values: Values) -> FingerChain:
        return chain.with_(surface=Surface(self.knots_deg, np.array(values)))

    def by_place(self, recording: Recording) -> FloatArray:
        return profile_basis(self.knots_deg, np.radians(recording.place[0]))
