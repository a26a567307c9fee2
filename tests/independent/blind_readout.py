"""Blind forms of the readout and of what time does. Formulas differ from those of `readout` and `catalogue_forms`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .effects import Effect
from .finger import Recording


def quarter_bridge(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A quarter bridge with constant voltage: y/(1 + v y/peak).

    The voltage of a Wheatstone bridge with one active arm is R'/(2 + R') times a constant (Doebelin, Measurement
    Systems, 2003); v is far larger here than that of a metal gauge, as for conductive rubber.
    """
    return replace(r, signal=r.signal / (1 + value * np.maximum(r.signal / r.peak, -0.5)))


def hall_curve(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """An element in the field of a magnet, whose curve has a point of inflection: y (1 + v x (1.2 - x)), x = y/peak.

    Field of a magnet on its axis against its distance, to third order; light loads read right, middle ones too much.
    """
    x = r.signal / r.peak
    return replace(r, signal=r.signal * (1 + value * x * (1.2 - x)))


def full_scale(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The converter's full scale cuts off: min(y, limit), the limit the largest signal times exp(-v), one for all."""
    return replace(r, signal=np.minimum(r.signal, np.abs(r.signal).max() * np.exp(-value)))


def leaking_stage(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A clamp diode for each element: above a level of its own, readings grow with the logarithm alone.

    y = L + s ln(1 + (y - L)/s) above L, L = the largest signal of the element times exp(-v), s = L/20. Shockley's
    diode behind a resistance (Horowitz and Hill, The Art of Electronics, 2015).
    """
    level = np.abs(r.signal).max(axis=0) * np.exp(-value)
    over = np.maximum(r.signal - level, 0)
    return replace(r, signal=np.minimum(r.signal, level) + level / 20 * np.log1p(20 * over / level))


def thermostat(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The room's heating goes on and off: zeros follow a saw tooth with rounded corners, each by a share of its own.

    Period 7 min, on for a third of it; a first-order lag of 60 s rounds it. Two-point control with dead time.
    """
    on = ((r.time / 420 + rng.uniform()) % 1 < 1 / 3).astype(float) - 1 / 3
    steps = np.diff(r.time, prepend=r.time[0])
    warm = np.zeros(len(on))
    for i in range(1, len(on)):
        warm[i] = warm[i - 1] + (on[i] - warm[i - 1]) * -np.expm1(-steps[i] / 60)
    share = value * rng.standard_normal(len(r.peak))
    return replace(r, signal=r.signal + share * r.peak * (warm / warm.std())[:, None])


def flicker(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Zeros flicker, 1/f: the sum of four processes with times of 60, 240, 960 and 3840 s, equal in variance.

    A spread of relaxation times makes 1/f noise (van der Ziel, 1950, doi:10.1016/0031-8914(50)90078-4). `value` is the
    standard deviation over the peak.
    """
    course = sum(_relaxing(r.time, each, len(r.peak), rng) for each in (60.0, 240.0, 960.0, 3840.0))
    return replace(r, signal=r.signal + value / 2 * r.peak * course)


def battery(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The supply is a battery that runs down: gains fall by value (t/T)³, faster and faster, T the whole time.

    Discharge curve of a lithium cell after its plateau.
    """
    return replace(r, signal=r.signal * (1 - value * (r.time / r.time[-1]) ** 3)[:, None])


def ageing(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Each gain ages by itself: 1 + value N_e ln(1 + t/t_e), normal N_e, times t_e between 30 and 1000 s.

    Logarithmic ageing of resistors of carbon black in rubber.
    """
    m = len(r.peak)
    begins = np.exp(rng.uniform(np.log(30), np.log(1000), m))
    course = rng.standard_normal(m) * np.log1p(r.time[:, None] / begins)
    return replace(r, signal=r.signal * (1 + value * course))


def findley(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Readings grow with a power of the time held: 1 + value t^0.35, t in seconds.

    Findley's law: Findley, Lai and Onaran, Creep and Relaxation of Nonlinear Viscoelastic Materials (1976).
    """
    return replace(r, signal=r.signal * (1 + value * held(r) ** 0.35)[:, None])


def burgers(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Burgers' body: 1 + value (1 - exp(-t/0.25 s) + t/2 s), delayed and viscous at once."""
    t = held(r)
    return replace(r, signal=r.signal * (1 + value * (-np.expm1(-t / 0.25) + t / 2))[:, None])


def algebraic_memory(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """What each touch leaves fades as 1/(1 + t/8 s), by no single time: recovery of filled rubber.

    Of the touches of the last five minutes. Ferry, Viscoelastic Properties of Polymers (1980), chapter 3.
    """
    last, end = r.signal[r.n_samples - 1 :: r.n_samples], r.time[r.n_samples - 1 :: r.n_samples]
    since = r.time[:, None] - end
    weight = np.where((since > 0) & (since < 300), 1 / (1 + np.maximum(since, 0) / 8), 0.0)
    return replace(r, signal=r.signal + value * weight @ last)


def memory_of_elements(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Each element's glue recovers with a time of its own, between 5 and 40 s, exponentially."""
    time = np.exp(rng.uniform(np.log(5), np.log(40), len(r.peak)))
    last, end = r.signal[r.n_samples - 1 :: r.n_samples], r.time[r.n_samples - 1 :: r.n_samples]
    left = np.zeros_like(last)
    for i in range(1, len(end)):
        left[i] = (left[i - 1] + last[i - 1]) * np.exp(-(end[i] - end[i - 1]) / time)
    return replace(r, signal=r.signal + value * left[r.touch] * np.exp((end[r.touch] - r.time)[:, None] / time))


def held(r: Recording) -> np.ndarray:
    """Time since the touch began, s."""
    return np.asarray(r.time - r.time[r.touch * r.n_samples])


def _relaxing(time: np.ndarray, length: float, count: int, rng: np.random.Generator) -> np.ndarray:
    """Processes of unit variance with one exponential correlation time, (n, count)."""
    kept = np.exp(-np.diff(time) / length)
    out = rng.standard_normal((len(time), count))
    for i, share in enumerate(kept, start=1):
        out[i] = share * out[i - 1] + np.sqrt(1 - share**2) * out[i]
    return out


EFFECTS = (
    Effect("gain_nonlinearity", "quarter bridge", "after", 0.2, 2.0, quarter_bridge),
    Effect("gain_nonlinearity", "inflected", "after", 0.2, 2.0, hall_curve),
    Effect("saturation", "full scale", "after", 0.2, 2.0, full_scale),
    Effect("saturation", "leaking stage", "after", 0.2, 2.0, leaking_stage),
    Effect("baseline_drift", "thermostat", "after", 0.02, 0.5, thermostat),
    Effect("baseline_drift", "flicker", "after", 0.02, 0.5, flicker),
    Effect("gain_drift", "battery", "after", 0.1, 0.8, battery),
    Effect("gain_drift", "ageing", "after", 0.03, 0.3, ageing),
    Effect("creep", "Findley", "after", 0.05, 0.5, findley),
    Effect("creep", "Burgers", "after", 0.05, 0.5, burgers),
    Effect("memory", "algebraic", "after", 0.05, 0.4, algebraic_memory),
    Effect("memory", "of elements", "after", 0.1, 0.6, memory_of_elements),
)
