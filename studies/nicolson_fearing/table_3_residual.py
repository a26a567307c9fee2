"""What explains the residuals of Tables 1 and 3, and what does not.

The Hertz columns of Table 3 are explained by the rigid core and one modulus (`table_3_modulus.py`). The columns of the
"approximate frictionless" model are still biased: sharp tips are read too blunt, blunt ones too sharp. And Table 1 fits
elements at 10.3 mm on average that were designed at 9.9 mm. Here each effect that might do this is simulated on its
own, with the modulus and the squeeze of the authors' approximate model inferred anew, and compared by what it leaves of
Table 3 (root mean square in R over nine tips and both calibrations) and by its evidence.

    python studies/nicolson_fearing/table_3_residual.py [folder for pictures] [--small]
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import _path  # noqa: F401
import numpy as np
from _published import figure, options, plain_ticks, save

from bayestouch.paper.published import TABLE_1, number
from nicolson_fearing.paper_finger import CALIBRATIONS, TIPS_MM
from nicolson_fearing.simulated_fits import HERTZ, SimulatedFits, simulate_fits
from nicolson_fearing.table_3_effects import (
    CASES,
    LAYER,
    LINEAR_NAME,
    MODULI_MPA,
    ODD_TIP,
    PLACEMENT_SD_MM,
    SQUEEZES_MM,
    TRUTH,
    Explanation,
    explain,
    rms_of,
    table_3,
)

LOAD_N_PER_MM = number("touches.load").value / 1000
#: The modulus at which both numbers of Figure 4 come out as printed (`figure_4.py`): the one the authors had.
FIGURE_4_MPA = 0.054
FINITE, LENGTH = "finite strain, 9.9 mm", "tips 4 mm long, σ 0.49"
SMALL_CASES = (LINEAR_NAME, FINITE)
# Fingers and errors for the means; with others, log evidences against the base change by 0.5. And for covariances.
MEANS, COVARIANCE = (2, 4), (4, 10)


@dataclass(frozen=True)
class Findings:
    """What the study found.

    Attributes
    ----------
    printed : dict
        Root mean square error in R (mm) of the printed columns by contact, before anything.
    printed_but_one : dict
        The same without the odd tip.
    rigid_core : Explanation
        Tips pressed and read by the exact contact on the layer.
    effects : dict
        By case.
    """

    printed: dict[str, float]
    printed_but_one: dict[str, float]
    rigid_core: Explanation
    effects: dict[str, Explanation]


def squeezes(modulus_MPa: float) -> np.ndarray:
    """Half-width (mm) that the second contact model takes off that of Hertz at the same reading, (2, tips).

    Both models fit one ellipse to a touch: what they call its radius tells how they go from width to radius.
    """
    widths = HERTZ.half_width(LOAD_N_PER_MM / modulus_MPa * table_3())
    return np.asarray(widths[1] - widths[0])


def squeeze_of_layer(modulus_MPa: float, radius_mm: np.ndarray) -> np.ndarray:
    """What the rigid core takes off the half-width of Hertz (mm) at composite radii (mm)."""
    kappa = LOAD_N_PER_MM / modulus_MPa * radius_mm
    return np.asarray(HERTZ.half_width(kappa) - LAYER.half_width(kappa))


def print_squeezes(modulus_MPa: float) -> None:
    """The authors' squeeze, from their columns alone."""
    seen, layer = squeezes(modulus_MPa), squeeze_of_layer(modulus_MPa, TRUTH)
    print(f"Half-width (mm) that the approximate frictionless model takes off that of Hertz, at {modulus_MPa:.3f} MPa")
    print(f"{'tip (mm)':>10s}{'model':>10s}{'empirical':>11s}{'rigid core':>12s}")
    for tip, a, b, c in zip(TIPS_MM, *seen, layer, strict=True):
        print(f"{tip:10.2f}{a:10.2f}{b:11.2f}{c:12.2f}")
    print(
        "A width that does not vanish with the contact reads sharp tips too blunt; too little reads blunt ones sharp.\n"
    )


