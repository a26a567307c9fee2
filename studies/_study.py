"""What the studies share: options, the paper's finger, tables, pictures, and numbers beside the paper's."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bayestouch import published

#: The paper prints no modulus. Its noise row (studies/noise_row.py), its Table 3 and its sentence on Hertz and
#: frictionless fits of flats ask for 0.10 to 0.15 MPa.
SHEAR_MODULUS = 0.12
OUTPUT = Path(__file__).parent / "figures_out"


@dataclass(frozen=True)
class Compared:
    """A number of the paper beside ours.

    Attributes
    ----------
    key : str
        Key of `bayestouch.published.number`.
    ours : float
        In the paper's unit; NaN where nothing here can give it.
    why : str
        Reason of the difference, or how the number was used.
    sd : float
        Uncertainty of ours (the shear modulus, or chance); NaN where none is given.
    """

    key: str
    ours: float
    why: str = ""
    sd: float = np.nan

    @classmethod
    def of_draws(cls, key: str, draws: Sequence[float], why: str = "") -> Compared:
        """Mean and standard deviation of draws; of one draw no standard deviation."""
        return cls(key, float(np.mean(draws)), why, float(np.std(draws, ddof=1)) if len(draws) > 1 else np.nan)

    @property
    def paper(self) -> published.PublishedNumber:
        """As printed."""
        return published.number(self.key)

    @property
    def difference(self) -> float:
        """Ours less the paper's."""
        return self.ours - self.paper.value


@dataclass(frozen=True)
class Options:
    """Command line of a study."""

    small: bool
    folder: Path | None


def options(description: str | None, arguments: list[str] | None = None) -> Options:
    """Read ``[FOLDER] [--small] [--no-pictures]``; pictures go to studies/figures_out by default."""
    parser = argparse.ArgumentParser(description=(description or "").splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path, default=OUTPUT, help="where pictures go")
    parser.add_argument("--small", action="store_true", help="fewer touches: seconds in place of minutes")
    parser.add_argument("--no-pictures", action="store_true")
    chosen = parser.parse_args(arguments)
    return Options(chosen.small, None if chosen.no_pictures else chosen.folder)


def print_compared(rows: Iterable[Compared]) -> None:
    """The rows as a table."""
    print(f"{'':34s}{'paper':>9s}{'ours':>10s}{'differs':>10s}  unit")
    for row in rows:
        paper = row.paper
        print(f"{row.key:34s}{paper.printed:>9s}{row.ours:10.4g}{row.difference:10.3g}  {paper.unit}")
        if row.why:
            print(f"{'':6s}{row.why}")


def figure(rows: int = 1, columns: int = 1, **options: Any) -> tuple[Any, Any]:
    """A matplotlib figure and its axes, for files only."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    options = {"figsize": (4.6 * columns, 3.6 * rows), "layout": "constrained", **options}
    return plt.subplots(rows, columns, **options)


def save(picture: Any, folder: Path, name: str) -> None:
    """Write the figure as PNG and close it."""
    import matplotlib.pyplot as plt

    folder.mkdir(parents=True, exist_ok=True)
    picture.savefig(folder / f"{name}.png", dpi=130)
    plt.close(picture)


def indenter(radius_mm: float) -> str:
    """What a tip is called."""
    if radius_mm == 0:
        return "edge"
    return "flat" if np.isinf(radius_mm) else f"{radius_mm:g} mm"
