"""Numbers that a report's page shows, beside those of its ``report.json``."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from report_cases import Page, strict_json

from bayestouch.diagnosis import outcome
from bayestouch.output.pictures import Picture
from bayestouch.output.text import number
from bayestouch.reporting import page as pages
from bayestouch.reporting import trust
from bayestouch.reporting.finger import sketch as finger_sketch
from bayestouch.reporting.live import live_figures
from bayestouch.reporting.pad import sketch as pad_sketch

_NUMBER = re.compile(r"\d+(?:\.\d+)?")
#: A number that a template or a drawing shows, with all digits.
_EXACT = re.compile("⟦([^⟧]*)⟧")
#: Shown in percent, and a fraction in ``diagnosis.json``, whose format is fixed.
_FRACTIONS = ("coverage_90", "P_coverage_90")


def pictures_of(folder: Path, numbers: dict[str, Any]) -> list[Picture]:
    """Figures of a report, from its folder."""
    return [
        Picture(**{name: each[name] for name in each if name != "file"}, content=(folder / each["file"]).read_bytes())
        for each in numbers["figures"]
    ]


def page_from_files(folder: Path) -> str:
    """The page of a report, made again from ``report.json`` and the folder ``figures`` alone."""
    numbers = strict_json(folder / "report.json")
    return pages.render(numbers, pictures_of(folder, numbers), live_figures(numbers))


def not_in_numbers(
    numbers: dict[str, Any], pictures: Sequence[Picture], known: dict[str, Any] | None = None
) -> list[str]:
    """Numbers of the page of `numbers` that neither `known` (by default the same) nor the fixed text of a template has.

    The page is made with all digits, so that two numbers are hardly ever equal by chance.
    """
    known = numbers if known is None else known
    with pytest.MonkeyPatch.context() as patch:
        for module in (finger_sketch, pad_sketch):
            patch.setattr(module, "number", _exactly)
            if hasattr(module, "fixed"):
                patch.setattr(module, "fixed", _exactly)
        patch.setattr(pages, "_shown", _exactly)
        patch.setattr(pages, "_place", _exactly)
        patch.setattr(pages, "_radius", lambda estimate: _exactly(estimate["r_c_mm"]))
        patch.setattr(pages, "plus_minus", lambda mean, sd: f"{_exactly(mean)} ± {_exactly(sd)}")
        patch.setattr(trust, "grade_text", lambda name, value: _exactly(value))
        patch.setattr(outcome, "_probability", _exactly)
        html = pages.render(numbers, pictures)
    text = " ".join(Page(re.sub(r"<style>.*?</style>", "", html, flags=re.DOTALL)).text)
    found = set(_EXACT.findall(text))
    assert len(found) > 50
    values = list(_leaves(known))
    exact = {repr(float(value)) for value in values if not isinstance(value, str)} | set(_derived(known))
    said = {each for value in values for each in _NUMBER.findall(str(value))} | set(_of_templates())
    plain = set(_NUMBER.findall(_EXACT.sub(" ", text)))
    return sorted(found - exact) + sorted(plain - said)


def _exactly(value: Any, *_: Any) -> str:
    if value is None or isinstance(value, bool | str):
        return number(value)
    return f"⟦{float(value)!r}⟧"


def _leaves(value: Any, name: str = "") -> Iterator[float | str]:
    """Numbers and texts, without the draws and readings of single touches, which no table shows."""
    if isinstance(value, dict):
        for key, each in value.items():
            if key != "touches" or not isinstance(each, dict):
                yield from _leaves(each, key)
    elif isinstance(value, list | tuple):
        for each in value:
            yield from _leaves(each, name)
    elif isinstance(value, float | int) and not isinstance(value, bool):
        yield value
        if name in _FRACTIONS:
            yield 100 * value
    elif isinstance(value, str):
        yield value


def _derived(numbers: dict[str, Any]) -> Iterator[str]:
    """Probability of all causes together that are too improbable to have a bar of their own."""
    for each in outcome.probable_causes(numbers.get("diagnosis") or {}, 6):
        if each["name"] == "others":
            yield repr(float(each["probability"]))


def _of_templates() -> Iterator[str]:
    """Numbers of the fixed text of all templates."""
    for file in pages._TEMPLATES.rglob("*.html"):
        text = file.read_text("utf-8")
        yield from _NUMBER.findall(re.sub(r"\{#.*?#\}", " ", text, flags=re.DOTALL))
