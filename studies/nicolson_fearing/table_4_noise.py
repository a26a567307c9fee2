"""Table 4's noise rows: which causes of scatter, in which amounts, give all six numbers, and how sure that is.

Printed are 0.14 degree, 9.6 N/m and 0.79 mm (model calibration), 0.14, 9.8 and 0.77 (empirical). Independent noise
with the levels of Table 1 gives another ratio of the three. Here mixtures of causes are inferred from the six numbers:
a share of every element's noise that all readings have in common, noise common to all strains, a load or a gain that
jitters, a simplex that stops early, and estimates that scatter along the ridge of R and P. Data besides: Table 1's
noise levels (smallest, mean, largest) and the modulus that Table 3 implies; the 0.5 % noise of the force sensor is held
against the jitter. Unknown besides: how the authors fitted (`READERS`), and which elements are the noisy ones.

    python studies/nicolson_fearing/table_4_noise.py [FOLDER] [--small] [--no-pictures] [--docs]
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

from bayestouch.paper.published import number
from nicolson_fearing.noise_causes import FINGERS, READERS, SAMPLES, Propagated
from nicolson_fearing.noise_mixtures import MODULUS_MPA, STEPS, TITLES, Inferred, Mixture, name_of, printed
from nicolson_fearing.stopped_simplex import TOLERANCES, added_scatter

SCRIPT = "nicolson_fearing/table_4_noise.py"
#: Of the load, %: the force sensor's 0.5 %, if it is that of averages.
SEEN_LOAD = number("noise.force_sensor").value * float(np.sqrt(SAMPLES))
MIXTURES: tuple[tuple[str, ...], ...] = (
    (),
    *((cause,) for cause in TITLES),
    ("share", "load"),
    ("share", "gain"),
    ("share", "search"),
    ("share", "ridge"),
    ("load", "ridge"),
    ("share", "load", "ridge"),
)
# What holding R does is said of independent noise alone: it moves R by a sixth, and costs as much time as all others.
FITS = tuple(name for name, reader in READERS.items() if not reader.held)
SMALL_MIXTURES, SMALL_READERS = ((), ("share", "ridge")), ("squeezed, near ones",)
#: Mixtures that are inferred with any modulus, too.
ANY_MODULUS: tuple[tuple[str, ...], ...] = (("share",), ("load",), ("gain",), ("share", "ridge"))


@dataclass(frozen=True, eq=False)
class Findings:
    """What the study found.

    Attributes
    ----------
    inferred : dict
        By mixture and reader, with Table 3's modulus.
    any_modulus : dict
        The same with any modulus, for some mixtures and the reader that explains each best.
    stopped : (tolerances, 3) array
        What a stopped simplex adds to θ_c, P and R, over the scatter of independent noise.
    held : pair of (3,) arrays
        θ_c, P and R under independent noise, read by the layer's contact: R not held and held between edge and flat.
    """

    inferred: dict[tuple[tuple[str, ...], str], Inferred]
    any_modulus: dict[tuple[str, ...], tuple[str, Inferred]]
    stopped: np.ndarray
    held: tuple[np.ndarray, np.ndarray]

    @property
    def top(self) -> float:
        """Largest log evidence."""
        return max(each.log_evidence for each in self.inferred.values())

    @property
    def readers(self) -> list[str]:
        """Ways of fitting."""
        return list(dict.fromkeys(reader for _, reader in self.inferred))

    def best_reader(self, causes: tuple[str, ...]) -> str:
        """The way of fitting that explains these causes best."""
        return max(self.readers, key=lambda reader: self.inferred[causes, reader].log_evidence)

    def evidence_rows(self) -> list[list[str]]:
        """Log evidence below the best, and hits, of each mixture and way of fitting."""
        mixtures = dict.fromkeys(causes for causes, _ in self.inferred)

        def cell(one: Inferred) -> str:
            return f"{one.log_evidence - self.top:.1f} ({100 * one.hits:.1f})"

        return [[name_of(m), *(cell(self.inferred[m, reader]) for reader in self.readers)] for m in mixtures]

    def posterior_rows(self) -> list[list[str]]:
        """Posterior of the unknowns and the six numbers, for each mixture as it is explained best."""
        best = [(m, self.best_reader(m)) for m in dict.fromkeys(causes for causes, _ in self.inferred)]
        rows = [[*posterior_cells(m, reader, self.inferred[m, reader])] for m, reader in best]
        return [*rows, *(posterior_cells(m, reader, one, "; any μ") for m, (reader, one) in self.any_modulus.items())]

    def stopped_rows(self) -> list[list[str]]:
        """Of the stopped simplex."""
        by_tolerance = zip(TOLERANCES, self.stopped, strict=True)
        return [[f"{100 * tolerance:g} %", *(f"{each:.2f}" for each in row)] for tolerance, row in by_tolerance]


EVIDENCE_HEAD = ("causes",)
POSTERIOR_HEAD = (
    "causes, and fits that explain them best",
    "amounts",
    "μ (MPa)",
    "model: θ_c, P, R",
    "empirical: θ_c, P, R",
    "χ² of six",
    "χ² of three means",
)
STOPPED_HEAD = ("tolerance of the simplex", "θ_c", "P", "R")


def posterior_cells(causes: tuple[str, ...], reader: str, one: Inferred, more: str = "") -> list[str]:
    """Cells of a row."""
    rows = one.mixture.rows(one.best)
    assert rows is not None
    numbers = [as_text(row) for row in rows.mean(axis=0)]
    return [
        f"{name_of(causes)} ({reader}{more})",
        "; ".join(f"{TITLES[c]} {span(one.of(c))}" for c in causes),
        span(one.of("modulus"), 3),
        *numbers,
        f"{one.mixture.misfit(one.best):.1f}",
        f"{one.mixture.misfit(one.best, averaged=True):.1f}",
    ]


def as_text(row: np.ndarray) -> str:
    """θ_c, P and R as they are printed."""
    return f"{row[0]:.2f}, {row[1]:.1f}, {row[2]:.2f}"


def span(values: np.ndarray, digits: int = 2) -> str:
    """Mean and 90 % interval."""
    low, high = np.quantile(values, [0.05, 0.95])
    return f"{values.mean():.{digits}f} ({low:.{digits}f}–{high:.{digits}f})"


def tables(found: Findings) -> str:
    """The tables for the page."""
    return "\n".join(
        [
            markdown_table((*EVIDENCE_HEAD, *found.readers), found.evidence_rows()),
            markdown_table(POSTERIOR_HEAD, found.posterior_rows()),
            "The force sensor shows at most 0.5 % of load jitter "
            f"({SEEN_LOAD:.1f} %, if the printed 0.5 % is of averages).\n",
            f"Independent noise, read by the layer's contact at {MODULUS_MPA:g} MPa: {as_text(found.held[0])}; with R "
            f"held between edge and flat: {as_text(found.held[1])}.\n",
            markdown_table(STOPPED_HEAD, found.stopped_rows()),
        ]
    )


def picture(folder: Path, found: Findings) -> None:
    """The three numbers of the model calibration under each mixture, beside what is printed."""
    mixtures = list(dict.fromkeys(causes for causes, _ in found.inferred))
    drawn, axes = figure(3, figsize=(13.0, 0.6 + 0.33 * len(mixtures)), sharey=True)
    values, rounding = printed()
    for i, (axis, label) in enumerate(zip(axes, ("$\\theta_c$ (degree)", "P (N/m)", "R (mm)"), strict=True)):
        axis.axvspan(values[0, i] - rounding[0, i], values[0, i] + rounding[0, i], color="0.8", label="printed")
        for place, causes in enumerate(mixtures):
            one = found.inferred[causes, found.best_reader(causes)]
            rows = one.mixture.rows(one.best)
            assert rows is not None
            axis.errorbar(rows[:, 0, i].mean(), place, xerr=rows[:, 0, i].std(), fmt="o", color="C0", ms=4)
        axis.set(xlabel=f"noise of {label}")
    axes[0].set_yticks(range(len(mixtures)), [name_of(causes) for causes in mixtures])
    axes[0].invert_yaxis()
    axes[0].legend()
    save(drawn, folder, "table_4_noise")


def main(small: bool = False, folder: Path | None = None) -> Findings:
    """Print the tables and save the picture."""
    names = SMALL_READERS if small else FITS
    mixtures = SMALL_MIXTURES if small else MIXTURES
    fingers, steps = (2, 90) if small else (FINGERS, STEPS)
    propagated = {name: Propagated.of(READERS[name], fingers=fingers) for name in names}
    inferred = {(m, name): Mixture(m, propagated[name]).inferred(steps=steps) for m in mixtures for name in names}
    held = tuple(
        Propagated.of(READERS[name], fingers=fingers).rows(MODULUS_MPA, {"independent": 1.0}).mean(axis=(0, 1))
        for name in ("layer, all elements", "layer, R held, all elements")
    )
    found = Findings(inferred, {}, added_scatter(samples=1 if small else 4), held)
    for causes in () if small else ANY_MODULUS:
        reader = found.best_reader(causes)
        any_modulus = Mixture(causes, propagated[reader], free_modulus=True).inferred()
        found.any_modulus[causes] = reader, any_modulus
    print("Log evidence below that of the best, and in brackets % of draws with all six numbers as printed")
    print(tables(found))
    if folder is not None:
        picture(folder, found)
    return found


if __name__ == "__main__":
    run_study(main, __doc__, SCRIPT, tables, PUBLISHED)
