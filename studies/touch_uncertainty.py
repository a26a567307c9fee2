"""What effects and corrections that are themselves uncertain do to a touch: to first order, and by brute force.

Fingers and a pad are simulated without the package, calibrated from few touches with the effects that they have, and
read. First, a few touches are read with many calibrations drawn from the posterior, each taken as exact, and these
posteriors are mixed: the standard deviations that `infer` gives, which propagates to first order, must be the same.
Then hundreds of touches are read, and their errors compared with what they say of themselves.

    python studies/touch_uncertainty.py [--calibrations 120] [--fingers 10] [--docs]
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from _nested import Array, Read, at_row, drawn, matched, mixed, read
from _page import STATISTICS, markdown_table, put_into_page

sys.path.append(str(Path(__file__).parents[1] / "tests"))

from independent import catalogue_finger as catalogue
from independent import pad as pads
from independent.dataset import Simulated, forms, simulate, write
from independent.finger import SMALL

import bayestouch
from bayestouch.data.dataset import DataSet
from bayestouch.data.touches import Touches, touches_from
from bayestouch.effects.stated import StatedModel
from bayestouch.finger.correction_table import MEAN, N_TERMS, PREFIX, correction_coefficients, pressure_nodes
from bayestouch.model.body import body_of
from bayestouch.model.correction import corrected_fit
from bayestouch.model.split_data import SplitData
from bayestouch.pad.beginning import PadEvaluation
from bayestouch.pad.corrected import PadEffects
from bayestouch.results.keys import EFFECT_ROOT
from bayestouch.results.objects import Calibration

FINGER, PAD = ("R", "theta_c", "P"), ("x", "y", "P")
# Edges and flats every 6° and 18° from -90° to 90°: 42 touches of 8 elements.
FEW = replace(SMALL, edge_step=6.0, flat_step=18.0)
FINGER_EFFECTS = {
    "crosstalk": {"share": 0.03, "reach": 0.3, "lean": 0.0},
    "gain_nonlinearity": {"share": -0.1, "power": 1.0},
    "load_offset": {"offset": 10.0},
}
PAD_EFFECTS = {
    "creep": {"share": 0.1, "time": 0.5},
    "gain_nonlinearity": {"share": -0.1, "power": 1.0},
    "load_nonlinearity": {"share": 0.2, "threshold": 0.05},
}
# Raw reads behind a sample of a pad, and touches of the tables.
PAD_READS, PAD_KNOWN, TOUCHES = 25.0, 40, 8
# Draws of a touch under one calibration, and under all of them.
ONE, ALL = 200, 20_000


@dataclass(frozen=True, eq=False)
class Compared:
    """A few touches read to first order, by brute force, and with a calibration taken as exact."""

    names: tuple[str, ...]
    first_order: Read
    nested: Read
    exact: Read

    @property
    def ratio(self) -> Array:
        """Standard deviation to first order over that by brute force, for each quantity the mean over touches."""
        return np.asarray((self.first_order.sd / self.nested.sd).mean(axis=0))

    @property
    def ratio_exact(self) -> Array:
        """The same of a calibration taken as exact."""
        return np.asarray((self.exact.sd / self.nested.sd).mean(axis=0))

    @property
    def shift(self) -> Array:
        """Root mean square difference of the means, in standard deviations."""
        off = (self.first_order.mean - self.nested.mean) / self.nested.sd
        return np.asarray(np.sqrt((off**2).mean(axis=0)))


def written(simulated: Simulated) -> DataSet:
    """The data set of a simulated finger."""
    with tempfile.TemporaryDirectory() as folder:
        return bayestouch.load_dataset(write(simulated, Path(folder)))


def touched(simulated: Simulated, rows: Array, reads: float, rng: np.random.Generator | None) -> Touches:
    """Some touches of a recording, one averaged sample of so many reads each; noise drawn, or none."""
    recording, design = simulated.recording, simulated.design
    first = rows * recording.n_samples
    readings, load = recording.signal[first], recording.read_load[first]
    if rng is not None:
        readings = readings + design.noise_sd / np.sqrt(reads) * rng.standard_normal(readings.shape)
        load = load + design.force_sd / np.sqrt(reads) * rng.standard_normal(load.shape)
    return touches_from(
        touch=np.arange(len(rows)),
        indenter_radius_mm=recording.tip[rows],
        angle_deg=recording.commanded[rows],
        load=load,
        readings=readings,
        reads=np.full(len(rows), reads),
    )


def some_rows(simulated: Simulated) -> Array:
    """A few touches of the table to be read: all tips, here and there."""
    known, unknown, _ = simulated.recording.parts
    return np.asarray(known + np.linspace(2, unknown - 3, TOUCHES).astype(int))


def finger_with(name: str, draws: int, seed: int = 1) -> Compared:
    """A finger with an effect of the catalogue."""
    simulated = catalogue.simulate(FEW, (catalogue.Stated(name, FINGER_EFFECTS[name]),), seed)
    model = StatedModel("finger", "layer", ((name, {}),))
    calibration = bayestouch.calibrate(written(simulated), model=model, draws=64, seed=seed)
    touches = touched(simulated, some_rows(simulated), 5.0, None)
    nested = mixed(drawn(calibration, draws, np.random.default_rng(3)), touches, FINGER, plug_in=True, draws=ONE)
    return compared(calibration, touches, FINGER, nested)


def compared(calibration: Calibration, touches: Touches, names: tuple[str, ...], nested: Read) -> Compared:
    """The touches read to first order, and exactly, beside what they are by brute force."""
    first, exact = (read(calibration, touches, names, plug_in=exact, draws=ALL) for exact in (False, True))
    return Compared(names, first, nested, exact)


def corrected_finger(draws: int, seed: int = 1) -> Compared:
    """A finger with a far lobe, which no effect explains, and a correction. Base and weights are drawn jointly."""
    design = replace(SMALL, edge_step=2.0, flat_step=6.0)
    simulated = simulate(design, [(forms("far_lobe")[0], 1.5)], seed)
    dataset = written(simulated)
    model = StatedModel("finger", "layer", (), correction=True)
    calibration = bayestouch.calibrate(dataset, model=model, draws=64, seed=seed)
    begun = body_of(dataset.sensor).begin(SplitData.of_calibration(dataset), draws=64, seed=seed, contact="layer")
    found = corrected_fit(begun.fitted)
    assert found is not None
    fitted, correction = found
    linear, functions = fitted.linear, fitted.linear.functions
    assert functions is not None
    columns = np.hstack([linear.jacobian, functions.white.dense()])
    precision = columns.T @ columns + np.diag(np.concatenate([linear.precision, np.ones(functions.raw.shape[0])]))
    root = np.linalg.inv(np.linalg.cholesky(precision)).T
    d, m = len(linear.precision), fitted.model.n_elements
    scale = np.concatenate([calibration.mode["response"], np.ones(d - m)])
    grid = calibration.extra["placed_angle_deg"]
    nodes, load = pressure_nodes(correction), fitted.model.reference_load
    terms, coefficients = correction_coefficients(correction, grid, design.body.outer, load, nodes)
    tables = np.zeros((N_TERMS + len(nodes), *coefficients.shape[2:]))
    calibrations = []
    for z in np.random.default_rng(3).standard_normal((draws, len(root))):
        step = root @ z
        tables[terms] = np.tensordot(coefficients, linear.weights() + step[d:], axes=(1, 0))
        extra = {
            **calibration.extra,
            **dict(zip((PREFIX + name for name in MEAN), tables[:N_TERMS].copy(), strict=True)),
        }
        if len(nodes):
            extra["placed_felt"] = tables[N_TERMS:].copy()
        calibrations.append(replace(at_row(calibration, scale * step[:d]), extra=extra))
    touches = touched(simulated, some_rows(simulated), 5.0, None)
    nested = mixed(calibrations, touches, FINGER, plug_in=True, draws=ONE)
    return compared(calibration, touches, FINGER, nested)


def pad_touches(name: str, values: dict[str, float], known: Any) -> Touches:
    """Touches on the pad without noise, of unknown loads beyond most of the calibration's, held four times as long."""
    rng = np.random.default_rng(9)
    place = rng.uniform(pads.NOMINAL.min(axis=0), pads.NOMINAL.max(axis=0), (TOUCHES, 2))
    load = rng.uniform(1.0, 2.0, TOUCHES)
    touch, held = np.repeat(np.arange(TOUCHES), pads.SAMPLES), np.tile(4 * pads.HELD, TOUCHES)
    time = 30.0 * touch + held
    reference = float(np.median(known.read_load.reshape(-1, pads.SAMPLES).mean(axis=1)))
    stage = pads.Stage(touch, time, held, place[touch], load[touch], reference, pads.GAIN * reference)
    acting = pads.ACTING[name](stage, values) if name in pads.ACTING else stage.load
    signal = acting[:, None] * pads.GAIN * pads.kernel(stage.place, False)
    if name in pads.SIGNALS:
        signal = pads.SIGNALS[name](stage, signal, values, rng)
    return touches_from(
        touch=touch,
        sample=np.tile(np.arange(pads.SAMPLES), TOUCHES),
        time_s=time,
        x_mm=stage.place[:, 0],
        y_mm=stage.place[:, 1],
        readings=pads.OFFSET + signal,
        reads=np.full(len(touch), PAD_READS),
    )