def rows(found: Findings) -> list[tuple[str, ...]]:
    """Cells of the table: what is assumed, rms of each contact, μ, squeeze, Table 1, evidences."""
    out = [
        (
            "as printed",
            *(f"{found.printed[c]:.2f}" for c in found.printed),
            f"{found.printed_but_one['frictionless']:.2f}",
        )
    ]
    out[0] += ("",) * 6
    for name, e in {"rigid core, read by its exact contact": found.rigid_core, **found.effects}.items():
        squeeze = (
            "exact"
            if np.isnan(e.squeeze_mm[0])
            else f"{e.squeeze_mm[0]:.2f} ({e.squeeze_mm[1]:.2f}–{e.squeeze_mm[2]:.2f})"
        )
        label = "the authors' squeeze inferred: base" if name == LINEAR_NAME else name
        out.append(
            (
                label,
                f"{e.rms('hertz'):.2f}",
                f"{e.rms('frictionless'):.2f}",
                f"{e.rms('frictionless', all_tips=False):.2f}",
                f"{e.modulus_MPa[0]:.3f} ({e.modulus_MPa[1]:.3f}–{e.modulus_MPa[2]:.3f})",
                squeeze,
                f"{e.fitted[0]:.2f}",
                f"{e.fitted[1]:.1f}",
                f"{e.log_evidence - found.effects[LINEAR_NAME].log_evidence:+.1f}",
                f"{e.log_evidence_as_designed - found.effects[LINEAR_NAME].log_evidence:+.1f}",
            )
        )
    return out


HEADINGS = (
    "what is true",
    "Hertz, rms R (mm)",
    "frictionless, rms R (mm)",
    "without the 3.9 mm tip",
    "μ (MPa)",
    "squeeze (mm)",
    "σ fitted",
    "r_s fitted (mm)",
    "log evidence",
    "elements at 9.9 mm",
)


def markdown(found: Findings) -> str:
    """The table for the documentation."""
    lines = [HEADINGS, ("---",) * len(HEADINGS), *rows(found)]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines) + "\n"


def print_rows(found: Findings) -> None:
    """The table for a terminal."""
    widths = (38, 7, 7, 7, 22, 18, 6, 6, 7, 7)
    short = ("", "Hertz", "frictl.", "less 1", "μ (MPa)", "squeeze (mm)", "σ", "r_s", "log ev", "at 9.9")
    print("Root mean square of printed minus predicted R (mm): Hertz columns, frictionless columns, these without the")
    print(
        "tip of 3.9 mm; posterior of μ and squeeze; Table 1 as predicted with elements built at 9.9 mm (paper: 0.46 and"
    )
    print(f"10.3 mm); log evidence over the base, with elements within {PLACEMENT_SD_MM:g} mm of 9.9 mm, or just there")
    for cells in (short, *rows(found)):
        print(cells[0].ljust(widths[0]) + "".join(c.rjust(w + 1) for c, w in zip(cells[1:], widths[1:], strict=True)))


def print_residuals(found: Findings) -> None:
    """By tip."""
    base = found.effects[LINEAR_NAME]
    print("\nPrinted minus predicted R (mm) of the frictionless columns, by tip; last, of the Hertz columns")
    print(
        f"(the tip of {TIPS_MM[ODD_TIP]:g} mm is read too sharp in all four columns, which nothing smooth in R can do)"
    )
    columns = {
        "as printed": table_3()[1] - TRUTH,
        "rigid core": found.rigid_core.residual[1],
        "base": base.residual[1],
        "base, Hertz": base.residual[0],
    }
    print(f"{'tip (mm)':>10s}" + "".join(f"{f'{name}, {c}':>24s}" for name in columns for c in CALIBRATIONS))
    for i, tip in enumerate(TIPS_MM):
        print(f"{tip:10.2f}" + "".join(f"{c[i]:24.2f}" for pair in columns.values() for c in pair))


