"""Parts of ``report.json`` for a pad."""

from __future__ import annotations

from typing import Any

import numpy as np

from bayestouch.chain.pad import element_pitch
from bayestouch.data.sensor import Pad, pad_of
from bayestouch.reporting.body_pages import BodyNumbers
from bayestouch.reporting.differences import load_errors, load_summary
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.headline import HeadlineError
from bayestouch.reporting.pad.locations import axes_of, inside_array, location_errors, pad_errors, several_modes
from bayestouch.reporting.pad.peaks import element_peaks
from bayestouch.reporting.pad.places import about_places
from bayestouch.results.units import load_unit


def pad_numbers(evidence: Evidence) -> BodyNumbers:
    """Numbers of a pad. It has no table of the paper; readings are not predicted, because references have no load."""
    return BodyNumbers(
        peak=element_peaks(evidence.calibration),
        estimates=_estimates(evidence),
        places=about_places(evidence),
    )


def headline_quantities(evidence: Evidence) -> list[HeadlineError]:
    """Location inside and outside the array of elements, and load read without the force sensor."""
    posteriors, error = evidence.posteriors, location_errors(evidence)
    distance, inside = np.sqrt((error**2).sum(axis=1)), inside_array(evidence)
    sd = np.sqrt(sum(posteriors.sd(axis) ** 2 for axis in axes_of(posteriors)))
    unseen = posteriors if evidence.without_load is None else evidence.without_load
    known = np.isfinite(distance)
    parts = [("location inside the array", known & inside), ("location outside the array", known & ~inside)]
    located = [HeadlineError(name, "mm", np.where(these, distance, np.nan), sd) for name, these in parts if these.any()]
    quantities = located or [HeadlineError("location", "mm", distance, sd)]
    # Where no load of the calibration was measured, loads are shares of one that is not known.
    if unit := load_unit(posteriors):
        quantities.append(HeadlineError("load", unit, load_errors(evidence), unseen.sd("P")))
    return quantities


def _estimates(evidence: Evidence) -> dict[str, Any]:
    posteriors = evidence.posteriors
    sd = np.sqrt(sum(posteriors.sd(axis) ** 2 for axis in axes_of(posteriors)))
    return {
        "axes": list(axes_of(posteriors)),
        "errors": pad_errors(evidence),
        "spacing_mm": _spacing(pad_of(evidence.sensor)),
        "posterior_sd_mm": float(np.median(sd)),
        "several_modes_percent": float(100 * np.mean(several_modes(posteriors))),
        "load": load_summary(evidence),
    }


def _spacing(pad: Pad) -> float | None:
    """Median distance of an element to its nearest neighbour, mm; None for a single element."""
    if pad.n_elements < 2:
        return None
    columns = [np.asarray(values) for values in pad.places_mm.values()]
    return element_pitch(np.stack(columns, axis=1), float(max(np.ptp(column) for column in columns)))
