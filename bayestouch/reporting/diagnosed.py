"""Diagnosis in a report: a short one made for the report, or a saved one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from bayestouch.data.dataset import DataSet
from bayestouch.errors import InputError
from bayestouch.output.pictures import Format, Picture
from bayestouch.output.progress import Progress
from bayestouch.reporting.diagnosis_file import read_diagnosis, read_figure

#: Number of figures of a diagnosis that a report shows; the folder of the diagnosis has all.
_SHOWN = 3


@dataclass(frozen=True, eq=False)
class Diagnosed:
    """A diagnosis as it appears in a report.

    Attributes
    ----------
    numbers : dict
        Content of ``diagnosis.json``, with ``sentences`` and ``made`` (its origin); or only ``missing``, the reason why
        there is no diagnosis.
    pictures : tuple of Picture
        The most important figures.
    """

    numbers: dict[str, Any]
    pictures: tuple[Picture, ...] = ()


def light_diagnosis(dataset: DataSet, seed: int, progress: Progress | None = None, *, read: bool = False) -> Diagnosed:
    """Diagnosis for a report: verdict and prediction errors, and errors of held-out touches if `read`."""
    from bayestouch.diagnosis import diagnose
    from bayestouch.diagnosis.outcome import sentences
    from bayestouch.diagnosis.pictures import diagnosis_pictures

    try:
        diagnosis = diagnose(dataset, sample=read, draws=100, seed=seed, progress=progress)
    except InputError as error:
        return Diagnosed({"missing": f"No effect was searched for: {error.message}."})
    numbers = diagnosis.to_dict()
    made = "made with this report" + ("" if read else ", without reading the held-out touches as unknown")
    return Diagnosed(
        {**numbers, "sentences": sentences(numbers, with_causes=False), "made": made},
        _of_report(diagnosis_pictures(diagnosis.traced)),
    )


def saved_diagnosis(folder: Path, dataset: DataSet) -> Diagnosed:
    """Diagnosis that `bayestouch diagnose` wrote to a folder.

    Raises
    ------
    InputError
        If the folder has no diagnosis, or one that is damaged or of another sensor.
    """
    from bayestouch.diagnosis.outcome import sentences

    file = folder / "diagnosis.json"
    numbers = read_diagnosis(file)
    found, wanted = numbers["data"].get("elements"), dataset.sensor.n_elements
    if found != wanted:
        raise InputError(f"expected a diagnosis of a sensor with {wanted} elements, got {found}", file=file)
    pictures = tuple(_read(folder, each) for each in numbers.pop("figures")[:_SHOWN])
    said = {"sentences": sentences(numbers, with_causes=False), "made": f"read from {folder.name}/{file.name}"}
    return Diagnosed({**numbers, **said}, _of_report(pictures))


def _read(folder: Path, described: dict[str, str]) -> Picture:
    names = ("name", "section", "title", "caption", "alt")
    form: Format = "png" if described["format"] == "png" else "svg"
    content = read_figure(folder, described["name"], form)
    return Picture(**{name: described[name] for name in names}, content=content, format=form)


def _of_report(pictures: tuple[Picture, ...]) -> tuple[Picture, ...]:
    """Figures with names and section for the report."""
    return tuple(replace(each, name=f"diagnosis_{each.name}", section="diagnosis") for each in pictures[:_SHOWN])
