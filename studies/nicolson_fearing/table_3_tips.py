"""Tips of Table 3 that may not have had the radius that is printed: the posterior of a radius from all four columns.

Every column of Table 3 reads the tip of 3.90 mm sharper than its neighbours say, and three the tip of 6.01 mm. Here the
radius of one tip, or of both, is unknown, beside the modulus and the width that the authors squeezed Hertz's contact by
(`table_3_effects.py`). Each of the nine tips is freed in turn, so that it shows whether these stand out. Estimates of
tips of other radii are interpolated between simulated ones, which lie smoothly on a curve.

    python studies/nicolson_fearing/table_3_tips.py [FOLDER] [--small] [--no-pictures] [--docs]
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import _path  # noqa: F401
import numpy as np
from _page import PUBLISHED, markdown_table
from _published import figure, run_study, save

from bayestouch.contact import composite_radius, indenter_radius
from nicolson_fearing.free_tips import CANDIDATES, FreeTips, TipPosterior
from nicolson_fearing.paper_finger import CALIBRATIONS, TIPS_MM
from nicolson_fearing.simulated_fits import R_B
from nicolson_fearing.table_3_effects import CONTACTS, ODD_TIP, rms_of

SCRIPT = "nicolson_fearing/table_3_tips.py"
ODD, NEXT = ODD_TIP, ODD_TIP + 1
INCH_MM = 25.4
#: The one of the inch series 1/16, 1/8, 1/4, 5/16, 3/8, 1/2, 3/4, 1 that no printed radius is close to.
MISSING_MM = INCH_MM / 8
#: By how much the other printed radii are smaller than those of the series: 0.00 to 0.40 mm, 0.15 mm at 25.25 mm.
MACHINED_MM = 0.4


@dataclass(frozen=True)
class Findings:
    """What the study found.

    Attributes
    ----------
    as_printed : TipPosterior
        With no tip free.
    one : dict
        With one tip free, by its row in Table 3.
    cases : dict
        With the tips of 3.90 and 6.01 mm free, and of the inch series.
    columns_mm : (2, 2, 2) array
        r_c that each column alone wants: of the two tips, by contact and calibration, all else as with both free.
    """

    as_printed: TipPosterior
    one: dict[int, TipPosterior]
    cases: dict[str, TipPosterior]
    columns_mm: np.ndarray


def radius_cells(found: TipPosterior, which: int) -> tuple[str, str]:
    """Posterior mean and 90 % interval of a free tip's radius."""
    mean, low, high = found.radius_mm(which)
    return f"{mean:.2f}", f"{low:.2f} to {high:.2f}"


def rows_by_tip(found: Findings) -> list[list[str]]:
    """Posterior of each tip's radius, freed alone, and evidence over the printed ones."""
    base = found.as_printed.log_evidence
    return [
        [
            f"{TIPS_MM[tip]:.2f}",
            *radius_cells(each, 0),
            f"{each.log_evidence - base:+.1f}",
            f"{each.extra_sd_mm:.2f}",
        ]
        for tip, each in found.one.items()
    ]


def rows_of_cases(found: Findings) -> list[list[str]]:
    """Evidence, residuals and unknowns with no, one and both tips free."""
    rows = []
    for name, each in found.cases.items():
        rows.append(
            [
                name,
                f"{each.log_evidence - found.as_printed.log_evidence:+.1f}",
                *(f"{rms_of(each.residual_mm[i]):.2f}" for i in range(len(CONTACTS))),
                f"{each.modulus_MPa[0]:.3f} ({each.modulus_MPa[1]:.3f}–{each.modulus_MPa[2]:.3f})",
                "{:.2f} ({:.2f}–{:.2f})".format(*each.of_law[0]),
                f"{each.extra_sd_mm:.2f}",
            ]
        )
    return rows


def rows_of_columns(found: Findings) -> list[list[str]]:
    """What each column alone wants."""
    return [
        [f"{TIPS_MM[tip]:.2f}", *(f"{each:.2f}" for each in found.columns_mm[i].ravel())]
        for i, tip in enumerate((ODD, NEXT))
    ]


