"""Greedy choice of touches by what they are expected to determine, in closed form for normal distributions.

Each step takes the touch with the largest gain, given those that were taken before. A posterior covariance does not
depend on the readings, so no touch is simulated. The gain of a set of touches is nearly submodular, and the greedy
choice is then not far from the best set of this size.

Source: A. Krause, A. Singh and C. Guestrin, Near-optimal sensor placements in Gaussian processes, Journal of Machine
Learning Research 9 (2008) 235.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.model.planned import Group, PlannedReadings


@dataclass(frozen=True, eq=False)
class ChosenTouches:
    """Touches in the order in which they are chosen; c chosen of n touches, g quantities.

    Attributes
    ----------
    chosen : (c,) int array
        Indices of the touches.
    gain : (c, n) array
        Expected gain of every touch at each step; NaN for a touch that is chosen already.
    value : (c + 1, g) array
        Each quantity before the first touch and after each chosen one.
    """

    chosen: IntArray
    gain: FloatArray
    value: FloatArray


def lowest_sd(planned: PlannedReadings, asked: Sequence[Group], count: int) -> ChosenTouches:
    """Choose touches that lower standard deviations.

    The gain of a touch is the decrease of the mean over the groups of (sum of the variances of a group over that sum
    before the first touch): within a group, where all quantities have one unit, this is their rms standard deviation
    (the A-criterion); between groups only ratios count, so that the units do not matter.

    Parameters
    ----------
    planned : PlannedReadings
        Touches to choose from.
    asked : sequence of Group
        Quantities whose standard deviations are to be lowered.
    count : int
        Number of touches to choose.

    Returns
    -------
    ChosenTouches
        `value` is the rms standard deviation of each group.
    """
    knowledge = _Knowledge.of(planned)
    rows = np.concatenate([each.rows for each in asked])
    group = np.repeat(np.arange(len(asked)), [len(each.rows) for each in asked])
    about = rows @ planned.covariance
    variance = np.einsum("kd,kd->k", about, rows)
    sizes, before = np.bincount(group), np.bincount(group, weights=variance)
    weight = (1 / np.where(before > 0, before, np.inf))[group] / len(asked)
    chosen, gains, values = list[int](), list[FloatArray](), [np.sqrt(before / sizes)]
    for _ in range(count):
        cross = planned.columns @ about.T
        decrease = (cross * np.linalg.solve(knowledge.total, cross)).sum(axis=1)
        gain = decrease @ weight
        gain[chosen] = np.nan
        best = int(np.nanargmax(gain))
        variance = variance - decrease[best]
        about = about - cross[best].T @ np.linalg.solve(knowledge.total[best], knowledge.through[best])
        knowledge = knowledge.after(best)
        chosen.append(best)
        gains.append(gain)
        values.append(np.sqrt(np.maximum(np.bincount(group, weights=variance), 0.0) / sizes))
    return ChosenTouches(np.array(chosen), np.array(gains), np.array(values))


def most_decisive(one: PlannedReadings, other: PlannedReadings, count: int) -> ChosenTouches:
    """Choose touches that decide which of two models of the same touches is right.

    The gain of a touch is the expected increase of the log Bayes factor in favour of the right model, as the mean of
    the cases that the one or the other is right: half the sum of the two Kullback-Leibler divergences between what the
    models predict. Each prediction includes the uncertainty of its parameters, so that a difference which the
    parameters can imitate counts for nothing; and two drifts that differ only in their covariance are compared too.

    Parameters
    ----------
    one, other : PlannedReadings
        The same touches by two models.
    count : int
        Number of touches to choose.

    Returns
    -------
    ChosenTouches
        `value` is the expected log Bayes factor in nat, (c + 1, 1).
    """
    known = _Knowledge.of(one), _Knowledge.of(other)
    errors = _Errors.of(one, other), _Errors.of(other, one)
    chosen, gains, values = list[int](), list[FloatArray](), [0.0]
    for _ in range(count):
        gain = 0.5 * (errors[0].divergence(*known) + errors[1].divergence(*known[::-1]))
        gain[chosen] = np.nan
        best = int(np.nanargmax(gain))
        errors = errors[0].after(best, known[1]), errors[1].after(best, known[0])
        known = known[0].after(best), known[1].after(best)
        chosen.append(best)
        gains.append(gain)
        values.append(values[-1] + float(gain[best]))
    return ChosenTouches(np.array(chosen), np.array(gains), np.array(values)[:, None])


@dataclass(frozen=True, eq=False)
class _Knowledge:
    """What is known of all touches after those that were chosen; n touches, m elements, d unknowns.

    `through` (n, m, d) is the covariance of the readings with the unknowns, `total` (n, m, m) that of the readings.
    """

    planned: PlannedReadings
    through: FloatArray
    total: FloatArray

    @classmethod
    def of(cls, planned: PlannedReadings) -> _Knowledge:
        through = planned.columns @ planned.covariance
        return cls(planned, through, through @ planned.columns.swapaxes(1, 2) + planned.noise)

    def gain(self, touch: int) -> FloatArray:
        """Change of the mean of the unknowns per unit error of each reading of a touch, (d, m)."""
        return np.asarray(np.linalg.solve(self.total[touch], self.through[touch]).T)

    def after(self, touch: int) -> _Knowledge:
        """Knowledge after one more touch, by the matrix inversion lemma."""
        columns = self.planned.columns
        root = np.linalg.cholesky(self.total[touch])
        spread = np.linalg.solve(root, self.through[touch])
        felt = columns @ spread.T
        return _Knowledge(self.planned, self.through - felt @ spread, self.total - felt @ felt.swapaxes(1, 2))


@dataclass(frozen=True, eq=False)
class _Errors:
    """Errors of the predictions by a wrong model, if another model is right.

    Both the unknowns z of the right model and the estimates of the wrong one, which learns from each chosen touch, are
    normal. The error of a reading is ``mean + columns z + noise``; `through` is the covariance of the errors with z.
    """

    mean: FloatArray
    columns: FloatArray
    through: FloatArray
    noise: FloatArray

    @classmethod
    def of(cls, right: PlannedReadings, wrong: PlannedReadings) -> _Errors:
        """Before the first touch the estimates of the wrong model are known: those of its fit."""
        known = np.zeros(wrong.columns.shape)
        columns = np.concatenate([right.columns, -wrong.columns], axis=2)
        through = np.concatenate([right.columns @ right.covariance, known], axis=2)
        return cls(right.mean - wrong.mean, columns, through, right.noise)

    def divergence(self, right: _Knowledge, wrong: _Knowledge) -> FloatArray:
        """Expected log density of each touch by the right model minus that by the wrong one, (n,), nat."""
        square = self.through @ self.columns.swapaxes(1, 2) + self.noise + self.mean[:, :, None] * self.mean[:, None]
        spread = np.trace(np.linalg.solve(wrong.total, square), axis1=1, axis2=2)
        volume = np.linalg.slogdet(wrong.total)[1] - np.linalg.slogdet(right.total)[1]
        return np.asarray(0.5 * (spread - self.mean.shape[1] + volume))

    def after(self, touch: int, wrong: _Knowledge) -> _Errors:
        """Errors after the wrong model, which was `wrong` before, has learned from one more touch."""
        gain = wrong.gain(touch)
        learned = np.zeros((self.columns.shape[2], gain.shape[1]))
        learned[-len(gain) :] = gain
        felt, seen = self.columns @ learned, self.columns @ self.through[touch].T
        own = self.through[touch] @ self.columns[touch].T + self.noise[touch]
        through = self.through + seen @ learned.T + felt @ (self.through[touch] + own @ learned.T)
        return _Errors(self.mean + felt @ self.mean[touch], self.columns, through, self.noise)
