"""Functions that read posterior files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from bayestouch.array_types import FloatArray
from bayestouch.errors import InputError, not_a, shown
from bayestouch.results.from_groups import calibration_from_groups, grades_of, notes_of, touches_of
from bayestouch.results.groups import NOT_READ, READABLE
from bayestouch.results.netcdf import read_groups
from bayestouch.results.objects import Calibration, TouchPosteriors


def load(path: str | Path) -> Calibration | TouchPosteriors:
    """Calibration or posteriors of touches from a posterior file.

    Draws of touches larger than 1 GB stay on file and are read when they are used. Groups that were written on request
    (`groups` of the result) are not read where they take more than 1 GB together; a note names them.

    Parameters
    ----------
    path : str or Path
        File that `Calibration.save`, `TouchPosteriors.save` or a command has written (netCDF).

    Returns
    -------
    Calibration or TouchPosteriors
        What the file contains.

    Raises
    ------
    InputError
        If the file is missing, is not a posterior file of bayestouch, is damaged, or is of a later version.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> dataset = bayestouch.simulate(design, seed=3).dataset
    >>> calibration = bayestouch.calibrate(dataset, draws=200)
    >>> calibration.save("calibration.nc")
    >>> again = bayestouch.load("calibration.nc")
    >>> again.sensor == calibration.sensor, again.posterior["sigma"].shape  # chains, draws
    (True, (4, 50))
    """
    if not isinstance(path, str | Path):
        raise not_a("the path of a posterior file", path, "Calibration.save and TouchPosteriors.save write one")
    groups, attributes, draws, unread = read_groups(path)
    kind, form = attributes.get("bayestouch"), attributes.get("bayestouch_format", "")
    if kind not in ("calibration", "touches"):
        raise InputError("expected a posterior file that bayestouch wrote, got another netCDF file", file=path)
    if form not in READABLE:
        raise InputError(
            f"expected format {' or '.join(READABLE)}, got {shown(form)}: another version of bayestouch wrote it",
            file=path,
        )
    try:
        of_calibration = kind == "calibration"
        result: Calibration | TouchPosteriors = (
            calibration_from_groups(groups, attributes) if of_calibration else touches_of(groups, attributes, draws)
        )
    except InputError as error:
        raise InputError(error.message, file=path, column=error.column) from None
    if not unread:
        return result
    note = f"{NOT_READ}{', '.join(unread)} (open the file with xarray)"
    return replace(result, notes=tuple(dict.fromkeys((*result.notes, note))))


def load_calibration(path: str | Path) -> Calibration:
    """Calibration from a file; raises as `load`, and if the file holds posteriors of touches."""
    result = load(path)
    if not isinstance(result, Calibration):
        raise InputError("expected a calibration, found posteriors of touches", file=path)
    return result


def load_touches(path: str | Path) -> TouchPosteriors:
    """Posteriors of touches from a file; raises as `load`, and if the file holds a calibration."""
    result = load(path)
    if not isinstance(result, TouchPosteriors):
        raise InputError("expected posteriors of touches, found a calibration", file=path)
    return result


def load_grades(path: str | Path) -> tuple[dict[str, FloatArray], tuple[str, ...]]:
    """Grades of each touch of a file (`TouchPosteriors.sample_stats`) and the notes; nothing else is read."""
    groups, attributes, _, _ = read_groups(path, only="sample_stats")
    return grades_of(groups), notes_of(attributes)
