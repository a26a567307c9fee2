"""All figures of a report, in the order of the page."""

from __future__ import annotations

from typing import Any

from bayestouch.output.pictures import Picture
from bayestouch.reporting.calibration_pictures import calibration_pictures
from bayestouch.reporting.corner_pictures import element_corner, touch_corners
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.finger_pictures import finger_pictures
from bayestouch.reporting.pad_pictures import pad_pictures
from bayestouch.reporting.sensor_pictures import sensor_pictures
from bayestouch.reporting.trust_pictures import trust_pictures


def report_pictures(evidence: Evidence, numbers: dict[str, Any]) -> tuple[Picture, ...]:
    """Every figure that the data give."""
    estimates = finger_pictures(evidence, numbers) if evidence.is_finger else pad_pictures(evidence)
    diagnosed = () if evidence.diagnosed is None else evidence.diagnosed.pictures
    return (
        *sensor_pictures(evidence, numbers),
        *calibration_pictures(evidence),
        *element_corner(evidence),
        *estimates,
        *trust_pictures(evidence),
        *touch_corners(evidence),
        *diagnosed,
    )
