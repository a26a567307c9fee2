"""Simulation-based calibration: ranks of the truth of simulated touches among the draws of their posteriors.

Each simulation draws a calibration from its posterior and a touch from its prior, simulates readings, runs the
inference, and computes the rank of the truth among the draws. The ranks are uniform if the posterior is correct (Talts
et al. 2018, arXiv:1804.06788). `calibrations` in this folder
validates calibrations in the same way.

The simulation uses the saved draws of the calibration and computes its noise from them; `infer` uses mode, covariance
and noise of the calibration. The check therefore detects any disagreement between them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain
from bayestouch.data.arrays import nearest_turn
from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import finger_of
from bayestouch.data.touches import Touches, touches_from
from bayestouch.errors import InputError, require_whole
from bayestouch.finger.place.posterior import PlacePosterior
from bayestouch.inference import infer
from bayestouch.output.progress import Progress, require_progress
from bayestouch.parallel.cluster import require_address
from bayestouch.priors.parameters import Prior
from bayestouch.results.data import require_calibration
from bayestouch.results.objects import Calibration
from bayestouch.simulation_based_calibration.ranks import BINS, RANKED, RankStatistics, rank_statistics

# Prior of a touch as in docs/statistics.md: margin of the location beyond the outermost elements, degree (less where
# both margins together would be wider than the gap of the finger), and largest load in mean calibration loads. Repeated
# here, so that the check is independent of `infer`.
MARGIN_DEG, LARGEST_LOAD = 20.0, 3.0


def sbc(
    of: Calibration | DataSet,
    *,
    simulations: int = 500,
    samples: int = 1,
    plug_in: bool = False,
    method: str = "emcee",
    priors: Mapping[str, Prior] | None = None,
    contact: str = "layer",
    effects: Sequence[str] = (),
    kernel: str | None = None,
    draws: int | None = None,
    seed: int = 0,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> RankStatistics:
    """Return the ranks of a simulation-based calibration: of touches on a finger, or of the calibration of a sensor.

    Parameters
    ----------
    of : Calibration or DataSet
        With a calibration, the posteriors of touches are tested: each touch is drawn from the prior, simulated with one
        of the draws of the calibration (reused if there are fewer draws than simulations), then read by
        `bayestouch.infer`. With a data set, the posterior of its calibration is tested: all parameters are drawn from
        their priors, the calibration touches are simulated, and the sensor is calibrated with them.
    simulations : int
        Number of simulated touches, or calibrations.
    samples : int
        Readings averaged in each touch (touches only; calibrations have the samples of the data set).
    plug_in : bool
        Take the calibration as exact; the ranks then show the resulting error (touches only).
    method : {"emcee", "importance"}
        Sampling method (touches only).
    priors : mapping of str to Prior, optional
        As in `bayestouch.calibrate` (calibrations only). Without a stated prior, responses and noise are
        within a factor of 1.3 and 1.5 of those of the data set, because a prior taken from data cannot be sampled.
    contact : str
        Contact model of a finger (calibrations only; a calibration has its own).
    effects : sequence of str
        Effects of the simulated sensors, by name; their values are drawn from the priors that the calibration uses for
        these touches (calibrations only).
    kernel : str, optional
        Kernel of a pad. Its parameters are drawn from their priors; gains, offsets and places of the elements, whose
        priors are nearly flat, from the narrower ones of the module `pads` (calibrations of pads only).
    draws : int, optional
        Posterior draws of each simulation, at least 100: by default 1024 of a touch, 400 of a calibration.
    seed : int
        Seed of all random numbers.
    scheduler : str, optional
        Address of the scheduler of a Dask cluster that computes the simulations (calibrations only).
    progress : callable, optional
        Called with the fraction of the work that is done.

    Returns
    -------
    RankStatistics
        Ranks by parameter. For a calibration, by parameter and element (``"r_s e03"``). With them, those of the log
        density (not of a pad with effects), and of two true loads (of a finger without effects).
        `RankStatistics.passes` tests whether all are uniform.

    Raises
    ------
    InputError
        If touches are tested and the sensor is not a finger, or its calibration has effects, an identified E map or
        functions of place (which the simulation does not include; `calibrate` with ``discrepancy="touch"`` has no
        functions of place); if there are too few simulations or draws, or an option does not apply.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> dataset = bayestouch.simulate(design, seed=3).dataset
    >>> calibration = bayestouch.calibrate(dataset, draws=200)
    >>> ranks = bayestouch.sbc(calibration, simulations=100, draws=200)
    >>> ranks.passes()  # the posteriors are neither too narrow, nor too wide, nor shifted
    True
    """
    require_progress(progress)
    require_address(scheduler)
    require_whole("simulations", simulations, 5 * BINS)
    require_whole("samples", samples, 1)
    require_whole("seed", seed, 0)
    if draws is None:
        draws = 400 if isinstance(of, DataSet) else 1024
    # A rank is among `RANKED` draws, each of which counts once.
    require_whole("draws", draws, RANKED + 1)
    if isinstance(of, DataSet):
        if plug_in or samples != 1 or method != "emcee":
            raise InputError("samples, plug_in and method are options of a calibration's touches, not of a data set")
        from bayestouch.simulation_based_calibration.calibrations import CalibrationDesign
        from bayestouch.simulation_based_calibration.running import check_calibration

        if kernel is not None:
            if priors or contact != "layer":
                raise InputError("priors and contact are options of a finger's calibration, kernel of a pad's")
            from bayestouch.simulation_based_calibration.pads import PadCalibrationDesign

            pad = PadCalibrationDesign.of(of, kernel, draws, seed, effects)
            return check_calibration(pad, simulations, progress, scheduler)
        design = CalibrationDesign.of(of, priors or {}, contact, draws, seed, effects)
        return check_calibration(design, simulations, progress, scheduler)
    if priors or contact != "layer" or effects or kernel is not None or scheduler is not None:
        raise InputError(
            "priors, contact, effects, kernel and scheduler are options of a data set's calibration; this one has "
            "its own"
        )
    require_calibration(of)
    finger_of(of.sensor, "simulation-based calibration")
    if of.has_effects or of.has_identified_map or PlacePosterior.from_arrays(of.extra) is not None:
        raise InputError(
            "simulation-based calibration of touches simulates the elastic model: calibrate without effects, with "
            'the E map of the model, and with discrepancy="touch" (--discrepancy touch)'
        )
    return _check_touches(of, simulations, samples, plug_in, method, draws, seed, progress)


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
    """Ranks of R, r_c, θ_c and P of simulated touches among the draws that `infer` returns."""
    truth, touches = simulate_touches(calibration, simulations, samples, np.random.default_rng([seed, 1]))
    read = infer(
        touches,
        calibration,
        plug_in=plug_in,
        check_sensor=False,
        method=method,
        draws=draws,
        seed=seed,
        progress=progress,
    )
    prior = next(each.prior for each in read.parameters if each.name == "theta_c")
    if np.ptp(prior.support) > 360 * (1 - 1e-9):
        # Draws on a full ring may go on beyond the end of the row, where the truth is in another turn.
        truth["theta_c"] = nearest_turn(truth["theta_c"], read.mean("theta_c"))
    return rank_statistics(read.posterior, truth)


def simulate_touches(
    calibration: Calibration, simulations: int, samples: int, rng: np.random.Generator
) -> tuple[dict[str, FloatArray], Touches]:
    """Return touches drawn from the prior, each simulated with another draw of the calibration.

    Touches with the same draw would have the same calibration error, and their ranks would not be independent.

    Parameters
    ----------
    calibration : Calibration
        Calibration with draws, one for each touch.
    simulations, samples : int
        Number of touches, and of readings of each.
    rng : numpy Generator
        Source of all random numbers.

    Returns
    -------
    dict of (simulations,) arrays
        True values: ``R``, ``r_c`` (mm), ``theta_c`` (degree), ``P`` (N/m).
    Touches
        ``simulations * samples`` rows.
    """
    finger = finger_of(calibration.sensor)
    place = np.asarray(calibration.mode["theta_s"])
    outer, largest = finger.outer_radius_mm, LARGEST_LOAD * float(np.nanmean(calibration.rows.load))
    gap = 360.0 - float(np.ptp(place))
    margin = min(MARGIN_DEG, max(0.0, gap / 2))
    radius = rng.uniform(0.0, outer, simulations)
    truth = {
        "R": radius,
        "r_c": radius * outer / (outer - radius),
        "theta_c": rng.uniform(place.min() - margin, place.max() + margin, simulations),
        "P": rng.uniform(0.0, largest, simulations),
    }
    flat = {name: values.reshape(-1, *values.shape[2:]) for name, values in calibration.posterior.items()}
    number = np.resize(rng.permutation(len(flat["sigma"])), simulations)
    clean = np.stack(
        [
            _chain(calibration, {name: values[i] for name, values in flat.items()}).predict(
                radius[row], np.radians(truth["theta_c"][row]), truth["P"][row]
            )
            for row, i in enumerate(number)
        ]
    )
    noise, force = flat["noise_sd"][number], flat["force_noise_sd"][number]
    missed = flat["discrepancy_sd"][number] if "discrepancy_sd" in flat else np.zeros_like(noise)
    rest = calibration.rest_reading
    mean = clean + rng.normal(0.0, missed) + (np.zeros(finger.n_elements) if rest is None else rest)
    touch = np.repeat(np.arange(simulations), samples)
    readings, load = rng.normal(mean[touch], noise[touch]), rng.normal(truth["P"][touch], force[touch])
    return truth, touches_from(touch, readings, load=load, contact=1.0)


def _chain(calibration: Calibration, drawn: Mapping[str, FloatArray]) -> FingerChain:
    """Finger with the parameters of one draw."""
    finger = finger_of(calibration.sensor)
    return FingerChain(
        core_radius_mm=finger.core_radius_mm,
        outer_radius_mm=finger.outer_radius_mm,
        response=drawn["response"],
        sensing_radius_mm=drawn["r_s"],
        angle=np.radians(drawn["theta_s"]),
        offset=np.zeros(finger.n_elements),
        poisson_ratio=float(drawn["sigma"]),
        shear_modulus_MPa=float(drawn["mu"]),
        largest_load=float(calibration.settings["largest_load"]),
        contact=str(calibration.settings["contact"]),
    )
