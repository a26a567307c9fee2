"""Every number that the paper printed beside ours: the table of docs/published_comparison.md.

Each row comes from the study of its table or figure, run on the same simulated fingers; nothing on our side is typed.

    python studies/nicolson_fearing/compare_published.py [FOLDER] [--small]      writes published_comparison.md there
    python studies/nicolson_fearing/compare_published.py --docs                  rewrites the page of the documentation
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

import _path  # noqa: F401
import distinguishability
import figure_2
import figure_3
import figure_4
import figure_6
import figure_12
import figure_13
import numpy as np
import table_1
import table_2
import table_3
import table_4
from _published import OUTPUT

from bayestouch.paper import published
from bayestouch.reliability import Beside, PublishedComparison
from bayestouch.reliability.paper_criterion import NOISE_FACTOR
from bayestouch.simulation import FingerDesign
from nicolson_fearing.explained_case import FREE
from nicolson_fearing.explained_case import after as after_effects
from nicolson_fearing.explained_fit import KEYS
from nicolson_fearing.paper_design import SHEAR_MODULUS, paper_design
from nicolson_fearing.paper_run import FINGERS, TIPS_MM, paper_run, put_in, runs

PAGE = Path(__file__).parents[2] / "docs" / "published_comparison.md"
#: Numbers that the shared unknowns are inferred from.
USED = frozenset(key for key in KEYS if ".total." not in key)
NO_COUNTERPART = {
    "dielectric_thickness": "an element is the strain at one radius; its thickness is not simulated",
    "tips.corner_angle": "the simulated edge is a knife edge; `bayestouch.contact.CornerContact` has the corner",
    "tips.length": "plane strain: indenters of any length",
    "tips.length_again": "plane strain: indenters of any length",
}


def settings() -> list[Beside]:
    """Sizes, tips and touches of the simulated finger."""
    design, built = paper_design(), FingerDesign()
    spacing = np.radians(built.pitch_deg) * built.sensing_radius_mm
    round_tips = [tip for tip in TIPS_MM if tip > TIPS_MM[1] and np.isfinite(tip)]
    return [
        put_in("core_radius", design.core_radius_mm),
        put_in("outer_radius", design.outer_radius_mm),
        put_in("sensing_radius", design.sensing_radius_mm, "simulated at the mean fitted depth of Table 1"),
        put_in("spacing", float(spacing)),
        put_in("tips.smallest", min(round_tips)),
        put_in("tips.largest", max(round_tips)),
        put_in("touches.interval", design.touch_step_deg),
        put_in("touches.load", float(np.mean(design.load_range))),
        put_in("touches.n_samples", design.samples_per_touch),
        *(Beside(key, np.nan, why=why) for key, why in NO_COUNTERPART.items()),
    ]


def criterion() -> list[Beside]:
    """The criterion of Figure 4, and what it is worth."""
    low = published.number("figure_4.low_noise").value
    return [
        put_in("figure_4.threshold", NOISE_FACTOR),
        put_in("figure_4.noise_plane", NOISE_FACTOR),
        put_in("figure_4.low_noise", low),
        *figure_4.compared(),
        *distinguishability.rows(),
    ]


def compared(small: bool = False) -> PublishedComparison:
    """All rows, in the paper's order."""
    found = runs(small)
    return PublishedComparison.of(
        [
            *settings(),
            *table_1.rows(found),
            *table_2.rows(found),
            *table_3.rows(found),
            *table_4.rows(found),
            *figure_2.rows(),
            *figure_3.rows(),
            *criterion(),
            *figure_6.rows(figure_6.contacts()),
            *figure_12.rows(paper_run(0)),
            *figure_13.rows(paper_run(0)),
        ]
    )


def counted_after(comparison: PublishedComparison, after: Mapping[str, Beside]) -> str:
    """Sentences with the numbers that agree under all effects: fitted, predicted, and as before."""
    kinds = {True: [0, 0], False: [0, 0]}
    same = [0, 0]
    for row in comparison.predicted:
        second = after.get(row.key)
        count = same if second is None else kinds[row.key in USED]
        count[0] += (second or row).agrees
        count[1] += 1
    agree, total = (same[i] + kinds[True][i] + kinds[False][i] for i in range(2))
    wider = [
        (after[row.key].high - after[row.key].low) / (row.high - row.low)
        for row in comparison.predicted
        if row.key in after and np.isfinite(row.low) and np.isfinite(after[row.key].low)
    ]
    fitted, others = kinds[True], kinds[False]
    return (
        f"After the effects of [](1995.md), {agree} of the {total} agree. These {total} numbers are of three "
        f"kinds. From {fitted[1]} of them (and from {len(USED) - fitted[1]} settings) the shared unknowns were "
        f"inferred: {fitted[0]} agree. Another {others[1]} change with the effects: {others[0]} agree. The last "
        f"{same[1]} do not change (the columns *after* are empty): {same[0]} agree. Ranges are "
        f"{np.median(wider):.1f} times as wide after as before (the median)."
    )


