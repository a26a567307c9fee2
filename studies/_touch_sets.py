"""Even grids of touches, and the fewest chosen touches that tell as much; for `studies/next_touches.py`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import bayestouch
from bayestouch.array_types import FloatArray, IntArray
from bayestouch.data.averages import TouchMeans
from bayestouch.model.planned import Group, PlannedReadings
from bayestouch.reliability.choice_of_touches import lowest_sd, most_decisive

# A decision counts from this log Bayes factor (odds of 150 to 1); largest even grid.
DECIDED, MOST = 5.0, 60
TIPS = (0.0, 1.59, 3.9, 12.3, np.inf)
#: Range of places: low and high end of each coordinate.
Box = tuple[FloatArray, FloatArray]


@dataclass(frozen=True, eq=False)
class Sets:
    """An even grid and the chosen touches that tell as much: indices among the candidates."""

    even: IntArray
    chosen: IntArray

    @property
    def saved(self) -> float:
        """Share of the touches of the even grid that the choice saves, %."""
        return 100 * (1 - len(self.chosen) / len(self.even))


def even_grids(means: TouchMeans, count: int, box: Box | None = None) -> list[IntArray]:
    """Even grids of candidates over a box, by default over all places."""
    place = means.location if means.angle_deg is None else means.angle_deg[:, None]
    low, high = (place.min(axis=0), place.max(axis=0)) if box is None else box
    if means.angle_deg is None:
        return [_nearest(place, _plane((low, high), count))]
    out = []
    for tips in ((0.0, np.inf), TIPS):
        tip = np.array(tips)[np.arange(count) % len(tips)]
        pairs = np.column_stack([place, 1e6 * np.searchsorted(TIPS, means.indenter_radius_mm)])
        wanted = np.column_stack([np.linspace(low, high, count), 1e6 * np.searchsorted(TIPS, tip)])
        out.append(_nearest(pairs, wanted))
    return out


def _plane(box: Box, count: int) -> FloatArray:
    """About `count` places in the middles of equal cells of a box."""
    low, high = box
    across = max(1, round(np.sqrt(count * (high[0] - low[0]) / (high[1] - low[1]))))
    sides = across, round(count / across)
    axes = [(np.arange(n) + 0.5) / n * (b - a) + a for n, a, b in zip(sides, low, high, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)


def _nearest(places: FloatArray, wanted: FloatArray) -> IntArray:
    """Index of the place nearest to each wanted one, each place once."""
    distance = ((wanted[:, None] - places) ** 2).sum(axis=2)
    out = list[int]()
    for row in distance:
        row[out] = np.inf
        out.append(int(np.argmin(row)))
    return np.array(out)


def relative(value: FloatArray) -> FloatArray:
    """Mean of the variances of the quantities over those before, (c + 1,), of sds (c + 1, g)."""
    return np.asarray(np.mean((value / value[0]) ** 2, axis=1))


def sets_for_sd(planned: PlannedReadings, asked: Sequence[Group], evens: Sequence[IntArray]) -> Sets:
    """The best even grid, and the fewest chosen touches that are not worse."""
    reached = [relative(lowest_sd(planned.select(each), asked, len(each)).value)[-1] for each in evens]
    best = int(np.argmin(reached))
    choice = lowest_sd(planned, asked, 2 * len(evens[best]))
    enough = np.flatnonzero(relative(choice.value) <= reached[best])
    return Sets(evens[best], choice.chosen[: int(enough[0])])


def sets_for_decision(models: Sequence[PlannedReadings], means: TouchMeans) -> Sets | None:
    """The smallest even grid that decides, and the fewest chosen touches; None if `MOST` even ones do not."""
    one, other = models
    for count in range(1, MOST + 1):
        for even in even_grids(means, count):
            if most_decisive(one.select(even), other.select(even), count).value[-1, 0] >= DECIDED:
                choice = most_decisive(one, other, count)
                enough = np.flatnonzero(choice.value[:, 0] >= DECIDED)
                return Sets(even, choice.chosen[: int(enough[0]) if len(enough) else count])
    return None


def log_ratio(models: Sequence[PlannedReadings], table: bayestouch.Touches, index: IntArray) -> float:
    """Log density of the readings of some touches by the first model minus that by the second."""
    from scipy.stats import multivariate_normal

    read = table.averaged().readings[index].ravel()
    logs = []
    for each in models:
        some = each.select(index)
        m = some.mean.shape[1]
        columns = some.columns.reshape(len(read), -1)
        total = columns @ some.covariance @ columns.T
        for i, noise in enumerate(some.noise):
            total[i * m : (i + 1) * m, i * m : (i + 1) * m] += noise
        logs.append(multivariate_normal.logpdf(read, some.mean.ravel(), total))
    return float(logs[0] - logs[1])
