"""Figure 13: estimates of r_c of five tips over location, and whether they err alike.

The paper finds the bias of a location "consistent across indenters" and estimates monotonic at each location. Both as
numbers: the mean correlation of errors of R between tips, and the share of locations where the tips come out in order.
They say of what kind the paper's model error is: the errors that the simulation puts in repeat whenever a place is
touched; were they as large but of every touch its own, neither would come out.
"""

from __future__ import annotations

from pathlib import Path

import _path  # noqa: F401
import numpy as np
from _published import figure, options, print_beside, save

from bayestouch.contact import composite_radius
from bayestouch.paper import published
from bayestouch.reliability import Beside, shared_by_indenters
from nicolson_fearing.paper_finger import CALIBRATIONS, DESIGN, PaperCalibration
from nicolson_fearing.paper_run import PaperRun, indenter_rows, paper_run, runs

TIPS = tuple(n.value for n in published.all_numbers() if n.key.startswith("figure_13.r_c["))


def estimates(run: PaperRun, calibration: PaperCalibration) -> tuple[np.ndarray, np.ndarray]:
    """Locations (n,), and r_c of each tip there (5, n) from averages, mm."""
    found = run.averaged(calibration).indenter_radius_mm
    by_tip = [run.rows([tip]) for tip in TIPS]
    return run.means.angle_deg[by_tip[0]], np.stack([found[some] for some in by_tip])


def monotonic(radii: np.ndarray) -> float:
    """Share of locations where the tips come out in order."""
    return float(np.mean(np.all(np.diff(radii, axis=0) > 0, axis=0)))


def shared(radii: np.ndarray) -> float:
    """Mean correlation of errors of R between tips."""
    outer = DESIGN.outer_radius_mm
    return shared_by_indenters(composite_radius(radii, outer) - composite_radius(TIPS, outer)[:, None])


def rows(run: PaperRun) -> list[Beside]:
    """Settings."""
    samples = run.data.truth["design"]["samples_per_touch"]
    return indenter_rows("figure_13", TIPS, {"n_averaged": samples, "n_radii": len(TIPS)})


def picture(folder: Path, run: PaperRun) -> None:
    """Model based above, empirical below."""
    drawn, axes = figure(1, 2, figsize=(7.5, 5.4), sharex=True, sharey=True)
    for side, calibration in zip(axes, CALIBRATIONS, strict=True):
        angle, radii = estimates(run, calibration)
        for i, (tip, row) in enumerate(zip(TIPS, radii, strict=True)):
            side.plot(angle, row, color=f"C{i}", label=f"{tip:g} mm")
            side.axhline(tip, color=f"C{i}", ls=":", lw=0.8)
        for element in DESIGN.element_angles_deg:
            if angle.min() <= element <= angle.max():
                side.axvline(element, color="0.9", zorder=0)
        side.set(ylabel="$r_c$ (mm)", title=f"{calibration} calibration")
    axes[0].legend(ncols=5, loc="upper center")
    axes[0].set_ylim(0, 23)
    axes[1].set_xlabel("location (degree); grey: elements as designed, dotted: the tips")
    drawn.suptitle("Figure 13: averages of 20, one simulated finger")
    save(drawn, folder, "figure_13")


def print_shared(name: str, found: list[PaperRun], calibration: PaperCalibration) -> tuple[float, float]:
    """Order and correlation, means over the fingers."""
    radii = [estimates(each, calibration)[1] for each in found]
    order, alike = [monotonic(r) for r in radii], [shared(r) for r in radii]
    print(
        f"  {name}: tips in order at {100 * np.mean(order):.0f} % of locations; correlation of errors between tips "
        f"{np.mean(alike):.2f} ({min(alike):.2f} to {max(alike):.2f}, {len(found)} fingers)"
    )
    return float(np.mean(order)), float(np.mean(alike))


def main(small: bool = False, folder: Path | None = None) -> list[Beside]:
    """Print the numbers and save the picture."""
    run = paper_run(0)
    out = rows(run)
    print_beside(out)
    print("\nthe paper: in order at each location, bias consistent across indenters")
    other = [PaperRun.of(0, repeats=False)]
    for calibration in CALIBRATIONS:
        print_shared(f"{calibration} calibration", runs(small), calibration)
        print_shared("    errors that do not repeat", other, calibration)
    if folder is not None:
        picture(folder, run)
    return out


if __name__ == "__main__":
    main(*options(__doc__))
