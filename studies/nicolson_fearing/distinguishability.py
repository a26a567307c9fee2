"""What one touch tells apart: the paper's threshold (Figure 4) beside the honest one.

The paper takes location, load and sensor as known and asks whether the root mean square of the strain difference
exceeds two standard deviations of the noise. The honest question is how often the posterior odds name the right
indenter when location and load are unknown and the sensor is known up to its calibration. Both are asked of the
paper's finger (edges every 1°, flats every 3°, 20 samples to calibrate), of the same finger with the lack of fit that
Table 1 reports (which no averaging removes), and of Figure 4's deep sensor.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

from dataclasses import dataclass, replace
from pathlib import Path

import _path  # noqa: F401
import numpy as np
from _page import markdown_table
from _published import Beside, figure, plain_ticks, print_beside, run_study, save
from figure_4 import deep_finger
from scipy.special import ndtr, ndtri

from bayestouch.contact import indenter_radius
from bayestouch.paper import published
from bayestouch.paper.published import TABLE_3
from bayestouch.reliability import (
    Annulus,
    KnownFinger,
    Trial,
    distinguished,
    expected_finger,
    optimism,
    threshold_radii,
    trial,
)
from bayestouch.reliability.paper_criterion import SPANS_DEG
from bayestouch.simulation import FingerDesign
from nicolson_fearing.paper_design import SHEAR_MODULUS, indenter, paper_design
from nicolson_fearing.paper_finger import MISFIT_PERCENT

TIPS = (0.0, *(row.r_c for row in TABLE_3), np.inf)
PLACES = {"between elements": 0.0, "quarter way": 2.2, "above an element": 4.4}
LOCATIONS = np.linspace(-8.8, 8.8, 33)
CASES = {
    "1 sample": (1, False),
    "1 sample, load measured": (1, True),
    "mean of 20": (20, False),
    "mean of 20, load measured": (20, True),
}


@dataclass(frozen=True)
class Sensor:
    """A finger of the study, to both criteria."""

    name: str
    design: FingerDesign
    annulus: Annulus
    lack_of_fit_percent: float = 0.0

    def known(self) -> KnownFinger:
        """As its calibration would know it."""
        return expected_finger(self.design, lack_of_fit_percent=self.lack_of_fit_percent)


def sensors() -> tuple[Sensor, ...]:
    """The paper's finger without and with its lack of fit, and Figure 4's deep sensor with 1 % noise."""
    built = paper_design()
    paper = Annulus(
        built.core_radius_mm / built.outer_radius_mm,
        built.sensing_radius_mm / built.outer_radius_mm,
        shear_modulus_MPa=SHEAR_MODULUS,
    )
    deep = deep_finger()
    outer = deep.outer_radius_mm
    design = replace(
        built,
        core_radius_mm=deep.alpha * outer,
        sensing_radius_mm=deep.sensing_radius * outer,
        noise_percent_peak=published.number("figure_4.low_noise").value,
    )
    name, misfit = "the paper's finger, 1.72 % noise", MISFIT_PERCENT["model"]
    return (
        Sensor(name, built, paper),
        Sensor(f"{name} and {misfit:.2f} % lack of fit", built, paper, misfit),
        Sensor("α = 0.70 at 1 % noise (Figure 4)", design, deep),
    )


def print_thresholds(sensor: Sensor, known: KnownFinger) -> None:
    """Sharpest r_c distinguished from an edge with 95 %, by location; calibration unknown, and known."""
    exact = replace(known, errors=None)
    print(f"\n{sensor.name}: sharpest r_c (mm) distinguished from an edge at 95 %")
    print(f"{'':30s}" + "".join(f"{name:>19s}" for name in PLACES) + "   (calibration known)")
    for name, (samples, use_load) in CASES.items():
        found = [
            threshold_radii(each, list(PLACES.values()), samples=samples, use_load=use_load) for each in (known, exact)
        ]
        cells = "".join(f"{a:12.2f} ({b:4.2f})" for a, b in zip(*found, strict=True))
        print(f"{name:>30s}{cells}")


def print_optimism(sensor: Sensor, known: KnownFinger) -> None:
    """The paper's threshold, what one touch makes of it, and the honest one."""
    print(f"\n{sensor.name}: the paper's criterion against one touch, load not measured")
    print(
        f"{'mean square over':>18s} {'samples':>8s} {'location':>18s} {'paper r_c':>10s} {'right':>7s} {'95 % r_c':>9s}"
    )
    for reading, span in SPANS_DEG.items():
        for samples in (1, 20):
            results = optimism(known, sensor.annulus, list(PLACES.values()), span_deg=span, samples=samples)
            for name, r in zip(PLACES, results, strict=True):
                print(
                    f"{reading:>18s} {samples:8d} {name:>18s} {r.paper_mm:10.2f} {100 * r.distinguished_there:6.1f}% "
                    f"{r.honest_mm:9.2f}   x {r.factor:.2f}"
                )


