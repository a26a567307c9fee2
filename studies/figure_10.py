"""Figure 10: empirical calibration of the third element, with a knife edge.

The paper prints no number of this element; the fit's error stands beside the mean over the elements, over 180 degrees.
"""

from __future__ import annotations

from pathlib import Path

from _edge_fits import EdgeFit, picture, print_errors
from _paper_run import paper_run
from _published import options

from bayestouch import published

ELEMENT = 2


def main(small: bool = False, folder: Path | None = None) -> EdgeFit:
    """Print the errors, with the other calibration's beside them, and save the picture; small is the same."""
    run = paper_run(0)
    fit, other = EdgeFit.of(run, "empirical", ELEMENT), EdgeFit.of(run, "model", ELEMENT)
    print_errors([fit, other])
    printed = published.number("fit_error.empirical")
    print(f"paper, mean of all elements over 180 degrees: {printed.printed} % (here {fit.errors_percent()[2]:.2f} %)")
    if folder is not None:
        picture(folder, "figure_10", f"Figure 10: {fit.name}", fit)
    return fit


if __name__ == "__main__":
    main(*options(__doc__))
