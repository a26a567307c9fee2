"""What each effect is worth, in the numbers of the paper: before, with all effects, and with each taken away.

Before is the comparison's first simulation (`compare_published`): long tips, one modulus, and errors as large as
Tables 1 and 2 say. Tables are for docs/1995.md, made by `explained`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from _page import markdown_table

from bayestouch.contact import composite_radius
from bayestouch.paper import published
from bayestouch.reliability import Beside, PublishedComparison
from nicolson_fearing import compare_published, figure_13
from nicolson_fearing.explained_fingers import THRESHOLDS, ExplainedFingers
from nicolson_fearing.explained_fit import KEYS, OF_TIPS
from nicolson_fearing.linear_touches import R_B
from nicolson_fearing.paper_design import MODULUS_INTERVAL, SHEAR_MODULUS
from nicolson_fearing.paper_finger import CALIBRATIONS
from nicolson_fearing.paper_run import runs

BEFORE = "without any (before)"
_ROWS = [(part, calibration) for part in ("location", "noise") for calibration in CALIBRATIONS]
_DIGITS = {"theta_c": 2, "P": 1, "R": 2}
LOCATION_ROWS = {k: [f"table_4.{k}.location.{name}" for name in _DIGITS] for k in CALIBRATIONS}
_OUTSIDE = "\\*"


@dataclass(frozen=True, eq=False)
class Numbers:
    """What a simulation says of the paper's numbers.

    Attributes
    ----------
    rows : dict
        By key.
    alike, order : pairs of float
        Figure 13: mean correlation of errors of R between tips, and share of the places in order; by calibration.
    """

    rows: Mapping[str, Beside]
    alike: tuple[float, ...]
    order: tuple[float, ...]

    @classmethod
    def of(cls, fingers: ExplainedFingers) -> Numbers:
        """Of single fingers under an explanation."""
        rows = {row.key: row for row in (*fingers.rows(), *fingers.thresholds, *fingers.text())}
        return cls(rows, *(tuple(each.mean(axis=0)) for each in fingers.shared))

    @classmethod
    def before(cls, small: bool) -> Numbers:
        """Of the comparison's first simulation."""
        some = [[figure_13.estimates(run, k)[1] for k in CALIBRATIONS] for run in runs(small)]
        of = [np.array([[measure(each) for each in pair] for pair in some]).mean(axis=0) for measure in _MEASURES]
        return cls({row.key: row for row in comparison(small).rows}, tuple(of[0]), tuple(of[1]))

    def count(self, *tables: str) -> str:
        """How many numbers of some tables agree."""
        some = [self.rows[key].agrees for key in KEYS if key.startswith(tables)]
        return f"{sum(some)} of {len(some)}"

    def rms(self, contact: str) -> float:
        """Root mean square of printed less expected composite radii of a contact's columns, mm."""
        some = [self.rows[key] for key, of_tip in zip(KEYS, OF_TIPS, strict=True) if of_tip and f".{contact}_" in key]
        both = np.array([[row.paper.value, row.ours] for row in some])
        return float(np.sqrt(np.mean(np.diff(composite_radius(both, R_B), axis=1) ** 2)))

    def of_effect(self) -> list[str]:
        """Cells about Tables 1 to 4 and Figure 13."""
        alike = ", ".join(f"{x:.2f}" for x in self.alike)
        order = ", ".join(f"{100 * x:.0f}" for x in self.order)
        counts = [self.count("table_1", "table_2"), self.count("table_3"), self.count("table_4")]
        return [*(f"{self.rms(contact):.2f}" for contact in ("hertz", "frictionless")), *counts, f"{alike}; {order} %"]

    def row_of_table_4(self, part: str, calibration: str) -> str:
        """θ_c, P and R of one row; marked where the printed number is outside."""
        return ", ".join(_marked(self.rows[f"table_4.{calibration}.{part}.{n}"], d) for n, d in _DIGITS.items())

    def of_table_4(self) -> list[str]:
        """Cells with the numbers of Table 4, and of Figure 4; marked where the printed number is outside."""
        cells = [self.row_of_table_4(part, k) for part, k in _ROWS]
        return [*cells, ", ".join(_marked(self.rows[key], d) for key, d in zip(THRESHOLDS, (1, 2), strict=True))]


_MEASURES = (figure_13.shared, figure_13.monotonic)


@lru_cache(maxsize=2)
def comparison(small: bool) -> PublishedComparison:
    """All printed numbers beside the first simulation."""
    return compare_published.compared(small)


def agreeing(numbers: Numbers, small: bool) -> str:
    """How many of all printed numbers that are no settings agree; those that effects do not change are as before."""
    rows = [numbers.rows.get(row.key, row) for row in comparison(small).predicted]
    return f"{sum(row.agrees for row in rows)} of {len(rows)}"


def _marked(row: Beside, digits: int) -> str:
    return f"{row.ours:.{digits}f}{'' if row.agrees else _OUTSIDE}"


def effects_table(found: Mapping[str, tuple[Numbers, str, str]]) -> str:
    """What each effect is worth: numbers, log evidence and modulus by the effect that is taken away."""
    rows = [[name, evidence, modulus, *each.of_effect()] for name, (each, evidence, modulus) in found.items()]
    head = ("effect taken away", "log evidence", "μ (MPa)", "Hertz, rms R (mm)", "frictionless, rms R (mm)")
    more = ("Tables 1, 2 agree", "Table 3 agree", "Table 4 agree", "Figure 13: shared; in order (model, empirical)")
    return markdown_table((*head, *more), rows)


def numbers_table(found: Mapping[str, Numbers], small: bool) -> str:
    """Table 4's location and noise rows, Figure 4's thresholds, and how many of all numbers agree."""
    printed = [", ".join(published.number(f"table_4.{k}.{part}.{n}").printed for n in _DIGITS) for part, k in _ROWS]
    printed.append(", ".join(published.number(key).printed for key in THRESHOLDS))
    rows = [["printed", *printed, ""]]
    rows += [[name, *each.of_table_4(), agreeing(each, small)] for name, each in found.items()]
    names = [f"{part}, {k}: θ_c (degree), P (N/m), R (mm)" for part, k in _ROWS]
    return markdown_table(("effect taken away", *names, "Figure 4: noise (%), r_c/r_b", "all that agree"), rows)


def before_of(small: bool) -> tuple[Numbers, str, str]:
    """The row before, without an evidence: nothing was inferred with it."""
    low, high = MODULUS_INTERVAL
    return Numbers.before(small), "–", f"{SHEAR_MODULUS:.3f} ({low:.3f} to {high:.3f})"
