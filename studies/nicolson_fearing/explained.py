"""The paper's tables explained by a few unknowns that they share: posteriors, what each is worth, what they predict.

    python studies/nicolson_fearing/explained.py [FOLDER] [--small] [--no-pictures] [--docs]

Unknowns are inferred from Tables 1 to 4 (`explained_fit`). Then one effect after the other is taken away, and unknowns
are inferred from a part of the tables, so that the rest is predicted. `compare_published` has all numbers one by one.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

from dataclasses import dataclass, replace
from pathlib import Path

import _path  # noqa: F401
import numpy as np
from _page import DOCS, markdown_table
from _published import figure, run_study, save

from bayestouch.contact import indenter_radius
from bayestouch.paper import published
from bayestouch.paper.published import TABLE_3
from bayestouch.reliability import Beside
from nicolson_fearing.explained_case import FREE, LENGTH_MM, Case, full
from nicolson_fearing.explained_effects import BEFORE, Numbers, before_of, effects_table, numbers_table
from nicolson_fearing.explained_fit import KEYS, Explanation
from nicolson_fearing.linear_touches import R_B
from nicolson_fearing.unknowns import PRIOR, Unknowns

PAGE = DOCS / "1995.md"
SCRIPT = "nicolson_fearing/explained.py"
OF_TIPS = ("modulus_MPa", "poisson_ratio", "squeeze_mm", "odd_tip_R_mm", "tip_sd_mm")
MEANING = {
    "modulus_MPa": ("shear modulus μ of the rubber, also that of the authors' formulas", "MPa"),
    "poisson_ratio": ("Poisson's ratio of the rubber in a contact", ""),
    "squeeze_mm": ("what the approximate frictionless model takes off the half-width of Hertz's contact", "mm"),
    "odd_tip_R_mm": ("radius r_c of the tip that is printed as 3.90 mm", "mm"),
    "tip_sd_mm": ("sd of the error of R of a tip; all columns share three quarters of its variance", "mm"),
    "map_error": ("error of the elements' E maps within 25°", "% of the peak"),
    "place_error": ("error of a place, every element its own", "% of the peak"),
    "spread": ("sd of the logarithm of the elements' error sizes", ""),
    "tail": ("error of the model's E map more than 25° from an element", "% of the peak"),
    "prober_deg": ("sd of the prober's error of location, by place", "degree"),
    "drift": ("sd of a factor of all readings that changes from touch to touch", "%"),
    "jitter": ("sd of a factor of all readings that changes from sample to sample", "%"),
}
TAKEN_AWAY = {
    "tips of 4 mm (plane strain in place of it)": ("poisson_ratio", {"length_mm": np.inf}),
    "radius of the 3.90 mm tip": ("odd_tip_R_mm", {}),
    "spread of the elements' errors": ("spread", {}),
    "error of the tails": ("tail", {}),
    "errors of the prober's location": ("prober_deg", {}),
    "drift from touch to touch": ("drift", {}),
    "jitter from sample to sample": ("jitter", {}),
}
NOISE_KEYS = ("table_4.model.noise.theta_c", "table_4.model.noise.R")


@dataclass(frozen=True, eq=False)
class Findings:
    """All effects, one taken away each, and parts of the tables alone."""

    full: Case
    without: dict[str, Case]
    from_part: dict[str, Case]
    small: bool = False


def without(name: str, small: bool) -> Case:
    """One effect taken away, all else inferred again."""
    dropped, changes = TAKEN_AWAY[name]
    free = tuple(each for each in FREE if each != dropped)
    return Case.of(Explanation(name, free, replace(Unknowns(length_mm=LENGTH_MM), **changes)), small, full(small))


def of_table_3(length_mm: float, small: bool) -> Case:
    """Table 3 alone; what it says nothing of is not there."""
    free = OF_TIPS if np.isfinite(length_mm) else tuple(n for n in OF_TIPS if n != "poisson_ratio")
    return Case.of(Explanation("Table 3", free, Unknowns(length_mm=length_mm), ("table_3",)), small)


def span(values: np.ndarray) -> str:
    """Mean and 90 % interval."""
    low, high = np.quantile(values, [0.05, 0.95])
    digits = 3 if values.mean() < 1 else 2
    return f"{values.mean():.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"


def shown(row: Beside) -> str:
    """Median and 90 % interval of single fingers."""
    return f"{row.ours:.2f} ({row.low:.2f} to {row.high:.2f})"


def posterior_table(case: Case) -> str:
    """Unknowns with their posteriors."""
    rows = []
    for name in case.inferred.explanation.free:
        values = case.inferred.of_name(name)
        ends = np.array(PRIOR[name])
        if name == "odd_tip_R_mm":
            values, ends = indenter_radius(values, R_B), indenter_radius(ends, R_B)
        meaning, unit = MEANING[name]
        rows.append([meaning, unit, f"{ends[0]:.3g} to {ends[1]:.3g}", span(values)])
    return markdown_table(("unknown", "unit", "uniform prior", "posterior mean (90 %)"), rows)


def effects_tables(found: Findings, small: bool) -> str:
    """What each effect is worth: evidence and what agrees, then numbers."""
    rows = {"with all effects": found.full, **found.without}
    numbers = {name: Numbers.of(case.fingers) for name, case in rows.items()}
    least = found.full.inferred.log_evidence
    said = {
        name: (numbers[name], f"{case.inferred.log_evidence - least:.0f}", span(case.inferred.of_name("modulus_MPa")))
        for name, case in rows.items()
    }
    before = before_of(small)
    first = effects_table({BEFORE: before, **said})
    return first + "\n" + numbers_table({BEFORE: before[0], **numbers}, small)


def prediction_table(found: Findings) -> str:
    """What Table 3 alone predicts."""
    rows = []
    for name, case in found.from_part.items():
        by_key = {row.key: row for row in (*case.fingers.rows(), *case.fingers.thresholds)}
        noise = [shown(by_key[key]) for key in NOISE_KEYS]
        figure_4 = [shown(row) for row in case.fingers.thresholds]
        rows.append([name, span(case.inferred.of_name("modulus_MPa")), *noise, *figure_4])
    keys = (*NOISE_KEYS, *(row.key for row in found.full.fingers.thresholds))
    rows.append(["printed", "", *(published.number(key).printed for key in keys)])
    names = ("θ_c, noise (degree)", "R, noise (mm)", "Figure 4: noise (%)", "Figure 4: r_c/r_b")
    return markdown_table(("Table 3 alone, with", "μ (MPa)", *names), rows)


def tables(found: Findings) -> str:
    """The tables for the page."""
    return "\n".join([posterior_table(found.full), effects_tables(found, found.small), prediction_table(found)])


def picture(folder: Path, found: Findings) -> None:
    """Table 3 and Table 4 under all effects; the modulus by the length of the tips."""
    drawn, (left, middle, right) = figure(3, figsize=(13.5, 4.0))
    by_key = after_of(found.full)
    radii = np.array([row.r_c for row in TABLE_3])
    for i, contact in enumerate(("hertz", "frictionless")):
        rows = [by_key[f"table_3[{r:.2f}].{contact}_model"] for r in radii]
        ends = np.array([[row.low, row.high] for row in rows])
        left.fill_between(radii, *ends.T, color=f"C{i}", alpha=0.2, label=f"{contact}, 90 % of fingers")
        for k, mark in (("model", "o"), ("empirical", "s")):
            printed = [getattr(row, f"{contact}_{k}") for row in TABLE_3]
            left.plot(radii, printed, mark, color=f"C{i}", mfc="none", ms=4, label=f"printed, {k} calibration")
    left.set(xlabel="$r_c$ of the tip (mm)", ylabel="mean estimate of $r_c$ (mm)", title="Table 3", ylim=(0, 26))
    left.legend(loc="upper left")
    keys = [key for key in KEYS if key.startswith("table_4")]
    ratio = np.array([[getattr(by_key[k], n) for n in ("ours", "low", "high")] for k in keys])
    ratio /= np.array([published.number(k).value for k in keys])[:, None]
    place = np.arange(len(keys))
    middle.errorbar(ratio[:, 0], place, xerr=np.abs(ratio[:, 1:].T - ratio[:, 0]), fmt="o", ms=4, capsize=2)
    middle.axvline(1, color="k", lw=0.8)
    middle.set_yticks(place, [k.removeprefix("table_4.").replace(".", ", ") for k in keys], fontsize=7)
    middle.invert_yaxis()
    middle.set(xlabel="ours over printed, 90 % of fingers", title="Table 4")
    for i, (name, case) in enumerate(found.from_part.items()):
        right.hist(case.inferred.of_name("modulus_MPa"), bins=30, density=True, alpha=0.5, label=f"Table 3, {name}")
        right.axvline(np.median(case.inferred.of_name("modulus_MPa")), color=f"C{i}", lw=1)
    right.hist(found.full.inferred.of_name("modulus_MPa"), bins=30, density=True, alpha=0.5, label="all tables, 4 mm")
    right.set(xlabel="shear modulus μ (MPa)", ylabel="posterior density", title="Tips of 4 mm agree with Table 4")
    right.legend()
    save(drawn, folder, "explained")


def after_of(case: Case) -> dict[str, Beside]:
    """Rows by key."""
    return {row.key: row for row in case.fingers.rows()}


def main(small: bool = False, folder: Path | None = None) -> Findings:
    """Print the tables and save the picture."""
    names = list(TAKEN_AWAY)[:1] if small else TAKEN_AWAY
    found = Findings(
        full(small),
        {name: without(name, small) for name in names},
        {
            "plane strain": of_table_3(np.inf, small),
            f"tips of {LENGTH_MM:g} mm": of_table_3(LENGTH_MM, small),
        },
        small,
    )
    print(tables(found))
    if folder is not None:
        picture(folder, found)
    return found


if __name__ == "__main__":
    run_study(main, __doc__, SCRIPT, tables, PAGE)
