"""Effects that occur on pads only."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.recording import Recording
from bayestouch.effects.effect import Effect, EffectParameter, Setting, Stage, Values
from bayestouch.priors.parameters import LogNormal, Normal

# Acting load of a touch under the threshold, over the reference load: no signal, but a load to divide by.
LEAST = 1e-6


@dataclass(frozen=True)
class LoadNonlinearity(Effect):
    """Readings are not proportional to the load P: the acting load is p/(1 + share p/P_ref), p = P - threshold.

    The contact widens as the load increases, and a thin layer or a channel under it becomes stiffer. A pad that is
    linear in the pressure is then not linear in the load. `threshold` is the load that the skin carries before it
    touches the layer or channel; a smaller load does not act (p is at least 10⁻⁶ P_ref). On a finger the base model
    already has the widening of the contact. The effect depends on the load; a gain that depends on the reading is
    `gain_nonlinearity`.

    Reference: K. L. Johnson, Contact Mechanics (1985), chapters 4 and 5 (the peak pressure under a sphere is
    proportional to the cube root of the load).
    """

    parameters: tuple[EffectParameter, ...]

    name: ClassVar[str] = "load_nonlinearity"
    stage: ClassVar[Stage] = "contact"
    summary: ClassVar[str] = "response that is not proportional to the load"
    mixes: ClassVar[bool] = False

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        if setting.finger or not setting.loads_vary:
            return None
        size = 0.3 * setting.reference_load
        # Under a threshold as large as the reference load, half of the touches would not act.
        prior = Normal(0.0, size, -setting.reference_load, setting.reference_load)
        what = "load that does not reach the elements"
        return cls(
            (
                EffectParameter("share", "", "how much the response flattens", Normal(0.0, 1.0, -0.2), (0.01,), 0.0),
                EffectParameter("threshold", setting.load_unit, what, prior, (0.01 * size,), 0.0),
            )
        )

    def pose(self, recording: Recording, values: Values) -> Recording:
        share, threshold = values
        load = np.maximum(recording.load - threshold, LEAST * recording.reference_load)
        return replace(recording, load=load / np.maximum(1 + share * load / recording.reference_load, 0.1))


@dataclass(frozen=True)
class CreepByElement(Effect):
    """Readings change while the touch is held, with a share for each element: y (1 + share_e (1 - exp(-t/time))).

    Then the material around each element creeps (gel in the housing, a bubble, the bond to the board), not the rubber
    over the whole pad. On a finger all elements lie in one rubber, so only `creep` is tried.

    Reference: J. D. Ferry, Viscoelastic Properties of Polymers (1980), chapter 1, the standard linear solid.
    """

    parameters: tuple[EffectParameter, ...]

    name: ClassVar[str] = "creep_by_element"
    stage: ClassVar[Stage] = "readout"
    summary: ClassVar[str] = "readings that change while the touch is held, different for each element"
    mixes: ClassVar[bool] = False
    needs_samples: ClassVar[bool] = True

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        if setting.finger or setting.hold_s <= 0 or setting.n_elements < 2:
            return None
        prior, times = Normal(0.0, 0.2), tuple(setting.hold_s * share for share in (0.25, 1.0))
        shares = [
            EffectParameter(
                f"share_{e}", "", f"change of {e} after a long time, as a share", prior, (0.001,), 0.0, True
            )
            for e in (f"e{number:02d}" for number in range(1, setting.n_elements + 1))
        ]
        time = EffectParameter("time", setting.time_unit, "time constant", LogNormal(times[1], 1.0), times)
        return cls((*shares, time))

    def signal(self, recording: Recording, values: Values) -> FloatArray:
        *share, time = values
        gained = -np.expm1(-recording.held_s / time)
        return np.asarray(recording.signal * (1 + gained[:, None] * np.array(share)))