def pad_with(name: str, draws: int, seed: int = 1) -> Compared:
    """A pad with an effect. With each drawn value its readings are corrected and its map is found anew.

    The noise stays that of the most probable values: first order holds it, too, and it would be larger with any other.
    """
    values = PAD_EFFECTS[name]
    known, unknown = (pads.touched(name, values, stream, PAD_KNOWN) for stream in (seed, seed + 1))
    with tempfile.TemporaryDirectory() as folder:
        dataset = bayestouch.load_dataset(pads.write(known, unknown, Path(folder)))
    evaluations: list[tuple[Any, ...]] = []
    made = PadEvaluation.calibration

    def kept(*of_fit: Any) -> Calibration:
        evaluations.append(of_fit)
        return made(*of_fit)

    PadEvaluation.calibration = kept  # type: ignore[method-assign, assignment]
    try:
        model = StatedModel("pad", "", ((name, {}),))
        calibration = bayestouch.calibrate(dataset, model=model, kernel="gaussian", draws=64, seed=seed)
    finally:
        PadEvaluation.calibration = made  # type: ignore[method-assign]
    evaluation, fitted, (added,), correction = evaluations[-1]
    effects = PadEffects.of(calibration)
    assert effects is not None
    parameters = added.effect.parameters
    calibrations = []
    for z in matched(np.random.default_rng(3), draws, len(effects.root)):
        steps = zip(parameters, added.values, effects.root @ z, strict=True)
        moved = tuple(p.from_unconstrained(p.to_unconstrained(v) + step) for p, v, step in steps)
        each = made(evaluation, fitted, (replace(added, values=moved),), correction)
        calibrations.append(replace(values_exact(each), noise=calibration.noise))
    touches = pad_touches(name, values, known)
    nested = mixed(calibrations, touches, PAD, plug_in=False, draws=2 * ONE)
    first = read(calibration, touches, PAD, plug_in=False, draws=ALL)
    return Compared(PAD, first, nested, read(values_exact(calibration), touches, PAD, plug_in=False, draws=ALL))


