"""Ranks of the truth among posterior draws, and tests of their uniformity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import ndtr, ndtri

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.errors import InputError, few, nearest
from bayestouch.output.summary import Summarised, span, summary_html
from bayestouch.output.text import number, plural

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from pandas import DataFrame


BINS = 20
# Number of draws for a rank: few enough that draws thinned from several hundred are independent.
RANKED = 99
COLUMNS = 5
# Maximum number of characters of a label below a narrow panel.
LETTERS = 24


@dataclass(frozen=True, repr=False)
class PooledSpread(Summarised):
    """Mean square of the normal scores of all quantities together.

    Quantities of one simulation are correlated, so that the effective number of independent scores is smaller than
    their number. It follows from the correlations of the squared scores over the simulations.

    Attributes
    ----------
    mean_square : float
        1 if the posteriors are correct, larger if they are too narrow.
    scores : float
        Effective number of independent scores.
    p_value : float
        Two-sided probability of a mean square at least as far from 1 if the posteriors are correct.
    """

    mean_square: float
    scores: float
    p_value: float


@dataclass(frozen=True, eq=False, repr=False)
class RankStatistics(Summarised):
    """Ranks of the truth among posterior draws, with tests of their uniformity.

    Attributes
    ----------
    ranks : mapping of (n,) int arrays
        Rank of the truth among `ranked` draws, 0 to `ranked`, by parameter.
    ranked : int
        Number of draws.
    p_value : mapping of float
        By parameter: three times the smallest p-value of three statistics, at most 1 (Bonferroni correction). The
        statistics are chi-square of the ranks in 20 equal bins, the mean of the normal scores of the ranks (tests for
        bias), and their mean square (tests whether the posterior is too narrow or too wide).
    mean_square : mapping of float
        This mean square: 1 if the posterior is correct, larger if it is too narrow; its sd is ``sqrt(1.83/n)``.
    coverage_90 : mapping of float
        Fraction of the simulations in which the central 90 % interval contains the truth.
    pooled : PooledSpread
        Mean square of the scores of all quantities: sensitive to posteriors that are all a little too narrow.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> dataset = bayestouch.simulate(design, seed=3).dataset
    >>> calibration = bayestouch.calibrate(dataset, draws=200)
    >>> ranks = bayestouch.sbc(calibration, simulations=100, draws=200)
    >>> {name: len(each) for name, each in ranks.ranks.items()}
    {'R': 100, 'r_c': 100, 'theta_c': 100, 'P': 100}
    >>> ranks.to_dataframe().columns.tolist()
    ['parameter', 'p_value', 'mean_square', 'coverage_90']
    """

    ranks: Mapping[str, IntArray]
    ranked: int
    p_value: Mapping[str, float]
    mean_square: Mapping[str, float]
    coverage_90: Mapping[str, float]
    pooled: PooledSpread

    def passes(self, level: float = 0.01) -> bool:
        """Return True if the pooled p-value and the p-value of every parameter reach their thresholds.

        Half of the level is for the pooled statistic; the other half is divided among the parameters (Bonferroni). A
        correct posterior fails with a probability of at most `level`, for any dependence between the parameters.
        """
        each = min(self.p_value.values()) >= self.threshold(level)
        return each and self.pooled.p_value >= self.pooled_threshold(level)

    def threshold(self, level: float = 0.01) -> float:
        """Return the minimum p-value of a parameter for passing."""
        return level / 2 / len(self.p_value)

    def pooled_threshold(self, level: float = 0.01) -> float:
        """Return the minimum pooled p-value for passing."""
        return level / 2

    def table(self) -> str:
        """Return a text table of p-value, mean square of the normal scores and coverage by parameter, then pooled."""
        width = max(map(len, self.ranks))
        lines = [f"{'':{width}}  p-value  mean square  coverage of 90 %"]
        for name in self.ranks:
            values = f"{self.p_value[name]:7.3f}  {self.mean_square[name]:11.3f}  {self.coverage_90[name]:16.3f}"
            lines.append(f"{name:{width}}  {values}")
        pooled = self.pooled
        lines.append(
            f"all together: mean square {pooled.mean_square:.3f}, worth {pooled.scores:.0f} independent scores, "
            f"p-value {pooled.p_value:.3f}"
        )
        return "\n".join(lines)

    def to_dataframe(self) -> DataFrame:
        """Return a data frame with one row per parameter."""
        import pandas as pd

        columns = {"p_value": self.p_value, "mean_square": self.mean_square, "coverage_90": self.coverage_90}
        return pd.DataFrame(
            {"parameter": list(self.ranks), **{k: [v[n] for n in self.ranks] for k, v in columns.items()}}
        )

    def _repr_html_(self) -> str:
        table = self.to_dataframe().to_html(index=False, float_format="{:.3f}".format, border=0)
        return summary_html(self) + table

    def plot_ranks(self, name: str, axes: Axes | None = None) -> Axes:
        """Plot the histogram of one parameter's ranks, with the band of 99 % of the bars of a uniform histogram.

        Raises
        ------
        InputError
            No parameter has this name.
        """
        from scipy.stats import binom

        from bayestouch.results.plots import new_axes

        if name not in self.ranks:
            known = few(list(self.ranks), 20)
            raise InputError(f"{name}: no such parameter; expected one of {known}{nearest(name, self.ranks)}")
        axes, ranks = new_axes(axes), self.ranks[name]
        axes.axhspan(*np.asarray(binom.ppf([0.005, 0.995], len(ranks), 1 / BINS)), color="0.88")
        axes.hist(ranks, bins=np.linspace(-0.5, self.ranked + 0.5, BINS + 1).tolist(), color="#0072b2")
        axes.set(xlabel=fill(f"rank of the true {name}", LETTERS), ylabel="simulations")
        axes.set_title(f"p = {self.p_value[name]:.2g}")
        return axes

    def plot(self) -> Figure:
        """Plot the histograms of all ranks, see `plot_ranks`."""
        from matplotlib.figure import Figure

        columns = min(COLUMNS, len(self.ranks))
        rows = -(-len(self.ranks) // columns)
        figure = Figure(figsize=(2.6 * columns, 2.2 * rows), layout="constrained")
        axes = figure.subplots(rows, columns, squeeze=False).ravel()
        for axis, name in zip(axes, self.ranks, strict=False):
            self.plot_ranks(name, axis)
        for axis in axes[len(self.ranks) :]:
            axis.remove()
        return figure

    def summary_lines(self) -> list[str]:
        """Lines of the ``repr``."""
        count = len(next(iter(self.ranks.values())))
        worst = min(self.p_value, key=lambda name: self.p_value[name])
        spans = (span(list(values.values())) for values in (self.mean_square, self.coverage_90))
        square, coverage = spans
        return [
            f"Ranks of {plural(count, 'simulation')}: {'uniform' if self.passes() else 'not uniform'} at 1 %",
            f"{plural(len(self.ranks), 'parameter')}, ranks among {self.ranked} draws",
            f"least p-value {number(self.p_value[worst])} ({worst[:60]}), threshold {number(self.threshold())}",
            f"mean square of the normal scores{square}; coverage of 90 % intervals{coverage}",
        ]


def rank_statistics(draws: Mapping[str, FloatArray], truth: Mapping[str, FloatArray]) -> RankStatistics:
    """Return the ranks of the truth (n,) among draws (chain, draw, n), thinned to `RANKED` over all chains."""
    ranks: dict[str, IntArray] = {}
    coverage: dict[str, float] = {}
    for name, true in truth.items():
        flat = draws[name].reshape(-1, len(true))
        ranks[name] = rank(flat, true)
        low, high = np.quantile(flat, [0.05, 0.95], axis=0)
        coverage[name] = float(np.mean((low <= true) & (true <= high)))
    return of_ranks(ranks, coverage)


def rank(draws: FloatArray, true: FloatArray) -> IntArray:
    """Return the rank of each truth (n,) among `RANKED` of the draws (draw, n); NaN draws count as larger."""
    thinned = draws[np.linspace(0, len(draws) - 1, RANKED).round().astype(np.int64)]
    return np.asarray((thinned < true).sum(axis=0))


def of_ranks(ranks: Mapping[str, IntArray], coverage_90: Mapping[str, float]) -> RankStatistics:
    """Return the statistics of given ranks."""
    scores = {name: normal_scores(each) for name, each in ranks.items()}
    return RankStatistics(
        ranks=ranks,
        ranked=RANKED,
        p_value={name: _p_value(each, scores[name]) for name, each in ranks.items()},
        mean_square={name: float(np.mean(each**2)) for name, each in scores.items()},
        coverage_90=coverage_90,
        pooled=pooled_spread(np.stack(list(scores.values()))),
    )


def normal_scores(ranks: IntArray) -> FloatArray:
    """Return normal scores of ranks among `RANKED` draws; their mean square is 1 if all ranks are equally likely."""
    return np.asarray(ndtri((np.asarray(ranks) + 0.5) / (RANKED + 1)) / _SCALE)


# With this number of ranks the scores are between ±2.6: their mean square is a little less than 1 (therefore they are
# scaled), and the variance of their square is a little below 2.
_SCALE = float(np.sqrt(np.mean(ndtri((np.arange(RANKED + 1) + 0.5) / (RANKED + 1)) ** 2)))
VARIANCE_OF_SQUARE = float(np.var(normal_scores(np.arange(RANKED + 1)) ** 2))


def pooled_spread(scores: FloatArray) -> PooledSpread:
    """Return the mean square of normal scores (quantity, simulation), and its p-value.

    The simulations are independent, but the quantities of one simulation are not. The variance of a sum of squares over
    q quantities with correlations c is ``sum(c)`` times that of one square: the effective number is ``q²/sum(c)``.
    """
    squares = np.asarray(scores) ** 2
    q, n = squares.shape
    varied = squares.std(axis=1) > 0
    standard = (squares[varied] - squares[varied].mean(axis=1, keepdims=True)) / squares[varied].std(axis=1)[:, None]
    # sum of the correlations; constant ranks have no correlation with others
    total = float(standard.sum(axis=0).var()) + float((~varied).sum())
    independent = n * q**2 / total
    mean_square = float(squares.mean())
    return PooledSpread(mean_square, independent, spread_p_value(mean_square, independent))


def spread_p_value(mean_square: float, scores: float) -> float:
    """Return the two-sided p-value of the mean square of `scores` independent normal scores.

    It is computed from the chi-square distribution with the same mean and variance.
    """
    from scipy.stats import chi2

    dof = 2 * scores / VARIANCE_OF_SQUARE
    below, above = chi2.cdf(mean_square * dof, dof), chi2.sf(mean_square * dof, dof)
    return 2 * min(float(below), float(above))


def _p_value(ranks: IntArray, scores: FloatArray) -> float:
    """Three times the smallest p-value of chi-square over bins, mean and mean square of the normal scores."""
    from scipy.stats import chisquare

    n = len(ranks)
    # the RANKED + 1 possible ranks are divided into BINS equal bins
    bins = float(chisquare(np.bincount(ranks * BINS // (RANKED + 1), minlength=BINS)).pvalue)
    bias = 2 * float(ndtr(-abs(scores.mean()) * np.sqrt(n)))
    return min(1.0, 3 * min(bins, bias, spread_p_value(float(np.mean(scores**2)), n)))