def for_the_page() -> str:
    """Tables of the documentation: sharpest tip distinguished from an edge, and the paper's criterion beside it."""
    plain, lacking, _ = sensors()
    rows = [
        [label, *(f"{mm:.2f}" for mm in threshold_radii(known, list(PLACES.values()), samples=n, use_load=use_load))]
        for each, extra in ((plain, ""), (lacking, f", {lacking.lack_of_fit_percent:.2f} % lack of fit"))
        for known in (each.known(),)
        for label, (n, use_load) in ((name + extra, case) for name, case in CASES.items())
    ]
    known = plain.known()
    criteria = []
    for reading, span in SPANS_DEG.items():
        found = optimism(known, plain.annulus, list(PLACES.values()), span_deg=span)
        criteria.append([reading, f"{found[0].paper_mm:.2f}", *(f"{each.factor:.2f}" for each in found)])
    thresholds = markdown_table(["r_c distinguished from an edge at 95 %, mm", *PLACES], rows)
    factors = [f"honest r_c / paper's r_c, {place}" for place in PLACES]
    return thresholds + "\n" + markdown_table(["mean square over", "paper's r_c, mm", *factors], criteria)


def print_pairs(found: Trial, expected: np.ndarray, title: str) -> None:
    """Matrix of pairs: trial above the diagonal, information below, % right."""
    print(f"\n{title}: % of touches of which the right one of two is named")
    print("above the diagonal by evidence of simulated touches, below it by information")
    names = [indenter(r) for r in found.indenters_mm]
    print(f"{'':>9s}" + "".join(f"{name:>9s}" for name in names))
    seen = found.distinguished
    for i, name in enumerate(names):
        cells = "".join(
            f"{'':>9s}" if i == j else f"{100 * (seen[i, j] if j > i else expected[i, j]):9.1f}"
            for j in range(len(names))
        )
        print(f"{name:>9s}{cells}")


def agreement(found: Trial, expected: np.ndarray) -> float:
    """Largest difference between trial and information over all pairs, in standard errors of the trial."""
    touches = found.log_evidence.shape[1]
    error = np.sqrt(np.maximum(expected * (1 - expected), 1.0 / touches) / (2 * touches))
    return float(np.max(np.abs(found.distinguished - expected) / error))


def compared(known: KnownFinger) -> list[Beside]:
    """Section 4's sentence: small radii that differ by 1.5 mm are distinguished at a 95 % level at a fixed location."""
    outer = known.outer_radius_mm
    difference = published.number("radius_error.distinguishable").value
    # Halfway between an element and the middle of two: a location as good as most.
    probability = distinguished(known, [0.0, indenter_radius(difference, outer)], [2.2], use_load=False)[0, 0, 1]
    needed = threshold_radii(known, [2.2], use_load=False)[0]
    composite = 1 / (1 / needed + 1 / outer)
    return [
        Beside(
            "radius_error.distinguishable",
            float(composite),
            why="the smallest R of a tip that one touch distinguishes from an edge: with location, load and "
            "calibration unknown, the right one of the two is named in 95 % of touches. Ours is less than printed, "
            "because the printed noise of R is larger than the noise of the readings explains "
            "(table_4.model.noise.R). With the printed 0.77 mm it would be "
            f"{2 * ndtri(0.95) * published.number('radius_error.noise').value:.1f} mm: the paper takes two standard "
            "deviations of one estimate",
        ),
        Beside(
            "radius_error.level",
            float(100 * probability),
            why="share of touches in which the right one of two is named: an edge, and a tip with an R of 1.5 mm; with "
            "the printed noise of 0.77 mm it would be "
            f"{100 * ndtr(difference / published.number('radius_error.noise').value / 2):.0f} %",
        ),
    ]


