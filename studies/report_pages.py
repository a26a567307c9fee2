"""The report of this version beside that of another: length, what is wrong with the page, and screenshots.

Both report on the simulated finger of the package (`bayestouch report -o FOLDER`), or with `--small` on a finger of six
elements, and Chromium shows both pages.

    python studies/report_pages.py [FOLDER] [--before CHECKOUT] [--small] [--docs]

CHECKOUT is a checkout of the other version (`git worktree add CHECKOUT COMMIT`); without it this version is measured
alone. A report that FOLDER already has is not made again. `--docs` writes the table and the pictures of the page
`docs/report_before_after.md`.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from _browser import SIZES, chromium, compressed, lengths, screenshot, side_by_side
from _page import DOCS, markdown_table, put_into_page

import bayestouch

#: Finger of `--small`, seed of its touches, and draws of a touch.
SMALL = bayestouch.FingerDesign(
    n_elements=6, calibration_span_deg=45.0, edge_step_deg=5.0, flat_step_deg=10.0, samples_per_touch=2,
    touch_radii_mm=(0.0, 3.9, 12.3, float("inf")), touch_span_deg=10.0, touch_step_deg=5.0,
)  # fmt: skip
SEED, DRAWS = 4, 256
ROOT = Path(__file__).resolve().parents[1]
PAGE, PICTURES = DOCS / "report_before_after.md", DOCS / "pictures"
ROWS = {
    "height 1280": ("height at 1280 px, as opened", "px"),
    "height 390": ("height at 390 px, as opened", "px"),
    "height 1280 unfolded": ("height at 1280 px, all unfolded", "px"),
    "height 390 unfolded": ("height at 390 px, all unfolded", "px"),
    "words": ("words, as opened", ""),
    "words unfolded": ("words, all unfolded", ""),
    "tables": ("tables, as opened", ""),
    "figures": ("figures, as opened", ""),
    "bytes": ("size of the file", "MB"),
    "wide": ("wider than the window", "px"),
    "violations": ("violations that axe-core finds, light and dark, both widths", ""),
    "messages": ("console messages", ""),
}


def made(checkout: Path, folder: Path, small: bool = False) -> Path:
    """Folder with the report of one version, made by its own code if it is not there."""
    if not (folder / "report.json").is_file():
        environment = {**os.environ, "PYTHONPATH": str(checkout.resolve())}
        command = [sys.executable, "-m", "bayestouch", "report", "-o", str(folder.resolve()), "--quiet"]
        if small:
            data = folder.parent.resolve() / "data"
            if not data.is_dir():
                bayestouch.save_dataset(bayestouch.simulate(SMALL, seed=SEED).dataset, data)
            command += [str(data), "--draws", str(DRAWS)]
        # not in the root of a checkout: there, Python would take that one
        subprocess.run(command, cwd=folder.parent, env=environment, check=True)
    return folder


def version(folder: Path) -> str:
    """Version that made a report."""
    return str(json.loads((folder / "report.json").read_text("utf-8"))["bayestouch"]["version"])


def finger(folder: Path) -> str:
    """Sentence on the finger of a report."""
    data = json.loads((folder / "report.json").read_text("utf-8"))["data"]
    elements = next(row["value"] for row in data["sensor"] if row["quantity"] == "elements")
    touches = ", ".join(f"{row['touches']} touches {row['use']}" for row in data["tables"])
    return f"The finger of this table and of the pictures has {elements} elements; {touches}."


def keys(value: Any, path: str = "") -> Iterator[str]:
    """Paths of all keys of a ``report.json``; entries of a list share theirs."""
    if isinstance(value, dict):
        for name, each in value.items():
            yield f"{path}{name}"
            yield from keys(each, f"{path}{name}.")
    elif isinstance(value, list):
        for each in value:
            yield from keys(each, path)


def lost(before: Path, after: Path) -> list[str]:
    """Keys of one ``report.json`` that the other lacks; of a branch that is gone the root alone."""
    old, new = (set(keys(json.loads((each / "report.json").read_text("utf-8")))) for each in (before, after))
    gone = sorted(old - new)
    return [each for each in gone if not any(each.startswith(f"{other}.") for other in gone)]


def as_table(found: dict[str, dict[str, float]]) -> str:
    """Markdown table of the lengths of each version; with two versions also the ratio."""
    two, rows = len(found) == 2, []
    for key in (each for each in ROWS if all(each in one for one in found.values())):
        name, unit = ROWS[key]
        values = [each[key] / 1e6 if unit == "MB" else each[key] for each in found.values()]
        shown = [f"{value:.2f}" if unit == "MB" else f"{value:.0f}" for value in values]
        ratio = [f"{values[1] / values[0]:.2f}" if values[0] else "–"] if two else []
        rows.append((f"{name}{f', {unit}' if unit else ''}", *shown, *ratio))
    return markdown_table(("the page", *found, *(["ratio"] if two else [])), rows)


def pictures(browser: Any, before: Path, after: Path) -> Iterator[tuple[str, bytes]]:
    """Name and content of each screenshot of the page of the documentation."""
    files = [each / "index.html" for each in (before, after)]
    for scheme in ("light", "dark"):
        for name, file in zip(("before", "after"), files, strict=True):
            yield f"report_{name}_1280_{scheme}.png", compressed(screenshot(browser, file, "1280", scheme))
        phones = [screenshot(browser, file, "390", scheme) for file in files]
        yield f"report_390_{scheme}.png", compressed(side_by_side(phones, SIZES["390"][0]))
    whole = [screenshot(browser, file, "1280", "light", whole=True) for file in files]
    yield "report_whole_pages.png", compressed(side_by_side(whole, 160))


def main(folder: Path, before: Path | None, small: bool, docs: bool) -> dict[str, dict[str, float]]:
    """Make the reports, measure their pages, print the table; write the page where asked to."""
    folder.mkdir(parents=True, exist_ok=True)
    checkouts = {"before": before, "after": ROOT}
    reports = [made(checkout, folder / name, small) for name, checkout in checkouts.items() if checkout is not None]
    with chromium() as browser:
        if browser is None:
            print("no Chromium, or no playwright (extra dev): only the files are measured")
        found = {version(each): lengths(browser, each / "index.html") for each in reports}
        table = as_table(found)
        print(table)
        if len(reports) == 2:
            gone = lost(*reports)
            print(f"keys of report.json that are gone: {', '.join(gone) or 'none'}")
        if len(reports) == 2 and browser is not None:
            shown = dict(pictures(browser, *reports))
            target = PICTURES if docs else folder
            for name, content in shown.items():
                (target / name).write_bytes(content)
                print(f"{name}: {len(content) / 1000:.0f} kB")
            if docs:
                put_into_page("report_pages.py", f"{finger(reports[1])}\n\n{table}", PAGE)
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("--before", type=Path, help="checkout of the other version")
    parser.add_argument("--small", action="store_true", help="a finger of six elements, few draws")
    parser.add_argument("--docs", action="store_true", help="write the table and the pictures of the page")
    chosen = parser.parse_args()
    with TemporaryDirectory() as scratch:
        main(chosen.folder or Path(scratch), chosen.before, chosen.small, chosen.docs)
