"""A diagnosis to files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from bayestouch.diagnosis.pictures import all_pictures
from bayestouch.diagnosis.repeat import repeat_script
from bayestouch.effects.stated import StatedModel
from bayestouch.reporting.files import write_numbers, write_pictures, write_text

if TYPE_CHECKING:
    from bayestouch.diagnosis.result import Diagnosis

NUMBERS, MODEL, SCRIPT = "diagnosis.json", "model.toml", "repeat.py"


def write_diagnosis(diagnosis: Diagnosis, folder: Path) -> None:
    """Write every file of a diagnosis into an existing folder."""
    diagnosis.calibration_before.save(folder / "calibration_before.nc")
    diagnosis.calibration_after.save(folder / "calibration_after.nc")
    write_text(folder / MODEL, stated_model(diagnosis).to_toml())
    write_text(folder / SCRIPT, repeat_script(diagnosis))
    pictures = all_pictures(diagnosis.traced)
    write_pictures(folder, pictures)
    figures = [picture.described for picture in pictures]
    write_numbers(folder / NUMBERS, {**diagnosis.to_dict(), "figures": figures})


def stated_model(diagnosis: Diagnosis) -> StatedModel:
    """The model that was found, for calibrations to come."""
    traced = diagnosis.traced
    effects = []
    for each in traced.added:
        values = zip(each.effect.parameters, each.values, strict=True)
        effects.append((each.effect.name, {parameter.name: float(value) for parameter, value in values}))
    return StatedModel(
        body=traced.data.dataset.sensor.body.kind,
        contact=str(diagnosis.options.get("contact", "")),
        effects=tuple(effects),
        correction=traced.corrected is not None,
    )
