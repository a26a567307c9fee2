"""Effects of fingers with values that data see well, of both signs where there are two; and fits of them."""

from __future__ import annotations

import os
import pickle
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from independent.catalogue_finger import Stated, simulate
from independent.dataset import Simulated, write
from independent.finger import SMALL, Design

import bayestouch
from bayestouch.calibration.with_effects import _with_effect
from bayestouch.data.dataset import DataSet, load_dataset
from bayestouch.effects import NoiseEffect
from bayestouch.effects.stated import StatedModel
from bayestouch.model.body import body_of
from bayestouch.model.drift_posterior import drift_posterior
from bayestouch.model.effect_list import named_effects
from bayestouch.model.noise_posterior import settled_noise
from bayestouch.model.noise_search import score_noise
from bayestouch.model.split_data import SplitData
from bayestouch.results.objects import Calibration

#: Small and quiet: 122 touches of five samples, noise of 0.4 % of the peak, loads that vary by a factor of three.
DESIGN = replace(SMALL, noise_sd=4.0, loads=(100.0, 300.0), force_sd=0.5)
#: Noise as large as that of the practice fingers, for effects of the noise.
NOISY = replace(SMALL, noise_sd=17.2)
#: Elements of unlike gain, among which a share of each one's peak is not one of the mean peak.
UNEQUAL = replace(NOISY, gain_sd=0.5)
#: Elements where they were meant to be: proximity is taken to go with the distance to an element as built.
AS_BUILT = replace(DESIGN, angle_sd=0.0)


@dataclass(frozen=True, eq=False)
class Case:
    """An effect at values, and which of them the data must see at least five of their sds from the null."""

    name: str
    values: dict[str, float]
    seen: tuple[str, ...]
    design: Design = DESIGN
    contact: str = "layer"
    start: dict[str, float] = field(default_factory=dict)

    @property
    def key(self) -> str:
        if len(self.values) > 10:
            return f"{self.name} {next(iter(self.values.values())):+g} …"
        return f"{self.name} {' '.join(f'{v:+g}' for v in self.values.values())}"

    @property
    def stated(self) -> Stated:
        return Stated(self.name, self.values)


def both(name: str, values: dict[str, float], seen: tuple[str, ...], **more: object) -> tuple[Case, Case]:
    """With the amplitudes that are `seen` as they are, and of the other sign."""
    other = {key: -value if key in seen else value for key, value in values.items()}
    return Case(name, values, seen, **more), Case(name, other, seen, **more)  # type: ignore[arg-type]


