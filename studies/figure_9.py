"""Figure 9: model based calibration of the second element, with a knife edge.

The paper prints no number of this element; the fit's error stands beside the mean over the elements, over 50 degrees.
"""

from __future__ import annotations

from pathlib import Path

from _edge_fits import EdgeFit, picture, print_errors
from _paper_run import paper_run
from _published import options

from bayestouch import published

ELEMENT = 1


def main(small: bool = False, folder: Path | None = None) -> EdgeFit:
    """Print the errors, with the other calibration's beside them, and save the picture; small is the same."""
    run = paper_run(0)
    fit, other = EdgeFit.of(run, "model", ELEMENT), EdgeFit.of(run, "empirical", ELEMENT)
    print_errors([fit, other])
    printed = published.number("fit_error.model")
    print(f"paper, mean of all elements over 50 degrees: {printed.printed} % (here {fit.errors_percent()[0]:.2f} %)")
    if folder is not None:
        picture(folder, "figure_9", f"Figure 9: {fit.name}", fit)
    return fit


if __name__ == "__main__":
    main(*options(__doc__))
