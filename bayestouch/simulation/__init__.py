"""Simulated data sets with known true values, reproducible from a seed."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from bayestouch.data.dataset import DataSet, save_dataset
from bayestouch.data.sensor import Finger, Pad
from bayestouch.errors import InputError, not_a, require_whole, shown
from bayestouch.output.summary import Summarised, summary_html
from bayestouch.simulation.chain import pressed, read
from bayestouch.simulation.finger import FingerDesign
from bayestouch.simulation.pad import PadDesign
from bayestouch.simulation.plan import Design
from bayestouch.simulation.values import SHAPES, effect_values, stated_again

if TYPE_CHECKING:
    from pandas import DataFrame

__all__ = [
    "SHAPES",
    "FingerDesign",
    "PadDesign",
    "SimulatedDataSet",
    "embedded_dataset",
    "embedded_design",
    "save_simulated",
    "simulate",
]

EMBEDDED_SEED = 1995
#: File with the true values of a simulated data set.
TRUTH = "truth.json"

#: Designs by the name of the body in ``sensor.toml``.
DESIGNS: Mapping[str, type[FingerDesign] | type[PadDesign]] = {Finger.kind: FingerDesign, Pad.kind: PadDesign}


@dataclass(frozen=True, eq=False, repr=False)
class SimulatedDataSet(Summarised):
    """A simulated data set with the true values behind it.

    Attributes
    ----------
    dataset : DataSet
        Sensor and touches, marked as simulated in `sensor.source`.
    truth : mapping
        ``seed``; ``effects`` as given; ``effect_values`` (every parameter of the effects); ``design``; calibration
        parameters with the names of a calibration's posterior (``sigma``, ``mu`` in MPa; by element ``r_s`` in mm,
        ``theta_s`` in degree, ``gain`` in reading per strain, ``response`` in reading per N/m; on a pad ``x``, ``y``
        in mm, ``gain`` and ``response`` in reading per N); ``tactile_sd``, ``force_sd``; true location and load of
        each touch in ``calibration`` and ``touches``.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> simulated = bayestouch.simulate(design, seed=3)
    >>> [round(each, 1) for each in simulated.truth["r_s"]]  # true depths of the elements, mm
    [10.1, 9.6, 9.9, 9.8]
    >>> simulated.truth["touches"]["theta_c"][:3]  # true locations, degree
    [-20.0, -10.0, 0.0]
    >>> bayestouch.save_dataset(simulated.dataset, "my-finger")
    """

    dataset: DataSet
    truth: Mapping[str, Any]

    def to_dataframe(self) -> DataFrame:
        """Both touch tables of the data set, see `bayestouch.DataSet.to_dataframe`."""
        return self.dataset.to_dataframe()

    def _repr_html_(self) -> str:
        from bayestouch.checking import check

        return summary_html(self) + check(self.dataset)._repr_html_()

    def summary_lines(self) -> list[str]:
        """Lines that ``repr`` shows."""
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
    """Write the data set to a folder, with the true values in ``truth.json`` if `truth` is True.

    If it is False, the true values of another data set that was in the folder are removed. As `save_dataset`, this
    replaces a data set that was in the folder, measured or not. (The commands `simulate` and `example` replace a
    simulated one only.)

    Raises
    ------
    InputError
        As `save_dataset`, or the folder has a folder ``truth.json``; then nothing changes.
    """
    save_with_truth(simulated.dataset, simulated.truth if truth else None, path, format)


def save_with_truth(
    dataset: DataSet, truth: Mapping[str, Any] | None, path: str | Path, format: Literal["csv", "parquet"] = "csv"
) -> None:
    """Write a data set and its true values; if there are none, those of another data set in the folder are removed.

    Raises
    ------
    InputError
        As `save_simulated`.
    """
    file = Path(path) / TRUTH
    if file.is_dir():
        raise InputError("expected no folder of this name beside the tables of a data set", file=file)
    text = None if truth is None else json.dumps(_plain(truth), indent=1, allow_nan=False) + "\n"
    save_dataset(dataset, path, format)
    if text is None:
        file.unlink(missing_ok=True)
    else:
        file.write_text(text, encoding="utf-8")


def simulate(
    design: Design | None = None,
    *,
    effects: Mapping[str, float] | None = None,
    seed: int,
) -> SimulatedDataSet:
    """Simulated sensor with its touches.

    The same design and seed give the same sensor, touches and noise for any effects, so that two data sets differ only
    by the effects.

    Parameters
    ----------
    design : FingerDesign or PadDesign, optional
        Design to simulate; by default the paper's finger.
    effects : mapping of str to float, optional
        Effects to add, from the catalogue or from other packages. ``NAME`` sets the first parameter of an effect (as
        listed by `bayestouch effects NAME`), ``NAME.PARAMETER`` any of them: ``{"creep": 0.05, "creep.time": 3}``.
        State at least one amplitude of each effect: a parameter that does nothing at a value that this list names, such
        as the first. An amplitude that is not stated has that value; any other parameter has the one that
        docs/effects.md states. ``truth["effect_values"]`` has all of them.
    seed : int
        Seed of all random numbers, zero or larger.

    Returns
    -------
    SimulatedDataSet

    Raises
    ------
    InputError
        If an effect is unknown or impossible here, its value is out of bounds, or the design is impossible.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, edge_step_deg=30.0, flat_step_deg=60.0, touch_step_deg=20.0)
    >>> simulated = bayestouch.simulate(design, seed=3)
    >>> simulated.dataset.sensor.n_elements, len(simulated.truth["r_s"])
    (4, 4)
    """
    design = FingerDesign() if design is None else design
    # By its methods: a body of another package has a design of its own.
    if isinstance(design, type) or not (hasattr(design, "build") and hasattr(design, "plan")):
        raise not_a("a design", design, "make one: bayestouch.FingerDesign() or bayestouch.PadDesign()")
    if not isinstance(effects, Mapping | None):
        raise InputError(f"effects: expected sizes by name, such as {{'creep': 0.05}}, got {shown(effects)}")
    effects = {name: _size(name, value) for name, value in (effects or {}).items()}
    require_whole("seed", seed, 0)
    of_sensor, of_plan, of_noise = (np.random.default_rng([seed, stream]) for stream in range(3))
    built, plan = design.build(of_sensor), design.plan(of_plan)
    values = effect_values(effects, built.setting(plan))
    built = built.with_effects(values)
    sensor = built.sensor({"note": f"simulated by bayestouch, seed {seed}; not a measurement"})
    true, acting = pressed(plan, built, values)
    readings = read(plan, built, acting, values, seed)
    tactile_sd = design.noise_percent_peak / 100 * design.peak_reading
    readings = readings + tactile_sd * of_noise.standard_normal(readings.shape)
    load = plan.rows(plan.load) + design.force_noise_sd * of_noise.standard_normal(plan.n_rows)
    calibration, touches = plan.tables(readings, load, sensor.body.location_columns)
    truth = {
        "seed": seed,
        "effects": effects,
        "effect_values": stated_again(values),
        "design": asdict(design),
        **built.truth(),
        "tactile_sd": [tactile_sd] * sensor.n_elements,
        "force_sd": design.force_noise_sd,
        **plan.true_touches(true, built.location_names),
    }
    return SimulatedDataSet(DataSet(sensor=sensor, calibration=calibration, touches=touches), truth)


def embedded_design() -> FingerDesign:
    """Design of the small simulated finger of the package.

    It is the paper's finger, calibrated with edges every 3° and flats every 6°, then touched with six tips from edge to
    flat at 21 locations; 3 samples a touch.
    """
    return FingerDesign(
        samples_per_touch=3,
        edge_step_deg=3.0,
        flat_step_deg=6.0,
        touch_radii_mm=(0.0, 1.59, 3.9, 7.55, 12.3, np.inf),
        touch_step_deg=2.0,
    )


def embedded_dataset() -> SimulatedDataSet:
    """Simulated finger of `embedded_design`, that the package reports on if it is given no data."""
    return simulate(embedded_design(), seed=EMBEDDED_SEED)


def _size(name: str, value: float) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        raise InputError(f"effect {name}: expected a number, got {shown(value)}") from None


def _plain(value: Any) -> Any:
    """Value with lists and numbers of Python, and infinite numbers replaced by text, because JSON has no infinity."""
    if isinstance(value, Mapping):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    return str(value) if isinstance(value, float) and not np.isfinite(value) else value
