"""Faulty sensors: are they found, and do the stated intervals hold with and without the check?

Simulated fingers are calibrated while sound. Then one thing breaks (an element dies, sticks, changes its gain or zero,
two wires are swapped, the force sensor is off by a factor), and tables of touches are read twice: as if nothing had
happened, and with the check that `infer` makes by default. For each fault: how often it is found and rightly named,
and the coverage of the 90 % intervals of R, θ_c and P. Tables without a fault give the rate of false alarms.

    python studies/faulty_sensors.py [fingers]
"""

from __future__ import annotations

import os
import sys

os.environ.setdefault("OMP_NUM_THREADS", "1")

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import bayestouch
from bayestouch.contact import composite_radius
from bayestouch.results import Calibration, TouchPosteriors
from bayestouch.simulation import FingerDesign, simulate
from bayestouch.touches import Touches

#: Radii from an edge to a flat; with 61 locations they make as many tables as there are radii.
RADII = tuple(float(r) for r in (0.0, *np.geomspace(0.5, 30.0, 18), np.inf))
NAMES = ("R", "theta_c", "P")
Break = Callable[[Touches, int, np.random.Generator], Touches]


@dataclass(frozen=True)
class Fault:
    """A way to break a sensor, and what the check should say of it."""

    name: str
    apply: Break
    found: Callable[[TouchPosteriors, int], bool]


def design() -> FingerDesign:
    """The paper's finger, calibrated every 2° with 5 samples a touch."""
    return FingerDesign(
        samples_per_touch=5,
        edge_step_deg=2.0,
        flat_step_deg=6.0,
        touch_radii_mm=RADII,
        touch_span_deg=60.0,
        touch_step_deg=2.0,
    )


def _elements(change: Callable[[np.ndarray, np.random.Generator], np.ndarray]) -> Break:
    def apply(touches: Touches, element: int, rng: np.random.Generator) -> Touches:
        readings = touches.readings.copy()
        readings[:, element] = change(readings[:, element], rng)
        return touches.with_(readings=readings)

    return apply


def _swap(distance: int) -> Break:
    def apply(touches: Touches, element: int, rng: np.random.Generator) -> Touches:
        readings = touches.readings.copy()
        pair = [element, element + distance]
        readings[:, pair] = readings[:, pair[::-1]]
        return touches.with_(readings=readings)

    return apply


def _force(factor: float) -> Break:
    return lambda touches, element, rng: touches.with_(load=touches.load * factor)


def _all_gains(sd: float) -> Break:
    def apply(touches: Touches, element: int, rng: np.random.Generator) -> Touches:
        return touches.with_(readings=touches.readings * np.exp(sd * rng.standard_normal(touches.n_elements)))

    return apply


def _left_out(result: TouchPosteriors, element: int) -> bool:
    """The element, and nothing else, was left out."""
    settings = result.settings
    other = "force_sensor" in settings or "element_order" in settings or "noise_widened" in settings
    return settings.get("elements_left_out") == f"e{element + 1:02d}" and not other


def _exchanged(distance: int) -> Callable[[TouchPosteriors, int], bool]:
    def found(result: TouchPosteriors, element: int) -> bool:
        order = np.arange(result.sensor.n_elements)
        order[[element, element + distance]] = order[[element + distance, element]]
        same = result.settings.get("element_order") == " ".join(f"e{column + 1:02d}" for column in order)
        return same and "elements_left_out" not in result.settings

    return found


def _no_force(result: TouchPosteriors, element: int) -> bool:
    return "force_sensor" in result.settings and "elements_left_out" not in result.settings


def _anything(result: TouchPosteriors, element: int) -> bool:
    return any(note.startswith("sensor check") for note in result.notes)


FAULTS = (
    Fault("dead (noise only)", _elements(lambda y, rng: 17.2 * rng.standard_normal(len(y))), _left_out),
    Fault("stuck at 0", _elements(lambda y, rng: np.zeros(len(y))), _left_out),
    Fault("stuck at a reading", _elements(lambda y, rng: np.full(len(y), rng.choice(y))), _left_out),
    Fault("neighbours swapped", _swap(1), _exchanged(1)),
    Fault("wires swapped", _swap(4), _exchanged(4)),
    Fault("zero moved by 5 % of peak", _elements(lambda y, rng: y + 50.0), _left_out),
    *(
        Fault(f"gain x {factor:g}", _elements(lambda y, rng, factor=factor: y * factor), _left_out)
        for factor in (0.5, 0.8, 0.9, 0.95, 0.98, 1.02, 1.05, 1.1, 1.25, 2.0)
    ),
    Fault("all gains, sd 5 %", _all_gains(0.05), _anything),
    *(Fault(f"force x {factor:g}", _force(factor), _no_force) for factor in (0.7, 0.9, 0.98, 1.02, 1.1, 1.4)),
)


