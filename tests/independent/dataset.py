"""Data sets: drawn from a seed, with effects of wanted sizes, and written as a folder."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from . import elements, errors, readout, rig, shape, unlisted
from .effects import Effect, forms_of
from .finger import Design, Recording, build, record
from .sizes import applied, size, value_of_size

LISTED = rig.EFFECTS + elements.EFFECTS + readout.EFFECTS + errors.EFFECTS
UNLISTED = unlisted.EFFECTS
#: Not among the causes of `studies/error_rates.py`, which was run before there were any.
SHAPES = shape.EFFECTS
EFFECTS = {effect.key: effect for effect in LISTED + UNLISTED + SHAPES}


@dataclass(frozen=True, eq=False)
class Simulated:
    """What was drawn: the recording without plain noise, readings and loads with it, and what is true."""

    design: Design
    recording: Recording
    readings: np.ndarray
    loads: np.ndarray
    truth: dict[str, object]


def forms(name: str) -> list[Effect]:
    """Every form of the effect called `name`."""
    return forms_of(EFFECTS, name)


def simulate(design: Design, wanted: list[tuple[Effect, float]], seed: int, noise: tuple[int, ...] = ()) -> Simulated:
    """A finger and its touches under effects of the `wanted` sizes.

    The same `seed` gives the same finger, touches and courses of effects, with `noise` besides the same noise, too.
    """
    of_finger, of_plan = (np.random.default_rng([seed, stream]) for stream in range(2))
    of_noise = np.random.default_rng([seed, 2, *noise])
    plain = record(design, build(design, of_finger), of_plan)
    values = [(effect, value_of_size(plain, effect, each, seed, i)) for i, (effect, each) in enumerate(wanted)]
    recording = applied(plain, values, seed)
    readings = recording.signal + recording.error + design.noise_sd * of_noise.standard_normal(recording.signal.shape)
    loads = recording.read_load + design.force_sd * of_noise.standard_normal(len(recording.time))
    truth = {
        "seed": seed,
        "effects": {effect.key: value for effect, value in values},
        "sizes": {effect.key: each for effect, each in wanted},
        "size": size(recording),
        "theta_deg": recording.finger.angle.tolist(),
        "rs_mm": recording.finger.depth.tolist(),
        "gain": recording.finger.gain.tolist(),
        "poisson_ratio": design.body.poisson,
        "shear_modulus_MPa": design.modulus,
    }
    return Simulated(design, recording, readings, loads, truth)


def write(simulated: Simulated, folder: Path) -> Path:
    """Write ``sensor.toml``, ``calibration.csv``, ``touches.csv`` and ``exam.csv``; returns the folder.

    What is true is in ``truth.json``. Touches of the exam are for scoring: no data set has that table.
    """
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "sensor.toml").write_text(_sensor(simulated.design, folder.name), encoding="utf-8")
    (folder / "truth.json").write_text(json.dumps(simulated.truth, indent=1) + "\n", encoding="utf-8")
    recording = simulated.recording
    ends = np.cumsum((0, *recording.parts))
    elements_ = ",".join(f"e{i + 1:02d}" for i in range(simulated.design.n_elements))
    header = "touch,sample,time_s,indenter_radius_mm,angle_deg,load_N_per_m," + elements_
    for name, start, end in zip(("calibration", "touches", "exam"), ends[:-1], ends[1:], strict=True):
        rows = np.flatnonzero((recording.touch >= start) & (recording.touch < end))
        touch = recording.touch[rows]
        table = np.column_stack(
            [
                touch - start,
                recording.sample[rows],
                recording.time[rows],
                recording.tip[touch],
                recording.commanded[touch],
                simulated.loads[rows],
                simulated.readings[rows],
            ]
        )
        formats = ["%d", "%d", "%.2f", "%g", "%g", "%.3f"] + ["%.2f"] * simulated.design.n_elements
        np.savetxt(folder / f"{name}.csv", table, fmt=formats, delimiter=",", header=header, comments="")
    return folder


def _sensor(design: Design, name: str) -> str:
    angles = ", ".join(f"{angle:.2f}" for angle in design.angles)
    return f"""name = "{name}"

[geometry]
core_radius_mm = {design.body.core}
outer_radius_mm = {design.body.outer}
sensing_radius_mm = {design.depth}
element_angles_deg = [{angles}]

[rubber]
shear_modulus_MPa = {design.modulus}
poisson_ratio = 0.46

[force_sensor]
noise_sd_N_per_m = {design.force_sd}

[readings]
unit = "counts"

[source]
note = "simulated for tests; not a measurement"
"""