def level() -> Beside:
    """The 95 % of Figure 4: how often one touch by the criterion's sharpest tip is distinguished from an edge."""
    deep = sensors()[2]
    found = optimism(deep.known(), deep.annulus, list(PLACES.values()), span_deg=SPANS_DEG["circumference"])
    right = [100 * each.distinguished_there for each in found]
    return Beside(
        "figure_4.level",
        float(np.mean(right)),
        min(right),
        max(right),
        "share of touches in which the right one of two is named: an edge, and the sharpest tip that the criterion "
        "distinguishes from an edge (α = 0.70, 1 % noise, load not measured): mean and range over locations. The "
        "criterion takes a mean over the circumference, which is less than what the elements near the touch see",
    )


def rows() -> list[Beside]:
    """All that the paper says of telling indenters apart, but for Figure 4's two numbers."""
    return [level(), *compared(sensors()[0].known())]


def picture(folder: Path, known: KnownFinger, sensor: Sensor, single: Trial, expected: np.ndarray) -> None:
    """Threshold over location, the matrix of pairs, and ROC curves."""
    figures, (left, middle, right) = figure(3, figsize=(13.5, 4.6))
    for (name, (samples, use_load)), style in zip(CASES.items(), ("C0-", "C0--", "C1-", "C1--"), strict=True):
        left.plot(LOCATIONS, threshold_radii(known, LOCATIONS, samples=samples, use_load=use_load), style, label=name)
    for (reading, span), style in zip(SPANS_DEG.items(), (":", "-.", "--"), strict=True):
        paper = optimism(known, sensor.annulus, [0.0], span_deg=span)[0].paper_mm
        left.axhline(paper, color="0.3", ls=style, label=f"paper's criterion, {reading}")
    for angle in np.degrees(known.chain.angle):
        if abs(angle) <= LOCATIONS.max():
            left.axvline(angle, color="0.85", zorder=0)
    left.set(xlabel="location (degree); grey: elements", ylabel="sharpest $r_c$ distinguished from an edge, 95 % (mm)")
    left.set(yscale="log")
    plain_ticks(left.yaxis, (0.1, 0.2, 0.5, 1, 2, 5))
    left.legend(loc="upper center", bbox_to_anchor=(0.5, -0.15), ncols=2)
    names = [indenter(r) for r in single.indenters_mm]
    both = np.where(np.triu(np.ones_like(expected), 1) > 0, single.distinguished, expected)
    image = middle.imshow(100 * both, vmin=50, vmax=100, cmap="viridis")
    middle.set_xticks(range(len(names)), names, rotation=90, fontsize=8)
    middle.set_yticks(range(len(names)), names, fontsize=8)
    middle.set_title("1 sample, load not measured: % right of two\n(above: trial; below: information)")
    figures.colorbar(image, ax=middle, shrink=0.85, label="named right (%)")
    for first, second in ((0, 1), (4, 5), (6, 7), (8, 9)):
        if second >= len(names):  # a small run has fewer tips
            continue
        alarms, hits = single.roc(first, second)
        area = single.area(first, second)
        right.plot(alarms, hits, label=f"{names[first]} or {names[second]}, area {area:.3f}")
    right.plot([0, 1], [0, 1], color="0.8")
    right.set(
        xlabel="share of sharper tips called blunter",
        ylabel="share of blunter tips called so",
        title="ROC of neighbours, 1 sample",
    )
    right.legend(loc="lower right")
    save(figures, folder, "distinguishability")


def main(small: bool = False, folder: Path | None = None) -> list[Beside]:
    """Print the tables and save the picture."""
    touches = 60 if small else 400
    for sensor in sensors():
        print_thresholds(sensor, sensor.known())
        if not sensor.lack_of_fit_percent:
            print_optimism(sensor, sensor.known())
    paper = sensors()[0]
    known = paper.known()
    tips = TIPS if not small else TIPS[::3]
    trials = {}
    for name in ("1 sample", "mean of 20"):
        samples, use_load = CASES[name]
        trials[name] = trial(known, tips, [2.2], touches=touches, samples=samples, use_load=use_load)
        expected = distinguished(known, tips, [2.2], samples=samples, use_load=use_load)[0]
        print_pairs(trials[name], expected, f"{paper.name}, {name}, load not measured")
        print(f"largest difference of the two: {agreement(trials[name], expected):.1f} standard errors")
    out = rows()
    print()
    print_beside(out)
    if folder is not None:
        expected = distinguished(known, tips, [2.2], use_load=False)[0]
        picture(folder, known, paper, trials["1 sample"], expected)
    return out


if __name__ == "__main__":
    run_study(main, __doc__, "nicolson_fearing/distinguishability.py", lambda _: for_the_page())
