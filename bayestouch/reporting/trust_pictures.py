"""Figures of residuals and coverage."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.output.pictures import (
    BLUE,
    DIVERGING,
    GREY,
    PALETTE,
    RED,
    Picture,
    canvas,
    drawing,
    element_ticks,
    rendered,
)
from bayestouch.output.text import plural, ranging
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.residuals import standardised
from bayestouch.reporting.trust import reference_ranks
from bayestouch.results.plots import LOCATION_LABELS

_LIMIT = 4.0
_SYMBOLS = {"theta_c": "location θ_c", "R": "radius R", "P": "load P", "x": "x", "y": "y"}


def trust_pictures(evidence: Evidence) -> Iterator[Picture]:
    """Figures of residuals and, if there are references, of coverage."""
    yield _residuals(evidence)
    ranks = [(name, rank[np.isfinite(rank)]) for name, _, rank in reference_ranks(evidence)]
    ranks = [(name, rank) for name, rank in ranks if rank.size]
    if ranks:
        yield _coverage(ranks)


def _residuals(evidence: Evidence) -> Picture:
    """Figure of standardised residuals by element and location."""
    rows = evidence.posteriors.rows
    z = standardised(rows)
    m = z.shape[1]
    present = np.isfinite(z)
    squares = np.where(present, z, 0.0) ** 2
    rms = np.sqrt(squares.sum(axis=0) / np.maximum(present.sum(axis=0), 1))
    x_name = next((n for n in ("theta_c", "x") if n in rows.location and np.isfinite(rows.location[n]).any()), None)
    with drawing():
        from matplotlib.ticker import MaxNLocator

        height = float(np.clip(2.0 + 0.16 * m, 2.9, 6.0))
        figure, axes = canvas(height, 1, 2, width_ratios=[3.4, 1], sharey=True)
        left, right = axes[0]
        where: Any = np.arange(len(z), dtype=float) if x_name is None else rows.location[x_name]
        edges, picture = _binned(np.asarray(where), z)
        mesh = left.pcolormesh(
            edges, np.arange(m + 1) - 0.5, picture.T, cmap=DIVERGING, vmin=-_LIMIT, vmax=_LIMIT, rasterized=True
        )
        averaged = "mean by location" if len(rows.location) == 1 else f"mean by {x_name}"
        label = "touch, in order" if x_name is None else LOCATION_LABELS[x_name]
        left.set(xlabel=label, ylabel="element", title=averaged)
        element_ticks(left, m, "y")
        figure.colorbar(mesh, ax=left, label="residual / its sd", shrink=0.9, extend="both")
        right.barh(np.arange(m), rms, height=0.7, color=BLUE)
        right.axvline(1, color=RED, ls=":", lw=1.8)
        right.set(xlabel="rms of residual / sd", title="all touches")
        right.xaxis.set_major_locator(MaxNLocator(4))
        right.set_xlim(0, max(1.25, 1.08 * float(rms.max(initial=0.0))))
        content = rendered(figure)
    worst = int(rms.argmax())
    return Picture(
        "residuals",
        "residuals",
        "Residuals by element and location",
        "Reading minus prediction at the posterior mean, over the standard deviation that noise and the calibration's "
        "discrepancy explain. Left: mean over the touches of a location; stripes or blocks of one colour are errors of "
        "the model. Right: 1 (dotted) is what noise alone would leave; a little less is usual, for each touch fits its "
        "own parameters.",
        f"Standardised residuals of {plural(m, 'element')}: root mean square "
        f"{ranging(float(rms.min()), float(rms.max()))}, largest at element e{worst + 1:02d}.",
        content,
    )


def _binned(where: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Limits (k + 1,) and mean residual (k, m) of each location, or of 60 bins if there are more locations."""
    known = np.isfinite(where)
    values = np.unique(np.round(where[known], 6))
    if len(values) > 60 or len(values) < 2:
        low, high = float(values.min()), float(values.max())
        edges = np.linspace(low - 1e-9, max(high, low + 1) + 1e-9, 61 if len(values) > 60 else 2)
    else:
        middle = 0.5 * (values[1:] + values[:-1])
        edges = np.r_[2 * values[0] - middle[0], middle, 2 * values[-1] - middle[-1]]
    place = np.clip(np.searchsorted(edges, where[known], side="right") - 1, 0, len(edges) - 2)
    out = np.full((len(edges) - 1, z.shape[1]), np.nan)
    for element, column in enumerate(z[known].T):
        there = np.isfinite(column)
        n = np.bincount(place[there], minlength=len(out))
        total = np.bincount(place[there], weights=column[there], minlength=len(out))
        out[n > 0, element] = total[n > 0] / n[n > 0]
    return edges, out


def _coverage(ranks: Sequence[tuple[str, FloatArray]]) -> Picture:
    """Figure of the share of touches whose central interval contains the reference, over its probability."""
    levels = np.linspace(0, 1, 101)
    with drawing():
        figure, axes = canvas(4.0)
        ax = axes[0, 0]
        smallest = min(len(rank) for _, rank in ranks)
        band = 1.96 * np.sqrt(levels * (1 - levels) / smallest)
        ax.fill_between(
            100 * levels,
            100 * (levels - band),
            100 * (levels + band),
            color=GREY,
            alpha=0.2,
            lw=0,
            label="95 % scatter, independent touches",
        )
        ax.plot([0, 100], [0, 100], ":", color=GREY)
        found = []
        for (name, rank), colour, dash in zip(ranks, PALETTE, ("-", "--", "-.", ":"), strict=False):
            inside = [100 * float(np.mean(np.abs(rank - 0.5) <= level / 2)) for level in levels]
            ax.plot(100 * levels, inside, dash, color=colour, label=f"{_SYMBOLS[name]} ({plural(len(rank), 'touch')})")
            found.append(f"{inside[90]:.0f} % for {_SYMBOLS[name]}")
        ax.set(xlabel="probability of the interval (%)", ylabel="touches inside (%)", xlim=(0, 100), ylim=(0, 100))
        ax.set_aspect("equal")
        ax.grid()
        ax.legend(loc="upper left", bbox_to_anchor=(1.02, 1))
        content = rendered(figure)
    return Picture(
        "coverage",
        "trust",
        "How often intervals hold the reference",
        "On the diagonal, intervals are as wide as they should be. Below it they are too narrow (overconfident), above "
        "it too wide. Touches at one place share the calibration's errors, so the true scatter is wider than the band.",
        f"Share of touches whose central interval holds the reference; at 90 %: {', '.join(found)}.",
        content,
    )
