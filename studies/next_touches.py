"""How many touches does `bayestouch.next_touches` save, against an even grid of touches?

A sensor is calibrated with few touches. Then more touches are made: those that `next_touches` chooses from a fine grid
(every tip at every place, all under the same load), or an even grid of them. On a finger the even grid is the better of
two: edges and flats in turn, or all tips in turn. It covers all places, or only those that are read.
Counted are the chosen touches that give the same expected standard deviation as the even grid (mean over what is asked
for of the variances over those before), or the same expected log Bayes factor between two causes. Then the prediction
is checked: the sensor is calibrated again with the readings of each set, and the rms standard deviation with the chosen
touches is given over that with the even grid; log Bayes factors are computed from the readings of each set.

Fingers are simulated with 8 elements and calibrated with 16 touches (34 for causes), pads with 8 elements and 24
touches. Seeds 9111 to 9120 were used for nothing else before the table was made; 1 to 3 are for looking. (9101 to 9110
showed that places beyond the outer elements of a pad say more of the prior of a location than of the touches.)

    python studies/next_touches.py [--development] [--only PART] [--docs]

PART is fingers, pads or causes; --docs writes the table of docs/calibrate_your_own.md.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from _page import DOCS, markdown_table, put_into_page
from _touch_sets import TIPS, Box, Sets, even_grids, log_ratio, sets_for_decision, sets_for_sd

import bayestouch
from bayestouch.array_types import IntArray
from bayestouch.diagnosis.place_or_time import IN_PLACE
from bayestouch.model.body import body_of
from bayestouch.model.planned import Group, PlannedReadings
from bayestouch.model.planned_table import planned_table
from bayestouch.model.split_data import joined_tables
from bayestouch.pad.calibration import calibrate_pad
from bayestouch.reliability.two_causes import TwoCauses

DEVELOPMENT, FRESH = range(1, 4), range(9111, 9121)
# Number of touches of an even grid, and on how many sensors it is checked with readings.
EVEN, CHECKED = 20, 6
FINGER = bayestouch.FingerDesign(
    n_elements=8,
    samples_per_touch=10,
    calibration_span_deg=35.0,
    edge_step_deg=7.0,
    flat_step_deg=14.0,
    touch_radii_mm=TIPS,
    touch_span_deg=35.0,
    touch_step_deg=2.5,
    load_range=(199.0, 201.0),
)
FINGER_OF_CAUSES = replace(FINGER, edge_step_deg=3.5, flat_step_deg=7.0, load_range=(160.0, 240.0))
PAD = bayestouch.PadDesign(calibration_step_mm=4.6, n_touches=240, load_range=(1.99, 2.01))
# The part of the sensor that is read: degree, or mm.
FINGER_PART, PAD_PART = (np.array([-10.0]), np.array([10.0])), (np.array([0.0, 0.0]), np.array([6.75, 6.75]))
# Causes that are simulated, with sizes that 34 touches hardly show, and causes with which they are confused.
PAIRS = (
    ("crosstalk", 0.02, "nothing"),
    ("crosstalk", 0.02, "prober_eccentricity"),
    ("crosstalk", 0.02, IN_PLACE),
    ("load_offset", 8.0, "gain_nonlinearity"),
    ("gain_nonlinearity", 0.05, "load_offset"),
    ("baseline_drift", 0.01, IN_PLACE),
    ("gain_drift", 0.05, "baseline_drift"),
)
Calibrate = Callable[[bayestouch.DataSet], bayestouch.Calibration]


@dataclass(frozen=True, eq=False)
class Row:
    """A line of the table: the sets of each sensor, and what their readings made of them."""

    body: str
    asked: str
    sets: Sequence[Sets]
    check: str

    def cells(self) -> list[str]:
        """As text."""
        even = np.median([len(each.even) for each in self.sets])
        chosen = np.median([len(each.chosen) for each in self.sets])
        saved = np.array([each.saved for each in self.sets])
        text = f"{np.median(saved):.0f} % ({saved.min():.0f} to {saved.max():.0f}; {len(saved)} sensors)"
        return [self.body, self.asked, f"{even:g}", f"{chosen:g}", text.replace("-", "−"), self.check]


@dataclass(frozen=True, eq=False)
class Question:
    """What is asked of a sensor: its parameters, or what it reads in a box of places.

    Attributes
    ----------
    words : str
        In the table.
    names : tuple of str
        Parameters that are asked for; without any, what is read.
    box : (low, high) or None
        Places that are read.
    even : (low, high) or None
        Range of the even grid; None for all places.
    """

    words: str
    names: tuple[str, ...] = ()
    box: Box | None = None
    even: Box | None = None

    def of(self, one: bayestouch.Calibration, table: bayestouch.Touches) -> tuple[PlannedReadings, tuple[Group, ...]]:
        """Readings of the candidates, and the quantities."""
        body, n = body_of(one.sensor), table.n_touches
        if self.box is None:
            planned = body.planned(one, table)
            return planned.readings, tuple(each for each in planned.parameters if each.name in self.names)
        axes = [np.linspace(low, high, 9) for low, high in zip(*self.box, strict=True)]
        places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
        tips = None if np.isnan(one.rows.radius_mm).all() else [1.59, 3.9, 12.3]
        read = bayestouch.candidate_touches(one, places=places, tips_mm=tips)
        planned = body.planned(one, joined_tables(table, read))
        return planned.readings.select(np.arange(n)), planned.biases(n + np.arange(read.n_touches))


def sd_rows(
    name: str, questions: Sequence[Question], calibrate: Calibrate, datasets: Sequence[bayestouch.DataSet]
) -> Iterator[Row]:
    """Rows on standard deviations."""
    first = [calibrate(each) for each in datasets]
    for question in questions:
        found, logs = [], []
        for one, dataset in zip(first, datasets, strict=True):
            table = dataset.touches
            means = planned_table(table, one)
            planned, asked = question.of(one, table)
            found.append(sets_for_sd(planned, asked, even_grids(means, EVEN, question.even)))
            if len(logs) < CHECKED:
                after = [
                    _log_sd(one, dataset, each, question, calibrate) for each in (found[-1].chosen, found[-1].even)
                ]
                logs.append(after[0] - after[1])
        error = np.std(logs, ddof=1) / np.sqrt(len(logs))
        yield Row(name, question.words, found, f"sd × {np.exp(np.mean(logs)):.2f} ± {error:.2f}")


def _log_sd(
    one: bayestouch.Calibration,
    dataset: bayestouch.DataSet,
    index: IntArray,
    question: Question,
    calibrate: Calibrate,
) -> float:
    """Log of the rms sd, over that before, after a calibration with the readings of more touches."""
    table = dataset.touches
    assert dataset.calibration is not None
    ids = table.touch[np.sort(np.unique(table.touch, return_index=True)[1])]
    more = joined_tables(dataset.calibration, table.select(np.isin(table.touch, ids[index])))
    again = calibrate(replace(dataset, calibration=more))
    _, asked = question.of(one, table)
    before, _ = question.of(one, table)
    after, new = question.of(again, table)
    sums = [
        [float(np.einsum("kd,de,ke->", group.rows, planned.covariance, group.rows)) for group in groups]
        for planned, groups in ((before, asked), (after, new))
    ]
    return 0.5 * float(np.log(np.mean(np.array(sums[1]) / np.array(sums[0]))))


def cause_rows(seeds: Sequence[int]) -> Iterator[Row]:
    """Rows on decisions between two causes of fingers."""
    for cause, size, other in PAIRS:
        found, ratios = [], []
        for seed in seeds:
            dataset = bayestouch.simulate(FINGER_OF_CAUSES, effects={cause: size}, seed=seed).dataset
            assert dataset.calibration is not None
            alone = replace(dataset, calibration=None, touches=dataset.calibration)
            diagnosis = bayestouch.diagnose(alone, draws=200, sample=False, seed=seed)
            end = float(np.nanmax(dataset.calibration.time_s))
            table = dataset.touches.with_(time_s=dataset.touches.time_s - end)
            means = planned_table(table, diagnosis.calibration_after)
            try:
                models = TwoCauses.named(diagnosis, (cause, other)).models(means)
            except bayestouch.InputError:
                continue  # the search did not try both in one round, or found no functions of place
            sets = sets_for_decision(models, means)
            if sets is not None:
                found.append(sets)
                ratios.append([log_ratio(models, table, each) for each in (sets.chosen, sets.even)])
        if found:
            won = np.array(ratios)
            right = " and ".join(f"{int((each > 0).sum())}" for each in won.T)
            means_of = " and ".join(f"{each.mean():.1f}" for each in won.T)
            yield Row("finger", f"{cause} or {other}", found, f"{means_of} nat; right in {right}")


def parts(seeds: Sequence[int]) -> dict[str, Callable[[], Iterator[Row]]]:
    """Rows of each part of the study."""

    def made(design: bayestouch.FingerDesign | bayestouch.PadDesign) -> list[bayestouch.DataSet]:
        return [bayestouch.simulate(design, seed=seed).dataset for seed in seeds]

    def whole(low: Sequence[float], high: Sequence[float]) -> Box:
        return np.array(low), np.array(high)

    finger = (
        Question("σ, μ, r_s", ("sigma", "mu", "r_s")),
        Question("R everywhere", box=whole([-35.0], [35.0])),
        Question("R within ±10°; even grid over all places", box=FINGER_PART),
        Question("R within ±10°; even grid there", box=FINGER_PART, even=FINGER_PART),
    )
    pad = (
        Question("gains, positions", ("gain", "x_s", "y_s")),
        Question("x, y between all elements", box=whole([0.0, 0.0], [6.75, 20.25])),
        Question("x, y between four elements; even grid over all places", box=PAD_PART),
        Question("x, y between four elements; even grid there", box=PAD_PART, even=PAD_PART),
    )
    return {
        "fingers": lambda: sd_rows("finger", finger, lambda each: bayestouch.calibrate(each, draws=800), made(FINGER)),
        "pads": lambda: sd_rows(
            "pad", pad, lambda each: calibrate_pad(each, kernel="layer", empirical=False, draws=40), made(PAD)
        ),
        "causes": lambda: cause_rows(seeds),
    }


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table, and with ``--docs`` write it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--development", action="store_true", help="seeds for looking")
    parser.add_argument("--only", choices=("fingers", "pads", "causes"), help="one part of the table")
    parser.add_argument("--docs", action="store_true", help="write the table of docs/calibrate_your_own.md")
    options = parser.parse_args(arguments)
    cells = []
    for name, rows in parts(DEVELOPMENT if options.development else FRESH).items():
        for row in rows() if options.only in (None, name) else ():
            cells.append(row.cells())
            print(" | ".join(cells[-1]), flush=True)
    if options.docs:
        head = ("sensor", "asked for", "even grid", "chosen", "saved: median (range)", "from readings")
        put_into_page("next_touches.py", markdown_table(head, cells), DOCS / "calibrate_your_own.md")


if __name__ == "__main__":
    main()
