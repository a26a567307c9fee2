"""What a real sensor adds to the chain: one small function on one stage for each effect.

Every effect has one number, and a null value of it that leaves the chain unchanged. "Peak" is the reading of
an element right under the reference load (200 N/m on a finger, the middle of the load range on a pad).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from bayestouch.effects import effect_classes
from bayestouch.errors import InputError
from bayestouch.simulation.recording import SimulatedRecording

Stage = Literal["rig", "contact", "body", "element", "readout", "noise"]
Apply = Callable[[SimulatedRecording, float, np.random.Generator], SimulatedRecording]

ECCENTRICITY_PHASE_DEG = 30.0
SOFT_SPOT_DEG, SOFT_SPOT_WIDTH_DEG = 7.0, 10.0
PROXIMITY_WIDTH_DEG = 30.0
FIRST_EFFECT_STREAM = 1000
DRIFT_TIME_S, CREEP_TIME_S, MEMORY_TIME_S = 600.0, 1.0, 10.0


@dataclass(frozen=True)
class SimulatedEffect:
    """An effect that the simulator can add.

    Attributes
    ----------
    name : str
        Name as in the data format.
    stage : str
        Stage of the chain it belongs to.
    meaning : str
        What its value is, with unit.
    null : float
        Value that changes nothing.
    support : (float, float)
        Lowest and highest value; infinite values only where that is the null.
    finger_only : bool
        Whether it needs a finger.
    apply : callable
        Recording before and after.
    """

    name: str
    stage: Stage
    meaning: str
    null: float
    support: tuple[float, float]
    finger_only: bool
    apply: Apply

    @property
    def before_body(self) -> bool:
        """Whether it changes what the body is pressed with, or (an element's width) what is summed there."""
        return self.stage in ("rig", "contact") or self.apply is aperture


def prober_eccentricity(r: SimulatedRecording, value: float, rng: np.random.Generator) -> SimulatedRecording:
    return replace(r, place=(r.angle_deg + value * np.sin(np.radians(r.angle_deg - ECCENTRICITY_PHASE_DEG)),))


def load_offset(r: SimulatedRecording, value: float, rng: np.random.Generator) -> SimulatedRecording:
    return replace(r, load_reading=r.load_reading + value)


def load_misalignment(r: SimulatedRecording, value: float, rng: np.random.Generator) -> SimulatedRecording:
    return replace(r, load_reading=r.load_reading * (1 + value * np.sin(np.radians(r.angle_deg))))


def blunt_edge(r: SimulatedRecording, value: float, rng: np.random.Generator) -> SimulatedRecording:
    return replace(r, indenter_radius_mm=np.where(r.indenter_radius_mm == 0, value, r.indenter_radius_mm))


def aperture(r: SimulatedRecording, value: float, rng: np.random.Generator) -> SimulatedRecording:
    return replace(r, aperture_mm=value)


def soft_spot(r: SimulatedRecording, value: float, rng: np.random.Generator) -> SimulatedRecording:
    bump = np.exp(-0.5 * ((r.angle_deg - SOFT_SPOT_DEG) / SOFT_SPOT_WIDTH_DEG) ** 2)
    return replace(r, signal=r.signal * (1 + value * bump)[:, None])


def crosstalk(r: SimulatedRecording, value: float, rng: np.random.Generator) -> SimulatedRecording:
    leak = np.zeros_like(r.signal)
    leak[:, 1:] += r.signal[:, :-1]
    leak[:, :-1] += r.signal[:, 1:]
    return replace(r, signal=r.signal + value * leak)


def channel_lag(r: SimulatedRecording, value: float, rng: np.random.Generator) -> SimulatedRecording:
    scan = r.signal.ravel()
    before = np.concatenate([scan[:1], scan[:-1]])
    return replace(r, signal=(scan + value * (before - scan)).reshape(r.signal.shape))


def proximity(r: SimulatedRecording, value: float, rng: np.random.Generator) -> SimulatedRecording:
    turn = (r.element_place[0] - r.angle_deg[:, None] + 180) % 360 - 180
    return replace(r, signal=r.signal + value * r.peak * np.exp(-0.5 * (turn / PROXIMITY_WIDTH_DEG) ** 2))


def gain_nonlinearity(r: SimulatedRecording, value: float, rng: np.random.Generator) -> SimulatedRecording:
    return replace(r, signal=r.signal * (1 + value * r.signal / r.peak))


def saturation(r: SimulatedRecording, value: float, rng: np.random.Generator) -> SimulatedRecording:
    return replace(r, signal=np.clip(r.signal, -value * r.peak, value * r.peak))


def gain_drift(r: SimulatedRecording, value: float, rng: np.random.Generator) -> SimulatedRecording:
    share = (r.time_s - r.time_s[0]) / max(r.time_s[-1] - r.time_s[0], 1e-300)
    return replace(r, signal=r.signal * (1 + value * share)[:, None])


def creep(r: SimulatedRecording, value: float, rng: np.random.Generator) -> SimulatedRecording:
    return replace(r, signal=r.signal * (1 + value * -np.expm1(-r.held_s / CREEP_TIME_S))[:, None])


def memory(r: SimulatedRecording, value: float, rng: np.random.Generator) -> SimulatedRecording:
    first = np.flatnonzero(r.sample == 0)
    before = np.concatenate([[0], first[1:] - 1])  # last row of the touch before
    left = np.where(np.arange(len(first))[:, None] > 0, r.signal[before], 0.0)
    fade = np.exp(-(r.time_s - r.time_s[before][r.touch]) / MEMORY_TIME_S)
    return replace(r, signal=r.signal + value * left[r.touch] * fade[:, None])


def baseline_drift(r: SimulatedRecording, value: float, rng: np.random.Generator) -> SimulatedRecording:
    # Ornstein-Uhlenbeck process, stationary from the start, one for each element.
    keep = np.exp(-np.diff(r.time_s, prepend=r.time_s[0] - 1e9) / DRIFT_TIME_S)
    shocks = rng.standard_normal(r.signal.shape) * np.sqrt(1 - keep**2)[:, None]
    drift = np.zeros_like(r.signal)
    for row in range(len(drift)):
        drift[row] = keep[row] * drift[row - 1] + shocks[row]
    return replace(r, signal=r.signal + value * r.peak * drift)


def common_mode_noise(r: SimulatedRecording, value: float, rng: np.random.Generator) -> SimulatedRecording:
    return replace(r, signal=r.signal + value * r.peak * rng.standard_normal((len(r.signal), 1)))


def signal_dependent_noise(r: SimulatedRecording, value: float, rng: np.random.Generator) -> SimulatedRecording:
    return replace(r, signal=r.signal * (1 + value * rng.standard_normal(r.signal.shape)))


def outliers(r: SimulatedRecording, value: float, rng: np.random.Generator) -> SimulatedRecording:
    wrong = rng.random(r.signal.shape) < value
    return replace(r, signal=r.signal + wrong * r.peak * rng.uniform(-1, 1, r.signal.shape))


ANY, POSITIVE, SHARE, CHANGE = (-np.inf, np.inf), (0.0, np.inf), (0.0, 1.0), (-1.0, np.inf)


def _effect(
    apply: Apply,
    stage: Stage,
    support: tuple[float, float],
    meaning: str,
    *,
    null: float = 0.0,
    finger_only: bool = False,
) -> SimulatedEffect:
    return SimulatedEffect(apply.__name__, stage, meaning, null, support, finger_only, apply)


_ALL = (
    _effect(prober_eccentricity, "rig", ANY, "degree: θ_c is off by VALUE sin(θ_c - 30°)", finger_only=True),
    _effect(load_offset, "rig", ANY, "added to every load reading, N/m (N on a pad)"),
    _effect(load_misalignment, "rig", ANY, "share: load readings are off by 1 + VALUE sin θ_c", finger_only=True),
    _effect(blunt_edge, "contact", POSITIVE, "radius of the knife edges in mm", finger_only=True),
    _effect(soft_spot, "body", CHANGE, "share of response added under touches about 7° ± 10°", finger_only=True),
    _effect(aperture, "element", POSITIVE, "width of the elements along the arc in mm", finger_only=True),
    _effect(crosstalk, "element", ANY, "share of the signals of the channels before and after that is added"),
    _effect(channel_lag, "element", SHARE, "share left over from the channel scanned before"),
    _effect(
        proximity,
        "element",
        ANY,
        "share of the peak read ± 30° around the probe, at any load",
        finger_only=True,
    ),
    _effect(gain_nonlinearity, "readout", ANY, "change of gain at the peak as a share: y (1 + VALUE y/peak)"),
    _effect(saturation, "readout", POSITIVE, "share of the peak at which readings are cut off", null=np.inf),
    _effect(gain_drift, "readout", CHANGE, "change of gain from first to last sample as a share"),
    _effect(creep, "readout", ANY, "share gained while held, approached within 1 s"),
    _effect(memory, "readout", ANY, "share left of the touch before, fading within 10 s"),
    _effect(baseline_drift, "readout", POSITIVE, "sd of the zero's wander over 10 min, share of the peak"),
    _effect(common_mode_noise, "noise", POSITIVE, "sd of an error shared by all elements, share of the peak"),
    _effect(signal_dependent_noise, "noise", POSITIVE, "sd of an error as a share of the signal"),
    _effect(outliers, "noise", SHARE, "probability that a reading is off by up to ± the peak"),
)

#: Effects by name, in the order in which they are applied within a stage.
SIMULATED_EFFECTS: Mapping[str, SimulatedEffect] = {effect.name: effect for effect in _ALL}


def check_effects(effects: Mapping[str, float], *, finger: bool) -> None:
    """Raise `InputError` for an unknown effect, a value without sense, or an effect of fingers on a pad."""
    for name, value in effects.items():
        effect = SIMULATED_EFFECTS.get(name)
        if effect is None:
            known = effect_classes()
            if name in known:
                continue  # `bayestouch.simulation.catalogue` looks at its value
            names = dict.fromkeys((*SIMULATED_EFFECTS, *known))
            raise InputError(f"unknown effect {name!r}; the simulator knows {', '.join(names)}")
        low, high = effect.support
        if not (low <= value <= high) or (np.isinf(value) and value != effect.null):
            raise InputError(f"effect {name}: expected a number from {low:g} to {high:g}, got {value:g}")
        if effect.finger_only and not finger:
            raise InputError(f"effect {name} is one of fingers, and this sensor is a pad")


def apply_effects(
    recording: SimulatedRecording, effects: Mapping[str, float], seed: int, *, before_body: bool
) -> SimulatedRecording:
    """Apply the effects that come before, or after, the strain is worked out.

    Each draws from a stream of its own, so that one does not change another.
    """
    for index, effect in enumerate(_ALL):
        if effect.name in effects and effect.before_body == before_body:
            rng = np.random.default_rng([seed, FIRST_EFFECT_STREAM + index])
            recording = effect.apply(recording, float(effects[effect.name]), rng)
    return recording
