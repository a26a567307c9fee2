"""What an error of a place is: of every element its own, or of the load, the surface and the core, as rubber allows.

    python studies/nicolson_fearing/place_mixtures.py [FOLDER] [--small] [--no-pictures] [--docs]

`explained` gives every element an error of its own at each place. No rubber makes such errors from a load. Here causes
that act as a load does take their part, one by one and together, and all unknowns are inferred again.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

from dataclasses import dataclass
from pathlib import Path

import _path  # noqa: F401
import numpy as np
from _page import DOCS, markdown_table
from _published import figure, run_study, save

from bayestouch.paper import published
from nicolson_fearing.explained_case import FREE, LENGTH_MM, Case, full
from nicolson_fearing.explained_effects import LOCATION_ROWS, Numbers
from nicolson_fearing.explained_fit import Explanation
from nicolson_fearing.unknowns import OF_SURFACE, Unknowns

PAGE = DOCS / "1995.md"
SCRIPT = "nicolson_fearing/place_mixtures.py"
OWN = "place_error"
SAID = {
    OWN: ("own", "%"),
    "load_by_place": ("load", "%"),
    "push": ("push", "%"),
    "curvature_per_mm": ("curvature", "/mm"),
    "core_mm": ("core", "mm"),
    "fine_map": ("fine maps", "%"),
    "touch_error": ("each touch", "%"),
}
MIXTURES = (
    (OWN,),
    *((OWN, each) for each in OF_SURFACE),
    (OWN, *OF_SURFACE),
    OF_SURFACE,
    ("fine_map",),
    ("fine_map", *OF_SURFACE),
    ("touch_error",),
)


@dataclass(frozen=True, eq=False)
class Mixture:
    """Causes that are free beside the other unknowns, and what the tables say of them."""

    causes: tuple[str, ...]
    case: Case

    @classmethod
    def of(cls, causes: tuple[str, ...], small: bool) -> Mixture:
        """Infer."""
        if causes == (OWN,):
            return cls(causes, full(small))
        rest = tuple(name for name in FREE if name != OWN)
        fixed = Unknowns(length_mm=LENGTH_MM, place_error=0.0)
        return cls(causes, Case.of(Explanation(" + ".join(causes), (*rest, *causes), fixed), small))

    @property
    def name(self) -> str:
        """In words."""
        return " + ".join(SAID[cause][0] for cause in self.causes)

    def amounts(self) -> str:
        """Posterior mean and 90 % interval of each cause."""
        return "; ".join(f"{SAID[name][0]} {self._amount(name)} {SAID[name][1]}" for name in self.causes)

    def _amount(self, name: str) -> str:
        values = self.case.inferred.of_name(name)
        low, high = np.quantile(values, [0.05, 0.95])
        digits = 4 if name == "curvature_per_mm" else 2
        return f"{values.mean():.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"


def for_the_page(found: list[Mixture]) -> str:
    """The table."""
    printed = [", ".join(published.number(key).printed for key in keys) for keys in LOCATION_ROWS.values()]
    rows = [["printed", "", "", "", "", "", *printed, ""]]
    least = found[0].case.inferred.log_evidence
    for each in found:
        numbers = Numbers.of(each.case.fingers)
        *_, of_elements, of_tips, of_errors, alike = numbers.of_effect()
        evidence = f"{each.case.inferred.log_evidence - least:+.0f}"
        locations = [numbers.row_of_table_4("location", k) for k in LOCATION_ROWS]
        agree = [of_elements, of_tips, of_errors]
        rows.append([each.name, evidence, each.amounts(), *agree, *locations, alike])
    head = ("errors of a place", "log evidence", "amounts", "Tables 1, 2 agree", "Table 3 agree", "Table 4 agree")
    more = [f"location, {name}: θ_c (degree), P (N/m), R (mm)" for name in LOCATION_ROWS]
    return markdown_table((*head, *more, "Figure 13: shared; in order (model, empirical)"), rows)


def picture(folder: Path, found: list[Mixture]) -> None:
    """Evidence of each mixture, and the location rows of R as single fingers have them."""
    drawn, (left, right) = figure(2, figsize=(11.0, 0.35 * len(found) + 1.6), sharey=True)
    row = np.arange(len(found))
    least = found[0].case.inferred.log_evidence
    left.barh(row, [each.case.inferred.log_evidence - least for each in found])
    left.set_yticks(row, [each.name for each in found])
    left.invert_yaxis()
    left.set(xlabel="log evidence over the first (nats)", title="what an error of a place is")
    for i, (calibration, keys) in enumerate(LOCATION_ROWS.items()):
        colour = f"C{i}"
        values = np.array([np.quantile(each.case.fingers.column(keys[-1]), [0.05, 0.5, 0.95]) for each in found])
        bars = np.abs(values[:, [0, 2]] - values[:, [1]]).T
        right.errorbar(values[:, 1], row + 0.2 * i - 0.1, xerr=bars, fmt="o", ms=4, color=colour, label=calibration)
        right.axvline(published.number(keys[-1]).value, color=colour, ls=":")
    right.set(xlabel="sd of R by location (mm); dotted: Table 4", title="90 % of fingers")
    right.legend(title="calibration")
    save(drawn, folder, "place_mixtures")


def main(small: bool = False, folder: Path | None = None) -> list[Mixture]:
    """Print the table and save the picture."""
    found = [Mixture.of(causes, small) for causes in ((OF_SURFACE,) if small else MIXTURES)]
    print(for_the_page(found))
    if folder is not None:
        picture(folder, found)
    return found


if __name__ == "__main__":
    run_study(main, __doc__, SCRIPT, for_the_page, PAGE)
