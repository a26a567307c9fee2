"""Parts of ``report.json`` for a pad."""

from __future__ import annotations

from typing import Any

import numpy as np

from bayestouch.chain.pad import element_pitch
from bayestouch.data.sensor import Pad, pad_of
from bayestouch.reporting.body_pages import BodyNumbers
from bayestouch.reporting.differences import load_summary
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.pad.locations import axes_of, pad_errors
from bayestouch.reporting.pad.peaks import element_peaks
from bayestouch.reporting.pad.places import about_places


def pad_numbers(evidence: Evidence) -> BodyNumbers:
    """Numbers of a pad. It has no table of the paper; readings are not predicted, because references have no load."""
    return BodyNumbers(
        peak=element_peaks(evidence.calibration),
        estimates=_estimates(evidence),
        places=about_places(evidence),
    )


def _estimates(evidence: Evidence) -> dict[str, Any]:
    posteriors = evidence.posteriors
    sd = np.sqrt(sum(posteriors.sd(axis) ** 2 for axis in axes_of(posteriors)))
    return {
        "axes": list(axes_of(posteriors)),
        "errors": pad_errors(evidence),
        "spacing_mm": _spacing(pad_of(evidence.sensor)),
        "posterior_sd_mm": float(np.median(sd)),
        "load": load_summary(evidence),
    }


def _spacing(pad: Pad) -> float | None:
    """Median distance of an element to its nearest neighbour, mm; None for a single element."""
    if pad.n_elements < 2:
        return None
    columns = [np.asarray(values) for values in pad.places_mm.values()]
    return element_pitch(np.stack(columns, axis=1), float(max(np.ptp(column) for column in columns)))
