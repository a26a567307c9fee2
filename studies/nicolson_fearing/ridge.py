"""The ridge between gain, depth and Poisson's ratio near the core, and what parametrising by the response does to it.

Near the core of an all but incompressible rubber the strain goes to zero, so that a gain defined as reading per
strain can grow along with σ or with depth and leave every reading as it is. The response (reading per N/m of a knife
edge right above the element) is what touches fix. Two simulated fingers show it: the paper's, calibrated with many
touches, and one with its elements closer to the core, few touches and wide priors. There the ridge pulls the mean of σ
some two standard deviations away from the mode: the depths have a prior each, and the further out they lie the more
room each has.

    python studies/nicolson_fearing/ridge.py [FOLDER] [--small] [--no-pictures]
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

from dataclasses import dataclass, replace
from pathlib import Path

import _path  # noqa: F401
import numpy as np
from _published import figure, options, plain_ticks, save

import bayestouch
from bayestouch.priors.parameters import LogNormal, Prior, Uniform
from bayestouch.simulation import FingerDesign

ELEMENTS = 7
THOROUGH = FingerDesign(
    n_elements=ELEMENTS,
    samples_per_touch=5,
    calibration_span_deg=48.0,
    edge_step_deg=2.0,
    flat_step_deg=6.0,
    touch_span_deg=2.0,
    touch_radii_mm=(3.9,),
)
# Elements 0.2 mm above the core, and an edge every 4 degrees beside a few flats, each read once.
SPARSE = replace(
    THOROUGH, sensing_radius_mm=9.6, depth_spread_mm=0.05, samples_per_touch=1, edge_step_deg=4.0, flat_step_deg=24.0
)
WIDE: dict[str, Prior] = {
    "sigma": Uniform(0.40, 0.4999),
    "r_s": Uniform(9.45, 11.0),
    "mu": LogNormal(0.15, float(np.log(3.0))),
}
CASES = {"thorough": (THOROUGH, {}), "sparse, near the core": (SPARSE, WIDE)}


@dataclass(frozen=True, eq=False)
class Ridge:
    """Draws of one element, (n,) each, and of its Poisson's ratio."""

    gain: np.ndarray
    response: np.ndarray
    depth: np.ndarray
    sigma: np.ndarray

    def condition(self, scale: np.ndarray) -> float:
        """Condition number of the correlation matrix of log scale, r_s and σ; scale is the gain or the response."""
        return float(np.linalg.cond(np.corrcoef([np.log(scale), self.depth, self.sigma])))

    def correlations(self, scale: np.ndarray) -> tuple[float, float]:
        """Correlation of log scale with r_s and with σ."""
        table = np.corrcoef([np.log(scale), self.depth, self.sigma])
        return float(table[0, 1]), float(table[0, 2])

    def spread(self, scale: np.ndarray) -> float:
        """Standard deviation of log scale."""
        return float(np.log(scale).std())


def ridges(case: str, draws: int = 2000, seed: int = 0) -> list[Ridge]:
    """Draws of every element of a simulated finger."""
    design, priors = CASES[case]
    dataset = bayestouch.simulate(design, seed=seed).dataset
    calibration = bayestouch.calibrate(dataset, priors=priors, draws=draws)
    flat = {name: values.reshape(-1, *values.shape[2:]) for name, values in calibration.posterior.items()}
    return [
        Ridge(flat["gain"][:, e], flat["response"][:, e], flat["r_s"][:, e], flat["sigma"]) for e in range(ELEMENTS)
    ]


def summary(elements: list[Ridge], kind: str) -> tuple[float, float, float, float]:
    """Means over elements for log gain or log response: sd, correlation with r_s and with σ, condition number."""
    rows = [
        (one.spread(scale), *one.correlations(scale), one.condition(scale))
        for one, scale in ((one, getattr(one, kind)) for one in elements)
    ]
    spread, by_depth, by_sigma, condition = np.mean(rows, axis=0)
    return float(spread), float(by_depth), float(by_sigma), float(condition)


def main(draws: int = 2000, folder: Path | None = None) -> dict[str, list[Ridge]]:
    """Print what both parametrisations leave; returns the draws by case."""
    found = {case: ridges(case, draws) for case in CASES}
    print(f"{'':24s}{'':10s}{'sd of log':>10s}{'corr. r_s':>11s}{'corr. σ':>9s}{'condition':>11s}   (mean of elements)")
    for case, elements in found.items():
        for kind in ("gain", "response"):
            spread, by_depth, by_sigma, condition = summary(elements, kind)
            print(f"{case:24s}{kind:10s}{spread:10.4f}{by_depth:11.2f}{by_sigma:9.2f}{condition:11.0f}")
        sigma = elements[0].sigma
        print(f"{case:24s}σ {sigma.mean():.3f} ± {sigma.std():.3f}, as built {CASES[case][0].poisson_ratio}")
    if folder is not None:
        save_picture(found, folder)
    return found


def save_picture(found: dict[str, list[Ridge]], folder: Path) -> None:
    """Draws of the middle element over their mean: gain above, response below, against depth and against σ."""
    drawn, axes = figure(2, 2, figsize=(9.0, 6.0), sharey=True)
    colours = dict(zip(CASES, ("#0072b2", "#d55e00"), strict=True))
    for case in reversed(CASES):
        one = found[case][ELEMENTS // 2]
        for row, scale in zip(axes, (one.gain, one.response), strict=True):
            for axis, other in zip(row, (one.depth - one.depth.mean(), one.sigma), strict=True):
                axis.plot(other, scale / scale.mean(), ".", ms=2, alpha=0.5, color=colours[case], label=case)
    for row, label in zip(axes, ("gain / its mean", "response / its mean"), strict=True):
        row[0].set_ylabel(label)
        for axis, name in zip(row, ("depth $r_s$ less its mean (mm)", "Poisson's ratio σ"), strict=True):
            axis.set(xlabel=name, yscale="log")
            plain_ticks(axis.yaxis, (0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3))
    axes[0, 0].legend(markerscale=4, title="calibration")
    save(drawn, folder, "ridge")


if __name__ == "__main__":
    small, pictures = options(__doc__)
    main(1000 if small else 2000, pictures)
