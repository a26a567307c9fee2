"""Lengths and pictures of report pages: against pages whose lengths are known."""

from __future__ import annotations

import io
import json
from pathlib import Path

import _browser
import numpy as np
import pytest
from study_modules import study

MODULE = study("report_pages")
#: 1234 px high, 500 more where the details are open; seven words, three of them folded; wider than a phone by 110 px.
PAGE = """<!doctype html><html lang="en"><head><title>page</title><style>
* { margin: 0; padding: 0; } summary { height: 34px; } .wide { width: 500px; height: 700px; } p { height: 500px; }
</style></head><body><main><h1 class="wide">one two</h1><p>three</p>
<details><summary>four</summary><p>five six seven</p></details></main>
<script>console.log("said")</script></body></html>"""


def test_keys_that_are_gone(tmp_path: Path) -> None:
    before, after = tmp_path / "before", tmp_path / "after"
    for folder, numbers in (
        (before, {"a": 1, "b": {"c": 2, "d": [{"e": 1}, {"f": {"g": 2}}]}, "h": {"i": 3}}),
        (after, {"a": 5, "b": {"c": None, "d": [{"e": 0}], "new": 1}}),
    ):
        folder.mkdir()
        (folder / "report.json").write_text(json.dumps(numbers))
    assert MODULE.lost(before, after) == ["b.d.f", "h"]
    assert MODULE.lost(after, before) == ["b.new"]
    assert set(MODULE.keys({"b": {"d": [{"e": 1}, {"f": 2}]}})) == {"b", "b.d", "b.d.e", "b.d.f"}


def test_table_has_the_ratio_of_two_versions() -> None:
    two = {
        "0.1.0": {"height 1280": 2000, "bytes": 2e6, "wide": 0},
        "0.2.0": {"height 1280": 500, "bytes": 1e6, "wide": 0},
    }
    lines = MODULE.as_table(two).splitlines()
    assert lines[0] == "| the page | 0.1.0 | 0.2.0 | ratio |" and len(lines) == 2 + 3
    assert "| height at 1280 px, as opened, px | 2000 | 500 | 0.25 |" in lines
    assert "| size of the file, MB | 2.00 | 1.00 | 0.50 |" in lines
    assert "| wider than the window, px | 0 | 0 | – |" in lines
    assert MODULE.as_table({"0.2.0": two["0.2.0"]}).splitlines()[0] == "| the page | 0.2.0 |"


def picture(values: np.ndarray) -> bytes:
    image = pytest.importorskip("PIL.Image")
    out = io.BytesIO()
    image.fromarray(values.astype(np.uint8)).save(out, "PNG")
    return out.getvalue()


@pytest.mark.slow
def test_pictures_are_put_beside_each_other_and_compressed() -> None:
    image = pytest.importorskip("PIL.Image")
    red, blue = (np.zeros((60, 40, 3)) for _ in range(2))
    red[..., 0], blue[..., 2] = 255, 255
    sheet = image.open(io.BytesIO(_browser.side_by_side([picture(red), picture(blue[:20])], 20, gap=4)))
    assert sheet.size == (44, 30)
    assert sheet.getpixel((10, 15)) == (255, 0, 0) and sheet.getpixel((34, 5)) == (0, 0, 255)
    assert sheet.getpixel((34, 20)) == sheet.getpixel((22, 5)) == (138, 143, 148)
    # colours at random: the file grows with the colours, and with one of its limits none is found
    noise = np.random.default_rng(0).integers(0, 255, (300, 400, 3))
    small = _browser.compressed(picture(noise))
    assert len(small) <= _browser.MOST_BYTES < len(picture(noise))
    with pytest.raises(ValueError, match="16 colours"):
        _browser.compressed(picture(np.random.default_rng(0).integers(0, 255, (900, 900, 3))))


def test_lengths_are_those_of_the_page(tmp_path: Path) -> None:
    pytest.importorskip("axe_playwright_python", reason="axe is not installed (extra dev)")
    file = tmp_path / "index.html"
    file.write_text(PAGE, "utf-8")
    with _browser.chromium() as browser:
        if browser is None:
            pytest.skip("no Chromium on this system")
        found = _browser.lengths(browser, file)
    assert found["bytes"] == len(PAGE.encode())
    assert [found[f"height {size}{more}"] for size in ("1280", "390") for more in ("", " unfolded")] == [1234, 1734] * 2
    assert (found["words"], found["words unfolded"]) == (4, 7)
    # one message a width; 500 px do not fit into 390
    assert found["messages"] == 2 and found["wide"] == 110 and found["violations"] == 0
    assert _browser.lengths(None, file) == {"bytes": len(PAGE.encode())}
