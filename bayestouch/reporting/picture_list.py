"""All figures of a report, in the order of the page."""

from __future__ import annotations

from typing import Any

from bayestouch.output.pictures import Picture
from bayestouch.reporting.bodies import PAGES
from bayestouch.reporting.calibration_pictures import calibration_pictures
from bayestouch.reporting.check_pictures import check_pictures
from bayestouch.reporting.corner_pictures import element_corner, touch_corners
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.trust_pictures import trust_pictures


def report_pictures(evidence: Evidence, numbers: dict[str, Any]) -> tuple[Picture, ...]:
    """All figures that are possible with the data, in the order of the page."""
    pages = PAGES[evidence.sensor.body.kind]
    diagnosed = () if evidence.diagnosed is None else evidence.diagnosed.pictures
    return (
        pages.sensor_picture(evidence, numbers),
        *calibration_pictures(evidence),
        *element_corner(evidence),
        *pages.pictures(evidence, numbers),
        *trust_pictures(evidence),
        *check_pictures(numbers),
        *touch_corners(evidence),
        *diagnosed,
    )
