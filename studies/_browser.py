"""Pages in Chromium: their lengths, what is wrong with them, and screenshots."""

from __future__ import annotations

import io
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
#: Width and height (px) of a laptop's window and of a phone.
SIZES = {"1280": (1280, 900), "390": (390, 844)}
#: Largest file of a screenshot, so that the documentation stays small, and numbers of colours to try for it.
MOST_BYTES, COLOURS = 150_000, (256, 128, 64, 32, 16)
_WORDS = "() => document.body.innerText.split(/\\s+/).filter((word) => word).length"
_UNFOLD = "() => document.querySelectorAll('details').forEach((each) => { each.open = true; })"
_SEEN = """(kinds) => [...document.querySelectorAll(kinds)].filter((each) => each.checkVisibility()).length"""


@contextmanager
def chromium() -> Iterator[Any]:
    """Headless Chromium, as a browser of playwright; None where one of the two is not installed."""
    program = next((found for found in map(shutil.which, BROWSERS) if found), None)
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        program = None
    if program is None:
        yield None
        return
    with sync_playwright() as started:
        browser = started.chromium.launch(executable_path=program, args=["--no-sandbox"])
        yield browser
        browser.close()


def opened(browser: Any, file: Path, size: str, scheme: str = "light") -> Any:
    """A page in a window of one of `SIZES`; `page.said` has its console messages."""
    width, height = SIZES[size]
    page = browser.new_page(viewport={"width": width, "height": height}, color_scheme=scheme)
    page.said = []
    page.on("console", lambda message: page.said.append(message.text))
    page.on("pageerror", lambda error: page.said.append(str(error)))
    page.goto(file.resolve().as_uri())
    # figures that a script draws say when they are there; pages without them have nothing to wait for
    page.wait_for_timeout(300)
    if page.evaluate("Boolean(document.getElementById('live-data'))"):
        page.wait_for_selector("html[data-ready=true]", timeout=60_000)
    return page


def lengths(browser: Any, file: Path) -> dict[str, float]:
    """Size of a page: bytes, words, tables and figures that are seen, height at each width, also with all unfolded.

    Without a browser it is the bytes alone.
    ``messages`` counts console messages, ``violations`` what axe-core finds in light and dark, ``wide`` the pixels that
    the page is wider than a window, summed over the widths.
    """
    found: dict[str, float] = {"bytes": file.stat().st_size}
    if browser is not None:
        found |= {"messages": 0, "violations": 0, "wide": 0}
    for size, (width, _) in SIZES.items() if browser is not None else ():
        page = opened(browser, file, size)
        found[f"height {size}"] = page.evaluate("document.documentElement.scrollHeight")
        if size == "1280":
            found["words"] = page.evaluate(_WORDS)
            found["tables"] = page.evaluate(_SEEN, "table")
            found["figures"] = page.evaluate(_SEEN, "figure")
        page.evaluate(_UNFOLD)
        page.wait_for_timeout(500)
        found[f"height {size} unfolded"] = page.evaluate("document.documentElement.scrollHeight")
        if size == "1280":
            found["words unfolded"] = page.evaluate(_WORDS)
        found["wide"] += max(0, page.evaluate("document.documentElement.scrollWidth") - width)
        found["violations"] += sum(_violations(page, scheme) for scheme in ("light", "dark"))
        found["messages"] += len(page.said)
        page.close()
    return found


def _violations(page: Any, scheme: str) -> int:
    from axe_playwright_python.sync_playwright import Axe

    page.emulate_media(color_scheme=scheme)
    return len(Axe().run(page).response["violations"])


def screenshot(browser: Any, file: Path, size: str, scheme: str, whole: bool = False) -> bytes:
    """Picture (PNG) of the first screen of a page, or of the whole page."""
    page = opened(browser, file, size, scheme)
    taken: bytes = page.screenshot(full_page=whole)
    page.close()
    return taken


def side_by_side(pictures: list[bytes], width: int, gap: int = 24) -> bytes:
    """Pictures (PNG) of one width each, beside each other, on grey."""
    from PIL import Image

    images = [Image.open(io.BytesIO(each)).convert("RGB") for each in pictures]
    scaled = [
        each.resize((width, round(each.height * width / each.width)), Image.Resampling.LANCZOS) for each in images
    ]
    sheet = Image.new("RGB", (len(scaled) * (width + gap) - gap, max(each.height for each in scaled)), "#8a8f94")
    for place, each in enumerate(scaled):
        sheet.paste(each, (place * (width + gap), 0))
    out = io.BytesIO()
    sheet.save(out, "PNG")
    return out.getvalue()


def compressed(picture: bytes) -> bytes:
    """PNG with as many colours as `MOST_BYTES` allow.

    Raises
    ------
    ValueError
        It is larger than that with the fewest colours, too.
    """
    from PIL import Image

    image = Image.open(io.BytesIO(picture)).convert("RGB")
    for colours in COLOURS:
        out = io.BytesIO()
        image.quantize(colours, dither=Image.Dither.NONE).save(out, "PNG", optimize=True)
        if out.tell() <= MOST_BYTES:
            return out.getvalue()
    raise ValueError(f"a screenshot has {out.tell()} bytes with {COLOURS[-1]} colours")
