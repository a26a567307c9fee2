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
from bayestouch.simulation import FingerDesign, PadDesign


def content_of(page: str) -> dict[str, Any]:
    """What the script of a page starts the figures from."""
    packed = page.partition('id="live-data">')[2].partition("</script>")[0]
    content: dict[str, Any] = json.loads(gzip.decompress(base64.b64decode(packed)))
    return content


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