def picture(folder: Path, found: Findings, fits: dict[str, SimulatedFits]) -> None:
    """The squeeze seen in the columns, the residual before and after, and Table 1's sensing radius."""
    drawn, (left, middle, right) = figure(3, figsize=(13.0, 4.2))
    base = found.effects[LINEAR_NAME]
    modulus, squeeze = base.modulus_MPa[0], base.squeeze_mm
    fine = np.linspace(0.0, 9.0, 100)
    left.axhspan(*squeeze[1:], color="C2", alpha=0.2, label="constant, inferred")
    left.plot(fine, squeeze_of_layer(modulus, fine), "k", label="rigid core, exact")
    for mark, calibration, seen in zip("os", CALIBRATIONS, squeezes(modulus), strict=True):
        left.plot(TRUTH, seen, mark, label=f"Table 3, {calibration}")
    left.set(xlabel="R of the tip (mm)", ylabel="half-width below that of Hertz (mm)", ylim=(0, None))
    left.set_title("what the authors' model squeezes")
    left.legend()
    middle.axhline(0, color="0.7")
    styles = {"as printed": ":", "rigid core, exact": "--", "authors' squeeze": "-"}
    residuals = (table_3()[1] - TRUTH, found.rigid_core.residual[1], base.residual[1])
    for (name, style), residual in zip(styles.items(), residuals, strict=True):
        for i, calibration in enumerate(CALIBRATIONS):
            middle.plot(TRUTH, residual[i], f"C{i}{style}", marker="os"[i], ms=4, label=f"{name}, {calibration}")
    middle.set(xlabel="R of the tip (mm)", ylabel="printed minus predicted R (mm)", title="frictionless columns")
    middle.legend(loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=2)
    for name in fits:
        if "9.9" in name or name == FINITE:
            right.plot(MODULI_MPA, fits[name].elements[:, 1], "o-", ms=3, label=name)
    printed_radius = TABLE_1[1].average
    right.axhspan(printed_radius - 0.08, printed_radius + 0.08, color="0.85", label="Table 1")
    right.axvspan(*base.modulus_MPa[1:], color="C2", alpha=0.15, label="μ of Table 3")
    right.set(xscale="log", xlabel="μ (MPa)", ylabel="mean r_s that edges fit (mm)", title="elements built at 9.9 mm")
    plain_ticks(right.xaxis, (0.05, 0.1, 0.2))
    right.legend(loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=2)
    save(drawn, folder, "table_3_residual")


def main(small: bool = False, folder: Path | None = None) -> Findings:
    """Print the table and save it and the picture."""
    fingers, errors = (1, 3) if small else MEANS
    moduli = MODULI_MPA[::2] if small else MODULI_MPA
    readers = SQUEEZES_MM[::3] if small else SQUEEZES_MM
    fits = {
        name: simulate_fits(moduli, CASES[name], fingers=fingers, errors=errors)
        for name in (SMALL_CASES if small else CASES)
    }
    many = (1, 8) if small else COVARIANCE
    base = simulate_fits(moduli, CASES[LINEAR_NAME], fingers=many[0], errors=many[1])
    effects = {name: explain(fits[name], CASES[name], base, readers=readers) for name in fits}
    effects["mean of R in place of r_c"] = explain(
        fits[LINEAR_NAME], CASES[LINEAR_NAME], base, readers=readers, average="R"
    )
    for name in fits:
        if name in (LINEAR_NAME, FINITE, LENGTH):
            read, read_base = (each.read_with(FIGURE_4_MPA) for each in (fits[name], base))
            what = f"{name}, read with {FIGURE_4_MPA:g} MPa"
            effects[what] = explain(read, CASES[name], read_base, readers=readers)
    off = {contact: table_3()[i] - TRUTH for i, contact in enumerate(("hertz", "frictionless"))}
    found = Findings(
        {contact: rms_of(each) for contact, each in off.items()},
        {contact: rms_of(each, all_tips=False) for contact, each in off.items()},
        explain(fits[LINEAR_NAME], CASES[LINEAR_NAME], base, readers=None),
        effects,
    )
    print_squeezes(effects[LINEAR_NAME].modulus_MPa[0])
    print_rows(found)
    print_residuals(found)
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "table_3_residual.md").write_text(markdown(found), encoding="utf-8")
        if not small:
            picture(folder, found, fits)
    return found


if __name__ == "__main__":
    main(*options(__doc__))
