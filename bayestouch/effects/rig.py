"""Effects of the rig: location or load of a touch differ from those in the touch table."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.pad import COORDINATES
from bayestouch.chain.recording import Recording
from bayestouch.effects.effect import Effect, EffectParameter, Setting, Stage, Values
from bayestouch.effects.element import bluntness
from bayestouch.priors.parameters import Normal

# Largest angle error of a prober, degree. On a finger of 12.7 mm the axis would be 1.1 mm beside, which is seen without
# any measurement. Without this limit it can imitate all that makes peaks wider.
LARGEST = 5.0
# Number of half waves over the recording of an angle error, and of the zero of a force sensor. Rigs are clamped anew or
# warm up; many half waves would follow what belongs to single touches.
WAVES_OF_ANGLE, WAVES_OF_LOAD = 4, 8
# Highest number of waves a turn of the angle error: of three jaws.
WAVES_A_TURN = 3


def once_around(angle_deg: FloatArray, values: Values, centre: tuple[float, ...]) -> FloatArray:
    """a (sin θ - s) + b (cos θ - c) at angles θ, for values (a, b) and a centre (s, c)."""
    turn = np.radians(angle_deg)
    return np.asarray(values[0] * (np.sin(turn) - centre[0]) + values[1] * (np.cos(turn) - centre[1]))


def centre_of_elements(setting: Setting, waves: int = 1) -> tuple[float, float]:
    """Means of sin kθ and cos kθ over the elements of a finger, with k waves a turn."""
    turn = waves * np.radians(setting.element_place[0])
    return float(np.sin(turn).mean()), float(np.cos(turn).mean())


def half_waves(time_s: FloatArray, span_s: float, count: int) -> FloatArray:
    """cos(π k t/T), k from 1 to `count`, at times t (n,) from 0 to T: (n, count). After T all stay as they are at T."""
    passed = np.clip(time_s / span_s, 0.0, 1.0)
    return np.asarray(np.cos(np.pi * np.outer(passed, np.arange(1, count + 1))))


def in_half_waves(of: EffectParameter, count: int) -> tuple[EffectParameter, ...]:
    """Parameters by which another one changes in half waves k over the recording; their sd is its over k."""
    sd = of.normal_prior[1]
    return tuple(
        replace(of, name=f"{of.name}_wave_{k}", description=f"{of.description}, {what}", prior=Normal(0.0, sd / k))
        for k in range(1, count + 1)
        for what in [f"half wave {k} in time"]
    )


@dataclass(frozen=True)
class ProberEccentricity(Effect):
    """The axis of the prober is not that of the finger: θ_c = θ + a (sin θ - s) + b (cos θ - c).

    An offset e of the axis gives an angle error with the amplitude e/r_b radians and a period of one turn. s and c are
    the means of sin θ and cos θ over the elements, so that the effect does not turn the finger as a whole: where zero
    degree is on a finger is known only as the data set states it. The fitted angles of the elements absorb the angle
    error at each element; only its change near an element can be observed.

    In the looser form the error also depends on the tip. If the tip descends beside the centre, the angle error of a
    tip of radius r_c is r_b/(r_b + r_c) times that of an edge, and a flat has none. `edge`, `edge_sine` and
    `edge_cosine` are such errors of an edge: the same everywhere, and with a period of one turn. The error also has two
    and three waves a turn, as a chuck has three jaws. And a finger is clamped anew, works loose, or slips: a, b, and an
    error `turn` that is the same everywhere change with time. Half wave k in time is k half periods of a cosine over
    the recording, and stays as it is at the end.

    Reference: J. Slocum, Precision Machine Design (1992), on radial error motion of spindles.
    """

    parameters: tuple[EffectParameter, ...]
    centres: tuple[tuple[float, float], ...]
    outer_mm: float = 0.0
    span_s: float = 0.0

    name: ClassVar[str] = "prober_eccentricity"
    stage: ClassVar[Stage] = "rig"
    summary: ClassVar[str] = "angle error of the prober, which comes back with each turn or changes with time"
    mixes: ClassVar[bool] = False

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        if not setting.finger:
            return None
        parameters = tuple(
            EffectParameter(
                name, "degree", f"angle error per {what} θ", Normal(0.0, 1.0, -LARGEST, LARGEST), (0.1,), 0.0
            )
            for name, what in (("sine", "sin"), ("cosine", "cos"))
        )
        centres = tuple(centre_of_elements(setting, k) for k in range(1, WAVES_A_TURN + 1))
        return cls(parameters, centres, setting.radii_mm[1], setting.span_s)

    @property
    def follows_time(self) -> bool:
        return len(self.parameters) > 2

    def further_parameters(self, n_elements: int) -> tuple[EffectParameter, ...]:
        if not (self.outer_mm > 0 and self.span_s > 0):
            return ()
        both = self.parameters[:2]
        of_edge = tuple(
            replace(both[0], name=name, description=f"angle error of an edge{what}")
            for name, what in (("edge", ""), ("edge_sine", " per sin θ"), ("edge_cosine", " per cos θ"))
        )
        around = tuple(
            replace(each, name=f"{each.name}_{k}", description=each.description.replace("θ", f"{k}θ"))
            for k in range(2, WAVES_A_TURN + 1)
            for each in both
        )
        turned = replace(both[0], name="turn", description="angle error everywhere")
        in_time = tuple(wave for each in (turned, *both) for wave in in_half_waves(each, WAVES_OF_ANGLE))
        return (*of_edge, *around, *in_time)

    def pose(self, recording: Recording, values: Values) -> Recording:
        return self.shifted(recording, self.by_place(recording) @ np.array(values))

    def shifted(self, recording: Recording, by: FloatArray) -> Recording:
        return replace(recording, place=(recording.place[0] + by, *recording.place[1:]))

    def by_place(self, recording: Recording) -> FloatArray:
        turn = np.radians(recording.place[0])
        around = [
            function(k * turn) - middle
            for k, centre in enumerate(self.centres, start=1)
            for function, middle in zip((np.sin, np.cos), centre, strict=True)
        ]
        once = np.stack(around[:2], axis=1)
        if len(self.parameters) == 2:
            return once
        beside = 1 - bluntness(recording.indenter_radius_mm, self.outer_mm)
        whole = np.stack([np.ones_like(turn), np.sin(turn), np.cos(turn)], axis=1)
        waves = half_waves(recording.time_s, self.span_s, WAVES_OF_ANGLE)
        in_time = (each[:, None] * waves for each in (np.ones_like(turn), *once.T))
        return np.hstack([once, beside[:, None] * whole, np.stack(around[2:], axis=1), *in_time])


@dataclass(frozen=True)
class LoadOffset(Effect):
    """The force sensor reads `offset` at zero load: P = reading - offset.

    The gains absorb the mean effect. What can be observed is that readings do not go to zero with the load as read, and
    that contacts are slightly narrower or wider than the load as read implies. Where all loads are equal, the gains and
    the shear modulus absorb both, and the effect is not looked for. In the looser form, which a finger has, the offset
    changes with time by half waves over the recording, and stays as it is at the end: force sensors warm up,
    are knocked, and are set to zero again.

    Reference: E. O. Doebelin, Measurement Systems (2003), on bias and sensitivity of instruments.
    """

    parameters: tuple[EffectParameter, ...]
    span_s: float = 0.0

    name: ClassVar[str] = "load_offset"
    stage: ClassVar[Stage] = "rig"
    summary: ClassVar[str] = "zero error of the force sensor"
    mixes: ClassVar[bool] = False

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        if not setting.loads_vary:
            return None
        size = 0.1 * setting.reference_load
        what = "added to every load reading"
        offset = EffectParameter("offset", setting.load_unit, what, Normal(0.0, size), (0.01 * size,), 0.0)
        return cls((offset,), setting.span_s if setting.finger else 0.0)

    @property
    def follows_time(self) -> bool:
        return len(self.parameters) > 1

    def further_parameters(self, n_elements: int) -> tuple[EffectParameter, ...]:
        return in_half_waves(self.parameters[0], WAVES_OF_LOAD) if self.span_s > 0 else ()

    def pose(self, recording: Recording, values: Values) -> Recording:
        return self.shifted(recording, self.by_place(recording) @ np.array(values))

    def shifted(self, recording: Recording, by: FloatArray) -> Recording:
        return replace(recording, load=recording.load - by)

    def by_place(self, recording: Recording) -> FloatArray:
        one = np.ones((len(recording.load), 1))
        if len(self.parameters) == 1:
            return one
        return np.hstack([one, half_waves(recording.time_s, self.span_s, WAVES_OF_LOAD)])


@dataclass(frozen=True)
class LoadMisalignment(Effect):
    """The force sensor is not parallel to the load; the angle between them varies with location.

    On a finger the reading of the force sensor is P (1 + a (sin θ - s) + b (cos θ - c)), where a and b are shares, and
    s and c the means of sin θ and cos θ over the elements: an error that is the same everywhere is absorbed by the
    gains, so that the scale of the loads is known only as the force sensor states it. On a pad the share changes
    linearly from one side to the other, as on a tilted table, and is zero in the middle; a coordinate in which all
    touches are equal has no share. All elements read too much or too little at the same locations. In the looser form
    on a finger there are two waves a turn beside the one, as the friction of a guide makes them; their mean over the
    elements is zero, too.

    Reference: E. O. Doebelin, Measurement Systems (2003), on the cross-sensitivity of force sensors.
    """

    parameters: tuple[EffectParameter, ...]
    around: bool
    centre: tuple[float, ...]
    half_range: tuple[float, ...]
    centre_2: tuple[float, ...] = (0.0, 0.0)

    name: ClassVar[str] = "load_misalignment"
    stage: ClassVar[Stage] = "rig"
    summary: ClassVar[str] = "load error that varies slowly with location"
    mixes: ClassVar[bool] = False

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        middle = tuple(0.5 * (low + high) for low, high in setting.place_range)
        half = tuple(0.5 * (high - low) for low, high in setting.place_range)
        # Along a coordinate in which all touches are equal, but for rounding, no error can change.
        changing = tuple(name for name, each in zip(COORDINATES, half, strict=False) if each > 1e-6 * max(half))
        names = ("sine", "cosine") if setting.finger else changing
        prior = Normal(0.0, 0.1)
        parameters = tuple(EffectParameter(n, "", f"load error ({n}) as a share", prior, (0.001,), 0.0) for n in names)
        if not names:
            return None
        if not setting.finger:
            return cls(parameters, False, middle, half)
        return cls(parameters, True, centre_of_elements(setting), half, centre_of_elements(setting, 2))

    def further_parameters(self, n_elements: int) -> tuple[EffectParameter, ...]:
        if not self.around:
            return ()
        return tuple(
            replace(each, name=f"{each.name}_2", description=f"load error ({each.name} of twice the angle) as a share")
            for each in self.parameters[:2]
        )

    def pose(self, recording: Recording, values: Values) -> Recording:
        if self.around:
            error = once_around(recording.place[0], values, self.centre)
            if len(values) > 2:
                error = error + once_around(2 * recording.place[0], values[2:], self.centre_2)
        else:
            axes = [COORDINATES.index(each.name) for each in self.parameters]
            places, middle, half = recording.place, self.centre, self.half_range
            scaled = [v * (places[i] - middle[i]) / half[i] for v, i in zip(values, axes, strict=True)]
            error = np.sum(scaled, axis=0)
        return replace(recording, load=recording.load / np.maximum(1 + error, 0.1))
