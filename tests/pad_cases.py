"""Effects of pads with values that data see well, of both signs where there are two; and fits of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from independent import pad

from bayestouch.calibration.with_effects import _with_effect
from bayestouch.data.dataset import DataSet, load_dataset
from bayestouch.effects import Setting
from bayestouch.model.added import AddedEffect, added_effects
from bayestouch.model.drift_posterior import settled_drifts
from bayestouch.model.effect_list import named_effects
from bayestouch.model.fitting import Fitted
from bayestouch.model.split_data import SplitData
from bayestouch.model.timing import Timing
from bayestouch.pad.calibration_with_effects import pad_calibration
from bayestouch.pad.start import pad_fit
from bayestouch.results.objects import Calibration


@dataclass(frozen=True, eq=False)
class Case:
    """An effect at values, and which of them the data must see at least five of their sds from the null."""

    name: str
    values: dict[str, float]
    seen: tuple[str, ...]
    kernel: str = "gaussian"

    @property
    def key(self) -> str:
        return f"{self.name} {' '.join(f'{v:+g}' for v in self.values.values())}"


def both(name: str, values: dict[str, float], seen: tuple[str, ...], kernel: str = "gaussian") -> tuple[Case, Case]:
    """With the amplitudes that are `seen` as they are, and of the other sign."""
    other = {key: -value if key in seen else value for key, value in values.items()}
    return Case(name, values, seen, kernel), Case(name, other, seen, kernel)


SHARES = {f"share_e{e + 1:02d}": share for e, share in enumerate((0.1, -0.1, 0.15, 0.05, -0.05, 0.08))}
SPOT = {"share": 0.3, "width": 3.0, "tails": 0.3, "centre": 6.0, "centre_y": 2.0}
CASES = (
    *both("load_offset", {"offset": 0.1}, ("offset",)),
    # A Gaussian times a straight line is a Gaussian elsewhere: under that kernel positions take the slope up.
    *both("load_misalignment", {"x": 0.1, "y": -0.08}, ("x", "y"), "half-space"),
    Case("load_nonlinearity", {"share": 0.4, "threshold": 0.05}, ("share", "threshold")),
    Case("load_nonlinearity", {"share": -0.12, "threshold": -0.05}, ("share", "threshold")),
    *both("soft_spot", SPOT, ("share",)),
    *both("crosstalk", {"share": 0.05}, ("share",)),
    *both("channel_lag", {"share": 0.05, "carry": 0.4}, ("share",)),
    *both("gain_nonlinearity", {"share": 0.06, "power": 1.5}, ("share",)),
    Case("saturation", {"level": 0.9, "knee": 12.0, "shared": 0.3}, ("level",)),
    Case("baseline_drift", {"sd": 0.005, "time": 80.0}, ("sd",)),
    Case("gain_drift", {"sd": 0.01, "time": 80.0, "own": 0.0}, ("sd",)),
    Case("gain_drift", {"sd": 0.01, "time": 80.0, "own": 1.0}, ("sd",)),
    *both("creep", {"share": 0.1, "time": 0.6}, ("share",)),
    Case("creep_by_element", {**SHARES, "time": 0.6}, tuple(SHARES)),
    *both("memory", {"share": 0.05, "time": 6.0, "breadth": 1.0}, ("share",)),
    Case("common_mode_noise", {"sd": 0.008, "shared": 0.5}, ("sd",)),
    Case("signal_dependent_noise", {"share": 0.03, "power": 1.0}, ("share",)),
    Case("outliers", {"probability": 0.03, "size": 0.1}, ("probability", "size")),
)


@dataclass(frozen=True, eq=False)
class Recovered:
    """What was simulated and fitted."""

    unknown: pad.Touched
    data: DataSet
    parted: SplitData
    setting: Setting
    fitted: Fitted
    added: AddedEffect
    kernel: str

    @property
    def found(self) -> dict[str, tuple[float, float]]:
        """Value and sd of each parameter."""
        effect = self.added.effect
        pairs = zip(self.added.values, self.added.sd, strict=True)
        return {p.name: pair for p, pair in zip(effect.parameters, pairs, strict=True)}

    def calibration(self) -> Calibration:
        """As a diagnosis makes it of its fit."""
        parted = self.parted
        return pad_calibration(
            self.fitted,
            (self.added,),
            dataset=parted.dataset,
            table=parted.table,
            clock=Timing(parted.time_s, parted.held_s, parted.unit),
            training=parted.training,
            rest=parted.rest,
            setting=self.setting,
            kernel=self.kernel,
            draws=200,
            seed=0,
            notes=(),
        )


@cache
def recovered(case: Case, seed: int) -> Recovered:
    """Simulate the case and fit its effect beside the kernel that was simulated."""
    half_space = case.kernel == "half-space"
    known = pad.touched(case.name, case.values, seed, half_space=half_space)
    unknown = pad.touched(case.name, case.values, seed + 1000, 60, half_space=half_space)
    with TemporaryDirectory() as folder:
        data = load_dataset(pad.write(known, unknown, Path(folder)))
    parted = SplitData.of_calibration(data)
    observed, table = parted.observations(parted.training), parted.table.select(parted.training)
    base, _ = pad_fit(observed, table, parted.dataset, kernel=case.kernel, empirical=False)
    setting = parted.setting("", base.model.reference_load)
    (effect,) = named_effects([case.name], setting)
    fitted, noise = _with_effect(base, effect, {})
    fitted, spreads = settled_drifts(fitted)
    (added,) = added_effects(fitted, noise, spreads)
    sd = tuple(np.nan_to_num(added.sd))
    return Recovered(unknown, data, parted, setting, fitted, AddedEffect(added.effect, added.values, sd), case.kernel)