def tables(touches: Touches, rng: np.random.Generator) -> list[np.ndarray]:
    """Touches shared out at random into as many tables as there are radii."""
    return [np.sort(part) for part in np.array_split(rng.permutation(np.unique(touches.touch)), len(RADII))]


def inside(result: TouchPosteriors, truth: dict[str, np.ndarray], outer: float) -> np.ndarray:
    """Share of touches whose central 90 % interval holds the truth: R, θ_c, P."""
    true = {**truth, "R": composite_radius(result.rows.radius_mm, outer)}
    out = []
    for name in NAMES:
        low, high = result.interval(name)
        # a knife edge or a flat lies on the end of R's range, which no central interval holds
        inner = (true["R"] > 0) & (true["R"] < outer) if name == "R" else np.ones(len(low), dtype=bool)
        out.append(np.mean((low <= true[name])[inner] & (true[name] <= high)[inner]))
    return np.array(out)


def read(table: Touches, calibration: Calibration, check: bool, seed: int) -> TouchPosteriors:
    """Posteriors of a table, with or without the check."""
    return bayestouch.infer(
        table, calibration, check_sensor=check, method="importance", draws=512, workers=1, seed=seed
    )


def main(fingers: int = 20) -> dict[str, dict[str, object]]:
    """Print the table; returns its rows by fault."""
    rows: dict[str, list[tuple[bool, bool, np.ndarray, np.ndarray]]] = {}
    for seed in range(fingers):
        simulated = simulate(design(), seed=seed)
        calibration = bayestouch.calibrate(simulated.dataset, draws=400, seed=seed)
        rng = np.random.default_rng([seed, 7])
        touches = simulated.dataset.touches
        outer = simulated.dataset.sensor.body.outer_radius_mm  # type: ignore[union-attr]
        ids = np.unique(touches.touch)
        true = {name: np.asarray(values) for name, values in simulated.truth["touches"].items()}
        for number, part in enumerate(tables(touches, rng)):
            table = touches.select(np.isin(touches.touch, part))
            truth = {name: values[np.searchsorted(ids, part)] for name, values in true.items()}
            sound = read(table, calibration, True, seed)
            rows.setdefault("none", []).append((_anything(sound, 0),) * 2 + (inside(sound, truth, outer),) * 2)
            for fault in FAULTS[number :: len(RADII)]:
                element = int(rng.integers(3, 9))  # under the touches, and so are its partners
                broken = fault.apply(table, element, rng)
                before, after = (read(broken, calibration, check, seed) for check in (False, True))
                result = (_anything(after, element), fault.found(after, element))
                rows.setdefault(fault.name, []).append(
                    (*result, inside(before, truth, outer), inside(after, truth, outer))
                )
    return _table(rows)


def _table(rows: dict[str, list[tuple[bool, bool, np.ndarray, np.ndarray]]]) -> dict[str, dict[str, object]]:
    print(f"{'':27s}{'':>7s}{'':>9s}{'':>9s}   coverage of 90 % intervals (%)")
    print(f"{'':27s}{'':>7s}{'':>9s}{'rightly':>9s}   without the check      with the check")
    heads = "".join(f"{name:>6s}" for name in ("R", "θ_c", "P"))
    print(f"{'fault':27s}{'tables':>7s}{'noticed':>9s}{'named':>9s}  {heads}     {heads}")
    out: dict[str, dict[str, object]] = {}
    for name in ("none", *(fault.name for fault in FAULTS)):
        if name not in rows:
            continue
        noticed, named, before, after = (np.array(column) for column in zip(*rows[name], strict=True))
        mean_before, mean_after = 100 * before.mean(axis=0), 100 * after.mean(axis=0)
        out[name] = {
            "tables": len(noticed),
            "noticed": noticed.mean(),
            "named": named.mean(),
            "before": mean_before,
            "after": mean_after,
        }
        print(
            f"{name:27s}{len(noticed):7d}{100 * noticed.mean():8.1f}%{100 * named.mean():8.1f}%   "
            f"{mean_before[0]:5.1f}{mean_before[1]:6.1f}{mean_before[2]:6.1f}    "
            f"{mean_after[0]:6.1f}{mean_after[1]:6.1f}{mean_after[2]:6.1f}"
        )
    return out


if __name__ == "__main__":
    main(*(int(argument) for argument in sys.argv[1:]))
