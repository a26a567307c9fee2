"""Expected errors of a pad at each place, predicted from its calibration."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.pad.locations import element_places
from bayestouch.reporting.places import (
    load_is_read,
    place_at,
    rounded_columns,
    typical_load_reads,
    typical_reads,
    typical_samples,
)

# Number of steps along a line, and along each side of a plane.
_ALONG, _ACROSS = 121, 41


def about_places(evidence: Evidence) -> dict[str, Any]:
    """Expected location errors over the pad, with the part that averaging lowers and the part that stays.

    They are those of touches like the ones that were read: with a measured load if most of these have one.
    """
    from bayestouch.pad.reading.reader import PadReader
    from bayestouch.reliability import pad_spots

    reader = PadReader.from_calibration(evidence.calibration)
    low, high = np.asarray(reader.map.low), np.asarray(reader.map.high)
    axes = [np.linspace(a, b, _ALONG if len(low) == 1 else _ACROSS) for a, b in zip(low, high, strict=True)]
    where = np.stack([grid.ravel() for grid in np.meshgrid(*axes, indexing="ij")], axis=1)
    use_load = reader.load_measured and load_is_read(evidence)
    of_typical = typical_reads(evidence), typical_load_reads(evidence)
    # Without end only the reads of a force sensor that is read with each sample increase.
    without_end = np.inf, evidence.posteriors.rows.usual_load_reads
    spots, lasting = (
        pad_spots(replace(reader, load_reads=load_reads), where, reads=reads, use_load=use_load)
        for reads, load_reads in (of_typical, without_end)
    )
    places = element_places(evidence)
    inside = ((where >= places.min(axis=0)) & (where <= places.max(axis=0))).all(axis=1)
    within = "the array of elements" if inside.any() else "the calibrated region"
    inside = inside if inside.any() else np.ones(len(where), dtype=bool)
    columns = {name: where[:, i] for i, name in enumerate(("x_mm", "y_mm")[: where.shape[1]])}
    steps = {name: float(axis[1] - axis[0]) for name, axis in zip(columns, axes, strict=True)}
    columns |= {
        "error_mm": spots.sd,
        # Their difference is rounding where there is no noise that averaging lowers.
        "noise_mm": np.sqrt(np.maximum(spots.sd**2 - lasting.sd**2, 0.0)),
        "shared_mm": lasting.sd,
    }
    variance = float(np.mean(spots.sd[inside] ** 2))
    # The rest of what stays is there because the readings do not tell load and place.
    of_calibration, of_none = lasting.bias_rms**2, lasting.of_none
    parts = [100 * float(part[inside].sum(axis=1).mean()) / variance for part in (of_calibration, of_none)]
    stays = 100 * float(np.mean(lasting.sd[inside] ** 2)) / variance
    rows = np.flatnonzero(inside)
    return {
        "body": "pad",
        "use_load": use_load,
        "samples": typical_samples(evidence),
        "size_mm": {axis: float(b - a) for axis, a, b in zip("xy", low, high, strict=False)},
        "by_location": rounded_columns(columns, steps),
        "elements_mm": places,
        "within": within,
        "best": place_at(columns, int(rows[spots.sd[rows].argmin()])),
        "worst": place_at(columns, int(rows[spots.sd[rows].argmax()])),
        "inside_rms_mm": float(np.sqrt(variance)),
        "shared_percent": stays,
        "calibration_percent": parts[0],
        "model_percent": stays - sum(parts),
    }
