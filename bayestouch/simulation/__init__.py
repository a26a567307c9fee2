"""Simulated data sets: every stage of the chain with known truth, from a seed."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from bayestouch.data.dataset import DataSet, save_dataset
from bayestouch.errors import InputError
from bayestouch.output.summary import Summarised, summary_html
from bayestouch.simulation import finger, pad
from bayestouch.simulation.catalogue import as_read, really_pressed, stated_effects
from bayestouch.simulation.designs import FingerDesign, PadDesign
from bayestouch.simulation.effects import SIMULATED_EFFECTS, SimulatedEffect, apply_effects, check_effects
from bayestouch.simulation.finger import BuiltFinger
from bayestouch.simulation.pad import BuiltPad
from bayestouch.simulation.recording import Built

if TYPE_CHECKING:
    from pandas import DataFrame

__all__ = [
    "SIMULATED_EFFECTS",
    "FingerDesign",
    "PadDesign",
    "SimulatedDataSet",
    "SimulatedEffect",
    "embedded_dataset",
    "save_simulated",
    "simulate",
]

EMBEDDED_SEED = 1995


@dataclass(frozen=True, eq=False, repr=False)
class SimulatedDataSet(Summarised):
    """A simulated data set and what is true of it.

    Attributes
    ----------
    dataset : DataSet
        Sensor and touches, marked as simulated in `sensor.source`.
    truth : mapping
        ``seed``, ``effects``, ``design``; calibration parameters under the names of a calibration's posterior
        (``sigma``, ``mu`` in MPa; by element ``r_s`` in mm, ``theta_s`` in degree, ``gain`` in reading per
        strain, ``response`` in reading per N/m; on a pad ``x``, ``y``, ``gain``, ``response``);
        ``tactile_sd``, ``force_sd``; true location and load of each touch by ``calibration`` and ``touches``.
    """

    dataset: DataSet
    truth: Mapping[str, Any]

    def to_dataframe(self) -> DataFrame:
        """Both tables of the data set, see `bayestouch.DataSet.to_dataframe`."""
        return self.dataset.to_dataframe()

    def _repr_html_(self) -> str:
        from bayestouch.checking import check

        return summary_html(self) + check(self.dataset)._repr_html_()

    def summary_lines(self) -> list[str]:
        """Lines of the ``repr``."""
        effects = ", ".join(f"{name} {size:g}" for name, size in self.truth["effects"].items()) or "none"
        first = f"SimulatedDataSet of {self.dataset.sensor.in_short}"
        return [first, *self.dataset.tables_in_short(), f"seed {self.truth['seed']}; effects: {effects}"]


def save_simulated(
    simulated: SimulatedDataSet,
    path: str | Path,
    format: Literal["csv", "parquet"] = "csv",
    *,
    truth: bool = True,
) -> None:
    """Write the data set to a folder, and the truth beside it as ``truth.json`` unless told not to."""
    save_dataset(simulated.dataset, path, format)
    if truth:
        text = json.dumps(_finite(simulated.truth), indent=1, allow_nan=False)
        (Path(path) / "truth.json").write_text(text + "\n", encoding="utf-8")


def simulate(
    design: FingerDesign | PadDesign | None = None,
    *,
    effects: Mapping[str, float] | None = None,
    seed: int,
) -> SimulatedDataSet:
    """Simulate a sensor and its touches.

    The same design and seed give the same sensor, touches and noise whatever the effects, so that two data
    sets differ by the effect alone.

    Parameters
    ----------
    design : FingerDesign or PadDesign, optional
        What to simulate; the paper's finger by default.
    effects : mapping of str to float, optional
        Effects to add, by name. `SIMULATED_EFFECTS` says what each value means; of any other effect of the catalogue,
        one of another package too, it is the value of the first parameter.
    seed : int
        Seed of everything random, zero or larger.

    Returns
    -------
    SimulatedDataSet

    Raises
    ------
    InputError
        If an effect is unknown or does not fit, or the design is impossible.
    """
    design = FingerDesign() if design is None else design
    effects = {} if effects is None else dict(effects)
    if seed < 0 or seed != int(seed):
        raise InputError(f"seed: expected a whole number, zero or larger, got {seed}")
    check_effects(effects, finger=isinstance(design, FingerDesign))
    of_sensor, of_plan, of_noise = (np.random.default_rng([seed, stream]) for stream in range(3))
    built: Built
    if isinstance(design, FingerDesign):
        built, plan = BuiltFinger.of(design, of_sensor), finger.plan_touches(design, of_plan)
    else:
        built, plan = BuiltPad.of(design, of_sensor), pad.plan_touches(design, of_plan)
    sensor = built.sensor({"note": f"simulated by bayestouch, seed {seed}; not a measurement"})
    others = {name: value for name, value in effects.items() if name not in SIMULATED_EFFECTS}
    stated = stated_effects(others, plan, sensor, built.reference_load)
    recording = really_pressed(plan.start(built), stated, built.reference_load)
    recording = apply_effects(recording, effects, seed, before_body=True)
    recording = as_read(built.press(recording), stated, built.reference_load)
    recording = apply_effects(recording, effects, seed, before_body=False)
    tactile_sd = design.noise_percent_peak / 100 * design.peak_reading
    recording = replace(
        recording,
        signal=recording.signal + tactile_sd * of_noise.standard_normal(recording.signal.shape),
        load_reading=recording.load_reading + design.force_noise_sd * of_noise.standard_normal(plan.n_rows),
    )
    calibration, touches = plan.tables(recording, sensor.body.location_columns)
    truth = {
        "seed": seed,
        "effects": effects,
        "design": asdict(design),
        **built.truth(),
        "tactile_sd": [tactile_sd] * sensor.n_elements,
        "force_sd": design.force_noise_sd,
        **plan.true_touches(recording, ("theta_c",) if isinstance(design, FingerDesign) else ("x", "y")),
    }
    return SimulatedDataSet(DataSet(sensor=sensor, calibration=calibration, touches=touches), truth)


def embedded_dataset(seed: int = EMBEDDED_SEED) -> SimulatedDataSet:
    """The small simulated finger that the package reports on when it is given no data.

    The paper's finger, calibrated with edges every 3° and flats every 6°, then touched with six tips from
    edge to flat at 21 locations; 3 samples a touch.
    """
    design = FingerDesign(
        samples_per_touch=3,
        edge_step_deg=3.0,
        flat_step_deg=6.0,
        touch_radii_mm=(0.0, 1.59, 3.9, 7.55, 12.3, np.inf),
        touch_step_deg=2.0,
    )
    return simulate(design, seed=seed)


def _finite(value: Any) -> Any:
    """Infinity as text, which JSON has no number for."""
    if isinstance(value, Mapping):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(each) for each in value]
    return str(value) if isinstance(value, float) and not np.isfinite(value) else value
