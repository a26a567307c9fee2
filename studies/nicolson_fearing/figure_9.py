"""Figure 9: model based calibration of the second element, with a knife edge.

The paper prints no number of this element; the fit's error stands beside the mean over the elements, over 50 degrees.
"""

from __future__ import annotations

from pathlib import Path

import _path  # noqa: F401
from _published import options

from nicolson_fearing.edge_fits import EdgeFit, edge_figure

ELEMENT = 1


def main(small: bool = False, folder: Path | None = None) -> EdgeFit:
    """Print the errors and save the picture; small is the same."""
    return edge_figure(9, "model", ELEMENT, folder)


if __name__ == "__main__":
    main(*options(__doc__))
