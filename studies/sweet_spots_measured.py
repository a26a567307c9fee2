"""Sweet spots of real pads: maps of bias and spread of the location on measured/array8-soft and measured/baro-line.

Half of the locations calibrate, the others are read. Location takes the place of the radius. The study asks:

* are there sweet spots: does the error vary by place more than chance, and do neighbours err alike?
* are they at the elements or between?
* are they predicted: the spread from the calibration alone (size), and, for a pad read with the elastic kernel alone,
  the bias that its empirical map implies (sign)?
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from _page import markdown_table
from _published import figure, plain_ticks, rms, run_study, save
from scipy.spatial import cKDTree
from scipy.stats import spearmanr

from bayestouch import infer, load_dataset
from bayestouch.data.dataset import DataSet
from bayestouch.data.splits import with_calibration
from bayestouch.pad.calibration import calibrate_pad
from bayestouch.pad.reading.reader import PadReader
from bayestouch.reliability import PadSpots, attainable, explained_sign, explained_size, pad_known_bias, pad_spots
from bayestouch.results.objects import TouchPosteriors

SHARED = Path(os.environ.get("BAYESTOUCH_SHARED", Path(__file__).resolve().parents[2] / "shared"))
NAMES = ("baro-line", "array8-soft")
KERNEL = {"baro-line": "layer-line", "array8-soft": "layer"}
DISTANCES = np.array([0.0, 0.125, 0.25, 0.375, 0.5, 0.75])  # pitches from the nearest element


@dataclass(frozen=True, eq=False)
class PadResult:
    """One pad.

    Attributes
    ----------
    elements, location : (m, D), (n, D) arrays
        Of elements as fitted and of held-out touches, mm.
    pitch_mm : float
        Between neighbouring elements.
    error, kernel_error : (n, D) arrays
        Posterior mean less stage position, with the empirical map and with the kernel alone.
    posterior_sd : (n,) array
        Of the location with the map, from the draws.
    spots, kernel_spots : PadSpots
        Predictions for both.
    predicted_bias : (n, D) array
        Of the kernel alone.
    """

    name: str
    elements: np.ndarray
    location: np.ndarray
    pitch_mm: float
    error: np.ndarray
    kernel_error: np.ndarray
    posterior_sd: np.ndarray
    spots: PadSpots
    kernel_spots: PadSpots
    predicted_bias: np.ndarray

    @property
    def inside(self) -> np.ndarray:
        """Touches within the elements' rectangle: beyond it the location runs off, and no first order holds."""
        low, high = self.elements.min(axis=0), self.elements.max(axis=0)
        return np.all((self.location >= low) & (self.location <= high), axis=1)

    @property
    def to_element(self) -> np.ndarray:
        """Distance to the nearest element, pitches."""
        return np.asarray(cKDTree(self.elements).query(self.location)[0] / self.pitch_mm)


def study_pad(name: str, touches: int | None = None) -> PadResult:
    """Calibrate with and without the map, predict, read, compare."""
    dataset = with_calibration(load_dataset(SHARED / "measured" / name))
    if touches is not None:
        dataset = thinned(dataset, touches)
    with_map = calibrate_pad(dataset, kernel=KERNEL[name], empirical=True)
    kernel = calibrate_pad(dataset, kernel=KERNEL[name], empirical=False)
    read, by_kernel = (infer(dataset.touches, each, draws=256) for each in (with_map, kernel))
    axes = tuple(axis for axis in ("x", "y") if axis in read.posterior)
    location = np.stack([read.reference[axis] for axis in axes], axis=1)
    elements = np.stack([with_map.mode[f"{axis}_s"] for axis in axes], axis=1)
    reader, bare = (PadReader.from_calibration(each) for each in (with_map, kernel))
    return PadResult(
        name=name,
        elements=elements,
        location=location,
        pitch_mm=float(np.sort(cKDTree(elements).query(elements, k=2)[0][:, 1]).mean()),
        error=errors(read, axes),
        kernel_error=errors(by_kernel, axes),
        posterior_sd=np.sqrt(np.sum([read.sd(axis) ** 2 for axis in axes], axis=0)),
        spots=pad_spots(reader, location),
        kernel_spots=pad_spots(bare, location),
        predicted_bias=pad_known_bias(bare, reader, location),
    )


