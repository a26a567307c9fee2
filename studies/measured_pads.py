"""Pads that other laboratories measured: half of the touches calibrate, the others are read.

For each data set of the folder `measured` and for each model of the pad (a kernel alone, with an empirical map, the map
alone) this prints, on touches held out of every fit and every choice:

reading     rms of reading minus prediction at the stage's position, percent of each element's peak
ring        the same from 1.25 to 2 pitches away from the element, where readings are negative
inside      location error (posterior mean against stage), median and rms in mm, within the hull of the elements
all         the same over all held-out touches
90 %        share of touches whose 90 % region of highest density contains the stage's position
places      touches whose posterior names more than one place

and, where loads were measured, how badly linearity in the load holds. The model that `calibrate` chooses (by
calibration touches alone) is marked. With `--small` baro-line alone.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from _published import figure, options, save

from bayestouch.chain.kernel_choice import kernel_for
from bayestouch.chain.kernels import LayerKernel
from bayestouch.data.averages import TouchMeans
from bayestouch.data.dataset import DataSet, load_dataset
from bayestouch.data.splits import with_calibration
from bayestouch.inference import infer
from bayestouch.pad.calibration import calibrate_pad
from bayestouch.pad.candidates import PadCandidate, fit_kernel
from bayestouch.pad.known_touches import pad_readings
from bayestouch.pad.problem import PadProblem, pad_problem
from bayestouch.pad.reading.reader import PadReader
from bayestouch.priors.parameters import Uniform
from bayestouch.results.objects import Calibration, TouchPosteriors

KERNELS = ("layer", "half-space", "gaussian")
RING_PITCHES = 1.25, 2.0
LEVELS = np.linspace(0.05, 0.95, 19)
DATA_SETS = ("baro-line", "array8-soft", "fluid-oil-1.5")
# Every model of a pad, and what `calibrate` chooses by itself.
WAYS: dict[str, dict[str, Any]] = {
    **{name: {"kernel": name, "empirical": False} for name in KERNELS},
    **{f"{name} with map": {"kernel": name, "empirical": True} for name in KERNELS},
    "map alone": {"kernel": "constant", "empirical": True},
    "chosen": {},
}


@dataclass(frozen=True, eq=False)
class Scores:
    """What a calibration makes of held-out touches; see the module. NaN where there is nothing to say."""

    reading: float
    ring: float
    inside: tuple[float, float]
    everywhere: tuple[float, float]
    coverage: float
    places: int


def load(folder: Path, name: str) -> DataSet:
    """A measured data set, split by location."""
    return with_calibration(load_dataset(folder / "measured" / name))


def held_out(dataset: DataSet, problem: PadProblem) -> TouchMeans:
    """Held-out touches, every load given."""
    dimensions = problem.known.location.shape[1]
    readings = pad_readings(dataset.touches.baseline_corrected(problem.rest), dimensions, problem.samples)
    return replace(readings, load=np.where(np.isfinite(readings.load), readings.load, 1.0))


def percent_of_peak(error: np.ndarray, peak: np.ndarray, where: np.ndarray | None = None) -> float:
    """Root mean square of errors (t, m), percent of peak (m,), mean of the elements; of some of them, `where`."""
    some = np.isfinite(error) if where is None else where & np.isfinite(error)
    if not some.any():
        return np.nan
    rms = [np.sqrt(np.mean(column[each] ** 2)) for column, each in zip(error.T, some.T, strict=True) if each.any()]
    return float(100 * np.mean(np.array(rms) / peak[some.any(axis=0)]))


def ring(location: np.ndarray, position: np.ndarray, pitch_mm: float) -> np.ndarray:
    """Whether touches are in the ring around each element, (t, m)."""
    distance = np.sqrt(((location[:, None] - position) ** 2).sum(axis=-1)) / pitch_mm
    return (distance > RING_PITCHES[0]) & (distance < RING_PITCHES[1])


def kernel_errors(dataset: DataSet) -> dict[str, tuple[PadCandidate, float, float]]:
    """Kernels alone: model, held-out reading error and that in the ring, percent of peak."""
    problem, _ = pad_problem(dataset.sensor, dataset.calibration, samples="auto", seed=0)
    touches = held_out(dataset, problem)
    kernels = {name: kernel_for(name, dataset.sensor, problem.pitch_mm) for name in KERNELS}
    layer = kernels["layer"]
    assert isinstance(layer, LayerKernel)
    kernels["layer, at its base"] = replace(layer, depth_share=Uniform(0.9999, 1.0))
    out = {}
    for name, kernel in kernels.items():
        model = fit_kernel(problem, kernel)
        chain = model.fit.chain
        error = touches.readings - chain.predict(touches.location, touches.load)
        peak = np.nanmax(np.abs(touches.readings - chain.offset), axis=0)
        around = ring(touches.location, chain.position, problem.pitch_mm)
        out[name] = model, percent_of_peak(error, peak), percent_of_peak(error, peak, around)
    return out


def read(folder: Path, name: str, label: str) -> tuple[Calibration, TouchPosteriors]:
    """A data set calibrated in one of the ways of `WAYS`, and its touches read with that."""
    dataset = load(folder, name)
    calibration = calibrate_pad(dataset, **WAYS[label])
    return calibration, infer(dataset.touches, calibration, draws=1000, workers=1)


def inside_array(location: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Whether locations (t, D) lie within the hull of the elements (m, D)."""
    if location.shape[1] == 1:
        return (location[:, 0] >= position.min()) & (location[:, 0] <= position.max())
    from scipy.spatial import Delaunay

    return np.asarray(Delaunay(position).find_simplex(location) >= 0)


