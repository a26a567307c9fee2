"""Simulation-based calibration: are the posteriors of touches what they claim to be?

Draw a calibration from its posterior and a touch from its prior, simulate readings, infer, and rank the truth among
the draws: the ranks are uniform if the posterior is right (Talts et al. 2018, arXiv:1804.06788).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bayestouch.calibration.finger_posterior import finger_chain
from bayestouch.chain.finger import FingerChain
from bayestouch.errors import InputError
from bayestouch.inference.finger_covariance import CalibrationCovariance
from bayestouch.inference.finger_draws import DrawTask, draw_all
from bayestouch.inference.finger_reader import IndenterPriors, TouchReadings
from bayestouch.inference.reading_table import ReadingTable
from bayestouch.progress import Progress
from bayestouch.results import Calibration
from bayestouch.sensor import Finger

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

BINS = 20
# Draws a rank is taken among: few enough to be independent when thinned from a thousand.
RANKED = 99
# Calibrations drawn from the posterior; each serves several touches.
CALIBRATIONS = 50


@dataclass(frozen=True, eq=False)
class RankStatistics:
    """Ranks of the truth among posterior draws.

    Attributes
    ----------
    ranks : mapping of (n,) int arrays
        Rank of the truth among `ranked` draws, 0 to `ranked`, by parameter.
    ranked : int
        Number of draws.
    p_value : mapping of float
        Of the chi-square statistic over equal bins, by parameter: uniform if the posterior is right.
    coverage_90 : mapping of float
        Share of the touches whose central 90 % interval holds the truth.
    """

    ranks: Mapping[str, IntArray]
    ranked: int
    p_value: Mapping[str, float]
    coverage_90: Mapping[str, float]

    def passes(self, level: float = 0.01) -> bool:
        """Whether no parameter's p-value is below `level` over the number of parameters (Bonferroni)."""
        return min(self.p_value.values()) >= level / len(self.p_value)

    def plot(self) -> Figure:
        """Histograms of the ranks, with the band in which 99 % of a uniform histogram's bars lie."""
        from matplotlib.figure import Figure
        from scipy.stats import binom

        figure = Figure(figsize=(3.2 * len(self.ranks), 2.8), layout="constrained")
        axes = figure.subplots(1, len(self.ranks), squeeze=False)[0]
        for axis, (name, ranks) in zip(axes, self.ranks.items(), strict=True):
            axis.axhspan(*np.asarray(binom.ppf([0.005, 0.995], len(ranks), 1 / BINS)), color="0.88")
            axis.hist(ranks, bins=np.linspace(-0.5, self.ranked + 0.5, BINS + 1), color="#0072b2")
            axis.set(xlabel=f"rank of the true {name}", ylabel="touches", title=f"p = {self.p_value[name]:.2g}")
        return figure


def sbc(
    calibration: Calibration,
    *,
    simulations: int = 500,
    samples: int = 1,
    plug_in: bool = False,
    method: str = "emcee",
    seed: int = 0,
    progress: Progress | None = None,
) -> RankStatistics:
    """Simulation-based calibration of touch posteriors on a finger.

    Parameters
    ----------
    calibration : Calibration
        Calibrated finger: calibrations are drawn from its Laplace normal, touches are read with its mode.
    simulations : int
        Touches to simulate, drawn from the prior.
    samples : int
        Readings averaged in each touch.
    plug_in : bool
        Read the touches as if the calibration were exact (its ranks then show what that costs).
    method : {"emcee", "importance"}
        How to draw.
    seed : int
        Seed of everything.
    progress : callable, optional
        Called with the fraction done.

    Raises
    ------
    InputError
        If the sensor is not a finger or too few simulations are asked for.
    """
    if not isinstance(calibration.sensor.body, Finger):
        raise InputError("simulation-based calibration is offered for fingers")
    if simulations < 5 * BINS:
        raise InputError(f"simulations: expected at least {5 * BINS}, got {simulations}")
    rng = np.random.default_rng(seed)
    chain = finger_chain(calibration)
    priors = IndenterPriors.of(chain, float(calibration.settings["typical_load"]))
    radius, angle, load = (
        np.asarray(prior.quantile(rng.random(simulations))) for prior in (priors.radius, priors.location, priors.load)
    )
    clean = _simulate(chain, calibration, (radius, angle, load), rng)
    sd = calibration.noise.mean_sd(np.full(clean.shape, samples), clean)
    force_sd = np.full(simulations, calibration.noise.force_sd / np.sqrt(samples))
    touches = TouchReadings(
        readings=clean + sd * rng.standard_normal(clean.shape),
        counts=np.full(clean.shape, samples, dtype=np.int64),
        load=load + force_sd * rng.standard_normal(simulations),
        load_sd=force_sd,
    )
    task = DrawTask(
        chain=chain,
        priors=priors,
        table=ReadingTable.of(chain, *priors.location.support),
        noise=calibration.noise,
        reading_covariance=None if plug_in else CalibrationCovariance(chain, calibration.covariance),
        method=method,
        draws=1024,
        seed=seed,
    )
    drawn = draw_all(task, touches, None, progress)
    truth = {"R": radius, "theta_c": np.degrees(angle), "P": load}
    return rank_statistics({name: drawn[name] for name in truth}, truth)


def rank_statistics(draws: Mapping[str, FloatArray], truth: Mapping[str, FloatArray]) -> RankStatistics:
    """Ranks of known truth among draws (chain, draw, n), thinned to `RANKED` spread over the chains."""
    from scipy.stats import chisquare

    ranks: dict[str, IntArray] = {}
    p_value: dict[str, float] = {}
    coverage: dict[str, float] = {}
    for name, true in truth.items():
        flat = draws[name].reshape(-1, len(true))
        thinned = flat[np.linspace(0, len(flat) - 1, RANKED).round().astype(np.int64)]
        # Ties (a repeated draw equals no truth of a continuous parameter) do not occur; NaN draws count as above.
        ranks[name] = (thinned < true).sum(axis=0)
        # RANKED + 1 possible ranks fall into BINS equal bins
        counts = np.bincount(ranks[name] * BINS // (RANKED + 1), minlength=BINS)
        p_value[name] = float(chisquare(counts).pvalue)
        low, high = np.quantile(flat, [0.05, 0.95], axis=0)
        coverage[name] = float(np.mean((low <= true) & (true <= high)))
    return RankStatistics(ranks, RANKED, p_value, coverage)


def _simulate(
    chain: FingerChain,
    calibration: Calibration,
    touch: tuple[FloatArray, FloatArray, FloatArray],
    rng: np.random.Generator,
) -> FloatArray:
    """Clean readings (n, m) of touches, each by a calibration drawn from the posterior."""
    n, m = len(touch[0]), chain.n_elements
    root = np.linalg.cholesky(calibration.covariance)
    out = np.empty((n, m))
    for rows in np.array_split(np.arange(n), min(CALIBRATIONS, n)):
        step = root @ rng.standard_normal(len(root))
        drawn = chain.with_(
            response=chain.response + step[:m],
            sensing_radius_mm=chain.sensing_radius_mm + step[m : 2 * m],
            angle=chain.angle + step[2 * m : 3 * m],
            poisson_ratio=min(chain.poisson_ratio + step[3 * m], 0.4999),
            shear_modulus_MPa=chain.shear_modulus_MPa * float(np.exp(step[3 * m + 1])),
        )
        out[rows] = drawn.predict(*(values[rows] for values in touch))
    return out
