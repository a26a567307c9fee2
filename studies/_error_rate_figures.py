"""Figures of `error_rates`: detection against size, confusion matrix, errors before and after."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt
from _error_rate_tables import Record, at_least, counted, indistinguishable, is_detected, of_kind, said

BLUE, ORANGE, GREY = "#1f6fb4", "#d9730d", "#8a8a8a"


def save_figures(
    records: list[Record],
    folder: Path,
    prefix: str = "",
    names: tuple[str, ...] = ("detection", "confusion", "before_after"),
) -> None:
    """Save figures as PNG."""
    done = counted(records)
    ones = of_kind(done, "one")
    if not ones:
        return
    folder.mkdir(parents=True, exist_ok=True)
    drawn = {"detection": lambda: detection(ones), "confusion": lambda: confusion(done)}
    drawn["before_after"] = lambda: before_after(done)
    for name in names:
        figure = drawn[name]()
        figure.savefig(folder / f"{prefix}{name}.png", dpi=100)
        plt.close(figure)


def detection(ones: list[Record]) -> plt.Figure:
    """Share of fingers in which an effect was seen, and named first, against its size."""
    names = list(dict.fromkeys(record["names"][0] for record in ones))
    sizes = sorted({record["effects"][0][1] for record in ones})
    rows = -(-len(names) // 5)
    figure, axes = plt.subplots(rows, 5, figsize=(13, 2.3 * rows), sharex=True, sharey=True, layout="constrained")
    for axis, name in zip(axes.flat, names, strict=False):
        shares: dict[str, list[float]] = {"seen": [], "named": [], "indistinguishable": []}
        for size in sizes:
            here = [r for r in ones if r["names"][0] == name and r["effects"][0][1] == size]
            named = [said(r) == name for r in here]
            shares["seen"].append(_mean(list(map(is_detected, here))))
            shares["named"].append(_mean(named))
            shares["indistinguishable"].append(
                _mean([n or name in indistinguishable(r) for n, r in zip(named, here, strict=True)])
            )
        axis.plot(sizes, shares["seen"], "o--", color=GREY, label="not called adequate")
        axis.plot(
            sizes, shares["indistinguishable"], "s:", color=ORANGE, label="named first or declared indistinguishable"
        )
        axis.plot(sizes, shares["named"], "o-", color=BLUE, label="named first")
        axis.axhline(0.9, color="black", lw=0.6)
        axis.set(title=name.replace("_", " "), xscale="log", ylim=(-0.05, 1.05))
        axis.set_xticks(sizes, [f"{size:g}" for size in sizes])
        axis.minorticks_off()
    for axis in axes.flat[len(names) :]:
        axis.set_visible(False)
    figure.supxlabel("residual over the noise of an averaged touch")
    figure.supylabel("share of fingers")
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3)
    return figure


def confusion(done: list[Record]) -> plt.Figure:
    """Effects of size 1 and above, effects outside the catalogue and none, against what was named first."""
    rows = [("none", of_kind(done, "none"))]
    large = at_least(done, 1.0)
    names = list(dict.fromkeys(record["names"][0] for record in large))
    rows += [(name, [r for r in large if r["names"][0] == name]) for name in names]
    outside = of_kind(done, "unlisted")
    rows += [
        (name, [r for r in outside if r["names"][0] == name]) for name in dict.fromkeys(r["names"][0] for r in outside)
    ]
    said_of = {said(record) for _, records in rows for record in records}
    columns = ["adequate", *names, *sorted(said_of - {"adequate", "unattributed", *names}), "unattributed"]
    share = np.array([[_mean([said(r) == column for r in records]) for column in columns] for _, records in rows])
    figure, axis = plt.subplots(figsize=(11, 9), layout="constrained")
    image = axis.imshow(np.nan_to_num(share), cmap="Blues", vmin=0, vmax=1, aspect="auto")
    for (i, j), value in np.ndenumerate(share):
        if value > 0:
            axis.text(j, i, f"{100 * value:.0f}", ha="center", va="center", color="white" if value > 0.5 else "black")
    axis.set_xticks(range(len(columns)), [each.replace("_", " ") for each in columns], rotation=60, ha="right")
    axis.set_yticks(range(len(rows)), [f"{name.replace('_', ' ')} ({len(records)})" for name, records in rows])
    axis.set(
        xlabel="named first, or verdict", ylabel="what was there (fingers)", title="% of fingers, size 1 and above"
    )
    figure.colorbar(image, shrink=0.5, label="share")
    return figure


def before_after(done: list[Record]) -> plt.Figure:
    """Held-out lack of fit and error in R before and after, one point a finger."""
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.6), layout="constrained")
    kinds = (("one", BLUE, "catalogued"), ("unlisted", ORANGE, "outside the catalogue"), ("none", GREY, "no effect"))
    for axis, key, label in zip(
        axes, ("lack_of_fit", "R_rms_mm"), ("held-out lack of fit", "held-out rms error of R (mm)"), strict=True
    ):
        values: list[float] = []
        for kind, colour, name in kinds:
            pairs = [[r["diagnosis"][when].get(key) for when in ("before", "after")] for r in of_kind(done, kind)]
            points = np.array([pair for pair in pairs if None not in pair], dtype=float).reshape(-1, 2)
            axis.plot(points[:, 0], points[:, 1], "o", ms=4, alpha=0.6, color=colour, label=name)
            values += points.ravel().tolist()
        if values:
            ends = [min(values) * 0.9, max(values) * 1.1]
            axis.plot(ends, ends, color="black", lw=0.6)
            axis.set(xscale="log", yscale="log")
        if key == "lack_of_fit":
            axis.axhline(1.1, color="black", lw=0.6, ls=":")
        axis.set(xlabel=f"{label}, before", ylabel="after")
        axis.legend()
    return figure


def _mean(values: list[bool]) -> float:
    return float(np.mean(values)) if values else float("nan")
