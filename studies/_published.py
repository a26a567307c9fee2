"""What the studies of the published tables share: numbers beside the paper's, and pictures."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from _page import RELIABILITY, docs_of, put_into_page

from bayestouch.output.pictures import BLUE, GREEN, GREY, ORANGE, PURPLE, RED, SKY
from bayestouch.reliability.comparison import Beside, shown_number

OUTPUT = Path(__file__).parent / "figures_out"

# One look for all pictures, distinguished without colour vision; C0, C1 … are these colours in turn.
LOOK: dict[str, Any] = {
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlesize": 10,
    "figure.titlesize": 11,
    "legend.edgecolor": "none",
    "legend.fontsize": 8,
    "legend.framealpha": 0.85,
    "lines.linewidth": 1.4,
}
CYCLE = (BLUE, RED, GREEN, PURPLE, ORANGE, SKY, GREY)
# Enough for lines with their smooth edges and a scale of colours, at a third of the bytes.
COLOURS = 128


def print_beside(rows: Iterable[Beside]) -> None:
    """Paper / bayestouch / difference / why; a reason that several rows in turn share is printed after the last."""
    listed = list(rows)
    print(f"{'':40s}{'paper':>8s}{'bayestouch':>12s}{'90 % interval':>18s}{'difference':>12s}  unit")
    for row, following in zip(listed, [*listed[1:], None], strict=True):
        interval = "" if np.isnan(row.low) else f"{row.low:.3g} to {row.high:.3g}"
        difference = "" if np.isnan(row.ours) else f"{row.difference:+.2g}"
        print(
            f"{row.key:40s}{row.paper.printed:>8s}{shown_number(row.ours):>12s}{interval:>18s}{difference:>12s}"
            f"  {row.paper.unit}{' (put in)' if row.put_in else ''}"
        )
        if row.why and (following is None or following.why != row.why):
            print(f"    {row.why}")


def options(description: str | None, arguments: list[str] | None = None) -> tuple[bool, Path | None]:
    """``[FOLDER] [--small] [--no-pictures]``: whether small, and where pictures go (None: nowhere)."""
    parser = argparse.ArgumentParser(description=(description or "").splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path, default=OUTPUT, help="where pictures go")
    parser.add_argument("--small", action="store_true", help="seconds in place of minutes")
    parser.add_argument("--no-pictures", action="store_true")
    chosen = parser.parse_args(arguments)
    return chosen.small, None if chosen.no_pictures else chosen.folder


def run_study(
    main: Callable[[bool, Path | None], Any],
    description: str | None,
    script: str,
    for_the_page: Callable[[Any], str],
    page: Path = RELIABILITY,
) -> None:
    """Run a study with the options of the command line.

    With ``--docs``, the tables that `for_the_page` makes of its result are written into `page`.
    """
    docs, arguments = docs_of(sys.argv[1:])
    found = main(*options(description, arguments))
    # Without the measured data a study finds nothing.
    if docs and found:
        put_into_page(script, for_the_page(found), page)


def figure(columns: int = 1, rows: int = 1, **changes: Any) -> tuple[Any, Any]:
    """A matplotlib figure and its axes, for files only."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    matplotlib.rcParams.update(LOOK, **{"axes.prop_cycle": plt.cycler(color=CYCLE)})
    return plt.subplots(rows, columns, **{"figsize": (4.2 * columns, 3.5 * rows), "layout": "constrained", **changes})


def plain_ticks(axis: Any, ticks: Iterable[float]) -> None:
    """Those of these ticks that are in view as the only ones of a logarithmic axis, and as plain numbers."""
    low, high = axis.get_view_interval()
    at = [float(tick) for tick in ticks if low <= tick <= high]
    axis.set_ticks(at, labels=[f"{tick:g}" for tick in at])
    axis.set_ticks([], minor=True)


def save(picture: Any, folder: Path, name: str) -> None:
    """Write the figure as PNG of a few colours and close it."""
    from io import BytesIO

    import matplotlib.pyplot as plt
    from PIL import Image

    folder.mkdir(parents=True, exist_ok=True)
    content = BytesIO()
    picture.savefig(content, format="png", dpi=120)
    plt.close(picture)
    # a few red points must stay red beside thousands of others
    few = Image.open(content).convert("RGB").quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    few.save(folder / f"{name}.png", optimize=True)


def rms(error: Any) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(error))))
