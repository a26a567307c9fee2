"""Files of a report."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from bayestouch.output.files import NUMBERS, PAGE, write_numbers, write_pictures, write_text
from bayestouch.output.pictures import Picture
from bayestouch.output.progress import Progress
from bayestouch.parallel.beside import both
from bayestouch.reporting.assemble import numbers_of_touches, with_checks, with_diagnosis
from bayestouch.reporting.bodies import PAGES
from bayestouch.reporting.calibration_pictures import calibration_pictures
from bayestouch.reporting.check_pictures import check_pictures
from bayestouch.reporting.checks import about_checks
from bayestouch.reporting.corner_pictures import Corners
from bayestouch.reporting.diagnosed import Diagnosed
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.live import Live, live_figures
from bayestouch.reporting.page import render
from bayestouch.reporting.trust_pictures import trust_pictures
from bayestouch.results.files import save_calibration, save_touches, without_requested

# Share of the time of a draft that its numbers, checks and corner plots take, for the progress bar.
_NUMBERS = 0.5


@dataclass(frozen=True, eq=False)
class Draft:
    """A report but for its diagnosis.

    Attributes
    ----------
    evidence : Evidence
        What it is made of, without touches that have no reading.
    numbers : dict
        Content of ``report.json`` but for what a diagnosis changes.
    pictures : tuple of Picture
        Figures, without those of the diagnosis.
    live : Live
        Interactive figures.
    """

    evidence: Evidence
    numbers: dict[str, Any]
    pictures: tuple[Picture, ...]
    live: Live


def drafted(folder: Path, evidence: Evidence, progress: Progress | None = None) -> Draft:
    """All of a report that needs no diagnosis; calibration and touches are written to an existing folder."""
    read = evidence.of_read_touches()
    # Both the checks and the corner plots load ArviZ, which takes seconds: no other process does.
    numbers, (checks, corners) = both(
        partial(numbers_of_touches, read), lambda tell: (about_checks(read), Corners.of(read))
    )
    numbers = with_checks(numbers, checks)
    if progress is not None:
        progress(_NUMBERS)
    pictures, live = both(
        partial(report_pictures, read, numbers, corners), lambda tell: _saved_and_live(evidence, numbers, folder)
    )
    if progress is not None:
        progress(1.0)
    return Draft(read, numbers, pictures, live)


def write_report(draft: Draft, diagnosed: Diagnosed | None, folder: Path) -> dict[str, Any]:
    """Write the rest of a report to the folder of its draft; the content of ``report.json`` is returned."""
    numbers = with_diagnosis(draft.numbers, replace(draft.evidence, diagnosed=diagnosed))
    pictures = (*draft.pictures, *(() if diagnosed is None else diagnosed.pictures))
    numbers["figures"] = [picture.described for picture in pictures]
    write_pictures(folder, pictures)
    write_numbers(folder / NUMBERS, numbers)
    write_text(folder / PAGE, render(numbers, pictures, draft.live))
    return numbers


def report_pictures(evidence: Evidence, numbers: dict[str, Any], corners: Corners) -> tuple[Picture, ...]:
    """All figures that are possible with the data, in the order of the page, where those of a diagnosis follow."""
    pages = PAGES[evidence.sensor.body.kind]
    return (
        pages.sensor_picture(evidence, numbers),
        *calibration_pictures(evidence),
        *corners.element,
        *pages.pictures(evidence, numbers),
        *trust_pictures(evidence),
        *check_pictures(numbers),
        *corners.touches,
    )


def _saved_and_live(evidence: Evidence, numbers: dict[str, Any], folder: Path) -> Live:
    """Write calibration and touches, and make the interactive figures, none of which needs the pictures."""
    save_calibration(without_requested(evidence.calibration), folder / "calibration.nc")
    save_touches(without_requested(evidence.posteriors), folder / "posterior.nc")
    return live_figures(numbers)