def page(comparison: PublishedComparison, fingers: int, after: Mapping[str, Beside]) -> str:
    """Markdown of the documentation's page."""
    listed = comparison.markdown(after).replace(comparison.counted(), "", 1).lstrip()
    return f"""# The paper and bayestouch, number by number

Made by `python studies/nicolson_fearing/compare_published.py --docs`. The command takes minutes, with `--small`
seconds. *The paper* is [Nicolson and Fearing 1995](published.md); σ, r_s, R, θ_c and the E map are in
[](physics.md) and the [glossary](glossary.md). Our numbers come from {fingers} simulated fingers with the
printed sizes and noise. The paper prints no shear modulus. So each finger has a modulus of its own, about
{SHEAR_MODULUS:g} MPa, drawn from what Table 3 implies. Errors of the elements and of the places touched are as
large as the residuals of Tables 1 and 2 (`studies/nicolson_fearing/paper_run.py`). Measured sensors are in
[](measured_diagnosis.md).

| column | meaning |
|---|---|
| number | key of the number in `bayestouch.paper.published` |
| paper | as printed, with its unit |
| bayestouch | our number, in the same unit: a mean over the fingers |
| 90 % | the 90 % range of single fingers, since the paper made one; Figure 4 has other ranges, see below |
| difference | ours minus the paper's, in the same unit; 0 within the paper's rounding |
| after | our number with the effects that explain the tables: the median of single fingers |
| after, 90 % | the 90 % range of single fingers with these effects |
| why | the reason of a difference, or from what our number comes |

A number agrees if the printed one, within its rounding, is inside the interval. The difference need not be 0. Where
there is no interval, the printed number must be equal to ours within the rounding of the printed one.

In Table 3 the keys have the contact model and the calibration. The contact models are *hertz* and the paper's
*approximate frictionless* model ([](physics.md)); the calibrations are *model* and *empirical*.

Figure 4 is of one finger. So its ranges are not those of several fingers. They are ranges over the values of the
modulus that Table 3 allows. Only the range of `figure_4.level` is another one: it is over the locations of the
touches.

"Setting" marks what the simulation was set to: its agreement shows nothing. A setting can still differ from the
printed number. Some settings are true only on average over many fingers. And the elements are simulated at
10.3 mm, where the paper's fit found them, not at 9.9 mm, where they were built. Begin with the rows without "setting".

## Before and after

{comparison.counted()} This is *before*: the columns *bayestouch* and *90 %*.

{counted_after(comparison, after)}

The columns *after* are of a second simulation. It has the printed length of the tips, 4 mm, and {len(FREE)}
unknowns that all tables share, inferred from the numbers of Tables 1 to 4 by
`studies/nicolson_fearing/explained.py`. The unknowns were inferred from some of the numbers. That these agree
shows that a few unknowns are enough. Only agreement of the other numbers is a prediction. Totals of Table 4,
and sentences that the paper calculates from its tables, follow from the other numbers. The ranges contain the
uncertainty of the unknowns, and the chance from finger to finger. The size of this chance was inferred from the
numbers, too. So more than 90 % of the numbers that were fitted are inside their ranges. The column *why* is about
*before*. After the effects, the mean error of each tip is subtracted in Table 4, and not the mean of all tips. Errors
go through the fits to first order: each fit is linearised.

{listed}"""


def main(small: bool = False, folder: Path | None = None) -> PublishedComparison:
    """Print the count of what agrees, and write the page to the folder."""
    comparison = compared(small)
    after = after_effects(small)
    print(comparison.counted())
    print(counted_after(comparison, after))
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        text = page(comparison, 2 if small else FINGERS, after)
        (folder / "published_comparison.md").write_text(text, encoding="utf-8")
    return comparison


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path, default=OUTPUT)
    parser.add_argument("--small", action="store_true", help="seconds in place of minutes")
    parser.add_argument("--docs", action="store_true", help="rewrite the page of the documentation")
    chosen = parser.parse_args()
    main(chosen.small, PAGE.parent if chosen.docs else chosen.folder)