def element_positions(calibration: Calibration) -> np.ndarray:
    """Positions (m, D) at the mode, mm."""
    return np.stack([calibration.mode[name] for name in ("x_s", "y_s") if name in calibration.mode], axis=1)


def errors(posterior: TouchPosteriors) -> tuple[np.ndarray, np.ndarray]:
    """Stage's positions (t, D) and the posterior means' errors against them, (t, D), mm."""
    names = [name for name in ("x", "y") if name in posterior.posterior]
    reference = np.stack([posterior.reference[name] for name in names], axis=1)
    return reference, np.stack([posterior.mean(name) for name in names], axis=1) - reference


def scores(dataset: DataSet, calibration: Calibration, posterior: TouchPosteriors, position: np.ndarray) -> Scores:
    """Held-out errors of a calibration; `position` (m, D) says what is inside the array."""
    problem, _ = pad_problem(dataset.sensor, dataset.calibration, samples="auto", seed=0)
    touches = held_out(dataset, problem)
    map_ = PadReader.from_calibration(calibration).map
    difference = touches.readings - map_.offset - touches.load[:, None] * map_.at(touches.location)[0]
    peak = np.nanmax(np.abs(touches.readings - map_.offset), axis=0)
    location, error = errors(posterior)
    distance = np.sqrt((error**2).sum(axis=1))
    inside = inside_array(location, position)
    return Scores(
        reading=percent_of_peak(difference, peak),
        ring=percent_of_peak(difference, peak, ring(location, position, problem.pitch_mm)),
        inside=_median_and_rms(distance[inside]),
        everywhere=_median_and_rms(distance),
        coverage=float(np.mean(posterior.sample_stats["reference_level"] <= 0.9)),
        places=int((posterior.sample_stats["modes"] > 1).sum()),
    )


def _median_and_rms(distance: np.ndarray) -> tuple[float, float]:
    return float(np.median(distance)), float(np.sqrt(np.mean(distance**2)))


