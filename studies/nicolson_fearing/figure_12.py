"""Figure 12: estimates of r_c of the 12.3 mm tip over location, averages and scatter of single samples.

With numbers for what the paper says of it: that the spread of samples is often less than the bias of a location, and
that it depends on the location.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import _path  # noqa: F401
import numpy as np
from _published import figure, options, print_beside, save

from bayestouch.paper import published
from bayestouch.reliability import Beside
from nicolson_fearing.paper_finger import CALIBRATIONS, PaperCalibration
from nicolson_fearing.paper_run import PaperRun, paper_run, put_in

TIP = published.number("figure_12.r_c").value


@dataclass(frozen=True)
class ByLocation:
    """Estimates of one tip's r_c at n locations, mm.

    Attributes
    ----------
    angle_deg : (n,) array
        Locations.
    averaged, mean, sd : (n,) arrays
        Fit to the average of the samples; mean and standard deviation of the fits to single samples.
    """

    angle_deg: np.ndarray
    averaged: np.ndarray
    mean: np.ndarray
    sd: np.ndarray

    @classmethod
    def of(cls, run: PaperRun, calibration: PaperCalibration, tip: float = TIP) -> ByLocation:
        """Read off a run."""
        touches = np.flatnonzero(run.rows([tip]))
        single = run.single(calibration).indenter_radius_mm
        samples = [single[run.of_sample == touch] for touch in touches]
        return cls(
            run.means.angle_deg[touches],
            run.averaged(calibration).indenter_radius_mm[touches],
            np.array([each.mean() for each in samples]),
            np.array([each.std(ddof=1) for each in samples]),
        )

    def within_bias(self, tip: float = TIP) -> float:
        """Share of locations where the samples' standard deviation is less than the bias."""
        return float(np.mean(self.sd < np.abs(self.averaged - tip)))


def picture(folder: Path, found: dict[str, ByLocation]) -> None:
    """Model based above, empirical below."""
    drawn, axes = figure(1, 2, figsize=(7.5, 5.2), sharex=True, sharey=True)
    for side, (calibration, each) in zip(axes, found.items(), strict=True):
        side.errorbar(
            each.angle_deg, each.mean, each.sd, fmt="none", color="0.6", capsize=1, label="samples, mean ± sd"
        )
        side.plot(each.angle_deg, each.averaged, "C0-", label="fit to the average of 20")
        side.axhline(TIP, color="k", ls=":", label="the tip")
        side.set(ylabel="$r_c$ (mm)", title=f"{calibration} calibration")
    axes[0].legend(ncols=3, loc="upper center")
    axes[1].set_xlabel("location (degree)")
    drawn.suptitle(f"Figure 12: {TIP:g} mm tip, one simulated finger")
    save(drawn, folder, "figure_12")


def rows(run: PaperRun) -> list[Beside]:
    """Settings."""
    return [
        put_in("figure_12.r_c", TIP),
        put_in("figure_12.n_averaged", run.data.truth["design"]["samples_per_touch"]),
    ]


def main(small: bool = False, folder: Path | None = None) -> list[Beside]:
    """Print the numbers and save the picture; small is the same."""
    run = paper_run(0)
    found = {calibration: ByLocation.of(run, calibration) for calibration in CALIBRATIONS}
    out = rows(run)
    print_beside(out)
    for calibration, each in found.items():
        low, high = np.quantile(each.sd, [0.05, 0.95])
        print(
            f"{calibration}: bias {np.std(each.averaged - TIP):.2f} mm rms over locations, samples' sd {low:.2f} to "
            f"{high:.2f} mm, less than the bias at {100 * each.within_bias():.0f} % of them (paper: often)"
        )
    if folder is not None:
        picture(folder, found)
    return out


if __name__ == "__main__":
    main(*options(__doc__))
