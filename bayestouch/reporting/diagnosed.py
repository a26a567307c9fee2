"""Diagnosis in a report: a short one made for the report, or a saved one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bayestouch.data.dataset import DataSet
from bayestouch.errors import InputError
from bayestouch.output.pictures import Format, Picture
from bayestouch.output.progress import Progress, staged
from bayestouch.reporting.diagnosis_file import read_diagnosis, read_figure

if TYPE_CHECKING:
    from bayestouch.diagnosis.traced import Traced

#: Number of figures of a diagnosis that a report shows; the folder of the diagnosis has all.
_SHOWN = 3
#: Share of the time of a diagnosis with regressions that the search takes, for the progress bar.
_SEARCHED = 0.7


@dataclass(frozen=True, eq=False)
class Diagnosed:
    """A diagnosis as it appears in a report.

    Attributes
    ----------
    numbers : dict
        Content of ``diagnosis.json``, with ``sentences`` and ``made`` (its origin); or only ``missing``, the reason why
        there is no diagnosis. With regressions `baselines`, a list of their names and errors; `before`, `after` and
        `after_against_stated` then also have `location_median_mm`.
    pictures : tuple of Picture
        The most important figures.
    folder : str
        Name of the folder of a saved diagnosis; empty if the diagnosis was made for the report.
    """

    numbers: dict[str, Any]
    pictures: tuple[Picture, ...] = ()
    folder: str = ""


def light_diagnosis(
    dataset: DataSet,
    seed: int,
    progress: Progress | None = None,
    *,
    read: bool = False,
    baselines: bool = False,
) -> Diagnosed:
    """Diagnosis for a report: verdict and prediction errors, and errors of held-out touches if `read`.

    With `baselines`, which need `read` and a pad, errors of the same touches read by regression without physics too.
    """
    from bayestouch.diagnosis import diagnose
    from bayestouch.diagnosis.outcome import is_tested, sentences
    from bayestouch.diagnosis.pictures import diagnosis_pictures

    searching = staged(progress, 0.0, _SEARCHED) if baselines else progress
    try:
        diagnosis = diagnose(dataset, sample=read, draws=100, seed=seed, progress=searching)
    except InputError as error:
        none: dict[str, Any] = {"baselines": []} if baselines else {}
        return Diagnosed({"missing": f"No effect was searched for: {error.message}.", **none})
    numbers = diagnosis.to_dict()
    made = "made with this report" + (
        "" if read or not is_tested(numbers) else ", without reading the held-out touches as unknown"
    )
    said = {"sentences": sentences(numbers, with_causes=False), "made": made}
    if baselines:
        staged(progress, _SEARCHED, 1.0, "regression without physics")
        numbers = _beside_regressions(numbers, diagnosis.traced, dataset)
    return Diagnosed({**numbers, **said}, _of_report(diagnosis_pictures(diagnosis.traced, _SHOWN)))


def _beside_regressions(numbers: dict[str, Any], traced: Traced, dataset: DataSet) -> dict[str, Any]:
    """Numbers of a diagnosis with `baselines`, and with the median error of the location in all."""
    from bayestouch.baselines import baselines
    from bayestouch.model.split_data import SplitData

    held = traced.before.held_out
    if held is None:
        return {**numbers, "baselines": []}
    # A regression is given all touches that are not held out, of which the search may use a part.
    found = baselines(SplitData.of(dataset), held.observed, traced.before.fitted.model.peak)
    out = {**numbers, "baselines": [{"name": each.regression.name, **each.errors} for each in found]}
    # No effect of a pad changes a location, so that references as stated and as corrected are the same.
    for key, model in (("before", traced.before), ("after", traced.after), ("after_against_stated", traced.after)):
        assert model.read is not None
        median = float(np.median(model.read.by_touch["location_rms_mm"]))
        out[key] = {**numbers[key], "location_median_mm": median}
    return out


def saved_diagnosis(folder: Path, dataset: DataSet) -> Diagnosed:
    """Diagnosis that `bayestouch diagnose` wrote to a folder, for a report on a data set as it was read.

    A sensor is known by the values in its `sensor.toml` and by its calibration touches (if it has no calibration table,
    by its touches). A diagnosis that was made from other touches of this sensor is taken, with a note.

    Raises
    ------
    InputError
        If the folder has no diagnosis, or one that is damaged, of another sensor or of another calibration.
    """
    from bayestouch.diagnosis.outcome import sentences
    from bayestouch.diagnosis.writing import MODEL
    from bayestouch.effects.stated import read_model

    file = folder / "diagnosis.json"
    numbers = read_diagnosis(file)
    found, wanted = numbers["data"].get("elements"), dataset.sensor.n_elements
    if found != wanted:
        raise InputError(f"expected a diagnosis of a sensor with {wanted} elements, got {found}", file=file)
    # Only the model says on which kind of body the diagnosis was made.
    model, kind = folder / MODEL, dataset.sensor.body.kind
    if model.is_file() and (of := read_model(model).body) != kind:
        raise InputError(f"expected a diagnosis of a {kind}, got one of a {of}", file=model)
    notes = _other_data(numbers["data"].get("fingerprints"), dataset, file)
    pictures = tuple(_read(folder, each) for each in numbers.pop("figures")[:_SHOWN])
    # Regressions are made in a report alone, so that `bayestouch diagnose` never wrote this.
    numbers.pop("baselines", None)
    said = {
        "notes": [*numbers.get("notes", []), *notes],
        "sentences": sentences(numbers, with_causes=False),
        "made": f"read from {folder.resolve().name}/{file.name}",
    }
    return Diagnosed({**numbers, **said}, _of_report(pictures), folder.resolve().name)


def _other_data(saved: Mapping[str, str | None] | None, dataset: DataSet, file: Path) -> tuple[str, ...]:
    """Notes on what differs between the data of a diagnosis and a data set; an error if the sensor is another one."""
    from bayestouch.diagnosis.fingerprints import data_fingerprints

    if saved is None:
        return ("the diagnosis does not say from which data it was made: whether it is of this sensor is not checked",)
    differs = {each for each, value in data_fingerprints(dataset).items() if saved[each] != value}
    if "sensor" in differs:
        raise InputError("expected a diagnosis of this sensor, got one made with another sensor.toml", file=file)
    if "calibration" in differs or (dataset.calibration is None and differs):
        raise InputError("expected a diagnosis of this sensor, got one made with other calibration touches", file=file)
    return ("the diagnosis was made from other touches of this sensor",) if differs else ()


def _read(folder: Path, described: dict[str, str]) -> Picture:
    names = ("name", "section", "title", "caption", "alt")
    form: Format = "png" if described["format"] == "png" else "svg"
    content = read_figure(folder, described["name"], form)
    return Picture(**{name: described[name] for name in names}, content=content, format=form)


def _of_report(pictures: tuple[Picture, ...]) -> tuple[Picture, ...]:
    """Figures with names and section for the report."""
    return tuple(replace(each, name=f"diagnosis_{each.name}", section="diagnosis") for each in pictures)