def thinned(dataset: DataSet, touches: int) -> DataSet:
    """Every so many touches of both tables."""
    tables = {}
    for part in ("calibration", "touches"):
        table = getattr(dataset, part)
        ids = np.unique(table.touch)
        kept = ids[:: max(1, len(ids) // touches)]
        tables[part] = table.select(np.isin(table.touch, kept))
    return replace(dataset, **tables)


def errors(posteriors: TouchPosteriors, axes: tuple[str, ...]) -> np.ndarray:
    return np.stack([posteriors.mean(axis) - posteriors.reference[axis] for axis in axes], axis=1)


def alike(location: np.ndarray, error: np.ndarray, seed: int = 0) -> tuple[float, float]:
    """Correlation of each touch's error with the mean of its nearest neighbours', and what chance reaches (95 %)."""
    count = 2 if location.shape[1] == 1 else 4
    _, near = cKDTree(location).query(location, k=count + 1)
    rng = np.random.default_rng(seed)

    def correlation(values: np.ndarray) -> float:
        return float(np.corrcoef(values.ravel(), values[near[:, 1:]].mean(axis=1).ravel())[0, 1])

    chance = [correlation(error[rng.permutation(len(error))]) for _ in range(200)]
    return correlation(error), float(np.quantile(chance, 0.95))


def print_pad(found: PadResult) -> None:
    """Everything asked of one pad."""
    some = found.inside
    size = np.sqrt((found.error**2).sum(axis=1))[some]
    bare = np.sqrt((found.kernel_error**2).sum(axis=1))[some]
    outside = np.sqrt((found.error[~some] ** 2).sum(axis=1))
    print(f"\n{found.name}: {some.sum()} held-out touches within the elements, pitch {found.pitch_mm:.2f} mm")
    print("  rms error of location (mm): seen, predicted before any touch, and by the posteriors")
    print(f"    with the map {rms(size):.3f}, {rms(found.spots.sd[some]):.3f}, {rms(found.posterior_sd[some]):.3f}")
    print(f"    kernel alone {rms(bare):.3f}, {rms(found.kernel_spots.sd[some]):.3f}")
    print(f"    beyond the elements, with the map {rms(outside):.3f}, {rms(found.spots.sd[~some]):.3f}")
    near, chance = alike(found.location[some], found.error[some])
    near_bare, _ = alike(found.location[some], found.kernel_error[some])
    print(
        f"  correlation with neighbours' errors {near:.2f} (map), {near_bare:.2f} (kernel); by chance to {chance:.2f}"
    )
    print("  distance to the nearest element (pitches), rms error seen and predicted (mm): map; kernel alone")
    for low, high in pairwise(DISTANCES):
        here = (found.to_element[some] >= low) & (found.to_element[some] < high)
        if here.sum() >= 3:
            both = [rms(each.sd[some][here]) for each in (found.spots, found.kernel_spots)]
            print(
                f"    {low:5.3f} to {high:5.3f} ({here.sum():4d}): "
                f"{rms(size[here]):.3f} {both[0]:.3f}; {rms(bare[here]):.3f} {both[1]:.3f}"
            )
    print_elements(found)
    for label, text in score(found).items():
        print(f"  {label}: {text}")


def print_elements(found: PadResult) -> None:
    """Which elements make the best and the worst place within the elements."""
    inside = np.flatnonzero(found.inside)
    sd = found.spots.sd[inside]
    for label, place in (("sweet spot", inside[sd.argmin()]), ("worst place", inside[sd.argmax()])):
        share = found.spots.by_element[place].sum(axis=0) / found.spots.sd[place] ** 2
        away = np.linalg.norm(found.elements - found.location[place], axis=1) / found.pitch_mm
        parts = ", ".join(
            f"e{e + 1:02d} {away[e]:.2f} pitches off {100 * share[e]:.0f} %" for e in np.argsort(-share)[:3]
        )
        print(f"  {label} (sd {found.spots.sd[place]:.3f} mm), share of the variance: {parts}")


def score(found: PadResult) -> dict[str, str]:
    """How much of the errors the predictions explain."""
    some = found.inside
    by_axis = np.hypot(found.spots.noise_sd, found.spots.bias_rms)[some].T
    seen = found.error[some].T
    rng = np.random.default_rng(0)
    size, best = (
        explained_size(by_axis, seen),
        attainable(by_axis, by_axis * rng.standard_normal((100, *by_axis.shape))),
    )
    sign = explained_sign(found.predicted_bias[some].T, found.kernel_error[some].T)
    posterior = spearmanr(found.spots.sd[some], found.posterior_sd[some])[0]
    return {
        "size, with the map": f"R² {size.r_squared:.2f}, rank {size.rank_correlation:.2f} "
        f"[{size.rank_interval[0]:.2f}, {size.rank_interval[1]:.2f}]; at best {best['r_squared'][0]:.2f}, "
        f"{best['rank_correlation'][0]:.2f}",
        "posterior sd, predicted before the touch": f"rank {posterior:.2f}",
        "sign, kernel alone": f"R² {sign.r_squared:.2f} [{sign.r_squared_interval[0]:.2f}, "
        f"{sign.r_squared_interval[1]:.2f}], rank {sign.rank_correlation:.2f}",
    }


def for_the_page(results: list[PadResult]) -> str:
    """Table of the documentation: a row for each question, a column for each pad."""
    columns = []
    for found in results:
        some = found.inside
        size, bare = (np.sqrt((error**2).sum(axis=1))[some] for error in (found.error, found.kernel_error))
        near = found.to_element[some] < DISTANCES[2]
        sd, text = found.spots.sd[some], score(found)
        alone, mapped = (alike(found.location[some], each[some])[0] for each in (found.kernel_error, found.error))
        columns.append(
            {
                "held-out touches within the elements": str(some.sum()),
                "rms error with the map, seen (predicted before any touch)": f"{rms(size):.3f} ({rms(sd):.3f}) mm",
                f"within {DISTANCES[2]:g} pitches of an element": f"{rms(size[near]):.3f} ({rms(sd[near]):.3f}) mm",
                "further away": f"{rms(size[~near]):.3f} ({rms(sd[~near]):.3f}) mm",
                "size of the error": text["size, with the map"],
                "read with the kernel alone: rms error": f"{rms(bare):.3f} mm",
                "sign of its bias, predicted by the map": text["sign, kernel alone"],
                "correlation of neighbours' errors: kernel alone; with the map": f"{alone:.2f}; {mapped:.2f}",
            }
        )
    rows = [[label, *(column[label] for column in columns)] for label in columns[0]]
    return markdown_table(["", *(f"measured/{found.name}" for found in results)], rows)


def picture(folder: Path, found: PadResult) -> None:
    """Maps of error and predicted spread, and signed bias of the kernel alone."""
    figures, axes = figure(3, figsize=(13.0, 4.0))
    size = np.sqrt((found.error**2).sum(axis=1))
    if found.location.shape[1] == 2:
        from matplotlib.colors import LogNorm

        scale = LogNorm(0.05, 2.0)
        for side, values, title in (
            (axes[0], found.spots.sd, "predicted before any touch"),
            (axes[1], size, "seen on held-out touches"),
        ):
            points = side.scatter(*found.location.T, c=values, s=9, norm=scale, cmap="viridis")
            side.plot(*found.elements.T, "r+", ms=9)
            side.set(xlabel="x (mm)", ylabel="y (mm)", aspect="equal", title=title)
        bar = figures.colorbar(points, ax=axes[1], label="location error (mm)")
        plain_ticks(bar.ax.yaxis, (0.05, 0.1, 0.2, 0.5, 1, 2))
    else:
        x = found.location[:, 0]
        order = np.argsort(x)
        axes[0].plot(x[order], found.spots.sd[order], "C1-", label="predicted sd")
        axes[0].plot(x, size, "C0.", label="|error| seen")
        axes[0].set(xlabel="x (mm)", ylabel="error of the location (mm)", title="with the empirical map", yscale="log")
        plain_ticks(axes[0].yaxis, (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5))
        axes[1].plot(x[order], found.predicted_bias[order, 0], "C1-", label="predicted bias")
        axes[1].plot(x, found.kernel_error[:, 0], "C0.", label="error seen")
        axes[1].set(xlabel="x (mm)", ylabel="error of the location (mm)", title="read with the kernel alone")
        for side in axes[:2]:
            for place in found.elements[:, 0]:
                side.axvline(place, color="0.85", zorder=0)
            side.legend()
    some = found.inside
    axes[2].plot(found.predicted_bias[some].ravel(), found.kernel_error[some].ravel(), ".", ms=3)
    ends = np.quantile(found.predicted_bias[some], [0.0, 1.0])
    axes[2].plot(ends, ends, color="0.6")
    axes[2].set(
        xlabel="bias predicted by the map (mm)",
        ylabel="error seen (mm)",
        title="kernel alone, inside the elements",
    )
    figures.suptitle(f"{found.name} (red or grey: elements)")
    save(figures, folder, f"sweet_spots_{found.name}")


def main(small: bool = False, folder: Path | None = None) -> list[PadResult]:
    """Print every table and save the pictures; nothing without the measured data."""
    if not (SHARED / "measured").is_dir():
        print("no measured data: set $BAYESTOUCH_SHARED, or put the folder `shared` beside the checkout")
        return []
    results = [study_pad(name, touches=120 if small else None) for name in (NAMES[:1] if small else NAMES)]
    for found in results:
        print_pad(found)
        if folder is not None:
            picture(folder, found)
    return results


if __name__ == "__main__":
    run_study(main, __doc__, "sweet_spots_measured.py", for_the_page)
