"""Files of a diagnosis."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bayestouch.diagnosis.pictures import diagnosis_pictures
from bayestouch.diagnosis.repeat import repeat_script
from bayestouch.diagnosis.traced import Traced
from bayestouch.effects.stated import StatedModel
from bayestouch.output.files import write_numbers, write_pictures, write_text

NUMBERS, MODEL, SCRIPT = "diagnosis.json", "model.toml", "repeat.py"


def write_diagnosis(traced: Traced, numbers: Mapping[str, Any], options: Mapping[str, Any], folder: Path) -> None:
    """Write every file of a diagnosis with these options to an existing folder."""
    traced.before.calibration.save(folder / "calibration_before.nc")
    traced.after.calibration.save(folder / "calibration_after.nc")
    write_text(folder / MODEL, stated_model(traced, str(options.get("contact", ""))).to_toml())
    write_text(folder / SCRIPT, repeat_script(options))
    pictures = diagnosis_pictures(traced)
    write_pictures(folder, pictures)
    figures = [picture.described for picture in pictures]
    write_numbers(folder / NUMBERS, {**numbers, "figures": figures})


def stated_model(traced: Traced, contact: str) -> StatedModel:
    """Model with the effects that were found, for later calibrations."""
    effects = []
    for each in traced.added:
        values = zip(each.effect.parameters, each.values, strict=True)
        effects.append((each.effect.name, {parameter.name: float(value) for parameter, value in values}))
    return StatedModel(
        body=traced.data.dataset.sensor.body.kind,
        contact=contact,
        effects=tuple(effects),
        correction=traced.corrected is not None,
    )