def rows_of_residuals(found: Findings) -> list[list[str]]:
    """Printed minus predicted R by tip, as printed and with the 3.90 mm tip free."""
    before, after = found.as_printed.residual_mm, found.one[ODD].residual_mm
    return [
        [f"{tip:.2f}", *(f"{before[c, k, i]:+.2f} / {after[c, k, i]:+.2f}" for c in range(2) for k in range(2))]
        for i, tip in enumerate(TIPS_MM)
    ]


BOTH = "both free"
COLUMNS = tuple(f"{contact}, {calibration}" for contact in CONTACTS for calibration in CALIBRATIONS)


def tables(found: Findings) -> str:
    """The tables for the page."""
    case_head = ("radii", "log evidence", "Hertz, rms R (mm)", "frictionless, rms R (mm)", "μ (MPa)", "squeeze (mm)")
    return "\n".join(
        [
            markdown_table(
                ("tip that is free (mm)", "r_c (mm)", "90 %", "log evidence over printed", "τ (mm)"), rows_by_tip(found)
            ),
            markdown_table((*case_head, "τ (mm)"), rows_of_cases(found)),
            markdown_table(("r_c (mm) that one column wants", *COLUMNS), rows_of_columns(found)),
            markdown_table(("printed less predicted R (mm), 3.90 / free", *COLUMNS), rows_of_residuals(found)),
        ]
    )


def picture(folder: Path, found: Findings) -> None:
    """Posteriors of the two radii, and evidence by tip."""
    drawn, (left, right) = figure(2, figsize=(10.0, 3.8))
    for i, tip in enumerate((ODD, NEXT)):
        radius = indenter_radius(found.one[tip].choices[0], R_B)
        density = found.one[tip].weight / np.gradient(radius)
        left.plot(radius, density, f"C{i}", label=f"{TIPS_MM[tip]:.2f} mm as printed")
        left.axvline(TIPS_MM[tip], color=f"C{i}", ls=":")
    left.axvline(MISSING_MM, color="0.6", ls="--", label="1/8 inch")
    left.set(xlabel="radius of the tip (mm)", ylabel="posterior density (1/mm)", xlim=(1.5, 8))
    left.legend()
    gain = [each.log_evidence - found.as_printed.log_evidence for each in found.one.values()]
    right.bar(range(len(gain)), gain)
    right.axhline(0, color="0.5", lw=0.8)
    right.set_xticks(range(len(gain)), [f"{TIPS_MM[tip]:g}" for tip in found.one])
    right.set(xlabel="tip that is free (mm)", ylabel="log evidence over the printed radius")
    save(drawn, folder, "table_3_tips")


def main(small: bool = False, folder: Path | None = None) -> Findings:
    """Print the tables and save the picture."""
    free = FreeTips.simulated(small)
    tips = (ODD, NEXT) if small else range(len(TIPS_MM))
    as_printed = free.posterior()
    one = {tip: free.posterior((tip,), [free.between(tip)]) for tip in tips}
    series = composite_radius(np.array([MISSING_MM - MACHINED_MM, MISSING_MM]), R_B)
    cases = {
        "as printed": as_printed,
        "3.90 mm free": one[ODD],
        "6.01 mm free": one[NEXT],
        BOTH: free.posterior((ODD, NEXT), [free.between(tip, CANDIDATES // 3) for tip in (ODD, NEXT)]),
        f"{MISSING_MM:.3f} mm (1/8 inch) for 3.90 mm": free.posterior((ODD,), [series[1:]]),
        f"{MISSING_MM - MACHINED_MM:.3f} to {MISSING_MM:.3f} mm for 3.90 mm": free.posterior(
            (ODD,), [np.linspace(*series, 9)]
        ),
    }
    wanted = np.array([free.wanted_mm(tip, cases[BOTH]) for tip in (ODD, NEXT)])
    found = Findings(as_printed, one, cases, wanted)
    print(tables(found))
    if folder is not None:
        picture(folder, found)
    return found


if __name__ == "__main__":
    run_study(main, __doc__, SCRIPT, tables, PUBLISHED)
