"""The report in a browser: figures, controls, width of a phone, scripts off, paper, contrast and accessibility."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from report_cases import FINGER, LINE, PLANE, pad_evidence, small

import bayestouch
from bayestouch.output.files import new_folder
from bayestouch.reporting.writing import drafted, write_report
from bayestouch.simulation import PadDesign

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed (extra dev)")
axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe is not installed (extra dev)")

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
SIZES = {"desktop": (1280, 900), "phone": (390, 844)}
# Text and pictures that overlap: neither holds the other, both can be seen, and they share more than a hair. What is
# scrolled out of a box of its own is not on the page.
OVERLAPS = """() => {
  const kinds = "h1,h2,h3,p,li,dt,dd,figcaption,caption,th,td,summary,img,.plot,select,label";
  const seen = [...document.querySelectorAll(kinds)]
    .filter((each) => each.checkVisibility() && !each.classList.contains("skip"));
  const box = (each) => {
    const b = each.getBoundingClientRect(), out = { l: b.left, r: b.right, t: b.top, b: b.bottom };
    for (let p = each.parentElement; p; p = p.parentElement) if (p.classList.contains("scroll")) {
      const s = p.getBoundingClientRect(); out.l = Math.max(out.l, s.left); out.r = Math.min(out.r, s.right);
    }
    return out;
  };
  const boxes = seen.map(box), found = [];
  for (let i = 0; i < seen.length; i++) for (let j = i + 1; j < seen.length; j++) {
    if (seen[i].contains(seen[j]) || seen[j].contains(seen[i])) continue;
    const w = Math.min(boxes[i].r, boxes[j].r) - Math.max(boxes[i].l, boxes[j].l);
    const h = Math.min(boxes[i].b, boxes[j].b) - Math.max(boxes[i].t, boxes[j].t);
    if (w > 2 && h > 2) found.push(seen[i].textContent.slice(0, 40) + " | " + seen[j].textContent.slice(0, 40));
  }
  return found;
}"""
# Where on the screen the chosen touch is in the estimates.
TOUCH_ON_SCREEN = """() => {
  const source = Bokeh.documents[0].get_model_by_name("touches"), i = source.selected.indices[0];
  const drawn = (each) => each.renderers.some((r) => ["Patches", "Rect"].includes(r.glyph.type));
  const all = Bokeh.documents[0].roots();
  const root = all.find((each) => !drawn(each) && each.renderers.some((r) => r.data_source === source));
  const dots = root.renderers.find((r) => r.data_source === source);
  const view = Bokeh.index.get_by_id(root.id);
  const x = dots.glyph.x.field ?? dots.glyph.x, y = dots.glyph.y.field ?? dots.glyph.y;
  const box = view.frame.bbox, at = view.el.getBoundingClientRect();
  const sx = view.frame.x_scale.compute(source.data[x][i]), sy = view.frame.y_scale.compute(source.data[y][i]);
  return [at.left + sx, at.top + sy];
}"""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    if CHROMIUM is None:
        pytest.skip("no Chromium on this system")
    with playwright.sync_playwright() as started:
        chromium = started.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield chromium
        chromium.close()


@pytest.fixture(scope="module")
def folders(made_once: Callable[[str, Callable[[Path], object]], Path]) -> dict[str, Path]:
    """A report on a finger, on a line of elements and on a plane."""

    def of_pad(design: PadDesign, path: Path) -> None:
        with new_folder(path) as folder:
            write_report(drafted(folder, pad_evidence(design)), None, folder)

    of = {
        "finger": lambda path: bayestouch.report(small(FINGER).dataset, path, draws=128, diagnosis=False),
        "line": partial(of_pad, LINE),
        "plane": partial(of_pad, PLANE),
    }
    return {name: made_once(f"page of a {name}", write) for name, write in of.items()}


def opened(browser: Any, folder: Path, size: str = "desktop", **options: Any) -> Any:
    """The page, with everything that goes wrong in it in `page.wrong`."""
    width, height = SIZES[size]
    page = browser.new_page(viewport={"width": width, "height": height}, **options)
    page.wrong = []
    page.on("console", lambda message: page.wrong.append(message.text))
    page.on("pageerror", lambda error: page.wrong.append(str(error)))
    page.on(
        "request",
        lambda request: None if request.url.startswith(("file:", "data:", "blob:")) else page.wrong.append(request.url),
    )
    page.goto((folder / "index.html").as_uri())
    if options.get("java_script_enabled", True):
        page.wait_for_selector("html[data-ready=true]", timeout=60_000)
    return page


def unfold(page: Any) -> None:
    page.evaluate("document.querySelectorAll('details').forEach((each) => { each.open = true; })")


def check_first_screen(page: Any) -> None:
    """On a wide screen the drawing, the verdict, the figures and the bars are seen without scrolling."""
    for part in (".sketch svg", ".answer", ".figures", ".loop", ".verdict"):
        box = page.locator(part).first.bounding_box()
        assert box["y"] + box["height"] <= 900, part
    assert page.locator(".figures dd").count() >= 2


def check_page(page: Any, width: int) -> None:
    assert page.wrong == []
    if width > 1000:
        check_first_screen(page)
    unfold(page)
    page.wait_for_timeout(300)  # figures inside are drawn when they are opened
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.evaluate(OVERLAPS) == []
    for figure in page.locator("main figure").all():
        assert len(figure.locator("figcaption").inner_text()) > 40
        shown = figure.locator("img:visible, .plot:visible")
        assert shown.count() == 1
        box = shown.bounding_box()
        assert box["width"] > 200 and box["height"] > 150
        assert len(shown.get_attribute("alt") or shown.get_attribute("aria-label")) > 40
    images = page.evaluate("[...document.images].map((image) => [image.complete, image.naturalWidth])")
    assert images and all(complete and natural > 100 for complete, natural in images)
    labels = page.evaluate(
        "Bokeh.documents[0].roots().flatMap((root) => [...root.below, ...root.left].map((axis) => axis.axis_label))"
    )
    assert len(labels) == 8 and all(labels)


def check_accessible(page: Any, scheme: str) -> None:
    page.emulate_media(color_scheme=scheme)
    found = axe.Axe().run(page, options={"resultTypes": ["violations", "passes"]})
    told = [(each["id"], [node["target"] for node in each["nodes"]][:3]) for each in found.response["violations"]]
    assert told == []
    # contrast was really computed, for hundreds of texts
    contrast = [each for each in found.response["passes"] if each["id"] == "color-contrast"]
    assert contrast and len(contrast[0]["nodes"]) > 100


def check_navigation(page: Any) -> None:
    links = page.locator("nav a")
    assert links.count() == 6
    for link in links.all():
        target = link.get_attribute("href")
        link.click()
        page.wait_for_function(
            "(target) => { const t = document.querySelector(target).getBoundingClientRect().top;"
            " return Math.abs(t) < 3 || scrollY + innerHeight > document.documentElement.scrollHeight - 3; }",
            arg=target,
        )
        page.evaluate("scrollTo({ top: 0, behavior: 'instant' })")
    page.keyboard.press("Tab")


def check_picker(page: Any, folder: Path) -> None:
    touches = json.loads((folder / "report.json").read_text("utf-8"))["touches"]
    places = page.locator("#pick-place")
    options = places.locator("option").all_inner_texts()
    assert len(options) > 3
    data = """(name) => Object.fromEntries(
      Object.entries(Bokeh.documents[0].get_model_by_name(name).data).map(([key, column]) => [key, [...column]]))"""
    seen = set()
    places.focus()
    for _ in range(2):
        page.keyboard.press("ArrowUp")  # a list is moved through by keys
        page.wait_for_timeout(50)
        chosen = int(page.locator("#pick-touch").input_value())
        seen.add(chosen)
        draws = page.evaluate(data, "draws")
        first, second = touches["shown"]
        assert draws["x"] == touches["draws"][first][chosen] and draws["y"] == touches["draws"][second][chosen]
        bars = page.evaluate(data, "residuals")
        assert bars["z"] == [value or 0 for value in touches["residuals"][chosen]]
        words = page.locator("#chosen").inner_text()
        assert words.startswith(f"Touch {touches['touch'][chosen]},") and "±" in words
    assert len(seen) == 2
    # what a tap on a touch does
    other = (max(seen) + 1) % len(touches["touch"])
    page.evaluate("(i) => { Bokeh.documents[0].get_model_by_name('touches').selected.indices = [i]; }", other)
    assert page.locator("#chosen").inner_text().startswith(f"Touch {touches['touch'][other]},")
    assert int(page.locator("#pick-touch").input_value()) == other


def check_value_under_the_pointer(page: Any) -> None:
    """A tooltip with the touch's values appears where the chosen touch is drawn."""
    plot = page.locator("#live-estimates")
    plot.scroll_into_view_if_needed()
    x, y = page.evaluate(TOUCH_ON_SCREEN)
    page.mouse.move(x + 30, y)
    page.mouse.move(x, y, steps=3)
    page.wait_for_selector(".bk-tooltip-row-value", timeout=5_000, state="attached")
    assert any("±" in text for text in page.locator(".bk-tooltip-row-value").all_inner_texts())
    page.mouse.move(1, 1)
    page.wait_for_selector(".bk-tooltip-row-value", timeout=5_000, state="hidden")


