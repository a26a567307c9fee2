"""First screen of a report as a picture, for the first page of the documentation.

A finger whose neighbours leak into each other is simulated, and `bayestouch.report` is given the data set and nothing
else. Needs Chromium and playwright: `python docs/pictures/report_first_screen.py` makes the picture again.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
from pathlib import Path

import bayestouch

DESIGN = bayestouch.FingerDesign(n_elements=8, edge_step_deg=2.0, flat_step_deg=4.0, touch_step_deg=4.0)
EFFECTS = {"crosstalk": 0.04}
SIZE = {"width": 1280, "height": 800}
BROWSERS = ("chromium", "chromium-browser", "google-chrome")


def take_picture(page: Path, picture: Path) -> None:
    """Save what a browser window of this size shows of a page."""
    from playwright.sync_api import sync_playwright

    browser = next((found for found in map(shutil.which, BROWSERS) if found), None)
    if browser is None:
        raise SystemExit("no Chromium on this system: the picture is not made")
    with sync_playwright() as started:
        chromium = started.chromium.launch(executable_path=browser, args=["--no-sandbox"])
        window = chromium.new_page(viewport=SIZE, java_script_enabled=False)
        window.goto(page.as_uri())
        window.screenshot(path=str(picture))
        chromium.close()


def main() -> None:
    """Simulate, report, and save the picture in the folder that is given."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=Path(__file__).parent)
    folder = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    data = bayestouch.simulate(DESIGN, effects=EFFECTS, seed=3).dataset
    with tempfile.TemporaryDirectory() as scratch:
        made = bayestouch.report(data, Path(scratch) / "report")
        take_picture(made.path / "index.html", folder / "report_first_screen.png")
    print(made)


if __name__ == "__main__":
    main()
