"""What holds for every report: its files, its page, and the numbers of the page."""

from __future__ import annotations

import itertools
import json
import re

from page_numbers import not_in_numbers, page_from_files, pictures_of
from report_cases import Page, strict_json

import bayestouch
from bayestouch.reporting import Report

# Large: the page has the draws of each touch, tables of the calibration, and the residuals by element and location.
ONLY_IN_THE_FOLDER = {"diagnosis_views", "corner_element", "corner_typical_touch", "corner_hardest_touch"}
NEEDED = {"index.html", "report.json", "calibration.nc", "posterior.nc"}


def check_files_are_complete(any_report: Report) -> None:
    folder = any_report.path
    assert {path.name for path in folder.iterdir()} == NEEDED | {"figures"}
    assert not list(folder.parent.glob(".*"))
    numbers = strict_json(folder / "report.json")
    listed = {figure["file"] for figure in numbers["figures"]}
    assert listed == {f"figures/{path.name}" for path in (folder / "figures").iterdir()}
    assert set(any_report.figures) == {folder / name for name in listed}
    for path in any_report.figures:
        start = path.read_bytes()[:100]
        assert start.startswith(b"\x89PNG") if path.suffix == ".png" else b"<?xml" in start
    assert (folder / "index.html").stat().st_size < 2e6
    calibration, posteriors = (bayestouch.load(folder / f"{name}.nc") for name in ("calibration", "posterior"))
    assert calibration.sensor == posteriors.sensor
    assert len(posteriors.rows.touch) == numbers["trust"]["convergence"]["touches"]


def check_page_is_sound_and_needs_nothing_else(any_report: Report) -> None:
    text = (any_report.path / "index.html").read_text("utf-8")
    page = Page(text)
    addresses = [a.get(key) or "" for _, a in page.found for key in ("src", "href", "srcset", "action") if key in a]
    assert addresses
    assert all(address.startswith(("data:", "#")) for address in addresses)
    # the library's own text may hold addresses; the browser tests see that nothing is asked for
    plain = re.sub(r"data:[^\"]*|<script.*?</script>", "", text, flags=re.DOTALL)
    assert not re.search(r"@import|url\(|https?:", plain)
    targets = {a["id"] for _, a in page.found if a.get("id")}
    assert {a[1:] for a in addresses if a.startswith("#")} <= targets
    assert len(page.all("table")) == len(page.all("caption")) > 5
    assert all(a.get("scope") for a in page.all("th"))
    figures = json.loads((any_report.path / "report.json").read_text("utf-8"))["figures"]
    shown = sorted(figure["alt"] for figure in figures if figure["name"] not in ONLY_IN_THE_FOLDER)
    assert sorted(a["alt"] or "" for a in page.all("img")) == shown
    assert len([tag for tag, _ in page.found if tag == "section"]) == 6
    assert all(len(figure["alt"]) > 40 for figure in figures)
    assert page.all("html")[0]["lang"] == "en"
    headings = [int(tag[1]) for tag, _ in page.found if re.fullmatch(r"h\d", tag)]
    assert headings[0] == 1 and all(after - before <= 1 for before, after in itertools.pairwise(headings))


def check_page_holds_no_other_numbers(any_report: Report) -> None:
    """The page is made from ``report.json`` and the figures alone, and its numbers are theirs."""
    folder = any_report.path
    assert page_from_files(folder) == (folder / "index.html").read_text("utf-8")
    numbers = strict_json(folder / "report.json")
    pictures = pictures_of(folder, numbers)
    assert not_in_numbers(numbers, pictures) == []
    for lost in ("answer", "calibration", "estimates", "places", "trust"):  # so that the check itself can fail
        assert not_in_numbers(numbers, pictures, {key: numbers[key] for key in numbers if key != lost})


def check_every_report(report: Report, *, simulated: bool) -> None:
    check_files_are_complete(report)
    check_page_is_sound_and_needs_nothing_else(report)
    check_page_holds_no_other_numbers(report)
    text = (report.path / "index.html").read_text("utf-8")
    assert (text.count("SIMULATED – not a measurement") == 1) is simulated
    assert report.numbers["data"]["simulated"] is simulated
    assert ("simulated" in str(report)) is simulated
    marked = [title for title in re.findall(r"<h2[^>]*>([^<]*)", text) if "(simulated)" in title]
    # how well, where, why not better, uncertainties
    assert len(marked) == (4 if simulated else 0)
