"""Simulated calibrations that tests of this folder read from file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import crosstalk
import numpy as np
import written_out as w
import xarray as xr

import bayestouch
from bayestouch.data.touches import Touches
from bayestouch.effects.stated import StatedModel
from bayestouch.results.reading import load_calibration


@dataclass(frozen=True, eq=False)
class Calibrated:
    """A simulated calibration and the file that it left.

    Attributes
    ----------
    pressed : Pressed
        Touches as they were made.
    table : Touches
        What was recorded of them.
    samples : int
        Samples of each touch.
    path : Path
        The file.
    """

    pressed: w.Pressed
    table: Touches
    samples: int
    path: Path

    def group(self, name: str) -> dict[str, np.ndarray]:
        """Arrays of a group of the file, as xarray reads them."""
        with xr.open_datatree(self.path) as tree:
            return {str(key): np.array(values) for key, values in tree[name].data_vars.items()}

    @property
    def draws(self) -> dict[str, np.ndarray]:
        """Draws of every parameter, all chains in a row: (n,) or (n, m)."""
        return {name: values.reshape(-1, *values.shape[2:]) for name, values in self.group("posterior").items()}

    def load(self) -> bayestouch.Calibration:
        """The calibration as a user opens it."""
        return load_calibration(self.path)


def calibrated(folder: Path, *, step: float, samples: int, draws: int, seed: int) -> Calibrated:
    """Simulate calibration touches, calibrate, save."""
    rng = np.random.default_rng(seed)
    pressed = w.calibrating(rng, step)
    table = w.recorded(w.true_finger(), pressed, rng, samples=samples)
    path = folder / "calibration.nc"
    bayestouch.calibrate(w.dataset(table, table), draws=draws, seed=3).save(path)
    return Calibrated(pressed, table, samples, path)


def calibrated_with_crosstalk(folder: Path) -> Calibrated:
    """The same for a finger with crosstalk, calibrated with that effect stated; 40 touches of two samples."""
    rng = np.random.default_rng(7)
    pressed = w.calibrating(rng, 2.6)
    table = w.recorded(w.true_finger(), pressed, rng, samples=2, after=crosstalk.leaked)
    model = StatedModel("finger", "layer", (("crosstalk", {}),))
    path = folder / "calibration.nc"
    bayestouch.calibrate(w.dataset(table, table), model=model, draws=4000, seed=3).save(path)
    return Calibrated(pressed, table, 2, path)