@pytest.mark.parametrize("name", ["finger", "line", "plane"])
def test_page(browser: Any, folders: dict[str, Path], name: str) -> None:
    folder = folders[name]
    assert (folder / "index.html").stat().st_size < 2e6
    for size, (width, _) in SIZES.items():
        page = opened(browser, folder, size)
        check_page(page, width)
        if size == "desktop":
            check_navigation(page)
            check_picker(page, folder)
            check_value_under_the_pointer(page)
            for scheme in ("light", "dark"):
                check_accessible(page, scheme)
            page.emulate_media(media="print")
            assert not page.locator(".plot:visible").count()
            assert page.locator("#sensor img").is_visible()
        page.close()


def test_pictures_stand_in_where_scripts_are_off(browser: Any, folders: dict[str, Path]) -> None:
    page = opened(browser, folders["finger"], java_script_enabled=False)
    for each in page.locator("summary").all():  # what is folded inside another comes after it
        if each.is_visible():
            each.click()
    figures = json.loads((folders["finger"] / "report.json").read_text("utf-8"))["figures"]
    shown = [each for each in figures if not each["name"].startswith("corner_")]
    assert page.locator("main img:visible").count() == len(shown) > 5
    assert page.locator("#sensor img").is_visible() and page.locator("#all_tips img").is_visible()
    assert not page.locator("#explorer").is_visible()
    page.close()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["measured/array8-soft", None])
def test_pages_of_real_data(browser: Any, shared_folder: Path, tmp_path: Path, name: str | None) -> None:
    data = None if name is None else bayestouch.load_dataset(shared_folder / name)
    if name == "measured/array8-soft":  # a part of 2,800 touches
        data = replace(data, touches=data.touches.select(data.touches.touch % 11 == 0))
    bayestouch.report(data, tmp_path / "out")
    assert (tmp_path / "out" / "index.html").stat().st_size < 2e6
    for size, (width, _) in SIZES.items():
        page = opened(browser, tmp_path / "out", size)
        check_page(page, width)
        if size == "desktop":
            check_navigation(page)
            check_picker(page, tmp_path / "out")
            for scheme in ("light", "dark"):
                check_accessible(page, scheme)
        page.close()
