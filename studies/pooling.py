"""What pooling changes: one rubber for all elements, or a Poisson's ratio and a modulus fitted for each element alone.

The paper fitted σ element by element and got 0.41 to 0.48. Here a simulated finger of the paper's dimensions and noise,
whose rubber has one σ and one μ, is calibrated both ways, each element alone with a posterior of its own: how far the
σ of single elements scatter, what that does to depth, and what either predicts of tips it has not seen.

    python studies/pooling.py [FOLDER] [--small] [--no-pictures]
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from _published import figure, options, rms, save
from _simulated import true_chain

import bayestouch
from bayestouch.chain.finger import FingerChain
from bayestouch.contact import composite_radius
from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import Finger
from bayestouch.finger.calibration import finger_chain
from bayestouch.paper import published
from bayestouch.priors.parameters import LogNormal, Prior, Uniform
from bayestouch.simulation import FingerDesign, SimulatedDataSet

# The paper's finger and touches, 5 samples each, with tips that no calibration sees. Wide priors of the rubber, so that
# it is the touches that speak.
DESIGN = FingerDesign(samples_per_touch=5, edge_step_deg=2.0, flat_step_deg=6.0, touch_step_deg=5.0)
SMALL = replace(DESIGN, n_elements=5, calibration_span_deg=40.0)
WIDE: dict[str, Prior] = {"sigma": Uniform(0.35, 0.4999), "mu": LogNormal(0.15, float(np.log(2.0)))}
POOLED, ALONE = "all elements together", "each element alone"


@dataclass(frozen=True, eq=False)
class Pooling:
    """One finger calibrated both ways.

    Attributes
    ----------
    pooled : (n,) array
        Draws of σ, all elements together.
    alone : (m, n) array
        Draws of σ of each element alone.
    depth_error, depth_sd : dict of (m,) arrays
        Error and standard deviation of r_s (mm), by way.
    prediction_error : dict of float
        Error of predicted readings of unseen tips, in % of an element's peak, by way.
    """

    pooled: np.ndarray
    alone: np.ndarray
    depth_error: dict[str, np.ndarray]
    depth_sd: dict[str, np.ndarray]
    prediction_error: dict[str, float]


def element_alone(dataset: DataSet, element: int) -> DataSet:
    """The data set of a finger with that element and no other."""
    assert isinstance(dataset.sensor.body, Finger)
    body = replace(dataset.sensor.body, element_angles_deg=(dataset.sensor.body.element_angles_deg[element],))
    assert dataset.calibration is not None
    one = [table.with_(readings=table.readings[:, [element]]) for table in (dataset.calibration, dataset.touches)]
    return DataSet(replace(dataset.sensor, body=body), one[0], one[1])


def readings(simulated: SimulatedDataSet, chain: FingerChain) -> np.ndarray:
    """Readings (t, m) of the touches to be read, whose indenter, location and load are known, without noise."""
    truth = simulated.truth["touches"]
    radius = composite_radius(simulated.dataset.touches.averaged().indenter_radius_mm, chain.outer_radius_mm)
    return chain.predict(radius, np.radians(truth["theta_c"]), np.asarray(truth["P"]))


def pooling(design: FingerDesign, draws: int = 1000, seed: int = 0) -> Pooling:
    """Calibrate a simulated finger both ways."""
    simulated = bayestouch.simulate(design, seed=seed)
    pooled = bayestouch.calibrate(simulated.dataset, priors=WIDE, draws=draws)
    alone = [
        bayestouch.calibrate(element_alone(simulated.dataset, element), priors=WIDE, draws=draws)
        for element in range(design.n_elements)
    ]
    truth = readings(simulated, true_chain(simulated, design.load_range[1]))
    by_way = {
        POOLED: readings(simulated, finger_chain(pooled)),
        ALONE: np.concatenate([readings(simulated, finger_chain(one)) for one in alone], axis=1),
    }
    depth = {
        POOLED: pooled.posterior["r_s"].reshape(-1, design.n_elements).T,
        ALONE: np.stack([one.posterior["r_s"].ravel() for one in alone]),
    }
    built = np.asarray(simulated.truth["r_s"], dtype=float)
    peak = np.abs(truth).max(axis=0)
    return Pooling(
        pooled=pooled.posterior["sigma"].ravel(),
        alone=np.stack([one.posterior["sigma"].ravel() for one in alone]),
        depth_error={way: draws.mean(axis=1) - built for way, draws in depth.items()},
        depth_sd={way: draws.std(axis=1) for way, draws in depth.items()},
        prediction_error={way: 100 * rms((values - truth) / peak) for way, values in by_way.items()},
    )


def main(design: FingerDesign = DESIGN, draws: int = 1000, folder: Path | None = None) -> Pooling:
    """Print what pooling changes."""
    found = pooling(design, draws)
    means, sds = found.alone.mean(axis=1), found.alone.std(axis=1)
    paper = [published.number(f"table_1.sigma.{end}").value for end in ("min", "max")]
    print(f"σ as built {design.poisson_ratio}; the paper's fits by element: {paper[0]} to {paper[1]}")
    print(f"σ, all elements together   {found.pooled.mean():.4f} ± {found.pooled.std():.4f}")
    print(f"σ, each element alone      {means.min():.3f} to {means.max():.3f}, ± {np.median(sds):.4f} each")
    scatter = rms((means - design.poisson_ratio) / sds)
    print(f"    they scatter about the truth by {scatter:.2f} of their standard deviations (rms)")
    print(f"{'':26s}{'rms error of r_s (mm)':>24s}{'sd of r_s (mm)':>18s}{'readings of unseen tips (% of peak)':>38s}")
    for way in (POOLED, ALONE):
        error, sd = rms(found.depth_error[way]), rms(found.depth_sd[way])
        print(f"{way:26s}{error:24.4f}{sd:18.4f}{found.prediction_error[way]:38.3f}")
    if folder is not None:
        save_picture(found, design, folder)
    return found


def save_picture(found: Pooling, design: FingerDesign, folder: Path) -> None:
    """σ of each element alone, with 90 % intervals, over the band of all together."""
    drawn, axis = figure(figsize=(7.0, 3.6))
    low, middle, high = np.quantile(found.alone, [0.05, 0.5, 0.95], axis=1)
    number = np.arange(1, len(middle) + 1)
    axis.errorbar(number, middle, [middle - low, high - middle], fmt="o", color="C1", label="each element alone, 90 %")
    axis.axhspan(*np.quantile(found.pooled, [0.05, 0.95]), color="C0", alpha=0.5, label="all together, 90 %")
    axis.axhline(design.poisson_ratio, color="black", lw=1, ls="--", label="as built")
    axis.set(xlabel="element", ylabel="Poisson's ratio σ", xticks=number)
    drawn.legend(loc="outside upper center", ncols=3)
    save(drawn, folder, "pooling")


if __name__ == "__main__":
    small, pictures = options(__doc__)
    main(SMALL if small else DESIGN, 400 if small else 1000, pictures)