def values_exact(calibration: Calibration) -> Calibration:
    """A pad's calibration with effects that count as exact, as files of version 0.1 have them."""
    left = (EFFECT_ROOT, "map_by_effect", "map_offset_by_effect")
    return replace(calibration, extra={name: each for name, each in calibration.extra.items() if name not in left})


CASES: dict[str, Callable[[int], Compared]] = {
    **{f"finger, {name}": lambda draws, name=name: finger_with(name, draws) for name in FINGER_EFFECTS},
    "finger, correction": corrected_finger,
    **{f"pad, {name}": lambda draws, name=name: pad_with(name, max(draws // 8, 8)) for name in PAD_EFFECTS},
}


def effects_held(calibration: Calibration) -> Calibration:
    """A finger's calibration whose effects are known exactly, at their most probable values."""
    n = 3 * len(calibration.mode["response"]) + 2
    full = calibration.covariance
    given = full[:n, :n] - full[:n, n:] @ np.linalg.solve(full[n:, n:], full[n:, :n])
    covariance = np.diag(1e-12 * np.diag(full))
    covariance[:n, :n] = given
    return replace(calibration, covariance=covariance)


def coverage(name: str, fingers: int) -> dict[str, dict[str, tuple[float, float, int]]]:
    """Root mean square z and share of 90 % intervals that hold the truth, by way of reading and quantity."""
    scores: dict[str, dict[str, list[Array]]] = {}
    hits: dict[str, dict[str, list[Array]]] = {}
    for seed in range(fingers):
        simulated = catalogue.simulate(FEW, (catalogue.Stated(name, FINGER_EFFECTS[name]),), seed)
        model = StatedModel("finger", "layer", ((name, {}),))
        calibration = bayestouch.calibrate(written(simulated), model=model, draws=64, seed=seed)
        known, unknown, exam = simulated.recording.parts
        # tips that are neither edges nor flats, where the prior would end
        rows = known + unknown + np.arange(seed % 4, exam, 4)
        touches = touched(simulated, rows, 20.0, np.random.default_rng([seed, 1]))
        tip, outer = simulated.recording.tip[rows], simulated.design.body.outer
        press = simulated.recording.press
        truth = {"R": outer * tip / (outer + tip), "theta_c": press.angle[rows], "P": press.load[rows]}
        for title, used, plug_in in (
            ("calibration exact", calibration, True),
            ("effects exact", effects_held(calibration), False),
            ("all uncertain", calibration, False),
        ):
            found = bayestouch.infer(touches, used, draws=512, seed=seed, plug_in=plug_in, check_sensor=False)
            for each in FINGER:
                flat = found.posterior[each].reshape(-1, len(rows))
                low, high = np.quantile(flat, [0.05, 0.95], axis=0)
                z = (flat.mean(axis=0) - truth[each]) / flat.std(axis=0)
                scores.setdefault(title, {}).setdefault(each, []).append(z)
                hits.setdefault(title, {}).setdefault(each, []).append((truth[each] > low) & (truth[each] < high))
    return {way: {each: summary(scores[way][each], hits[way][each]) for each in FINGER} for way in scores}


def summary(scores: list[Array], hits: list[Array]) -> tuple[float, float, int]:
    """Root mean square, share, and how many touches."""
    z, inside = np.concatenate(scores), np.concatenate(hits)
    return float(np.sqrt(np.mean(z**2))), float(inside.mean()), len(z)


def nested_table(draws: int) -> str:
    """First order beside brute force, for all cases."""
    rows = []
    for title, case in CASES.items():
        found = case(draws)
        cells = [
            f"{name} {now:.2f} ({exact:.2f})"
            for name, now, exact in zip(found.names, found.ratio, found.ratio_exact, strict=True)
        ]
        rows.append([title, *cells, f"{found.shift.max():.2f}", f"{found.nested.log_evidence.min():.0f}"])
        print(rows[-1], flush=True)
    head = ["case", *["sd to first order over brute force (exact)"] * 3, "largest rms shift, sd", "least calibrations"]
    return markdown_table(head, rows)


def coverage_table(fingers: int) -> str:
    """Errors of touches beside what they say of themselves."""
    rows = []
    for name in FINGER_EFFECTS:
        for way, of in coverage(name, fingers).items():
            cells = [f"{z:.2f}, {100 * inside:.0f} %" for z, inside, _ in of.values()]
            rows.append([name, way, *cells, str(of["R"][2])])
            print(rows[-1], flush=True)
    return markdown_table(["effect", "read with", *FINGER, "touches"], rows)


def main(arguments: list[str]) -> None:
    """Print both tables, or put them into the documentation."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--calibrations", type=int, default=120, help="calibrations drawn from a posterior")
    parser.add_argument("--fingers", type=int, default=10, help="fingers of each effect whose touches are scored")
    parser.add_argument("--docs", action="store_true", help="write the tables into docs/statistics.md")
    chosen = parser.parse_args(arguments)
    text = f"{nested_table(chosen.calibrations)}\n{coverage_table(chosen.fingers)}"
    print(text)
    if chosen.docs:
        put_into_page("touch_uncertainty.py", text, STATISTICS)


if __name__ == "__main__":
    main(sys.argv[1:])
