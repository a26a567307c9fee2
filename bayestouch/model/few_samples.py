"""Mean readings of touches with few samples, of which some may be outliers.

The median of many samples shows which of them are wrong. Few samples do not: one reading may be right or wrong, and of
two that differ either may be. The other elements of the touch can tell. What they expect is weighed with what the
samples allow, as for the touches of a calibration (`OutlierLikelihood.true_means`), and the normal density that says
the same replaces that of the mean. As each element expects something of the others, this is repeated.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray, IntArray
from bayestouch.data.averages import TouchMeans
from bayestouch.data.grouping import groups
from bayestouch.data.sample_rows import reads_of_rows
from bayestouch.data.touches import Touches
from bayestouch.effects.effect import Values
from bayestouch.model.outlier_likelihood import OutlierLikelihood, grouped_samples
from bayestouch.model.outliers import RightReadings

# With so many samples left, more than half of all, those that are left out are surely wrong and the others right.
ENOUGH = 4
# Number of times that all touches are fitted; a further one changes the means by less than a tenth of their sd.
ROUNDS = 8
# Sd of the true mean about the samples, over that of a wrong reading, if no other element tells it.
UNKNOWN = 2.0
# Least variance of an expected true mean, over that of a reading: the noise of a reading is known to some per cent.
LEAST = 1e-2
# Largest distance of a mean beyond the samples, in sd of a right reading.
BEYOND = 3.0
# An element that contradicts the others has a mean whose variance is this many times that of right samples. It is not
# explained by outliers if it does so in more touches than the second number of sd above the expected number.
CONTRADICTS, UNEXPLAINED = 10.0, 5.0

#: From means, the difference of each reading from what the other elements expect, and its variance, (t, m) both;
#: infinite where they expect nothing.
Expected = Callable[[TouchMeans], tuple[FloatArray, FloatArray]]

#: Means and variances of normal densities, (g,) both.
Normals = tuple[FloatArray, FloatArray]


@dataclass(frozen=True, eq=False)
class FewSamples:
    """Samples of g groups (one element in one touch) with so few samples that they do not show which are outliers.

    Attributes
    ----------
    likelihood : OutlierLikelihood
        Density of the samples, relative to their mean, in units of the own noise of a reading. Effects of the noise add
        what they do at the signal that samples and other elements together tell.
    centre : (g,) array
        Mean of the samples of each group, right or wrong.
    rest : (g,) array
        Variance of the rest reading that was subtracted from each group, over that of a right reading.
    values : tuple of float
        Share of wrong readings, and the sd of their errors over the peak.
    right : RightReadings
        Noise of readings that are not wrong.
    """

    likelihood: OutlierLikelihood
    centre: FloatArray
    rest: FloatArray
    values: Values
    right: RightReadings

    @classmethod
    def of(cls, doubtful: Touches, values: Values, right: RightReadings) -> FewSamples | None:
        """Groups of samples of a table that has only the readings in doubt, see `doubtful_samples`; None without any.

        `values` and `right` are as the attributes. None, too, if rows are means of several reads: their own
        scatter is not that of a reading.
        """
        rows = np.flatnonzero(doubtful.in_contact)
        if (reads_of_rows(doubtful)[rows] != 1).any():
            return None
        samples = grouped_samples(doubtful.readings[rows], groups(doubtful.touch[rows])[1])
        touch, element = np.nonzero(~np.isnan(samples).all(axis=2))
        if not len(touch):
            return None
        samples = samples[touch, element]
        centre = np.nanmean(samples, axis=1)
        deviation = (samples - centre[:, None]) / right.sd[element, None]
        likelihood = _likelihood(right, deviation, element, touch, np.nanmedian(samples, axis=1))
        rest = np.zeros(len(touch))
        if doubtful.rest_reads is not None:
            first = np.unique(groups(doubtful.touch[rows])[1], return_index=True)[1]
            rest = np.nan_to_num(1 / doubtful.rest_reads[rows][first][touch, element])
        return cls(likelihood, centre, rest, values, right)

    def weighed(self, means: TouchMeans, expected: Expected) -> TouchMeans:
        """The means of touches, those of the groups replaced by what samples and other elements say together.

        `TouchMeans.counts` is the number of right samples whose mean would have the same variance.
        """
        at, flat = self.likelihood, UNKNOWN**2 * self._wrong_variance
        of_samples = self._true_means(np.zeros(len(self.centre)), flat)
        best = np.full(means.n_touches, -np.inf)
        found, spread, signal = of_samples, flat, self.centre
        for now in self._starts(means, of_samples, expected):
            here = self
            for _ in range(ROUNDS):
                about, told = here._of_others(means, now, expected)
                together = _product(now, (self.centre + about, told))[0]
                here = here._at(together)
                now = _between(now, here._true_means(about, told))
            agree = here._agreement(means.n_touches, about, told)
            better = (agree > best)[at.touch]
            best = np.maximum(agree, best)
            found = np.where(better, now[0], found[0]), np.where(better, now[1], found[1])
            spread, signal = np.where(better, told, spread), np.where(better, together, signal)
        return self._at(signal)._replaced(means, found, spread, of_samples)

    def _at(self, signal: FloatArray) -> FewSamples:
        """The same samples, with the noise of right readings at signals of the groups, (g,).

        A reader has this noise at the signal that it predicts. At a wrong reading far from it there is another one.
        """
        if not self.right.added.adds:
            return self
        at = self.likelihood
        return replace(self, likelihood=_likelihood(self.right, at.deviation, at.element, at.touch, signal))

    def _replaced(self, means: TouchMeans, found: Normals, spread: FloatArray, of_samples: Normals) -> TouchMeans:
        """The means of touches with what was `found`, or with what samples say where outliers do not explain it."""
        explained = self._explained(found, spread)
        return self._in(means, *(np.where(explained, one, other) for one, other in zip(found, of_samples, strict=True)))

    def _starts(self, means: TouchMeans, of_samples: Normals, expected: Expected) -> Iterator[Normals]:
        """Means and variances to start from: what the samples say (`of_samples`), and the same without one element.

        This is the element of each touch without which the others agree best. One wrong reading far from the touch can
        move the fit there, and all right readings contradict it then.
        """
        yield of_samples
        at, wrong, right = self.likelihood, self._wrong_variance, self._right_variance / self.likelihood.count
        if not (of_samples[1] > CONTRADICTS * right).any():
            return
        best, left_out = np.full(means.n_touches, -np.inf), np.zeros(means.n_touches)
        for element in range(means.n_elements):
            tried = of_samples[0], np.where(at.element == element, wrong, right)
            agree = self._agreement(means.n_touches, *self._of_others(means, tried, expected))
            better = agree > best
            best[better], left_out[better] = agree[better], element
        yield of_samples[0], np.where(at.element == left_out[at.touch], wrong, of_samples[1])

    def _agreement(self, n_touches: int, about: FloatArray, spread: FloatArray) -> FloatArray:
        """Log density (t,) of the mean samples of each touch, each as the others expect them: right or wrong."""
        probability, right = self.values[0], self._right_variance / self.likelihood.count
        density = (1 - probability) * _density(about, spread + right)
        density += probability * _density(about, spread + self._wrong_variance)
        return np.asarray(np.bincount(self.likelihood.touch, np.log(density + 1e-300), n_touches), dtype=np.float64)

    def _of_others(self, means: TouchMeans, found: Normals, expected: Expected) -> Normals:
        """True mean of each group that the other elements expect, relative to its centre, and its variance, (g,)."""
        difference, variance = (
            each[self.likelihood.touch, self.likelihood.element] for each in expected(self._in(means, *found))
        )
        known = np.isfinite(variance)
        own = found[1] + self.rest * self._right_variance
        about = np.where(known, found[0] - difference - self.centre, 0.0)
        spread = np.maximum(variance - own, LEAST * self._right_variance)
        return about, np.where(known, spread, UNKNOWN**2 * self._wrong_variance)

    @property
    def _sd(self) -> FloatArray:
        """Own noise of a reading of each group, (g,), the unit of `likelihood`."""
        return self.right.sd[self.likelihood.element]

    @property
    def _right_variance(self) -> FloatArray:
        """Variance of a reading of each group that is right, (g,)."""
        return np.asarray(self._sd**2 * (1 + self.likelihood.others))

    @property
    def _wrong_variance(self) -> FloatArray:
        """Variance of a reading of each group that is surely wrong, (g,)."""
        return np.asarray(self._right_variance + (self.values[1] * self.right.peak[self.likelihood.element]) ** 2)

    def _true_means(self, about: FloatArray, spread: FloatArray) -> Normals:
        """Mean and variance (g,) that replace the samples, if `about` (g,), from their centre, is expected.

        If the samples say less than nothing about it, as they contradict what is expected, these are the mean of the
        samples, and the variance of a wrong reading.
        """
        sd, own = self._sd, np.ones(len(self.right.sd))
        found = self.likelihood.true_means(self.values, own, about / sd, spread / sd**2)
        mean, variance = self.centre + found.mean * sd, found.variance * sd**2
        # A normal density beyond all samples replaces two separate ranges of the true mean, and is far too sure.
        samples = self.likelihood.deviation
        beyond = np.maximum(np.nanmin(samples, axis=1) - found.mean, found.mean - np.nanmax(samples, axis=1))
        wrong = (variance > self._wrong_variance) | (beyond > BEYOND * np.sqrt(1 + self.likelihood.others))
        return np.where(wrong, self.centre, mean), np.where(wrong, self._wrong_variance, variance)

    def _explained(self, found: Normals, spread: FloatArray) -> BoolArray:
        """Whether outliers explain how often the element of each group contradicts the others, (g,).

        They do not if the element has a fault, which the check of the sensor shall find.
        """
        told, count = spread < self._wrong_variance, self.likelihood.count
        wrong = told & (found[1] > CONTRADICTS * self._right_variance / count)
        m, element = len(self.right.sd), self.likelihood.element
        often = np.bincount(element, wrong, m)
        usual = np.bincount(element, told * np.minimum(1.0, self.values[0] * count), m)
        return np.asarray((often <= usual + UNEXPLAINED * np.sqrt(usual + 1))[element])

    def _in(self, means: TouchMeans, mean: FloatArray, variance: FloatArray) -> TouchMeans:
        """The means of touches with `mean` and `variance` (g,) of the groups."""
        readings, counts = means.readings.copy(), means.counts.astype(np.float64)
        at = self.likelihood.touch, self.likelihood.element
        readings[at] = mean
        counts[at] = 1 / (variance / self._right_variance + self.rest)
        return replace(means, readings=readings, counts=counts, load_reads=means.reads_of_load)


def _likelihood(
    right: RightReadings, deviation: FloatArray, element: IntArray, touch: IntArray, signal: FloatArray
) -> OutlierLikelihood:
    """Density of the deviations (g, k) of samples, in units of the own noise, with all noise at signals (g,)."""
    others = right.added_variance(signal, element) / right.sd[element] ** 2
    return OutlierLikelihood.about(deviation, element, touch, np.ones(len(right.sd)), right.sd / right.peak, others)


def _product(one: Normals, other: Normals) -> Normals:
    """Mean and variance of the product of two normal densities."""
    variance = 1 / (1 / one[1] + 1 / other[1])
    return variance * (one[0] / one[1] + other[0] / other[1]), variance


def _between(one: Normals, other: Normals) -> Normals:
    """Mean and variance of the root of the product of two normal densities, with the same weight as each of them.

    Steps of half the way do not go to and fro where two elements each say that the other is wrong.
    """
    mean, variance = _product(one, other)
    return mean, 2 * variance


def _density(off: FloatArray, variance: FloatArray) -> FloatArray:
    """Normal density at a distance from its mean, up to a constant factor."""
    return np.asarray(np.exp(-0.5 * off**2 / variance) / np.sqrt(variance))


def doubtful_samples(table: Touches, kept: Touches) -> Touches:
    """The table with only the readings of elements with few samples in their touch that are surely right, else NaN.

    Parameters
    ----------
    table, kept : Touches
        All readings, and those without the readings that are probably wrong by the median of their touch.
    """
    rows = np.flatnonzero(table.in_contact)
    _, group = groups(table.touch[rows])
    before, left = (grouped_counts(~np.isnan(each.readings[rows]), group) for each in (table, kept))
    few = (left < ENOUGH) | (left <= 0.5 * before)
    readings = np.full(table.readings.shape, np.nan)
    readings[rows] = np.where(few[group], table.readings[rows], np.nan)
    return table.with_(readings=readings)


def grouped_counts(present: BoolArray, group: IntArray) -> FloatArray:
    """Number of rows (n, m) that are present in each group (n,), (t, m)."""
    return np.stack([np.bincount(group, column).astype(np.float64) for column in present.T], axis=1)