#: Weights of 21 knots from -90° to 90°. Data see those within the elements, which end at 31°.
PROFILE = {f"weight_{i:02d}": float(0.03 * (-1) ** (i // 2)) for i in range(1, 22)}
#: Of eight elements, both signs.
OFFSETS = {f"own_{e:02d}": float(0.05 * (-1) ** e + 0.004 * e) for e in range(1, 9)}

CASES = (
    *both("prober_eccentricity", {"sine": 2.0, "cosine": -1.5}, ("sine", "cosine")),
    *both("load_offset", {"offset": 15.0}, ("offset",)),
    *both("load_misalignment", {"sine": 0.08, "cosine": -0.06}, ("sine", "cosine")),
    Case("rigid_core", {"share": 1.0}, ("share",), contact="hertz"),
    Case("rigid_core", {"share": -0.4}, ("share",), contact="hertz"),
    Case("blunt_edge", {"radius": 2.0}, ("radius",)),
    *both("tangential_load", {"share": 0.2}, ("share",)),
    Case("surface_profile", PROFILE, tuple(PROFILE)[9:12]),
    Case("surface_profile", {knot: -value for knot, value in PROFILE.items()}, tuple(PROFILE)[9:12]),
    *both("soft_spot", {"share": 0.15, "width": 10.0, "tails": 0.3, "centre": 12.0}, ("share",)),
    Case("finite_strain", {"share": 0.8}, ("share",)),
    Case("finite_strain", {"share": -0.4}, ("share",)),
    Case("aperture", {"width": 3.0}, ("width",)),
    *both("crosstalk", {"share": 0.05, "reach": 0.3, "lean": 0.3}, ("share",)),
    *both("channel_lag", {"share": 0.05, "carry": 0.4}, ("share",)),
    *both("proximity", {"share": 0.06, "width": 30.0, "load_power": 0.3, "tails": 0.5}, ("share",), design=AS_BUILT),
    *both("gain_nonlinearity", {"share": 0.15, "power": 1.5}, ("share",)),
    Case("saturation", {"level": 0.85, "knee": 12.0, "shared": 0.3}, ("level",)),
    Case("rest_offset", OFFSETS, tuple(OFFSETS)),
    Case("rest_offset", {own: -value for own, value in OFFSETS.items()}, tuple(OFFSETS)),
    Case("baseline_drift", {"sd": 0.012, "time": 60.0}, ("sd",), NOISY),
    # Seventeen times the noise of a touch's mean: the course itself is seen, more than any knots would hold of it.
    Case("baseline_drift", {"sd": 0.03, "time": 60.0}, ("sd",), DESIGN),
    Case("gain_drift", {"sd": 0.03, "time": 60.0, "own": 0.0}, ("sd",), NOISY),
    Case("gain_drift", {"sd": 0.03, "time": 60.0, "own": 1.0}, ("sd",), NOISY),
    *both("creep", {"share": 0.1, "time": 0.6}, ("share",)),
    *both("memory", {"share": 0.06, "time": 6.0, "breadth": 1.0}, ("share",)),
    Case("common_mode_noise", {"sd": 0.02, "shared": 0.7}, ("sd",), UNEQUAL),
    Case("signal_dependent_noise", {"share": 0.04, "power": 1.0}, ("share",), NOISY),
    # One wrong reading of five moves their mean by a fifth of its error.
    Case("outliers", {"probability": 0.03, "size": 0.2}, ("probability", "size"), NOISY),
)


@dataclass(frozen=True, eq=False)
class Recovered:
    """What was simulated and what was fitted; sds are those of the draws, by the parameter's own name."""

    simulated: Simulated
    data: DataSet
    calibration: Calibration
    value: dict[str, float]
    sd: dict[str, float]


def settled(case: Case, seed: int) -> dict[str, tuple[float, float]]:
    """Value and sd of each parameter of a drift or an effect of the noise, as a calibration states them; no more."""
    with TemporaryDirectory() as folder:
        data = load_dataset(write(simulate(case.design, (case.stated,), seed), Path(folder)))
    begun = body_of(data.sensor).begin(SplitData.of_calibration(data), contact=case.contact, draws=1, seed=0)
    (effect,) = named_effects([case.name], begun.setting)
    if isinstance(effect, NoiseEffect):
        found = settled_noise(begun.fitted, score_noise(begun.fitted, (effect,))[0])
        values, sd = found.values, found.sd
    else:
        values, sd = drift_posterior(_with_effect(begun.fitted, effect, {})[0], 0)
    return {p.name: pair for p, pair in zip(effect.parameters, zip(values, sd, strict=True), strict=True)}


@cache
def recovered(case: Case, seed: int, folder: Path) -> Recovered:
    """`fitted`, once for all workers of a run: `folder` is one that they share."""
    path = folder / f"{CASES.index(case)} {seed}.pickle"
    if not path.exists():
        partial = path.with_suffix(f".{os.getpid()}")
        partial.write_bytes(pickle.dumps(fitted(case, seed)))
        partial.replace(path)
    return pickle.loads(path.read_bytes())  # type: ignore[no-any-return]


def fitted(case: Case, seed: int) -> Recovered:
    """Simulate the case and calibrate with exactly its effect."""
    simulated = simulate(case.design, (case.stated,), seed)
    with TemporaryDirectory() as folder:
        data = load_dataset(write(simulated, Path(folder)))
    model = StatedModel("finger", case.contact, ((case.name, case.start),))
    found = bayestouch.calibrate(data, model=model, draws=400)
    names = {name: f"{case.name}_{name}" for name in case.values}
    value = {name: float(found.mode[public]) for name, public in names.items()}
    sd = {name: float(np.std(found.posterior[public])) for name, public in names.items()}
    return Recovered(simulated, data, found, value, sd)
