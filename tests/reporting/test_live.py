"""Interactive figures of a page: each has its place there, and colours say what the caption says."""

from __future__ import annotations

import base64
import gzip
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from report_cases import FINGER, LINE, PLANE, Page, small

import bayestouch
from bayestouch.output.pictures import GREY
from bayestouch.reporting.finger.live import estimate_figure
from bayestouch.reporting.live_touches import touch_source
from bayestouch.simulation import FingerDesign, PadDesign


def content_of(page: str) -> dict[str, Any]:
    """What the script of a page starts the figures from."""
    packed = page.partition('id="live-data">')[2].partition("</script>")[0]
    content: dict[str, Any] = json.loads(gzip.decompress(base64.b64decode(packed)))
    return content


def test_colours_of_tips_are_from_sharp_to_blunt() -> None:
    """As the caption says, in whichever order the table has them."""
    names = ["12.3 mm", "unknown", "flat", "knife edge", "3.9 mm"]
    radius = [6.23, None, 12.3, 0.0, 3.1]
    values = {"reference": radius, "mean": [6.0] * 5, "sd": [0.1] * 5, "low": [5.9] * 5, "high": [6.1] * 5}
    touches = {"touch": [*range(5)], "indenter": names, "parameters": {"R": values, "theta_c": {**values}}}
    figure = estimate_figure({"touches": touches}, touch_source(touches))
    dots = next(each for each in figure.renderers if each.glyph.__class__.__name__ == "Scatter")
    colours = dots.glyph.fill_color.transform
    assert colours.factors == ["knife edge", "3.9 mm", "12.3 mm", "flat"]
    light = [sum(int(colour[at : at + 2], 16) for at in (1, 3, 5)) for colour in colours.palette]
    assert light == sorted(light) and len(set(light)) == 4
    assert colours.nan_color == GREY


@pytest.mark.slow
@pytest.mark.parametrize("design", [FINGER, LINE, PLANE], ids=["finger", "line", "plane"])
def test_every_figure_has_its_place_in_a_page_without_references(
    tmp_path: Path, design: FingerDesign | PadDesign
) -> None:
    """A figure without a place stops the script, and with it all other figures."""
    dataset = small(design).dataset
    unknown = dict.fromkeys(("angle_deg",) if design is FINGER else ("x_mm", "y_mm"))
    touches = dataset.touches.select(dataset.touches.touch < 5).with_(**unknown)
    report = bayestouch.report(replace(dataset, touches=touches), tmp_path / "out", draws=64, diagnosis=False)
    text = (report.path / "index.html").read_text("utf-8")
    page = Page(text)
    places = {attributes.get("id") for attributes in page.all("div")}
    (item,) = content_of(text)["items"]
    assert set(item["roots"].values()) == {"live-sensor", "live-posterior", "live-touch_residuals"} <= places
    # and none is a place without a figure, or a sentence on one
    assert not any(str(place).startswith("live-") for place in places - set(item["roots"].values()))
    assert "in the estimates below" not in text
