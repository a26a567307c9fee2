"""How the authors' approximate frictionless model may go from R to a width, and what Table 3 says of each law.

Both contact models of Table 3 read the same touches, so that its columns are data about the law (`width_laws.py`). Each
law is inferred beside the modulus and the tips' errors, with the tip of 3.90 mm as printed and free (`free_tips.py`).
Then the S map of the paper is solved with few coefficients: which widths it would have given the authors.

    python studies/nicolson_fearing/table_3_widths.py [FOLDER] [--small] [--no-pictures] [--docs]
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import _path  # noqa: F401
import numpy as np
from _page import PUBLISHED, markdown_table
from _published import figure, run_study, save

from bayestouch.contact.slope_map import SlopeMap
from nicolson_fearing.free_tips import FreeTips, TipPosterior
from nicolson_fearing.paper_finger import POISSON_RATIO, TIPS_MM
from nicolson_fearing.simulated_fits import HERTZ, R_B, RADII
from nicolson_fearing.table_3_effects import CONTACTS, ODD_TIP, TRUTH, rms_of
from nicolson_fearing.table_3_residual import LOAD_N_PER_MM, squeeze_of_layer, squeezes
from nicolson_fearing.width_laws import CONSTANT, EXACT, LAWS

SCRIPT = "nicolson_fearing/table_3_widths.py"
COEFFICIENTS = (20, 28, 40, 71)
"""n_c of the S map; 28 is the 4.5 cycles/radian that the rubber lets through."""
LEAST_RESOLVED = 3.0  # n_c times the half-angle, `SlopeMap`
HALF_ANGLES = 24


@dataclass(frozen=True)
class Findings:
    """What the study found.

    Attributes
    ----------
    laws : dict
        By name: with the tip of 3.90 mm as printed, and free.
    by_s_map : dict
        By n_c: what the S map takes off Hertz's half-width at each tip (mm); NaN where it resolves no contact.
    """

    laws: dict[str, tuple[TipPosterior, TipPosterior]]
    by_s_map: dict[int, np.ndarray]

    @property
    def modulus_MPa(self) -> float:
        """Posterior mean with the constant law."""
        return self.laws[CONSTANT.name][0].modulus_MPa[0]


def squeeze_of_s_map(coefficients: int, modulus_MPa: float) -> np.ndarray:
    """What the paper's S map takes off the half-width of Hertz at each tip, mm."""
    body = {"core_radius_mm": RADII[0], "outer_radius_mm": R_B, "poisson_ratio": POISSON_RATIO}
    angles = np.geomspace(1.001 * LEAST_RESOLVED / coefficients, 0.5, HALF_ANGLES)
    kappa = []
    for half in angles:
        solved = SlopeMap.for_contact(coefficients, half_angle_rad=float(half), **body)
        # slopes of a tip with R = 1 mm: the load that they need is P R/μ
        kappa.append(abs(solved.load_over_modulus(solved.pressure(R_B * solved.contact_angles))))
    wanted = LOAD_N_PER_MM / modulus_MPa * TRUTH
    return np.asarray(HERTZ.half_width(wanted) - np.interp(wanted, kappa, R_B * angles, left=np.nan))


def rows_of_laws(found: Findings) -> list[list[str]]:
    """Evidence, residuals and parameters of each law, with the odd tip as printed and free."""
    base = [each.log_evidence for each in found.laws[CONSTANT.name]]
    rows = []
    for law in LAWS:
        if law.name not in found.laws:
            continue
        pair = found.laws[law.name]
        cells = [f"{each.log_evidence - b:+.1f}" for each, b in zip(pair, base, strict=True)]
        cells += [", ".join(f"{rms_of(each.residual_mm[i]):.2f}" for each in pair) for i in range(len(CONTACTS))]
        said = "; ".join(
            "{} {:.2f} ({:.2f} to {:.2f})".format(n, *s) for n, s in zip(law.grids, pair[1].of_law, strict=True)
        )
        mu = pair[1].modulus_MPa
        rows.append([law.name, *cells, said, f"{mu[0]:.3f} ({mu[1]:.3f} to {mu[2]:.3f})"])
    return rows


def rows_of_widths(found: Findings) -> list[list[str]]:
    """What is taken off Hertz's half-width at each tip."""
    modulus = found.modulus_MPa
    columns = [*squeezes(modulus), squeeze_of_layer(modulus, TRUTH), *found.by_s_map.values()]
    return [
        [f"{tip:.2f}", *("–" if np.isnan(c[i]) else f"{c[i]:.2f}" for c in columns)] for i, tip in enumerate(TIPS_MM)
    ]


def tables(found: Findings) -> str:
    """The tables for the page."""
    head = ("half-width of the approximate model", "log evidence", "log evidence, 3.90 mm free")
    more = ("Hertz, rms R (mm)", "frictionless, rms R (mm)", "parameters, 3.90 mm free", "μ (MPa)")
    of_map = [f"S map, n_c = {n}" for n in found.by_s_map]
    columns = ("tip (mm)", "Table 3, model", "Table 3, empirical", "exact contact on the layer", *of_map)
    return markdown_table((*head, *more), rows_of_laws(found)) + "\n" + markdown_table(columns, rows_of_widths(found))


def picture(folder: Path, found: Findings) -> None:
    """Widths taken off Hertz's: as the columns show, by the laws, and by the S map."""
    drawn, side = figure(figsize=(7.5, 4.4))
    modulus, fine = found.modulus_MPa, np.linspace(0.02, 9.0, 200)
    kappa = LOAD_N_PER_MM / modulus * fine
    for mark, name, seen in zip("os", ("model", "empirical"), squeezes(modulus), strict=True):
        side.plot(TRUTH, seen, mark, mfc="none", color="k", label=f"Table 3, {name}")
    for i, law in enumerate(law for law in LAWS if law.name in found.laws):
        mean = law.model(*(each[0] for each in found.laws[law.name][1].of_law))
        side.plot(fine, HERTZ.half_width(kappa) - mean.half_width(kappa), color=f"C{i}", label=law.name)
    for mark, (n, taken) in zip("+x1", found.by_s_map.items(), strict=False):
        side.plot(TRUTH, taken, mark, color="0.4", label=f"S map, n_c = {n}")
    side.set(xlabel="R of the tip (mm)", ylabel="half-width below that of Hertz (mm)", ylim=(-0.05, 0.9))
    side.legend(fontsize=7, ncols=2)
    save(drawn, folder, "table_3_widths")


def main(small: bool = False, folder: Path | None = None) -> Findings:
    """Print the tables and save the picture."""
    free = FreeTips.simulated(small)
    laws: dict[str, tuple[TipPosterior, TipPosterior]] = {}
    for law in (EXACT, CONSTANT) if small else LAWS:
        by = replace(free, law=law)
        laws[law.name] = (by.posterior(), by.posterior((ODD_TIP,), [by.between(ODD_TIP)]))
    modulus = laws[CONSTANT.name][0].modulus_MPa[0]
    found = Findings(laws, {n: squeeze_of_s_map(n, modulus) for n in COEFFICIENTS})
    print(tables(found))
    if folder is not None:
        picture(folder, found)
    return found


if __name__ == "__main__":
    run_study(main, __doc__, SCRIPT, tables, PUBLISHED)
