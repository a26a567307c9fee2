"""A small pad under a Gaussian kernel, touched all over, with effects of the catalogue's own form at stated values.

signal_e = P gain_e exp(-ρ²/2w²), ρ the distance (mm) from the touch to element e; reading = offset_e + what the effects
make of the signal + noise. Loads in N, readings in kPa. Nothing of the package is used.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from . import catalogue_forms as forms

Values = Mapping[str, float]
PITCH = 6.0
NOMINAL = np.stack(np.meshgrid([0.0, PITCH, 2 * PITCH], [0.0, PITCH], indexing="ij"), axis=-1).reshape(-1, 2)
WIDTH, DEPTH = 4.0, 6.0
GAIN = np.array([10.0, 12.0, 14.0, 9.0, 11.0, 13.0])
OFFSET = np.array([0.2, -0.1, 0.0, 0.1, 0.3, -0.2])
ASIDE = np.array([[0.2, 0.1], [-0.3, 0.2], [0.1, -0.2], [0.0, 0.3], [0.2, -0.1], [-0.1, 0.0]])
SAMPLES, NOISE, FORCE_NOISE = 4, 0.05, 0.005
HELD = np.array([0.0, 0.3, 0.7, 1.2])
PAUSE = 4.0


@dataclass(frozen=True, eq=False)
class Touched:
    """A table of touches: n rows; true place (mm) and load (N), load as read, and readings (kPa)."""

    touch: np.ndarray
    time: np.ndarray
    place: np.ndarray
    load: np.ndarray
    read_load: np.ndarray
    readings: np.ndarray


@dataclass(frozen=True, eq=False)
class Stage:
    """What effects may use: rows with touch, time (s), held (s), place (mm) and load (N); peaks (kPa)."""

    touch: np.ndarray
    time: np.ndarray
    held: np.ndarray
    place: np.ndarray
    load: np.ndarray
    reference: float
    peak: np.ndarray


ACTING: dict[str, Callable[[Stage, Values], np.ndarray]] = {
    "load_nonlinearity": lambda s, v: forms.load_nonlinearity(s.load, s.reference, v["share"], v["threshold"]),
}
READ: dict[str, Callable[[Stage, Values], np.ndarray]] = {
    "load_offset": lambda s, v: forms.load_offset(s.load, v["offset"]),
    "load_misalignment": lambda s, v: forms.load_misalignment_pad(s.load, s.place, np.array([v["x"], v["y"]])),
}
Signal = Callable[[Stage, np.ndarray, Values, np.random.Generator], np.ndarray]
SIGNALS: dict[str, Signal] = {
    "soft_spot": lambda s, y, v, rng: forms.soft_spot(
        y, s.place, v["share"], v["width"], v["tails"], np.array([v["centre"], v["centre_y"]])
    ),
    "crosstalk": lambda s, y, v, rng: forms.crosstalk_pad(y, NOMINAL, PITCH, v["share"]),
    "channel_lag": lambda s, y, v, rng: forms.channel_lag(y, v["share"], v["carry"]),
    "gain_nonlinearity": lambda s, y, v, rng: forms.gain_nonlinearity(y, s.peak, v["share"], v["power"]),
    "saturation": lambda s, y, v, rng: forms.saturation(y, s.peak, v["level"], v["knee"], v["shared"]),
    "baseline_drift": lambda s, y, v, rng: forms.baseline_drift(
        y, s.peak, v["sd"], forms.wander(s.time, y.shape[1], v["time"], rng)
    ),
    "gain_drift": lambda s, y, v, rng: forms.gain_drift(
        y, v["sd"], forms.wander(s.time, y.shape[1] if v["own"] else 1, v["time"], rng)
    ),
    "creep": lambda s, y, v, rng: forms.creep(y, s.held, v["share"], v["time"]),
    "creep_by_element": lambda s, y, v, rng: forms.creep(
        y, s.held, np.array([v[f"share_e{e + 1:02d}"] for e in range(y.shape[1])]), v["time"]
    ),
    "memory": lambda s, y, v, rng: forms.memory(y, s.touch, s.time, PAUSE, (v["share"], v["time"], v["breadth"])),
    "common_mode_noise": lambda s, y, v, rng: y + forms.common_mode_noise(s.peak, len(y), v["sd"], v["shared"], rng),
    "signal_dependent_noise": lambda s, y, v, rng: (
        y + forms.signal_dependent_noise(y, s.peak, v["share"], v["power"], rng)
    ),
    "outliers": lambda s, y, v, rng: y + forms.outliers(y, s.peak, v["probability"], v["size"], rng),
}
NAMES = (*READ, *ACTING, *SIGNALS)


def kernel(place: np.ndarray, half_space: bool) -> np.ndarray:
    """Response of each element over that right above it, (n, m): Gaussian, or Boussinesq's under a point load.

    exp(-ρ²/2w²), or (1 + ρ²/z²)^(-5/2): the normal stress at the depth z in a half-space.
    """
    away = np.linalg.norm(place[:, None] - (NOMINAL + ASIDE), axis=2)
    if half_space:
        return np.asarray((1 + (away / DEPTH) ** 2) ** -2.5)
    return np.asarray(np.exp(-0.5 * (away / WIDTH) ** 2))


def touched(name: str, values: Values, seed: int, touches: int = 160, *, half_space: bool = False) -> Touched:
    """Touches at random places from 2 mm outside the elements, under one effect (none where `name` is empty)."""
    rng = np.random.default_rng([seed, 7])
    low, high = NOMINAL.min(axis=0) - 2, NOMINAL.max(axis=0) + 2
    # The corners are touched, and each element from right above: so much is known of the range and of the peaks.
    above = NOMINAL + ASIDE
    places = rng.permutation(np.vstack([rng.uniform(low, high, (touches - 2 - len(above), 2)), above, [low, high]]))
    loads = rng.uniform(0.4, 1.6, touches)
    touch = np.repeat(np.arange(touches), SAMPLES)
    held = np.tile(HELD, touches)
    time = touch * (HELD[-1] + PAUSE) + held
    stage = Stage(touch, time, held, places[touch], loads[touch], np.nan, np.full(len(GAIN), np.nan))
    read = READ[name](stage, values) if name in READ else stage.load
    read = read + FORCE_NOISE * np.random.default_rng([seed, 8]).standard_normal(len(read))
    # Peaks go with the median load of the touches as it was read.
    reference = float(np.median(read.reshape(touches, SAMPLES).mean(axis=1)))
    stage = replace(stage, reference=reference, peak=GAIN * reference)
    acting = ACTING[name](stage, values) if name in ACTING else stage.load
    signal = acting[:, None] * GAIN * kernel(stage.place, half_space)
    if name in SIGNALS:
        signal = SIGNALS[name](stage, signal, values, rng)
    readings = OFFSET + signal + NOISE * rng.standard_normal(signal.shape)
    return Touched(touch, time, stage.place, stage.load, read, readings)


def write(known: Touched, unknown: Touched, folder: Path) -> Path:
    """Write ``sensor.toml``, ``calibration.csv`` and ``touches.csv``; returns the folder."""
    x, y = (", ".join(f"{value:g}" for value in axis) for axis in NOMINAL.T)
    (folder / "sensor.toml").write_text(
        f"""name = "simulated pad"
body = "pad"

[geometry]
element_x_mm = [{x}]
element_y_mm = [{y}]

[force_sensor]
noise_sd_N = {FORCE_NOISE}

[readings]
unit = "kPa"

[source]
note = "simulated for tests; not a measurement"
""",
        encoding="utf-8",
    )
    header = "touch,sample,time_s,x_mm,y_mm,load_N," + ",".join(f"e{e + 1:02d}" for e in range(len(GAIN)))
    for name, table in (("calibration", known), ("touches", unknown)):
        sample = np.tile(np.arange(SAMPLES), len(table.touch) // SAMPLES)
        rows = np.column_stack([table.touch, sample, table.time, table.place, table.read_load, table.readings])
        formats = ["%d", "%d", "%.2f"] + ["%.6f"] * (rows.shape[1] - 3)
        np.savetxt(folder / f"{name}.csv", rows, fmt=formats, delimiter=",", header=header, comments="")
    return folder
