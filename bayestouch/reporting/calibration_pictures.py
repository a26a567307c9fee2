"""Figures of the calibration: each element compared with its design, and the fit of one element."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.output.pictures import (
    BLUE,
    GREY,
    ORANGE,
    RED,
    Picture,
    canvas,
    drawing,
    element_ticks,
    rendered,
)
from bayestouch.output.text import listed, number, plural, ranging
from bayestouch.reporting.bodies import PAGES
from bayestouch.reporting.calibration_tables import describe
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.peak_table import error_and_noise
from bayestouch.results.plots import LOCATION_LABELS

#: Decimals of a place in mm or degrees: what is smaller than a billionth, a hundredth of an atom, is rounding.
_ROUNDING_DECIMALS = 9


def calibration_pictures(evidence: Evidence) -> Iterator[Picture]:
    """Figures of the parameters by element and, on a finger or a line of elements, of the fit of the middle element."""
    yield _elements(evidence)
    rows = evidence.calibration.rows
    if len(rows.location) == 1:
        yield _fit(evidence)


@dataclass(frozen=True, eq=False)
class _Departure:
    """Draws (n, m) and true values (m,) of a parameter, minus the design and a shift that all elements share.

    The shift is zero if places of elements and touches have one origin, as on a finger. On a pad, the origin of the
    stage that touches it may differ from that of the design.
    """

    symbol: str
    unit: str
    draws: FloatArray
    true: FloatArray | None
    shift: float


def _departures(evidence: Evidence) -> list[_Departure]:
    sensor, calibration = evidence.sensor, evidence.calibration
    pages, m = PAGES[sensor.body.kind], sensor.n_elements
    out = []
    for name, places in pages.design(sensor).items():
        if name in calibration.posterior and calibration.posterior[name].shape[2:] == (m,):
            symbol, unit, _, _ = describe(calibration, name)
            true = evidence.truth.get(name)
            draws = calibration.posterior[name].reshape(-1, m) - places
            shift = 0.0 if pages.origin_known else float(draws.mean())
            true = None if true is None else np.asarray(true) - places - shift
            out.append(_Departure(symbol, unit, draws - shift, true, shift))
    return out


def _elements(evidence: Evidence) -> Picture:
    m = evidence.sensor.n_elements
    departures = _departures(evidence)
    error, noise = error_and_noise(evidence.calibration)
    at = np.arange(m)
    with drawing():
        figure, axes = canvas(2.0 * (1 + len(departures)), 1 + len(departures), 1, sharex=True)
        for ax, found in zip(axes[:, 0], departures, strict=False):
            low, high = np.quantile(found.draws, [0.05, 0.95], axis=0)
            middle = found.draws.mean(axis=0)
            ax.axhline(0, color=GREY, lw=0.8)
            ax.errorbar(at, middle, [middle - low, high - middle], fmt="o", ms=4, color=BLUE, label="posterior, 90 %")
            if found.true is not None:
                ax.plot(at + 0.18, found.true, "x", color=RED, ms=5, label="true")
                ax.legend(loc="upper left", ncols=2, bbox_to_anchor=(0, 1.22))
            ax.set_ylabel(f"{found.symbol} − design\n({found.unit})")
            ax.grid(axis="y")
        last = axes[-1, 0]
        both = np.isfinite(noise).any()
        last.bar(at - 0.2 * both, error, width=0.38, color=BLUE, label="error of the fit")
        if both:
            last.bar(at + 0.2, noise, width=0.38, color=ORANGE, label="noise of one reading")
        last.set(xlabel="element", ylabel="% of the\nelement's peak")
        last.grid(axis="y")
        element_ticks(last, m)
        last.legend(loc="upper left", ncols=2, bbox_to_anchor=(0, 1.22))
        content = rendered(figure)
    shown = []
    for found in departures:
        middle = found.draws.mean(axis=0)
        # Less the shift that all share, the place of a single element is zero but for rounding.
        low, high = (round(float(each), _ROUNDING_DECIMALS) for each in (middle.min(), middle.max()))
        shown.append(f"{found.symbol} less design {ranging(low, high, 2)} {found.unit}")
    moved = [f"{number(found.shift)} {found.unit} in {found.symbol}" for found in departures if found.shift]
    shift = f" and less the {listed(moved)} that all elements share (the origin of the stage)" if moved else ""
    return Picture(
        "elements",
        "calibration",
        "Element by element",
        "Where each element was found to lie (posterior mean and 90 % interval), less where it was designed to"
        + shift
        + "; and how well its readings are fitted. The error is of means over a touch's samples, the noise of single "
        "readings." + (" There is no bar for noise, because the data have no repeats that differ." if not both else ""),
        f"Calibration of {plural(m, 'element')}: {'; '.join(shown)}; error "
        f"{ranging(float(np.nanmin(error)), float(np.nanmax(error)), 2)} % of the peak.",
        content,
    )


def _fit(evidence: Evidence) -> Picture:
    """Figure of one element's readings against location, with fit and difference (Figures 9 and 10 of the paper)."""
    rows = evidence.calibration.rows
    (name, location), *_ = rows.location.items()
    edges = rows.radius_mm == 0
    these = np.flatnonzero((edges if edges.sum() > 5 else np.ones(len(edges), dtype=bool)) & np.isfinite(location))
    element = _middle_element(rows.observed[these])
    these = these[np.argsort(location[these])]
    load = rows.load[these]
    scale = np.ones(len(these)) if np.isnan(load).any() or (load <= 0).any() else load.mean() / load
    offset = evidence.calibration.mode.get("offset")
    rest = 0.0 if offset is None else float(offset[element])
    read, fit = (rest + scale * (values[these, element] - rest) for values in (rows.observed, rows.predicted))
    x = location[these]
    repeated = len(np.unique(x)) < len(x)
    unit = evidence.sensor.reading_unit or "reading"
    with drawing():
        figure, axes = canvas(4.2, 2, 1, sharex=True, height_ratios=[3, 1])
        top, bottom = axes[:, 0]
        top.plot(x, read, "o", ms=3.5, color=GREY, label="mean reading")
        top.plot(x, fit, "_" if repeated else "-", ms=9, color=BLUE, label="calibrated model")
        top.set_ylabel(f"e{element + 1:02d} ({unit})")
        top.legend()
        bottom.axhline(0, color=GREY, lw=0.8)
        sd = scale * rows.sd[these, element]
        bottom.fill_between(x, -2 * sd, 2 * sd, color=ORANGE, alpha=0.3, lw=0, label="± 2 sd")
        bottom.plot(x, read - fit, "o", ms=3, color=BLUE, label="reading − model")
        bottom.set(xlabel=LOCATION_LABELS[name], ylabel=f"difference\n({unit})")
        bottom.legend(loc="upper center", bbox_to_anchor=(0.5, -0.5), ncols=2)
        for ax in (top, bottom):
            ax.grid(axis="y")
        content = rendered(figure)
    what = "knife edges" if edges.sum() > 5 else "all calibration touches"
    peak = float(np.nanmax(np.abs(read - rest)))
    rms = float(np.sqrt(np.nanmean((read - fit) ** 2)))
    return Picture(
        "element_fit",
        "calibration",
        f"Fit of element e{element + 1:02d} to {what}",
        "The form of the paper's Figure 9: readings against location, the fit, and below the difference."
        + (" Readings and fit are brought to the mean load." if np.ptp(scale) > 0 else ""),
        f"Readings and fit of one element against location: peak {number(peak)} {unit}, rms difference "
        f"{number(100 * rms / peak, 2)} % of it.",
        content,
    )


def _middle_element(observed: FloatArray) -> int:
    """Number of the element in the middle, or of the nearest one that has readings."""
    m = observed.shape[1]
    alive = np.flatnonzero(np.isfinite(observed).any(axis=0))
    return int(alive[np.abs(alive - m // 2).argmin()])
