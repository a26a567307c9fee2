"""Corner plots of the posteriors of single touches, and of the calibration of one element."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.output.pictures import BLUE, RED, Picture, drawing, rendered
from bayestouch.output.text import number
from bayestouch.reporting.bodies import PAGES
from bayestouch.reporting.calibration_tables import describe
from bayestouch.reporting.evidence import Evidence
from bayestouch.results.plots import reference_near

# Number of draws in a corner plot; more draws only make its file larger.
_CORNER_DRAWS = 2000
_OF_ELEMENT = ("r_s", "theta_s", "x_s", "y_s", "x", "y", "response", "gain", "sigma", "mu")


def corner_png(values: FloatArray, labels: Sequence[str], truths: Sequence[float | None] | None = None) -> bytes:
    """Corner plot of draws (n, k) as PNG; columns that do not vary are left out."""
    from matplotlib.figure import Figure

    corner = _corner_library()
    varies = np.ptp(values, axis=0) > 0
    values, labels = values[:, varies], [label for label, keep in zip(labels, varies, strict=True) if keep]
    marks = None if truths is None else [truth for truth, keep in zip(truths, varies, strict=True) if keep]
    step = max(1, len(values) // _CORNER_DRAWS)
    with drawing():
        side = 2.1 + 1.35 * values.shape[1]
        figure = Figure(figsize=(side, side))
        corner.corner(
            values[::step],
            labels=labels,
            truths=marks,
            fig=figure,
            color=BLUE,
            truth_color=RED,
            quantiles=[0.05, 0.5, 0.95],
            max_n_ticks=3,
            label_kwargs={"fontsize": 10},
            labelpad=0.05,
            bins=24,
            smooth=0.8,
            data_kwargs={"ms": 1.5, "alpha": 0.2},
        )
        return rendered(figure, "png", tight=True)


def _corner_library() -> Any:
    """Module `corner`. It imports arviz if that is installed, which fails if the home folder is not writable; `corner`
    is then imported without arviz."""
    import sys
    import warnings

    try:
        with warnings.catch_warnings():
            # readers of a report do not need the daily message of arviz about its next version
            warnings.simplefilter("ignore", FutureWarning)
            import corner
    except OSError:
        sys.modules["arviz"] = None  # type: ignore[assignment]  # makes the import of arviz fail
        try:
            import corner
        finally:
            del sys.modules["arviz"]
    return corner


def corner_columns(names: Sequence[str], draws: Mapping[str, FloatArray], index: int) -> FloatArray:
    """Draws for one touch or element as columns (n, k); a parameter without that axis is shared by all."""
    columns = []
    for name in names:
        values = draws[name]
        columns.append(values[..., index].ravel() if values.ndim == 3 else values.ravel())
    return np.stack(columns, axis=1)


@dataclass(frozen=True, eq=False)
class Corners:
    """Corner plots of a report: of the element in the middle, and of single touches."""

    element: tuple[Picture, ...]
    touches: tuple[Picture, ...]

    @classmethod
    def of(cls, evidence: Evidence) -> Corners:
        """All corner plots that are possible with the data."""
        return cls(tuple(element_corner(evidence)), tuple(touch_corners(evidence)))


def touch_corners(evidence: Evidence) -> Iterator[Picture]:
    """Corner plots of a typical touch and, if the body's pages name one, of the hardest touch."""
    posteriors = evidence.posteriors
    chosen = PAGES[evidence.sensor.body.kind].examples(evidence)
    labels = {parameter.name: parameter.label for parameter in posteriors.parameters}
    names = [name for name in labels if name in posteriors.posterior]
    for which, touch in chosen.items():
        reference = [float(reference_near(posteriors, n, posteriors.mean(n))[touch]) for n in names]
        marks = [value if np.isfinite(value) else None for value in reference]
        values = corner_columns(names, posteriors.posterior, touch)
        estimates = ", ".join(
            f"{name} {number(float(values[:, i].mean()))} ± {number(float(values[:, i].std()), 2)}"
            for i, name in enumerate(names)
        )
        yield Picture(
            f"corner_{which}_touch",
            "trust",
            f"Posterior of a {which} touch (touch {posteriors.rows.touch[touch]})"
            if which == "typical"
            else f"Posterior of the most uncertain touch (touch {posteriors.rows.touch[touch]})",
            "Each panel shows draws of one or two parameters; dashed lines are 5, 50 and 95 %, red the reference (for "
            "the load the force sensor's reading).",
            f"Corner plot of a {which} touch: {estimates}.",
            corner_png(values, [labels[name] for name in names], marks),
            "png",
        )


def element_corner(evidence: Evidence) -> Iterator[Picture]:
    """Corner plot of the calibration of the element in the middle."""
    calibration = evidence.calibration
    element = calibration.sensor.n_elements // 2
    m = calibration.sensor.n_elements
    latex = {parameter.name: parameter.label for parameter in calibration.parameters}
    draws = calibration.posterior
    names = [n for n in _OF_ELEMENT if n in draws and (draws[n].ndim == 2 or draws[n].shape[2:] == (m,))]
    names += [n for n in draws if draws[n].ndim == 2 and n not in names][: max(0, 7 - len(names))]
    if len(names) < 2:
        return
    labels = []
    for name in names:
        symbol, unit, _, _ = describe(calibration, name)
        label = latex.get(name, f"{symbol} ({unit})" if unit else symbol)
        labels.append(label.replace(" (", "\n(", 1))  # long units would overlap
    true = [evidence.truth.get(name) for name in names]
    marks = [None if t is None else float(np.atleast_1d(t)[element] if np.ndim(t) else t) for t in true]
    values = corner_columns(names, draws, element)
    correlation = np.asarray(np.corrcoef(values.T))
    np.fill_diagonal(correlation, 0)
    i, j = np.unravel_index(int(np.nanargmax(np.abs(correlation))), correlation.shape)
    yield Picture(
        "corner_element",
        "calibration",
        f"Calibration posterior of element e{element + 1:02d}",
        "Parameters that lie along a ridge are not known one by one, only together; the chain uses them together."
        + (" Red: true values of the simulation." if any(mark is not None for mark in marks) else ""),
        f"Corner plot of {', '.join(names)} of one element; the strongest correlation is "
        f"{number(float(correlation[i, j]), 2)} between {names[i]} and {names[j]}.",
        corner_png(values, labels, marks if any(mark is not None for mark in marks) else None),
        "png",
    )
