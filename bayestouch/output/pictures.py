"""Figures of the report: common style, colours for colour-blind readers, reproducible files."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Format = Literal["svg", "png"]

# Okabe and Ito, Color Universal Design (2008).
BLUE, ORANGE, GREEN, RED, PURPLE, SKY, GREY = (
    "#0072B2",
    "#E69F00",
    "#009E73",
    "#D55E00",
    "#CC79A7",
    "#56B4E9",
    "#666666",
)
PALETTE = (BLUE, RED, GREEN, PURPLE, ORANGE, SKY)
#: Colour maps for ordered values (dark to light) and for signed values; both readable without colour vision.
ORDERED, DIVERGING = "cividis", "PuOr"
WIDTH, DOTS_PER_INCH = 7.5, 110
#: The unit of SVG files is a point.
SVG_DOTS = 72

_STYLE: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 10,
    "axes.titlesize": 10.5,
    "axes.labelsize": 10,
    "xtick.labelsize": 9,
    "ytick.labelsize": 9,
    "legend.fontsize": 9,
    "legend.frameon": False,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.4,
    "figure.facecolor": "white",
    "svg.fonttype": "path",
    "svg.hashsalt": "bayestouch",
}


@dataclass(frozen=True)
class Picture:
    """A finished figure.

    Attributes
    ----------
    name : str
        File name without ending, unique in a report.
    section : str
        Section of the page that shows it.
    title, caption, alt : str
        Heading; explanation of the figure; description for readers who cannot see it.
    content : bytes
        Content of the file.
    format : {"svg", "png"}
        PNG if thousands of points would make the SVG file too large.
    """

    name: str
    section: str
    title: str
    caption: str
    alt: str
    content: bytes
    format: Format = "svg"

    @property
    def file(self) -> str:
        """Path in the folder of the report."""
        return f"figures/{self.name}.{self.format}"

    @property
    def described(self) -> dict[str, str]:
        """All attributes except the content, for `report.json`."""
        names = ("name", "section", "title", "caption", "alt", "format", "file")
        return {name: str(getattr(self, name)) for name in names}


@contextmanager
def drawing() -> Iterator[None]:
    """Use the style of the report inside a ``with`` block; the previous settings are restored afterwards."""
    import matplotlib

    with matplotlib.rc_context(_STYLE):
        yield


def canvas(height: float, rows: int = 1, columns: int = 1, **options: Any) -> tuple[Figure, NDArray[Any]]:
    """Return a figure of the page width with its axes in an array (rows, columns)."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, **options)
    return figure, axes


def rendered(figure: Figure, format: Format = "svg", *, tight: bool = False) -> bytes:
    """Return the file of a figure, without a date, so that it is reproducible; cropped to the content if `tight`."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    canvas = FigureCanvasSVG if format == "svg" else FigureCanvasAgg
    canvas(figure)
    layout = figure.get_layout_engine()
    if layout is not None and not tight:
        # matplotlib would lay the figure out as a part of drawing it, only to draw it again.
        figure.set_dpi(SVG_DOTS if format == "svg" else DOTS_PER_INCH)
        layout.execute(figure)
        figure.set_layout_engine(None)
    buffer = io.BytesIO()
    metadata = {"Date": None} if format == "svg" else {"Software": None}
    box = "tight" if tight else None
    figure.savefig(buffer, format=format, dpi=DOTS_PER_INCH, metadata=metadata, bbox_inches=box)
    return buffer.getvalue()


def ordered_colours(n: int) -> list[Any]:
    """Return n colours for ordered values (radii), without the lightest, which is not visible on white."""
    import matplotlib

    return list(matplotlib.colormaps[ORDERED](np.linspace(0.0, 0.85, max(n, 1))))


def mark_elements(axes: Axes, places: FloatArray, low: float, high: float) -> None:
    """Draw small triangles on the lower axis at the positions of the elements."""
    shown = places[(places >= low) & (places <= high)]
    transform = axes.get_xaxis_transform()
    axes.plot(
        shown,
        np.full(len(shown), 0.015),
        "^",
        color=GREY,
        ms=5,
        transform=transform,
        clip_on=False,
        label="element",
        zorder=3,
    )


def legend_below(axes: Axes, columns: int = 4) -> None:
    """Draw the legend below the axes, where it hides no data."""
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=columns)


def element_ticks(axes: Axes, n: int, which: Literal["x", "y"] = "x") -> None:
    """Set ticks e01, e02 … at 0, 1 …; fewer ticks if there are many elements."""
    step = max(1, -(-n // 16))
    places = np.arange(0, n, step)
    names: Sequence[str] = [f"e{i + 1:02d}" for i in places]
    if which == "x":
        axes.set_xticks(places, names, rotation=90 if n > 10 else 0)
    else:
        axes.set_yticks(places, names)
