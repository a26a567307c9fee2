"""Simulation-based calibration: are the posteriors what they claim to be?

Of touches: draw a calibration from its posterior and a touch from its prior, simulate readings, infer, and rank the
truth among the draws: the ranks are uniform if the posterior is right (Talts et al. 2018, arXiv:1804.06788). Of
calibrations likewise, see `bayestouch.calibration_checks`.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from bayestouch.calibration.finger_posterior import finger_chain
from bayestouch.chain.finger import FingerChain
from bayestouch.dataset import DataSet
from bayestouch.errors import InputError
from bayestouch.inference.finger_covariance import CalibrationCovariance
from bayestouch.inference.finger_draws import DrawTask, draw_all
from bayestouch.inference.finger_reader import IndenterPriors, TouchReadings
from bayestouch.inference.reading_table import ReadingTable
from bayestouch.parameters import Prior
from bayestouch.progress import Progress
from bayestouch.ranks import BINS, RankStatistics, rank_statistics
from bayestouch.results import Calibration
from bayestouch.sensor import Finger

FloatArray = NDArray[np.float64]


def sbc(
    of: Calibration | DataSet,
    *,
    simulations: int = 500,
    samples: int = 1,
    plug_in: bool = False,
    method: str = "emcee",
    priors: Mapping[str, Prior] | None = None,
    contact: str = "layer",
    draws: int | None = None,
    seed: int = 0,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> RankStatistics:
    """Simulation-based calibration of the posteriors on a finger: of touches, or of the calibration itself.

    Parameters
    ----------
    of : Calibration or DataSet
        A calibrated finger checks the posteriors of touches: calibrations are drawn from its Laplace normal, touches
        from their prior, and read with its mode. A data set checks the posterior of its calibration: all
        parameters are drawn from their priors, and the calibration touches simulated and calibrated with.
    simulations : int
        Touches, or calibrations, to simulate.
    samples : int
        Readings averaged in each touch (touches only; calibrations have the data set's samples).
    plug_in : bool
        Read the touches as if the calibration were exact: its ranks then show what that costs (touches only).
    method : {"emcee", "importance"}
        How to draw (touches only).
    priors : mapping of str to Prior, optional
        As in `bayestouch.calibrate` (calibrations only). Where none is stated of responses or noise, they follow the
        data set's own within a factor of 1.3 and 1.5, since a prior that is taken from data cannot be drawn from.
    contact : str
        Contact model (calibrations only; a calibration has its own).
    draws : int, optional
        Posterior draws of each simulation: 1024 of a touch, 400 of a calibration.
    seed : int
        Seed of everything.
    scheduler : str, optional
        Address of the scheduler of a Dask cluster that does the simulations (calibrations only).
    progress : callable, optional
        Called with the fraction done.

    Returns
    -------
    RankStatistics
        By parameter, and of a calibration by parameter and element (``"r_s e03"``), with two true loads and the log
        density. `RankStatistics.passes` says whether all are uniform at a level: each p-value must be the level over
        their number at least.

    Raises
    ------
    InputError
        If the sensor is not a finger, too few simulations are asked for or an option does not fit.
    """
    if simulations < 5 * BINS:
        raise InputError(f"simulations: expected at least {5 * BINS}, got {simulations}")
    if isinstance(of, DataSet):
        if plug_in or samples != 1 or method != "emcee":
            raise InputError("samples, plug_in and method are options of a calibration's touches, not of a data set")
        from bayestouch.calibration_checks import CalibrationDesign, check_calibration

        design = CalibrationDesign.of(of, priors or {}, contact, draws or 400, seed)
        return check_calibration(design, simulations, progress, scheduler)
    if priors or contact != "layer" or scheduler is not None:
        raise InputError("priors, contact and scheduler are options of a data set's calibration; this one has its own")
    if not isinstance(of.sensor.body, Finger):
        raise InputError("simulation-based calibration is offered for fingers")
    return _check_touches(of, simulations, samples, plug_in, method, draws or 1024, seed, progress)


def _check_touches(
    calibration: Calibration,
    simulations: int,
    samples: int,
    plug_in: bool,
    method: str,
    draws: int,
    seed: int,
    progress: Progress | None,
) -> RankStatistics:
    """Ranks of R, θ_c and P of simulated touches."""
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
        draws=draws,
        seed=seed,
    )
    drawn = draw_all(task, touches, None, progress)
    truth = {"R": radius, "theta_c": np.degrees(angle), "P": load}
    return rank_statistics({name: drawn[name] for name in truth}, truth)


def _simulate(
    chain: FingerChain,
    calibration: Calibration,
    touch: tuple[FloatArray, FloatArray, FloatArray],
    rng: np.random.Generator,
) -> FloatArray:
    """Clean readings (n, m) of touches, each by a calibration of its own drawn from the posterior.

    Touches that share a calibration share its error: their ranks would not be independent.
    """
    n, m = len(touch[0]), chain.n_elements
    root = np.linalg.cholesky(calibration.covariance)
    out = np.empty((n, m))
    for row in range(n):
        step = root @ rng.standard_normal(len(root))
        drawn = chain.with_(
            response=chain.response + step[:m],
            sensing_radius_mm=chain.sensing_radius_mm + step[m : 2 * m],
            angle=chain.angle + step[2 * m : 3 * m],
            poisson_ratio=min(chain.poisson_ratio + step[3 * m], 0.4999),
            shear_modulus_MPa=chain.shear_modulus_MPa * float(np.exp(step[3 * m + 1])),
        )
        out[row] = drawn.predict(*(values[row : row + 1] for values in touch))[0]
    return out
