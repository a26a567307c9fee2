"""Example data sets of the package: a simulated finger with an effect, and a measured pad."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib.resources import as_file, files
from pathlib import Path

from bayestouch.data.dataset import DataSet, load_dataset
from bayestouch.errors import unknown_name
from bayestouch.simulation import SimulatedDataSet, embedded_design, save_with_truth, simulate

#: Effect of the simulated finger, which its data set does not state, and seed.
HIDDEN, SEED = {"crosstalk": 0.04}, 2


@dataclass(frozen=True)
class Example:
    """An example data set.

    Attributes
    ----------
    summary : str
        What it is, in one line.
    make : callable
        Function that returns it.
    """

    summary: str
    make: Callable[[], DataSet | SimulatedDataSet]


def _finger() -> SimulatedDataSet:
    return simulate(embedded_design(), effects=HIDDEN, seed=SEED)


def _measured(name: str) -> DataSet:
    with as_file(files("bayestouch.data") / "examples" / name) as folder:
        return load_dataset(folder)


#: Examples by name.
EXAMPLES = {
    "finger": Example("a simulated finger with an effect that no file but truth.json states", _finger),
    "fluid-oil-1.5": Example(
        "a measured channel of oil with a pressure sensor at each end (SDU Soft Robotics, CC BY 4.0)",
        lambda: _measured("fluid-oil-1.5"),
    ),
}


def save_example(name: str, path: str | Path) -> DataSet:
    """Write an example data set to a folder, in the format of `bayestouch.load_dataset`.

    As `bayestouch.save_dataset`, this replaces a data set that was in the folder.

    Parameters
    ----------
    name : str
        One of `EXAMPLES`.
    path : str or Path
        Folder, created if necessary. The true values of a simulation are written to ``truth.json``, which no command
        reads. A measured data set has none: those of another data set in the folder are removed.

    Returns
    -------
    DataSet

    Raises
    ------
    InputError
        If there is no such example, or the folder cannot be written.
    """
    if name not in EXAMPLES:
        raise unknown_name("example", name, EXAMPLES)
    made = EXAMPLES[name].make()
    dataset, truth = (made.dataset, made.truth) if isinstance(made, SimulatedDataSet) else (made, None)
    save_with_truth(dataset, truth, path)
    return dataset
