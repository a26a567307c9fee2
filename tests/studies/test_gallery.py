"""The gallery shows the pictures of all studies, one by one, and says of each what it is."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest
from study_modules import SCRIPTS, STUDIES, study

DOCS = STUDIES.parent / "docs"
# These have pages of their own.
ELSEWHERE = {"effects_gallery", "error_rates"}
# Of 256 levels of grey: what is darker is drawn, and by so much is a point drawn in one picture and not in the other.
DRAWN, DRAWN_APART = 192, 64


def test_every_study_that_saves_a_picture_is_in_the_gallery() -> None:
    sources = {name.split("/")[-1]: (STUDIES / f"{name}.py").read_text("utf-8") for name in SCRIPTS}
    saving = {name for name, text in sources.items() if re.search(r"\bsave\(|edge_figure\(", text)}
    # these save calibrations and data sets
    saving -= {"fuzz_readers", "golden", "interruptions", "gallery"}
    assert set(study("gallery").PICTURES) == saving - ELSEWHERE


def test_the_page_shows_each_picture_once_and_no_other() -> None:
    pictures = Counter(name for names in study("gallery").PICTURES.values() for name in names)
    page = (DOCS / "gallery.md").read_text("utf-8")
    assert Counter(re.findall(r"!\[[^\]]+\]\(gallery/(\w[\w.-]*)\.png\)", page)) == pictures
    assert {path.stem for path in (DOCS / "gallery").iterdir()} == set(pictures)
    # what was improved is said of each
    assert set(re.findall(r"^\| `([\w.-]+)` \|", page, re.MULTILINE)) >= set(pictures)


def test_pictures_are_small() -> None:
    assert max(path.stat().st_size for path in (DOCS / "gallery").iterdir()) < 100_000


def test_a_picture_is_made_by_its_study(tmp_path: Path) -> None:
    """Figure 2 takes a second, and comes out as it is in the gallery; older matplotlib sets text otherwise."""
    pytest.importorskip("matplotlib", minversion="3.11")
    from PIL import Image, ImageChops, ImageFilter

    gallery = study("gallery")
    gallery.make("figure_2", tmp_path)
    made, kept = (Image.open(folder / "figure_2.png").convert("L") for folder in (tmp_path, gallery.FOLDER))
    assert made.size == kept.size
    # fonts and matplotlib's versions may move a line by a point: what is drawn in one is drawn within two points of it
    # in the other
    for one, other in ((made, kept), (kept, made)):
        missing = ImageChops.subtract(other.filter(ImageFilter.MinFilter(5)), one, offset=0)
        drawn = sum(one.histogram()[:DRAWN])
        assert sum(missing.histogram()[DRAWN_APART:]) < 0.01 * drawn
