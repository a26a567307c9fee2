"""Diagram of how often sets of causes are right, against their probability."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from _cause_rules import EDGES, MOST, Forecasts, bins

mpl.use("Agg")
import matplotlib.pyplot as plt

BLUE, ORANGE, GREY = "#1f6fb4", "#d9730d", "#8a8a8a"


def save_diagram(results: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Save the diagram of results that have probabilities of causes."""
    figure = diagram(results)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=100)
    plt.close(figure)


def diagram(results: Sequence[Mapping[str, Any]]) -> plt.Figure:
    """Share of first statements that are right, with 95 % intervals, above the number of fingers in each bin.

    The verdict with its effects is the square at its probability of 0.99.
    """
    forecasts = Forecasts.of(results)
    found = bins(forecasts)
    at = np.array([each.probability for each in found])
    share = np.array([each.right / each.fingers for each in found])
    ends = np.array([each.interval for each in found])
    layout = {"height_ratios": (3, 1)}
    figure, (above, below) = plt.subplots(2, 1, figsize=(7, 6.5), sharex=True, gridspec_kw=layout, layout="constrained")
    above.plot([0, 1], [0, 1], color="black", lw=0.8, label="as often right as stated")
    errors = np.abs(ends.T - share)
    above.errorbar(at, share, errors, fmt="o", color=BLUE, capsize=3, label="first statement, 95 % interval")
    above.plot(MOST, forecasts.rule_hit.mean(), "s", color=ORANGE, label="verdict, taken as 99 % certain")
    above.set(ylabel="share that is right", ylim=(-0.03, 1.03))
    above.legend(loc="upper left")
    above.set_title(
        f"{len(forecasts.sure)} fingers, expected calibration error {forecasts.calibration_error:.3f}\n"
        f"log score {forecasts.log_score:.2f}, of the verdict {forecasts.rule_log_score:.2f}"
    )
    below.hist(forecasts.sure, EDGES, color=GREY, edgecolor="white")
    below.set(xlabel="probability of the first statement", ylabel="fingers", xlim=(-0.02, 1.02))
    return figure
