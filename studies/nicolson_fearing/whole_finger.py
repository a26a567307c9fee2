"""Fingers of the paper simulated whole, every fit searched for, beside the same fingers to first order.

    python studies/nicolson_fearing/whole_finger.py [FOLDER] [--small] [--docs]

Elements, errors, noise and tips are the same random numbers for both (`searched_finger`, `linear_finger`). Some fingers
are at the posterior means of `explained`; others at draws of its posterior say how many of the paper's numbers agree.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

from dataclasses import dataclass
from pathlib import Path

import _path  # noqa: F401
import numpy as np
from _page import DOCS, markdown_table
from _published import run_study

from bayestouch.contact import indenter_radius
from bayestouch.paper import published
from bayestouch.paper.published import TABLE_3
from bayestouch.reliability import shared_by_indenters
from nicolson_fearing import figure_13
from nicolson_fearing.explained_case import full, posterior_mean
from nicolson_fearing.explained_effects import Numbers
from nicolson_fearing.explained_fingers import ExplainedFingers, first_order
from nicolson_fearing.finger_errors import OF_TABLE_3, FloatArray, Tables
from nicolson_fearing.linear_touches import R_B
from nicolson_fearing.paper_finger import CALIBRATIONS
from nicolson_fearing.paper_run import TIPS_MM
from nicolson_fearing.searched_finger import SearchedFinger
from nicolson_fearing.unknowns import Unknowns

PAGE = DOCS / "1995.md"
SCRIPT = "nicolson_fearing/whole_finger.py"
FINGERS, DRAWN = 3, 60
PARTS = ("total", "location", "noise")
KINDS = ("first order", "searched for")
FIGURE_13 = [TIPS_MM.index(tip) for tip in figure_13.TIPS]


def searched(seed: int, unknowns: Unknowns, draw: int) -> Tables:
    """A finger whose fits are all searched for."""
    return SearchedFinger.of(seed, unknowns, draw).tables()


@dataclass(frozen=True, eq=False)
class Findings:
    """Tables of single fingers to first order and searched for, and what agrees on fingers at draws of the posterior.

    Attributes
    ----------
    fingers : tuple of pairs of Tables
        At the posterior means.
    drawn : pair of Numbers
        Of fingers at draws.
    """

    fingers: tuple[tuple[Tables, Tables], ...]
    drawn: tuple[Numbers, Numbers]


def shown(values: FloatArray, digits: tuple[int, ...] = (2, 2, 2)) -> str:
    """Some numbers, one after the other."""
    return ", ".join(f"{value:.{d}f}" for value, d in zip(values, digits, strict=True))


def numbers(tables: Tables) -> list[str]:
    """Tables 1, 2 and 4, and Figure 13, a cell each."""
    of_elements = [np.array([e.min(), e.mean(), e.max()]) for e in (tables.errors_1, tables.errors_2)]
    shared = [shared_by_indenters(each[FIGURE_13]) for each in tables.radius_errors]
    rows = [row for calibration in tables.table_4 for row in calibration]
    return [*map(shown, of_elements), *(shown(row, (2, 1, 2)) for row in rows), shown(np.array(shared), (2, 2))]


def printed_numbers() -> list[str]:
    """The same of the paper."""
    of_elements = [[f"table_{t}.error.{end}" for end in ("min", "avg", "max")] for t in (1, 2)]
    of_touches = [[f"table_4.{k}.{part}.{n}" for n in ("theta_c", "P", "R")] for k in CALIBRATIONS for part in PARTS]
    return [*(", ".join(published.number(key).printed for key in keys) for keys in (*of_elements, *of_touches)), ""]


def of_numbers(found: Findings) -> str:
    """Tables 1, 2 and 4 of the fingers at the posterior means."""
    names = ["Table 1: errors, smallest, mean, largest (%)", "Table 2: the same (%)"]
    names += [f"Table 4, {k}, {part}: θ_c (degree), P (N/m), R (mm)" for k in CALIBRATIONS for part in PARTS]
    names += ["Figure 13: shared by tips (model, empirical)"]
    columns = [printed_numbers(), *(numbers(tables) for both in found.fingers for tables in both)]
    head = [f"finger {i}, {kind}" for i in range(len(found.fingers)) for kind in KINDS]
    return markdown_table(("", "printed", *head), zip(names, *columns, strict=True))


def of_tips(found: Findings) -> str:
    """Table 3 of the first finger, and how far R differs on all."""
    first, whole = (indenter_radius(t.table_3.reshape(4, -1), R_B) for t in found.fingers[0])
    rows = [
        [f"{row.r_c:.2f} mm", *(f"{a:.2f}, {b:.2f}" for a, b in zip(first[:, i], whole[:, i], strict=True))]
        for i, row in enumerate(TABLE_3)
    ]
    for i, (a, b) in enumerate(found.fingers):
        off = np.sqrt(((b.table_3 - a.table_3) ** 2).mean(axis=-1)).ravel()
        rows.append([f"finger {i}: rms difference of R (mm)", *(f"{each:.2f}" for each in off)])
    for i, both in enumerate(found.fingers):
        rows.append([f"finger {i}: errors of R of the averages", "", "", *(alike(*pair) for pair in errors_of(both))])
    kinds = [f"{contact}, {k}" for contact in ("Hertz", "frictionless") for k in CALIBRATIONS]
    return markdown_table(("Table 3 of finger 0: r_c (mm), first order, searched for", *kinds), rows)


def errors_of(both: tuple[Tables, Tables]) -> list[tuple[FloatArray, FloatArray]]:
    """Errors of R (mm) of the averages of round tips by both ways; a pair a calibration."""
    a, b = (each.radius_errors[:, OF_TABLE_3].reshape(2, -1) for each in both)
    return list(zip(a, b, strict=True))


def alike(first: FloatArray, whole: FloatArray) -> str:
    """Their correlation, sizes and difference."""
    sizes = (first.std(), whole.std(), (whole - first).std())
    return f"correlation {np.corrcoef(first, whole)[0, 1]:.2f}; sd {shown(np.array(sizes))}"


def of_agreement(found: Findings) -> str:
    """What agrees with single fingers at draws of the posterior."""
    head = ("fingers at draws", "Hertz, rms R (mm)", "frictionless, rms R (mm)", "Tables 1, 2 agree", "Table 3 agree")
    rows = [[kind, *each.of_effect()] for kind, each in zip(KINDS, found.drawn, strict=True)]
    return markdown_table((*head, "Table 4 agree", "Figure 13: shared; in order (model, empirical)"), rows)


def for_the_page(found: Findings) -> str:
    """All tables."""
    return "\n".join([of_numbers(found), of_tips(found), of_agreement(found)])


def main(small: bool = False, folder: Path | None = None) -> Findings:
    """Print the tables; write them in the folder given."""
    at = posterior_mean(small)
    ways = (first_order, searched)
    fingers = tuple(tuple(way(seed, at, 0) for way in ways) for seed in range(1 if small else FINGERS))
    drawn = [Numbers.of(ExplainedFingers.of(full(small).inferred, 3 if small else DRAWN, way)) for way in ways]
    found = Findings(tuple((a, b) for a, b in fingers), (drawn[0], drawn[1]))
    tables = for_the_page(found)
    print(tables)
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "whole_finger.md").write_text(tables + "\n", "utf-8")
    return found


if __name__ == "__main__":
    run_study(main, __doc__, SCRIPT, for_the_page, PAGE)