def print_data_set(
    name: str, dataset: DataSet, made: dict[str, tuple[Calibration, TouchPosteriors]], pictures: Path | None
) -> None:
    """Tables of one data set."""
    print(f"\n{name}")
    models = kernel_errors(dataset)
    for kernel, (model, reading, in_ring) in models.items():
        values = ", ".join(
            f"{parameter.symbol} {value:.3g} {parameter.unit}".strip()
            for parameter, value in zip(model.kernel.parameters, model.fit.chain.values, strict=True)
        )
        print(f"  {kernel:20s} reading {reading:6.2f} %   ring {in_ring:5.2f} %   ({values})")
    print(f"  {'':22s} reading   ring  inside med   rms    all med   rms    90 %  places")
    position = element_positions(made["layer"][0])
    for label, (calibration, posterior) in made.items():
        s = scores(dataset, calibration, posterior, position)
        print(
            f"  {label:22s} {s.reading:6.2f} {s.ring:6.2f} {s.inside[0]:10.3f} {s.inside[1]:6.3f} "
            f"{s.everywhere[0]:9.3f} {s.everywhere[1]:6.3f} {s.coverage:7.3f} {s.places:6d}"
        )
    chosen, posterior = made["chosen"]
    print(f"  chosen: {chosen.settings['kernel']}, empirical map: {chosen.settings['empirical_map']}")
    for key in ("load_exponent", "error_percent_peak_linear", "error_percent_peak_power", "load_trend_share"):
        if key in chosen.statistics:
            print(f"  {key} {chosen.statistics[key]:.3g}")
    if pictures is not None:
        draw(name, models, posterior, dataset, position, pictures)


def draw(
    name: str,
    models: dict[str, tuple[PadCandidate, float, float]],
    posterior: TouchPosteriors,
    dataset: DataSet,
    position: np.ndarray,
    pictures: Path,
) -> None:
    """Save readings over distance with the kernels, location errors over the pad, and coverage."""
    problem, _ = pad_problem(dataset.sensor, dataset.calibration, samples="auto", seed=0)
    drawn, (left, middle, right) = figure(3, figsize=(12.5, 3.8))
    for kernel, (model, _, _) in models.items():
        chain, known = model.fit.chain, problem.known
        distance = np.sqrt(((known.location[:, None] - chain.position) ** 2).sum(axis=-1)).ravel()
        if kernel == "layer":
            signal = (known.readings - chain.offset) / known.load[:, None] / chain.gain
            left.plot(distance, signal.ravel(), ".", ms=2, color="0.8")
        x = np.linspace(0, distance.max(), 400)
        left.plot(x, chain.kernel(x, chain.values), label=kernel)
    left.set(xlabel="distance from the element (mm)", ylabel="signal over that above the element", ylim=(-0.06, 0.12))
    left.legend(title="kernel (dots: readings)")
    location, error = errors(posterior)
    if location.shape[1] == 2:
        size = np.sqrt((error**2).sum(axis=1))
        points = middle.scatter(*location.T, c=np.clip(size, 0, 1), s=6, cmap="viridis")
        drawn.colorbar(points, ax=middle, label="location error (mm), cut at 1")
        middle.plot(*position.T, "r+")
        middle.set(xlabel="x (mm)", ylabel="y (mm)", aspect="equal")
    else:
        middle.errorbar(location[:, 0], error[:, 0], posterior.sd("x"), fmt=".", ms=4, elinewidth=0.6, alpha=0.6)
        middle.set(xlabel="x (mm)", ylabel="error and posterior sd (mm)")
    found = [(posterior.sample_stats["reference_level"] <= level).mean() for level in LEVELS]
    right.plot(LEVELS, found, "o-")
    right.plot([0, 1], [0, 1], color="0.7")
    right.set(xlabel="probability of the region", ylabel="share of touches inside it")
    drawn.suptitle(f"{name}: {dataset.sensor.source.get('repository', '')}")
    save(drawn, pictures, f"measured_pads_{name}")


def main(small: bool = False, pictures: Path | None = None) -> None:
    """Print every table; save pictures in the folder given."""
    default = Path(__file__).resolve().parent.parent.parent / "shared"
    folder = Path(os.environ.get("BAYESTOUCH_SHARED", default))
    if not (folder / "measured").is_dir():
        print("no measured data: set $BAYESTOUCH_SHARED, or put the folder `shared` beside the checkout")
        return
    names = DATA_SETS[:1] if small else DATA_SETS
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        jobs = {each: pool.submit(read, folder, *each) for each in product(names, WAYS)}
        for name in names:
            made = {label: jobs[name, label].result() for label in WAYS}
            print_data_set(name, load(folder, name), made, pictures)


if __name__ == "__main__":
    main(*options(__doc__))
