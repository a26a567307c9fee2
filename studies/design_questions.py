"""Design questions: what depth, spacing, noise and thickness do to a finger, and how much effort is enough.

One call each (`design_maps`, `calibration_effort`, `averaging_effort`), asked of the paper's finger: standard
deviations of R at places from an element to halfway to the next, load not measured, single samples. Depth and thickness
change the strain at the elements, so both are asked twice: with noise that stays at 1.72 % of the peak, and with noise
that stays the same as a strain. Last a pad of two rows of four barometers (`pad_design_maps`): spacing and thickness.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from _page import markdown_table
from _published import figure, plain_ticks, run_study, save
from nicolson_fearing.paper_design import indenter, paper_design
from nicolson_fearing.paper_finger import MISFIT_PERCENT

from bayestouch.reliability import (
    DesignMaps,
    Effort,
    PadDesignMaps,
    averaging_effort,
    calibration_effort,
    design_maps,
    expected_finger,
    pad_design_maps,
)
from bayestouch.reliability.designs import PLACES, places_deg
from bayestouch.simulation import PadDesign

VALUES = {
    "depth_mm": (1.2, 1.6, 2.0, 2.4, 2.8, 3.1),
    "spacing_mm": (0.8, 1.2, 1.58, 2.0, 2.5, 3.2, 4.0),
    "noise_percent": (0.1, 0.4, 1.0, 1.72, 3.0),
    "thickness_mm": (1.5, 2.0, 2.6, 3.3, 4.2, 5.2),
}
LABELS = {
    "depth_mm": "depth of the elements (mm)",
    "spacing_mm": "element spacing (mm)",
    "noise_percent": "noise of a sample (% of peak)",
    "thickness_mm": "thickness of the rubber (mm)",
}
PAD_VALUES = {"spacing_mm": (4.0, 5.5, 6.75, 8.5), "thickness_mm": (4.0, 6.0, 8.0, 10.0)}
STRAIN = ("depth_mm", "thickness_mm")
#: Places of the indenters in the picture: 3.9 and 12.3 mm.
DRAWN = (1, 2)
SD_TICKS_MM = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20)
MISFIT = MISFIT_PERCENT["model"]


@dataclass(frozen=True, eq=False)
class Answers:
    """What the study found.

    Attributes
    ----------
    maps : dict of DesignMaps
        By what was varied, and with ``, same strain noise`` after it.
    calibration : dict of Effort
        By the samples of the touch to be read.
    averaging : dict of Effort
        Without and with the paper's lack of fit.
    pads : dict of PadDesignMaps
        By what was varied.
    """

    maps: dict[str, DesignMaps]
    calibration: dict[int, Effort]
    averaging: dict[str, Effort]
    pads: dict[str, PadDesignMaps]


def answer(small: bool) -> Answers:
    """Ask everything."""
    # Calibration every 3°: enough, and quicker than every degree.
    design = paper_design(edge_step_deg=3.0, flat_step_deg=9.0)
    maps = {}
    for vary, values in VALUES.items():
        some = values[::4] if small else values
        maps[vary] = design_maps(design, vary, some)  # type: ignore[arg-type]  # a key of the table
        if vary in STRAIN and not small:
            maps[f"{vary}, same strain noise"] = design_maps(design, vary, some, noise_of="strain")  # type: ignore[arg-type]  # a key of the table
    steps = (18.0, 6.0) if small else (18.0, 12.0, 9.0, 6.0, 4.5, 3.0, 2.0, 1.0)
    calibration = {samples: calibration_effort(paper_design(), steps, samples=samples) for samples in (1, 20)}
    places = places_deg(design, PLACES)
    averaging = {
        name: averaging_effort(expected_finger(design, lack_of_fit_percent=percent), places)
        for name, percent in (("noise and calibration", 0.0), (f"and {MISFIT:.2f} % lack of fit", MISFIT))
    }
    pads = {
        vary: pad_design_maps(PadDesign(), vary, values[::3] if small else values)  # type: ignore[arg-type]  # a key of the table
        for vary, values in PAD_VALUES.items()
        if not small or vary == "spacing_mm"
    }
    return Answers(maps, calibration, averaging, pads)


def print_maps(name: str, maps: DesignMaps) -> None:
    """One row for each value."""
    indenters = [indenter(r) for r in maps.spots[0].indenters_mm]
    print(f"\n{name}: sd of R (mm) above an element / halfway to the next; rms of θ_c and P; r_c told from an edge")
    print(f"{'':>8s}" + "".join(f"{i:>14s}" for i in indenters) + f"{'θ_c (deg)':>11s}{'P (N/m)':>9s}{'r_c (mm)':>16s}")
    radius, angle, load = maps.sd("R"), maps.rms("theta_c"), maps.rms("P")
    for i, value in enumerate(maps.values):
        cells = "".join(f"{row[0]:7.2f}/{row[-1]:6.2f}" for row in radius[i])
        edge = maps.threshold_mm[i]
        print(f"{value:8.2f}{cells}{angle[i]:11.3f}{load[i]:9.1f}{edge[0]:8.2f}/{edge[-1]:7.2f}")


def print_effort(name: str, effort: Effort) -> None:
    """Standard deviations by count, and what is enough."""
    cells = ", ".join(f"{n}: {sd:.3f}" for n, sd in zip(effort.count, effort.sd, strict=True))
    enough = effort.enough()
    needed = f"from {enough:.0f}" if np.isfinite(enough) else f"with more than {effort.count[-1]} alone"
    print(f"  {name}: {cells}; never below {effort.floor:.3f}; within 10 % of that {needed}")


def name_of(samples: int) -> str:
    return "1 sample" if samples == 1 else f"mean of {samples}"


def draw_effort(side: Any, efforts: dict[str, Effort]) -> None:
    """Standard deviations by count, with their floors and what is enough."""
    for colour, (name, effort) in enumerate(efforts.items()):
        side.plot(effort.count, effort.sd, f"C{colour}.-", label=name)
        side.axhline(effort.floor, color=f"C{colour}", ls=":")
        side.plot(effort.enough(), min(1.1 * effort.floor, effort.sd[0]), "k*", ms=10)
    side.set_xscale("log")
    side.set_xlim(effort.count[0] / 1.2, 1.2 * effort.count[-1])
    plain_ticks(side.xaxis, (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000))
    side.legend()


def picture(folder: Path, found: Answers) -> None:
    """Four maps and two efforts."""
    drawn, axes = figure(3, 2, figsize=(12.5, 7.0))
    sides = axes.ravel()
    for side, vary in zip(sides, VALUES, strict=False):
        for name, style in ((vary, "-"), (f"{vary}, same strain noise", "--")):
            if name not in found.maps:
                continue
            maps = found.maps[name]
            for i in DRAWN:
                radius = maps.spots[0].indenters_mm[i]
                sd = maps.sd("R")[:, i]
                label = indenter(radius) if style == "-" else None
                side.plot(maps.values, sd[:, 0], f"C{i}{style}", label=label)
                side.plot(maps.values, sd[:, -1], f"C{i}{style}", lw=0.8, marker="o", ms=3, mfc="none")
        side.set(xlabel=LABELS[vary], ylabel="sd of R (mm)", yscale="log")
        if vary == "noise_percent":
            side.set_xscale("log")
            plain_ticks(side.xaxis, (0.1, 0.3, 1, 3))
        plain_ticks(side.yaxis, SD_TICKS_MM)
    sides[0].legend(title="above an element;\ncircles: between two", title_fontsize=8)
    sides[0].set_title("dashed: noise that stays the same as a strain")
    draw_effort(sides[4], {name_of(n): effort for n, effort in found.calibration.items()})
    sides[4].set(xlabel="calibration touches (edges and flats)", ylabel="rms sd of R (mm)", ylim=(0, None))
    sides[4].set_title("dotted: calibration without error;\nstar: within 10 % of it")
    draw_effort(sides[5], found.averaging)
    sides[5].set(xlabel="samples averaged", ylabel="rms sd of R (mm)", yscale="log")
    plain_ticks(sides[5].yaxis, SD_TICKS_MM)
    sides[5].set_title("dotted: what no averaging removes;\nstar: within 10 % of it")
    save(drawn, folder, "design_questions")


def for_the_page(found: Answers) -> str:
    """Table of what to build, and how much effort is enough, for the documentation."""
    strain = "noise the same in units of strain"
    rows = [
        ("as it is", "spacing_mm", 1.58),
        ("elements 0.8 mm apart", "spacing_mm", 0.8),
        ("2.5 mm apart", "spacing_mm", 2.5),
        ("1.6 mm deep", "depth_mm", 1.6),
        (f"1.6 mm deep, {strain}", "depth_mm, same strain noise", 1.6),
        (f"3.1 mm deep, {strain}", "depth_mm, same strain noise", 3.1),
        ("noise 0.4 % in place of 1.72 %", "noise_percent", 0.4),
        ("rubber 2.0 mm thick", "thickness_mm", 2.0),
        ("rubber 5.2 mm thick", "thickness_mm", 5.2),
    ]
    lines = []
    for label, vary, value in rows:
        maps = found.maps[vary]
        at = list(maps.values).index(value)
        sd = maps.sd("R")[at]
        tips = [f"{sd[tip, 0]:.2f} / {sd[tip, -1]:.2f}" for tip in DRAWN]
        lines.append([label, *tips, f"{maps.rms('theta_c')[at]:.2f}", f"{maps.rms('P')[at]:.1f}"])
    tips = [indenter(found.maps["spacing_mm"].spots[0].indenters_mm[tip]) for tip in DRAWN]
    head = ["", *(f"R, {tip}: above / between" for tip in tips), "θ_c (degree)", "P (N/m)"]
    enough = [
        *((f"calibration touches, where {name_of(n)} is read", each) for n, each in found.calibration.items()),
        *((f"samples of a touch, {name}", each) for name, each in found.averaging.items()),
    ]
    counts = [[name, _count(each)] for name, each in enough]
    return markdown_table(head, lines) + "\n" + markdown_table(["within 10 % of the best", "count"], counts)


def _count(effort: Effort) -> str:
    enough = effort.enough()
    return f"{enough:.0f}" if np.isfinite(enough) else f"more than {effort.count[-1]}"


def main(small: bool = False, folder: Path | None = None) -> Answers:
    """Print every answer and save the picture."""
    found = answer(small)
    for name, maps in found.maps.items():
        print_maps(name, maps)
    print("\nrms sd of R (mm) by the number of calibration touches")
    for samples, effort in found.calibration.items():
        print_effort(f"touches of {samples} sample{'s' * (samples > 1)}", effort)
    print("rms sd of R (mm) by the number of samples averaged")
    for name, effort in found.averaging.items():
        print_effort(name, effort)
    for name, pads in found.pads.items():
        print(f"\npad, {name}: sd of the location (mm) from an element to halfway to the next, 1 % noise, 1 sample")
        for value, row in zip(pads.values, pads.sd(), strict=True):
            print(f"{value:8.2f}" + "".join(f"{sd:8.3f}" for sd in row))
    if folder is not None:
        picture(folder, found)
    return found


if __name__ == "__main__":
    run_study(main, __doc__, "design_questions.py", for_the_page)
