"""What Figures 9 and 10 share: one element's readings of knife edges, beside what a calibration makes of them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from _published import figure, rms, save

from bayestouch.paper import published
from bayestouch.paper.simplex.elements import WINDOW_DEG
from nicolson_fearing.paper_finger import PaperCalibration
from nicolson_fearing.paper_run import PaperRun, paper_run


@dataclass(frozen=True)
class EdgeFit:
    """Readings of one element over the angle of the touch; all over the fitted peak, 1 right under the edge.

    Attributes
    ----------
    off_deg : (n,) array
        Angle of the touch from the element.
    data, fit : (n,) arrays
        Averages of the samples, and the calibration's prediction.
    """

    name: str
    off_deg: np.ndarray
    data: np.ndarray
    fit: np.ndarray

    @classmethod
    def of(cls, run: PaperRun, calibration: PaperCalibration, element: int) -> EdgeFit:
        """Read off a run; elements count from 0."""
        means = run.calibrating
        assert means.angle_deg is not None
        edges = means.indenter_radius_mm == 0
        angle, load = means.angle_deg[edges], means.load[edges]
        finger = run.finger.reader(calibration, "layer", run.modulus)
        predicted = finger.predict(np.zeros(len(angle)), np.radians(angle), load)[:, element]
        off = angle - np.degrees(finger.angle[element])
        order = np.argsort(off)
        peak = finger.response[element] * load
        return cls(
            f"element {element + 1}, {calibration} calibration",
            off[order],
            (means.readings[edges][:, element] / peak)[order],
            (predicted / peak)[order],
        )

    @property
    def error(self) -> np.ndarray:
        """Data less fit."""
        return self.data - self.fit

    @property
    def near(self) -> np.ndarray:
        """The 50 degrees about the element."""
        return np.abs(self.off_deg) <= WINDOW_DEG / 2

    def errors_percent(self) -> tuple[float, float, float]:
        """Root mean square error within the 50 degrees, beyond them, and over all touches, % of the peak."""
        near, error = self.near, 100 * self.error
        return rms(error[near]), rms(error[~near]), rms(error)


def print_errors(fits: list[EdgeFit]) -> None:
    """Near, in the tails, and all."""
    print(f"{'root mean square error, % of peak':40s}{'50 degrees':>12s}{'the tails':>12s}{'all':>12s}")
    for fit in fits:
        print(f"{fit.name:40s}" + "".join(f"{value:12.2f}" for value in fit.errors_percent()))


def picture(folder: Path, name: str, title: str, fit: EdgeFit) -> None:
    """As the paper draws it: fit solid, data dashed, error dotted."""
    drawn, side = figure(figsize=(6.4, 4.0))
    side.axvspan(-WINDOW_DEG / 2, WINDOW_DEG / 2, color="0.93", zorder=0, label=f"{WINDOW_DEG:g}° about the element")
    side.plot(fit.off_deg, fit.fit, "C0-", label="fit")
    side.plot(fit.off_deg, fit.data, "C1--", label="data (simulated)")
    side.plot(fit.off_deg, fit.error, "k:", label="data less fit")
    side.set(xlabel="angle from the element (degree)", ylabel="reading over its peak", title=title)
    side.legend()
    save(drawn, folder, name)


def edge_figure(number: int, calibration: PaperCalibration, element: int, folder: Path | None) -> EdgeFit:
    """Print the errors, with the other calibration's and the paper's beside them, and save the picture.

    The paper's is its mean over all elements: over the 50 degrees for the model, over all for the empirical map.
    """
    run = paper_run(0)
    other: PaperCalibration = "empirical" if calibration == "model" else "model"
    fit = EdgeFit.of(run, calibration, element)
    print_errors([fit, EdgeFit.of(run, other, element)])
    printed, span = published.number(f"fit_error.{calibration}"), published.number(f"fit_range.{calibration}")
    near, _, everywhere = fit.errors_percent()
    ours = near if calibration == "model" else everywhere
    print(f"paper, mean of all elements over {span.printed} degrees: {printed.printed} % (here {ours:.2f} %)")
    if folder is not None:
        picture(folder, f"figure_{number}", f"Figure {number}: {fit.name}", fit)
    return fit
