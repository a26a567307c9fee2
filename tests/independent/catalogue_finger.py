"""Fingers under effects of the catalogue's own form, at stated values: which formula acts where."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from . import catalogue_forms as forms
from .dataset import Simulated
from .finger import REFERENCE_LOAD, Design, Finger, Press, Recording, build, record

Values = Mapping[str, float]
Apply = Callable[[Recording, Values, np.random.Generator], Recording]

TABLE = Path(__file__).parents[2] / "bayestouch" / "body" / "data" / "finite_strain.npz"


def reference_load(r: Recording) -> float:
    """Mean load of the calibration touches, N/m: what peaks go with."""
    return float(r.read_load[r.touch < r.parts[0]].mean())


def peak(r: Recording) -> np.ndarray:
    """Readings of the elements right under a knife edge at the reference load, (m,)."""
    return np.asarray(r.peak * reference_load(r) / REFERENCE_LOAD)


def pressed_otherwise(r: Recording, **changes: object) -> Recording:
    """The recording with other touches or elements."""
    return replace(r, press=replace(r.press, **changes))


def turn(r: Recording) -> np.ndarray:
    """Angle from the probe to each element, -180 to 180 degrees, (n, m)."""
    return np.asarray((r.finger.angle - r.press.angle[r.touch][:, None] + 180) % 360 - 180)


def held(r: Recording) -> np.ndarray:
    """Time since the touch began, s."""
    return np.asarray(r.time - r.time[r.touch * r.n_samples])


def pause(r: Recording) -> float:
    """Time from the last sample of a touch to the first of the next, s."""
    first, last = r.time[:: r.n_samples], r.time[r.n_samples - 1 :: r.n_samples]
    return float(np.median(first[1:] - last[:-1]))


@lru_cache(maxsize=1)
def _table() -> dict[str, np.ndarray]:
    with np.load(TABLE) as content:
        return dict(content)


def finite_strain(finger: Finger, press: Press, share: float) -> np.ndarray:
    """Counts (t, m) that a neo-Hookean annulus adds, by splines through the shipped finite-element table.

    share × P × (reading per N/m of a knife edge) × Σ_j a_j(P/μ, R) D_j(r_s, φ), D_j(φ) = c_0 + 2 Σ_k c_k cos kφ.
    """
    table, outer = _table(), finger.body.outer
    composite = np.where(press.tip == 0, table["radius_mm"][0], 1 / (1 / outer + 1 / np.maximum(press.tip, 1e-9)))
    composite = np.maximum(composite, table["radius_mm"][0])
    by_load = CubicSpline(table["load_over_modulus_mm"], table["projected_amplitudes"])(
        press.load / 1000 / finger.modulus
    )
    amplitude = np.array([CubicSpline(table["radius_mm"], a)(r) for a, r in zip(by_load, composite, strict=True)])
    shapes = CubicSpline(table["sensing_radius_mm"], table["projected_shapes"], axis=1)(finger.depth)
    k = np.arange(shapes.shape[-1])
    angle = np.radians(finger.angle - press.angle[:, None])
    waves = np.where(k == 0, 1.0, 2.0) * np.cos(angle[..., None] * k)
    added = np.einsum("tmk,jmk,tj->tm", waves, shapes, amplitude)
    return np.asarray(share * finger.peak / REFERENCE_LOAD * press.load[:, None] * added)


def _on_signal(form: Callable[[Recording, Values], np.ndarray]) -> Apply:
    return lambda r, v, rng: replace(r, signal=form(r, v))


def _on_error(form: Callable[[Recording, Values, np.random.Generator], np.ndarray]) -> Apply:
    return lambda r, v, rng: replace(r, error=r.error + form(r, v, rng))


def _gain_drift(r: Recording, v: Values, rng: np.random.Generator) -> Recording:
    course = forms.wander(r.time, len(r.peak) if v["own"] else 1, v["time"], rng)
    return replace(r, signal=forms.gain_drift(r.signal, v["sd"], course))


def _baseline_drift(r: Recording, v: Values, rng: np.random.Generator) -> Recording:
    course = forms.wander(r.time, len(r.peak), v["time"], rng)
    return replace(r, signal=forms.baseline_drift(r.signal, peak(r), v["sd"], course))


BEFORE: dict[str, Apply] = {
    "prober_eccentricity": lambda r, v, rng: pressed_otherwise(
        r, angle=forms.prober_eccentricity(r.commanded, v["sine"], v["cosine"], r.finger.angle)
    ),
    "load_offset": lambda r, v, rng: replace(r, read_load=forms.load_offset(r.read_load, v["offset"])),
    "load_misalignment": lambda r, v, rng: replace(
        r,
        read_load=forms.load_misalignment_finger(
            r.read_load, r.commanded[r.touch], v["sine"], v["cosine"], r.finger.angle
        ),
    ),
    "rigid_core": lambda r, v, rng: pressed_otherwise(r, half_space=1 - v["share"]),
    "blunt_edge": lambda r, v, rng: pressed_otherwise(r, tip=np.where(r.tip == 0, v["radius"], r.tip)),
    "tangential_load": lambda r, v, rng: pressed_otherwise(r, tangential=np.full(len(r.tip), v["share"])),
    "surface_profile": lambda r, v, rng: pressed_otherwise(r, hump=forms.surface_profile(r.commanded, v)),
    "aperture": lambda r, v, rng: pressed_otherwise(r, width=v["width"]),
}
AFTER: dict[str, Apply] = {
    "soft_spot": _on_signal(
        lambda r, v: forms.soft_spot(
            r.signal, r.commanded[r.touch][:, None], v["share"], v["width"], v["tails"], np.array([v["centre"]])
        )
    ),
    "finite_strain": _on_signal(lambda r, v: r.signal + finite_strain(r.finger, r.press, v["share"])[r.touch]),
    "crosstalk": _on_signal(
        lambda r, v: forms.crosstalk_finger(r.signal, r.finger.angle, v["share"], v["reach"], v["lean"])
    ),
    "channel_lag": _on_signal(lambda r, v: forms.channel_lag(r.signal, v["share"], v["carry"])),
    "proximity": _on_signal(
        lambda r, v: (
            r.signal
            + forms.proximity(
                turn(r),
                peak(r),
                r.press.load[r.touch],
                reference_load(r),
                (v["share"], v["width"], v["load_power"], v["tails"]),
            )
        )
    ),
    "gain_nonlinearity": _on_signal(lambda r, v: forms.gain_nonlinearity(r.signal, peak(r), v["share"], v["power"])),
    "saturation": _on_signal(lambda r, v: forms.saturation(r.signal, peak(r), v["level"], v["knee"], v["shared"])),
    "rest_offset": _on_signal(lambda r, v: forms.rest_offset(r.signal, peak(r), np.array(list(v.values())))),
    "baseline_drift": _baseline_drift,
    "gain_drift": _gain_drift,
    "creep": _on_signal(lambda r, v: forms.creep(r.signal, held(r), v["share"], v["time"])),
    "memory": _on_signal(
        lambda r, v: forms.memory(r.signal, r.touch, r.time, pause(r), (v["share"], v["time"], v["breadth"]))
    ),
    "common_mode_noise": _on_error(
        lambda r, v, rng: forms.common_mode_noise(peak(r), len(r.time), v["sd"], v["shared"], rng)
    ),
    "signal_dependent_noise": _on_error(
        lambda r, v, rng: forms.signal_dependent_noise(r.signal, peak(r), v["share"], v["power"], rng)
    ),
    "outliers": _on_error(lambda r, v, rng: forms.outliers(r.signal, peak(r), v["probability"], v["size"], rng)),
}
NAMES = (*BEFORE, *AFTER)


@dataclass(frozen=True)
class Stated:
    """An effect of the catalogue with the values of its parameters, by name."""

    name: str
    values: Values


def recorded(plain: Recording, effects: tuple[Stated, ...], rng: np.random.Generator) -> Recording:
    """The recording under the effects, in the order of the chain."""
    out = plain
    for each in effects:
        if each.name in BEFORE:
            out = BEFORE[each.name](out, each.values, rng)
    out = out.pressed()
    for name in AFTER:
        for each in effects:
            if each.name == name:
                out = AFTER[name](out, each.values, rng)
    return out


def simulate(design: Design, effects: tuple[Stated, ...], seed: int) -> Simulated:
    """A finger, its touches under effects with stated values, and noise, all of them drawn from `seed`."""
    of_finger, of_plan, of_noise, of_effects = (np.random.default_rng([seed, 50 + stream]) for stream in range(4))
    recording = recorded(record(design, build(design, of_finger), of_plan), effects, of_effects)
    noise = design.noise_sd * of_noise.standard_normal(recording.signal.shape)
    loads = recording.read_load + design.force_sd * of_noise.standard_normal(len(recording.time))
    truth: dict[str, object] = {each.name: dict(each.values) for each in effects}
    return Simulated(design, recording, recording.signal + recording.error + noise, loads, truth)
