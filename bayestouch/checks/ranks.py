"""Ranks of known truth among posterior draws, and whether they are uniform."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import ndtr, ndtri

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.errors import InputError, few
from bayestouch.output.summary import Summarised, span, summary_html
from bayestouch.output.text import number, plural

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from pandas import DataFrame


BINS = 20
# Draws a rank is taken among: few enough to be independent when thinned from some hundred.
RANKED = 99
COLUMNS = 5
# of a label, as many as fit below a narrow panel
LETTERS = 24


@dataclass(frozen=True)
class PooledSpread:
    """Mean square of the normal scores of all quantities together.

    Quantities of one simulation are correlated: the mean square is worth fewer independent scores than there are. How
    many follows from the correlations of the squared scores over the simulations.

    Attributes
    ----------
    mean_square : float
        1 if the posteriors are right, above it if they are too narrow.
    scores : float
        Number of independent scores whose mean square scatters as much as this one.
    p_value : float
        Two-sided probability of a mean square at least as far from 1 if the posteriors are right.
    """

    mean_square: float
    scores: float
    p_value: float


@dataclass(frozen=True, eq=False, repr=False)
class RankStatistics(Summarised):
    """Ranks of the truth among posterior draws.

    Attributes
    ----------
    ranks : mapping of (n,) int arrays
        Rank of the truth among `ranked` draws, 0 to `ranked`, by parameter.
    ranked : int
        Number of draws.
    p_value : mapping of float
        By parameter: three times the least of the p-values of three statistics (at most 1), so that it is below any
        level at most that often if the posterior is right. They are the chi-square statistic of the ranks in 20 equal
        bins, and the mean (is the posterior biased?) and the mean square (is it too narrow or too wide?) of the normal
        scores of the ranks.
    mean_square : mapping of float
        That mean square: 1 if the posterior is right, above it if it is too narrow; scatters by ``sqrt(1.83/n)``.
    coverage_90 : mapping of float
        Share of the simulations whose central 90 % interval holds the truth.
    pooled : PooledSpread
        Mean square of the scores of all quantities: notices what makes all of them a little too narrow.
    """

    ranks: Mapping[str, IntArray]
    ranked: int
    p_value: Mapping[str, float]
    mean_square: Mapping[str, float]
    coverage_90: Mapping[str, float]
    pooled: PooledSpread

    def passes(self, level: float = 0.01) -> bool:
        """Whether the pooled p-value and the p-value of every parameter reach their thresholds.

        Half of the level goes to the pooled statistic, the other half is divided among the parameters (Bonferroni): a
        right posterior fails with a probability of at most `level`, however the parameters depend on each other.
        """
        each = min(self.p_value.values()) >= self.threshold(level)
        return each and self.pooled.p_value >= self.pooled_threshold(level)

    def threshold(self, level: float = 0.01) -> float:
        """Least p-value of a parameter with which the whole passes."""
        return level / 2 / len(self.p_value)

    def pooled_threshold(self, level: float = 0.01) -> float:
        """Least pooled p-value with which the whole passes."""
        return level / 2

    def table(self) -> str:
        """One line a parameter: p-value, mean square of the normal scores, coverage of 90 % intervals; then pooled."""
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
        """The same as a table, a row each parameter."""
        import pandas as pd

        columns = {"p_value": self.p_value, "mean_square": self.mean_square, "coverage_90": self.coverage_90}
        return pd.DataFrame(
            {"parameter": list(self.ranks), **{k: [v[n] for n in self.ranks] for k, v in columns.items()}}
        )

    def _repr_html_(self) -> str:
        table = self.to_dataframe().to_html(index=False, float_format="{:.3f}".format, border=0)
        return summary_html(self) + table

    def plot_ranks(self, name: str, axes: Axes | None = None) -> Axes:
        """Histogram of one parameter's ranks, with the band in which 99 % of a uniform histogram's bars lie.

        Raises
        ------
        InputError
            There is no such parameter.
        """
        from scipy.stats import binom

        from bayestouch.results.plots import new_axes

        if name not in self.ranks:
            raise InputError(f"{name}: expected one of {few(list(self.ranks), 20)}")
        axes, ranks = new_axes(axes), self.ranks[name]
        axes.axhspan(*np.asarray(binom.ppf([0.005, 0.995], len(ranks), 1 / BINS)), color="0.88")
        axes.hist(ranks, bins=np.linspace(-0.5, self.ranked + 0.5, BINS + 1).tolist(), color="#0072b2")
        axes.set(xlabel=fill(f"rank of the true {name}", LETTERS), ylabel="simulations")
        axes.set_title(f"p = {self.p_value[name]:.2g}")
        return axes

    def plot(self) -> Figure:
        """Histograms of all ranks, see `plot_ranks`."""
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
    """Ranks of known truth (n,) among draws (chain, draw, n), thinned to `RANKED` spread over the chains."""
    ranks: dict[str, IntArray] = {}
    coverage: dict[str, float] = {}
    for name, true in truth.items():
        flat = draws[name].reshape(-1, len(true))
        ranks[name] = rank(flat, true)
        low, high = np.quantile(flat, [0.05, 0.95], axis=0)
        coverage[name] = float(np.mean((low <= true) & (true <= high)))
    return of_ranks(ranks, coverage)


def rank(draws: FloatArray, true: FloatArray) -> IntArray:
    """Rank of each truth (n,) among `RANKED` of the draws (draw, n); draws that are NaN count as above it."""
    thinned = draws[np.linspace(0, len(draws) - 1, RANKED).round().astype(np.int64)]
    return np.asarray((thinned < true).sum(axis=0))


def of_ranks(ranks: Mapping[str, IntArray], coverage_90: Mapping[str, float]) -> RankStatistics:
    """Statistics of ranks that are there."""
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
    """Normal scores of ranks among `RANKED` draws: of mean square 1 if all ranks are equally likely."""
    return np.asarray(ndtri((np.asarray(ranks) + 0.5) / (RANKED + 1)) / _SCALE)


# Scores of so many ranks end at ±2.6: their mean square is a little less than 1 (so they are scaled), and their square
# has a variance a little below 2.
_SCALE = float(np.sqrt(np.mean(ndtri((np.arange(RANKED + 1) + 0.5) / (RANKED + 1)) ** 2)))
VARIANCE_OF_SQUARE = float(np.var(normal_scores(np.arange(RANKED + 1)) ** 2))


def pooled_spread(scores: FloatArray) -> PooledSpread:
    """Mean square of normal scores (quantity, simulation), and how probable it is if the posteriors are right.

    The simulations are independent, the quantities of one are not. A sum of squares over q quantities of correlations
    c has the variance ``sum(c)`` times that of one square: as if there were ``q²/sum(c)`` quantities.
    """
    squares = np.asarray(scores) ** 2
    q, n = squares.shape
    varied = squares.std(axis=1) > 0
    standard = (squares[varied] - squares[varied].mean(axis=1, keepdims=True)) / squares[varied].std(axis=1)[:, None]
    # sum of the correlations; ranks that never vary have none with others
    total = float(standard.sum(axis=0).var()) + float((~varied).sum())
    independent = n * q**2 / total
    mean_square = float(squares.mean())
    return PooledSpread(mean_square, independent, spread_p_value(mean_square, independent))


def spread_p_value(mean_square: float, scores: float) -> float:
    """Two-sided p-value of the mean square of so many independent normal scores.

    By the chi-square distribution of the same mean and variance.
    """
    from scipy.stats import chi2

    dof = 2 * scores / VARIANCE_OF_SQUARE
    below, above = chi2.cdf(mean_square * dof, dof), chi2.sf(mean_square * dof, dof)
    return 2 * min(float(below), float(above))


def _p_value(ranks: IntArray, scores: FloatArray) -> float:
    """Three times the least p-value of chi-square over bins, mean and mean square of the normal scores."""
    from scipy.stats import chisquare

    n = len(ranks)
    # RANKED + 1 possible ranks fall into BINS equal bins
    bins = float(chisquare(np.bincount(ranks * BINS // (RANKED + 1), minlength=BINS)).pvalue)
    bias = 2 * float(ndtr(-abs(scores.mean()) * np.sqrt(n)))
    return min(1.0, 3 * min(bins, bias, spread_p_value(float(np.mean(scores**2)), n)))
