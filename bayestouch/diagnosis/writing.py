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
    write_text(folder / MODEL, model_text(traced, str(options.get("contact", ""))))
    write_text(folder / SCRIPT, repeat_script(options))
    pictures = diagnosis_pictures(traced)
    write_pictures(folder, pictures)
    figures = [picture.described for picture in pictures]
    write_numbers(folder / NUMBERS, {**numbers, "figures": figures})


def model_text(traced: Traced, contact: str) -> str:
    """Text of ``model.toml``: the model of the calibration that is returned, and a comment on what it is without."""
    used = set(traced.after.fitted.names)
    text = stated_model(traced, contact).to_toml()
    if left := [each.effect.name for each in traced.added if each.effect.name not in used]:
        text += f"\n# Found too, and not used for reading, see not_used in {NUMBERS}: {', '.join(left)}.\n"
    return text


def stated_model(traced: Traced, contact: str) -> StatedModel:
    """Model of the calibration that is returned, for later calibrations.

    A fit begins with the values that its effects have beside all that were found.
    """
    used, effects = set(traced.after.fitted.names), []
    for each in traced.added:
        if each.effect.name in used:
            values = zip(each.effect.parameters, each.values, strict=True)
            effects.append((each.effect.name, {parameter.name: float(value) for parameter, value in values}))
    return StatedModel(
        body=traced.data.dataset.sensor.body.kind,
        contact=contact,
        effects=tuple(effects),
        correction=traced.after.correction is not None,
    )
