"""Table 3: mean estimates of r_c over 40 degrees, by two contact models and both calibrations, of simulated fingers.

Tips are pressed by the exact contact on the bonded layer and read by Hertz and by the approximate frictionless model,
at the modulus that the printed Hertz columns imply (`table_3_modulus.py` infers it, with errors by column).
"""

from __future__ import annotations

from pathlib import Path
from time import perf_counter

import _path  # noqa: F401
import numpy as np
from _published import figure, options, print_beside, rms, save

from bayestouch.contact import composite_radius
from bayestouch.paper import published
from bayestouch.paper.published import TABLE_3
from bayestouch.paper.simplex import fit_touch
from bayestouch.reliability import Beside
from nicolson_fearing.paper_finger import CALIBRATIONS, DESIGN, PaperCalibration
from nicolson_fearing.paper_run import CONTACT, TABLE_4_TIPS, PaperRun, over_fingers, put_in, runs

CONTACTS = {"hertz": "hertz", "frictionless": CONTACT}
WHY = {
    "hertz": "the modulus is fitted to both Hertz columns together; published.md has the residuals of single tips",
    "frictionless": "here this model is an elliptic pressure as wide as the contact on the layer. So the bias of r_c "
    "is small. The paper's r_c of sharp and of blunt tips are biased, as if its contact were a Hertz contact minus "
    "a fixed width (table_3_residual.py)",
}
WHY_TIME = "one simplex fit in Python, machine of today; measured anew at each run"
#: An estimate counts as unbiased within this share of the tip's radius.
UNBIASED = 0.1


def mean_radius(run: PaperRun, tip: float, contact: str, calibration: PaperCalibration) -> float:
    """Mean estimate of r_c over the locations, mm."""
    return float(run.averaged(calibration, CONTACTS[contact]).indenter_radius_mm[run.rows([tip])].mean())


def seconds(run: PaperRun, touches: int) -> tuple[float, float]:
    """Median time of one simplex fit, without and with the load."""
    finger = run.finger.reader("model", CONTACT, run.modulus)
    some = np.flatnonzero(run.rows(TABLE_4_TIPS))[:: max(1, 240 // touches)]
    took = []
    for load in (None, DESIGN.load_range[0]):
        each = []
        for row in some:
            start = perf_counter()
            fit_touch(finger, run.means.readings[row], load=load)
            each.append(perf_counter() - start)
        took.append(float(np.median(each)))
    return took[0], took[1]


def unbiased_to(found: list[PaperRun]) -> float:
    """Largest tip of the table whose mean is within a tenth of its radius (model calibration), and all sharper ones."""
    good = [
        abs(np.mean([mean_radius(run, row.r_c, "frictionless", "model") for run in found]) / row.r_c - 1) < UNBIASED
        for row in TABLE_3[1:]  # at 0.5 mm a tenth is less than the error of a mean
    ]
    count = good.index(False) if False in good else len(good)
    return TABLE_3[count].r_c


def rows(found: list[PaperRun], timed: int = 24) -> list[Beside]:
    """All numbers of the table, and of the text about it."""
    out = []
    for tip in TABLE_3:
        name = f"table_3[{tip.r_c:.2f}]"
        out.append(put_in(f"{name}.r_c", tip.r_c))
        for contact in CONTACTS:
            for calibration in CALIBRATIONS:
                out.append(
                    over_fingers(
                        f"{name}.{contact}_{calibration}",
                        lambda run, t=tip.r_c, c=contact, k=calibration: mean_radius(run, t, c, k),
                        found,
                        WHY[contact],
                    )
                )
    places = len(np.unique(found[0].means.angle_deg))
    without, with_load = seconds(found[0], timed)
    return [
        *out,
        put_in("table_3.range", places * DESIGN.touch_step_deg),
        put_in("table_3.n_indenters", len(TABLE_3)),
        Beside(
            "table_3.unbiased_to",
            unbiased_to(found),
            why="from 1.59 mm up to this tip, all means are within a tenth of r_c (frictionless, "
            "model calibration); see the rows of Table 3",
        ),
        Beside("fit_time.without_load", without, why=WHY_TIME),
        Beside("fit_time.with_load", with_load, why=WHY_TIME),
    ]


def errors_in_r(found: list[PaperRun]) -> dict[str, tuple[float, float]]:
    """Root mean square error of R over the nine tips, by column: of the printed means, and of ours (mm)."""
    truth = composite_radius([row.r_c for row in TABLE_3], DESIGN.outer_radius_mm)
    out = {}
    for contact in CONTACTS:
        for calibration in CALIBRATIONS:
            printed = [getattr(row, f"{contact}_{calibration}") for row in TABLE_3]
            ours = [np.mean([mean_radius(run, row.r_c, contact, calibration) for run in found]) for row in TABLE_3]
            errors = [rms(composite_radius(each, DESIGN.outer_radius_mm) - truth) for each in (printed, ours)]
            out[f"{contact}, {calibration} calibration"] = (errors[0], errors[1])
    return out


def picture(folder: Path, out: list[Beside]) -> None:
    """Printed and simulated means over the tip's radius."""
    by_key = {row.key: row for row in out}
    radii = np.array([row.r_c for row in TABLE_3])
    drawn, axes = figure(2, sharey=True)
    for side, contact in zip(axes, CONTACTS, strict=True):
        side.plot(radii, radii, ":", color="0.5", label="the tip's own")
        for i, calibration in enumerate(CALIBRATIONS):
            found = [by_key[f"table_3[{r:.2f}].{contact}_{calibration}"] for r in radii]
            ours, low, high = (np.array([getattr(row, n) for row in found]) for n in ("ours", "low", "high"))
            reach = None if np.isnan(low).any() else np.abs([ours - low, high - ours])
            side.errorbar(radii, ours, reach, color=f"C{i}", capsize=2, label=f"simulated, {calibration} calibration")
            printed = [published.number(row.key).value for row in found]
            side.plot(radii, printed, "os"[i], color=f"C{i}", mfc="none", label=f"printed, {calibration} calibration")
        side.set(
            xlabel="$r_c$ of the tip (mm)",
            ylabel="mean estimate of $r_c$ (mm)",
            title=f"Table 3: {CONTACTS[contact].capitalize()} contact",
        )
        side.legend()
    save(drawn, folder, "table_3")


def main(small: bool = False, folder: Path | None = None) -> list[Beside]:
    """Print the numbers and save the picture."""
    found = runs(small)
    out = rows(found)
    print_beside(out)
    print("\nroot mean square error of R over the nine tips (mm): printed, simulated")
    for name, (printed, ours) in errors_in_r(found).items():
        print(f"  {name:40s} {printed:.2f} {ours:.2f}")
    if folder is not None:
        picture(folder, out)
    return out


if __name__ == "__main__":
    main(*options(__doc__))
