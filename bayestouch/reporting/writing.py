"""Files of a report."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

from bayestouch.output.files import NUMBERS, PAGE, write_numbers, write_pictures, write_text
from bayestouch.output.pictures import Picture
from bayestouch.parallel.beside import both
from bayestouch.reporting.assemble import report_numbers
from bayestouch.reporting.bodies import PAGES
from bayestouch.reporting.calibration_pictures import calibration_pictures
from bayestouch.reporting.check_pictures import check_pictures
from bayestouch.reporting.corner_pictures import element_corner, touch_corners
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.live import Live, live_figures
from bayestouch.reporting.page import render
from bayestouch.reporting.trust_pictures import trust_pictures
from bayestouch.results.files import save_calibration, save_touches, without_requested


def write_report(evidence: Evidence, folder: Path) -> dict[str, Any]:
    """Write every file of a report to an existing folder; the content of ``report.json`` is returned."""
    read = evidence.of_read_touches()
    numbers = report_numbers(read)
    pictures, live = both(
        partial(report_pictures, read, numbers), lambda tell: _saved_and_live(evidence, numbers, folder)
    )
    numbers["figures"] = [picture.described for picture in pictures]
    write_pictures(folder, pictures)
    write_numbers(folder / NUMBERS, numbers)
    write_text(folder / PAGE, render(numbers, pictures, live))
    return numbers


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


def _saved_and_live(evidence: Evidence, numbers: dict[str, Any], folder: Path) -> Live:
    """Write calibration and touches, and make the interactive figures, none of which needs the pictures."""
    save_calibration(without_requested(evidence.calibration), folder / "calibration.nc")
    save_touches(without_requested(evidence.posteriors), folder / "posterior.nc")
    return live_figures(numbers)
