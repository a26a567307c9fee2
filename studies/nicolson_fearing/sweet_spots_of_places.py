"""Sweet spots that belong to the place: bias that the residuals of calibration touches at the same place foretell.

The paper's Figure 13 (bias shared by all tips, with both calibrations) asks for errors of the place touched, which no E
map takes up (`figure_13.py`). Here fingers have such errors, as large as Table 2 leaves over (1.26 % of the peak), or
errors of the elements' E maps (2.06 %), or both kinds, or none. Each is read with the elastic model. The identified E
map, and what edges leave over of it at a place, predict the bias of tips that calibrated nothing, with its sign. Last
practice/finger-a.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import _path  # noqa: F401
import numpy as np
from _page import ends, markdown_table
from _published import figure, rms, run_study, save

from bayestouch import load_dataset, simulate
from bayestouch.data.averages import average
from bayestouch.data.dataset import DataSet
from bayestouch.reliability import (
    KnownFinger,
    observed_bias,
    place_bias,
    shared_by_indenters,
)
from bayestouch.simulation import SimulatedDataSet
from nicolson_fearing.foretold import Foretold
from nicolson_fearing.paper_design import calibrated, indenter, paper_design, with_map_errors, with_place_errors
from nicolson_fearing.paper_finger import MISFIT_PERCENT
from nicolson_fearing.sweet_spots import CALIBRATORS, SHARED, as_model, interval, read

SEEDS = (0, 1, 2)


def of_place(simulated: SimulatedDataSet, seed: int) -> DataSet:
    return with_place_errors(simulated, MISFIT_PERCENT["empirical"], seed)


def of_map(simulated: SimulatedDataSet, seed: int) -> DataSet:
    return with_map_errors(simulated, MISFIT_PERCENT["model"], seed)


def of_both(simulated: SimulatedDataSet, seed: int) -> DataSet:
    return of_place(replace(simulated, dataset=of_map(simulated, seed)), seed)


def of_none(simulated: SimulatedDataSet, seed: int) -> DataSet:
    return simulated.dataset


KINDS: dict[str, Callable[[SimulatedDataSet, int], DataSet]] = {
    "of the place": of_place,
    "of the E maps": of_map,
    "of both": of_both,
    "none": of_none,
}


def foretell(name: str, dataset: DataSet) -> Foretold:
    """Calibrate, predict, touch."""
    identified = calibrated(dataset, "empirical")
    calibration = as_model(identified)
    posteriors = read(dataset, calibration)
    seen = observed_bias(posteriors, without=CALIBRATORS)
    assert dataset.calibration is not None
    predicted = place_bias(
        KnownFinger.of(calibration),
        average(dataset.calibration.baseline_corrected()),
        seen.indenters_mm,
        seen.angle_deg,
        better=KnownFinger.of(identified),
        samples=int(np.median(posteriors.rows.counts)),
    )
    return Foretold(name, predicted["R"], seen)


def print_foretold(title: str, found: list[Foretold]) -> None:
    """One line a finger."""
    print(f"\nerrors {title}: bias of R at places of tips held out, predicted from edges")
    print(
        f"{'finger':>10s} {'seen rms':>10s} {'R² of bias':>23s} {'rank of |bias|':>22s} {'left over':>11s} "
        f"{'shared by tips':>15s} {'left':>6s}"
    )
    for each in found:
        score, size = each.score, each.size_score
        print(
            f"{each.name:>10s} {rms(each.seen.error):7.3f} mm "
            f"{score.r_squared:8.2f} {interval(score.r_squared_interval)} "
            f"{size.rank_correlation:7.2f} {interval(size.rank_interval)} {rms(each.left):8.3f} mm "
            f"{each.seen.shared:15.2f} {shared_by_indenters(each.left):6.2f}"
        )


def for_the_page(found: dict[str, list[Foretold]]) -> str:
    """Table of the documentation: smallest and largest value over the fingers, for each kind of error."""
    head = ["errors", "seen, mm", "R² of bias", "rank of absolute bias", "left when it is taken off, mm"]
    rows = [
        [
            kind,
            ends(rms(each.seen.error) for each in fingers),
            ends(each.score.r_squared for each in fingers),
            ends(each.size_score.rank_correlation for each in fingers),
            ends(rms(each.left) for each in fingers),
            ends(each.seen.shared for each in fingers),
            ends(shared_by_indenters(each.left) for each in fingers),
        ]
        for kind, fingers in found.items()
    ]
    return markdown_table([*head, "shared by tips, seen", "shared by tips, left"], rows)


def picture(folder: Path, found: dict[str, list[Foretold]]) -> None:
    """Bias by place of three tips, and predicted against seen for all kinds."""
    drawn, (left, right) = figure(2, figsize=(11.0, 4.2))
    one = next(iter(found.values()))[0]
    for colour, i in enumerate((0, len(one.seen.indenters_mm) // 2, -1)):
        name = indenter(one.seen.indenters_mm[i])
        left.plot(one.seen.angle_deg, one.seen.error[i], f"C{colour}.", ms=5, label=f"{name}, seen")
        left.plot(one.seen.angle_deg, one.predicted[i], f"C{colour}-", lw=1)
    left.set(xlabel="location (degree)", ylabel="bias of R (mm)")
    left.set_title(f"errors {next(iter(found))}; lines: predicted before any touch")
    left.legend()
    for colour, (kind, fingers) in zip(("C0", "C1", "C2", "0.5"), found.items(), strict=False):
        for i, each in enumerate(fingers):
            label = None if i else f"{kind}, R² {np.mean([f.score.r_squared for f in fingers]):.2f}"
            right.plot(each.predicted.ravel(), each.seen.error.ravel(), ".", ms=3, color=colour, alpha=0.6, label=label)
    ends = np.array(right.get_xlim())
    right.plot(ends, ends, color="0.6", lw=1)
    right.set(xlabel="bias of R predicted (mm)", ylabel="bias of R seen (mm)")
    right.set_title("tips that calibrated nothing, by kind of error")
    right.legend(title="errors", markerscale=2)
    save(drawn, folder, "sweet_spots_of_places")


def main(small: bool = False, folder: Path | None = None) -> dict[str, list[Foretold]]:
    """Print every table and save the picture."""
    touches = (
        {"touch_step_deg": 2.0, "touch_span_deg": 16.0, "edge_step_deg": 2.0, "flat_step_deg": 6.0} if small else {}
    )
    design = paper_design(touch_radii_mm=(1.59, 6.01, 12.3), **touches)
    seeds = SEEDS[:1] if small else SEEDS
    made = [simulate(design, seed=seed) for seed in seeds]
    found = {}
    for kind, errors in KINDS.items():
        if small and kind not in ("of both", "none"):
            continue
        found[kind] = [foretell(f"finger {s}", errors(each, s)) for s, each in zip(seeds, made, strict=True)]
        print_foretold(kind, found[kind])
    if not small and (SHARED / "practice" / "finger-a").is_dir():
        practice = load_dataset(SHARED / "practice" / "finger-a")
        print_foretold("as practice/finger-a has them", [foretell("finger-a", practice)])
    if folder is not None:
        picture(folder, found)
    return found


if __name__ == "__main__":
    run_study(main, __doc__, "nicolson_fearing/sweet_spots_of_places.py", for_the_page)
