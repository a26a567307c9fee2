"""What the studies of the published tables share: numbers beside the paper's, and pictures."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from bayestouch.reliability.comparison import Beside, shown

OUTPUT = Path(__file__).parent / "figures_out"


def print_beside(rows: Iterable[Beside]) -> None:
    """Paper / bayestouch / difference / why; a reason that several rows in turn share is printed after the last."""
    listed = list(rows)
    print(f"{'':40s}{'paper':>8s}{'bayestouch':>12s}{'90 % interval':>18s}{'difference':>12s}  unit")
    for row, following in zip(listed, [*listed[1:], None], strict=True):
        interval = "" if np.isnan(row.low) else f"{row.low:.3g} to {row.high:.3g}"
        difference = "" if np.isnan(row.ours) else f"{row.difference:+.2g}"
        print(
            f"{row.key:40s}{row.paper.printed:>8s}{shown(row.ours):>12s}{interval:>18s}{difference:>12s}"
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


def figure(columns: int = 1, rows: int = 1, **changes: Any) -> tuple[Any, Any]:
    """A matplotlib figure and its axes, for files only."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    return plt.subplots(rows, columns, **{"figsize": (4.8 * columns, 3.8 * rows), "layout": "constrained", **changes})


def save(picture: Any, folder: Path, name: str) -> None:
    """Write the figure as PNG and close it."""
    import matplotlib.pyplot as plt

    folder.mkdir(parents=True, exist_ok=True)
    picture.savefig(folder / f"{name}.png", dpi=130)
    plt.close(picture)


def rms(error: Any) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(error))))
