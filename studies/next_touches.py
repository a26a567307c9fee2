"""How many touches does `bayestouch.next_touches` save, against an even grid of touches?

A sensor is calibrated with few touches. Then more touches are made: those that `next_touches` chooses from a fine grid
(every tip at every place), or an even grid of them (places evenly over the same range, all tips in turn). Counted are
the chosen touches that give the same expected standard deviation as an even grid (mean of the relative variances of
what is asked for), or the same expected log Bayes factor between two causes. The prediction is then checked: the
sensor is calibrated again with the readings of both sets, and the log Bayes factor is computed from readings.

Fingers are simulated with 8 elements and calibrated with 16 touches, pads with 8 elements and 24 touches. Seeds 9101 to
9110 were used for nothing else, and nobody looked at them before the table was made; 1 to 3 are for looking.

    python studies/next_touches.py [--development] [--docs]      --docs writes the table of docs/calibrate_your_own.md
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from _page import DOCS, markdown_table, put_into_page  # noqa: E402

import bayestouch  # noqa: E402
from bayestouch.array_types import FloatArray, IntArray  # noqa: E402
from bayestouch.diagnosis.place_or_time import IN_PLACE  # noqa: E402
from bayestouch.model.body import body_of  # noqa: E402
from bayestouch.model.planned import Group, PlannedReadings, PlannedTouches, planned_table  # noqa: E402
from bayestouch.model.split_data import joined_tables  # noqa: E402
from bayestouch.reliability.choice_of_touches import lowest_sd, most_decisive  # noqa: E402
from bayestouch.reliability.two_causes import two_models  # noqa: E402

DEVELOPMENT, FRESH = range(1, 4), range(9101, 9111)
# Numbers of touches of the even grids; a decision counts from this log Bayes factor (odds of 150 to 1).
EVEN, DECIDED, MOST = (12, 24), 5.0, 60
TIPS = (0.0, 1.59, 3.9, 12.3, np.inf)
FINGER = bayestouch.FingerDesign(
    n_elements=8,
    samples_per_touch=10,
    calibration_span_deg=35.0,
    edge_step_deg=7.0,
    flat_step_deg=14.0,
    touch_radii_mm=TIPS,
    touch_span_deg=35.0,
    touch_step_deg=2.5,
)
PAD = bayestouch.PadDesign(calibration_step_mm=4.6, n_touches=240)
# Causes that are simulated, sizes too small for 34 touches to decide, and with what they are confused.
PAIRS = (
    ("crosstalk", 0.02, "nothing"),
    ("crosstalk", 0.02, "prober_eccentricity"),
    ("crosstalk", 0.02, IN_PLACE),
    ("load_offset", 8.0, "gain_nonlinearity"),
    ("gain_nonlinearity", 0.05, "load_offset"),
    ("baseline_drift", 0.02, IN_PLACE),
    ("gain_drift", 0.05, "baseline_drift"),
)


@dataclass(frozen=True, eq=False)
class Sets:
    """An even grid and the chosen touches that tell as much: indices among the candidates."""

    even: IntArray
    chosen: IntArray

    @property
    def saved(self) -> float:
        """Share of the touches of the even grid that the choice saves."""
        return 1 - len(self.chosen) / len(self.even)


def even_grid(table: bayestouch.Touches, count: int) -> IntArray:
    """Candidates nearest to an even grid: places evenly over a line with all tips in turn, or over a plane."""
    means = table.with_(readings=np.zeros(table.readings.shape)).averaged()
    if means.angle_deg is not None:
        places = np.linspace(means.angle_deg.min(), means.angle_deg.max(), count)
        tips = np.unique(means.indenter_radius_mm)
        tip = tips[np.arange(count) % len(tips)]
        return np.array(
            [
                int(np.argmin(np.abs(means.angle_deg - place) + 1e6 * (means.indenter_radius_mm != one)))
                for place, one in zip(places, tip, strict=True)
            ]
        )
    low, high = means.location.min(axis=0), means.location.max(axis=0)
    across = max(2, round(np.sqrt(count * (high[0] - low[0]) / (high[1] - low[1]))))
    along = round(count / across)
    axes = [(np.arange(n) + 0.5) / n * (b - a) + a for n, a, b in zip((across, along), low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    free = np.ones(means.n_touches, dtype=bool)
    out = []
    for place in grid:
        out.append(int(np.argmin(np.where(free, ((means.location - place) ** 2).sum(axis=1), np.inf))))
        free[out[-1]] = False
    return np.array(out)


def relative(value: FloatArray) -> FloatArray:
    """Mean of the variances of the quantities over those before, (c + 1,), of sds (c + 1, g)."""
    return np.asarray(np.mean((value / value[0]) ** 2, axis=1))


def sets_for_sd(planned: PlannedReadings, asked: Sequence[Group], even: IntArray) -> Sets:
    """The fewest chosen touches with the mean relative variance of an even grid."""
    wanted = relative(lowest_sd(planned.select(even), asked, len(even)).value)[-1]
    choice = lowest_sd(planned, asked, 2 * len(even))
    reached = np.flatnonzero(relative(choice.value) <= wanted)
    return Sets(even, choice.chosen[: int(reached[0])])


@dataclass(frozen=True, eq=False)
class Row:
    """A line of the table: touches of even grids and chosen ones by seed, and what readings made of both sets."""

    body: str
    asked: str
    sets: tuple[Sets, ...]
    check: str

    def cells(self) -> list[str]:
        """As text."""
        even, chosen = (
            float(np.median([len(getattr(each, name)) for each in self.sets])) for name in Sets.__annotations__
        )
        saved = np.array([each.saved for each in self.sets]) * 100
        ends = f"{np.median(saved):.0f} % ({saved.min():.0f} to {saved.max():.0f})"
        return [self.body, self.asked, f"{even:.0f}", f"{chosen:.0f}", ends.replace("-", "−"), self.check]


def with_touches(dataset: bayestouch.DataSet, index: IntArray) -> bayestouch.DataSet:
    """The data set with some of the touches to be read among those of the calibration."""
    table = dataset.touches
    ids = table.touch[np.sort(np.unique(table.touch, return_index=True)[1])]
    assert dataset.calibration is not None
    more = table.select(np.isin(table.touch, ids[index]))
    return replace(dataset, calibration=joined_tables(dataset.calibration, more))


def places_of(one: bayestouch.Calibration) -> bayestouch.Touches:
    """Touches that are read: round tips on a finger, everywhere on a pad."""
    tips = None if np.isnan(one.rows.radius_mm).all() else [1.59, 3.9, 12.3]
    return bayestouch.candidate_touches(one, tips_mm=tips)


def asked_of(
    one: bayestouch.Calibration, dataset: bayestouch.DataSet, about: str
) -> tuple[PlannedTouches, IntArray, tuple[Group, ...]]:
    """Planned touches of the data set, which of them are candidates, and what is asked for."""
    body = body_of(one.sensor)
    n = dataset.touches.n_touches
    if about == "calibration":
        planned = body.planned(one, dataset.touches)
        return planned, np.arange(n), planned.parameters
    planned = body.planned(one, joined_tables(dataset.touches, read := places_of(one)))
    return planned, np.arange(n), planned.biases(n + np.arange(read.n_touches))


def sd_rows(name: str, options: dict[str, object], datasets: Sequence[bayestouch.DataSet]) -> Iterator[Row]:
    """Rows on standard deviations, for fingers or pads."""
    first = [bayestouch.calibrate(each, draws=800, **options) for each in datasets]  # type: ignore[arg-type]
    for about in ("calibration", "places"):
        for count in EVEN:
            found, ratios = [], []
            for k, (one, dataset) in enumerate(zip(first, datasets, strict=True)):
                planned, candidates, asked = asked_of(one, dataset, about)
                sets = sets_for_sd(planned.readings.select(candidates), asked, even_grid(dataset.touches, count))
                found.append(sets)
                if k < CHECKED and count == EVEN[-1]:
                    ratios.append(
                        np.subtract(*(after(one, dataset, each, about, options) for each in (sets.chosen, sets.even)))
                    )
            check = (
                f"{100 * np.expm1(np.mean(ratios)):+.1f} % ± {100 * np.std(ratios, ddof=1) / np.sqrt(len(ratios)):.1f}"
                if ratios
                else ""
            )
            yield Row(name, asked_words(asked), tuple(found), check.replace("-", "−"))


CHECKED = 6


def after(
    one: bayestouch.Calibration, dataset: bayestouch.DataSet, index: IntArray, about: str, options: dict[str, object]
) -> float:
    """Log of the rms relative sd after a calibration with more touches, from their readings."""
    again = bayestouch.calibrate(with_touches(dataset, index), draws=800, **options)  # type: ignore[arg-type]
    sds = []
    for each in (one, again):
        planned, _, asked = asked_of(each, dataset, about)
        covariance = planned.readings.covariance
        sds.append([np.einsum("kd,de,ke->", group.rows, covariance, group.rows) for group in asked])
    return 0.5 * float(np.log(np.mean(np.array(sds[1]) / np.array(sds[0]))))


def asked_words(asked: Sequence[Group]) -> str:
    """Names of what is asked for."""
    return ", ".join(each.name for each in asked)


def cause_rows(seeds: Sequence[int]) -> Iterator[Row]:
    """Rows on decisions between two causes of fingers."""
    for cause, size, other in PAIRS:
        found, log_ratios = [], []
        for seed in seeds:
            dataset = bayestouch.simulate(FINGER_OF_CAUSES, effects={cause: size}, seed=seed).dataset
            assert dataset.calibration is not None
            alone = replace(dataset, calibration=None, touches=dataset.calibration)
            diagnosis = bayestouch.diagnose(alone, draws=200, sample=False, seed=seed)
            begun = float(np.nanmax(dataset.calibration.time_s))
            table = dataset.touches.with_(time_s=dataset.touches.time_s - begun)
            try:
                models = two_models(diagnosis, (cause, other), planned_table(table, diagnosis.calibration_after))
            except bayestouch.InputError:
                continue  # these data do not show the other cause at all
            sets = sets_for_decision(models, table)
            if sets is not None:
                found.append(sets)
                log_ratios.append([log_ratio(models, table, each) for each in (sets.chosen, sets.even)])
        if found:
            won = np.array(log_ratios)
            check = f"{won[:, 0].mean():.1f} and {won[:, 1].mean():.1f} nat; right {(won[:, 0] > 0).sum()} and {(won[:, 1] > 0).sum()} of {len(won)}"
            yield Row("finger", f"{cause} or {other}", tuple(found), check)


FINGER_OF_CAUSES = replace(FINGER, edge_step_deg=3.5, flat_step_deg=7.0)


def sets_for_decision(models: Sequence[PlannedReadings], table: bayestouch.Touches) -> Sets | None:
    """The smallest even grid that decides, and the fewest chosen touches; None if `MOST` even ones do not."""
    one, other = models
    for count in range(1, MOST + 1):
        even = even_grid(table, count)
        reached = most_decisive(one.select(even), other.select(even), count).value[-1, 0]
        if reached >= DECIDED:
            value = most_decisive(one, other, count).value[:, 0]
            chosen = most_decisive(one, other, int(np.argmax(value >= min(DECIDED, value[-1])))).chosen
            return Sets(even, chosen)
    return None


def log_ratio(models: Sequence[PlannedReadings], table: bayestouch.Touches, index: IntArray) -> float:
    """Log density of the readings of some touches by the first model minus that by the second."""
    from scipy.stats import multivariate_normal

    rest = table.averaged().readings[index].ravel()
    logs = []
    for each in models:
        some = each.select(index)
        columns = some.columns.reshape(len(rest), -1)
        total = columns @ some.covariance @ columns.T
        m = some.mean.shape[1]
        for i, noise in enumerate(some.noise):
            total[i * m : (i + 1) * m, i * m : (i + 1) * m] += noise
        logs.append(multivariate_normal.logpdf(rest, some.mean.ravel(), total))
    return float(logs[0] - logs[1])


def table_of(rows: Sequence[Row]) -> str:
    """Markdown table."""
    head = ("sensor", "asked for", "even grid", "chosen", "saved (of seeds)", "with readings")
    return markdown_table(head, [each.cells() for each in rows])


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table, and with ``--docs`` write it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--development", action="store_true", help="seeds for looking")
    parser.add_argument("--docs", action="store_true", help="write the table of docs/calibrate_your_own.md")
    options = parser.parse_args(arguments)
    seeds = DEVELOPMENT if options.development else FRESH
    rows: list[Row] = []
    for source in (
        sd_rows("finger", {}, [bayestouch.simulate(FINGER, seed=seed).dataset for seed in seeds]),
        sd_rows("pad", {"kernel": "gaussian"}, [bayestouch.simulate(PAD, seed=seed).dataset for seed in seeds]),
        cause_rows(seeds),
    ):
        for row in source:
            print(" | ".join(row.cells()), flush=True)
            rows.append(row)
    if options.docs:
        put_into_page("next_touches.py", table_of(rows), DOCS / "calibrate_your_own.md")


if __name__ == "__main__":
    main()
