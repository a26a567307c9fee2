"""The calibration of a finger as a posterior, ready to be saved and used."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

import bayestouch
from bayestouch.calibration.finger import FingerFit, fit_finger
from bayestouch.calibration.finger_density import FingerDensity
from bayestouch.calibration.finger_priors import FingerPriors
from bayestouch.chain.finger import FingerChain
from bayestouch.dataset import DataSet
from bayestouch.errors import InputError
from bayestouch.fit import LaplaceFit
from bayestouch.progress import Progress
from bayestouch.results import Calibration, TouchRows
from bayestouch.sampling import BlockDraws, StudentT, sample_blocks
from bayestouch.sensor import Finger

FloatArray = NDArray[np.float64]

# A force sensor whose noise is not stated is taken to be off by this share of the load.
UNSTATED_FORCE_NOISE = 0.005
CHAINS = 4
# Tails a little heavier than normal: in some fifty dimensions much heavier ones would hardly ever be accepted.
PROPOSAL_DOF = 100.0


def calibrate_finger(
    dataset: DataSet,
    *,
    contact: str,
    e_map: str = "model",
    draws: int,
    seed: int,
    progress: Progress | None = None,
) -> Calibration:
    """Calibrate a finger; see `bayestouch.calibrate`.

    The mode and the normal (Laplace) approximation around it come first; emcee then draws from the exact posterior
    with proposals from that normal. Sensor noise is held at its estimate from repeats.
    """
    sensor, table = dataset.sensor, dataset.calibration
    finger = sensor.body
    assert isinstance(finger, Finger) and table is not None
    priors, notes = FingerPriors.of(sensor)
    rest = table.rest_reading()
    corrected = table.baseline_corrected()
    means = corrected.averaged()
    if means.n_touches == 0:
        raise InputError("calibration: no touch is in contact", file=_file(dataset))
    force_sd = sensor.force_noise_sd
    if force_sd is None:
        force_sd = UNSTATED_FORCE_NOISE * float(np.nanmean(means.load)) if np.isfinite(means.load).any() else np.nan
        notes += (f"The force sensor's noise is not stated: {UNSTATED_FORCE_NOISE:.1%} of the load is assumed.",)
    fit, used = fit_finger(means, finger, priors, force_sd, contact=contact)
    density = FingerDensity.of(fit.likelihood, fit.laplace, fit.sd)
    drawn = sample_density(density, fit.laplace, draws, seed, progress)
    vectors = drawn.draws[:, :, 0]
    known = means.touch[used]
    location = means.angle_deg
    assert location is not None
    rows = TouchRows(
        touch=known,
        location={"theta_c": location[used]},
        radius_mm=means.indenter_radius_mm[used],
        load=means.load[used],
        observed=means.readings[used],
        predicted=fit.predicted,
        sd=fit.sd,
        counts=means.counts[used],
    )
    if not used.all():
        notes += (f"{int((~used).sum())} calibration touches without known indenter or location were left out.",)
    new_notes = tuple(dict.fromkeys((*dataset.notes, *table.notes, *corrected.notes, *notes)))
    typical = float(np.nanmean(rows.load))
    calibration = Calibration(
        sensor=sensor,
        parameters=priors.parameters(finger, sensor.reading_unit),
        mode=_public_mode(fit),
        posterior=_public_draws(fit, vectors, means.pure_error_dof, seed),
        covariance=np.cov(vectors.reshape(-1, vectors.shape[-1]).T),
        layout=layout(finger.n_elements),
        noise=fit.noise,
        rows=rows,
        settings={
            "body": "finger",
            "contact": contact,
            "e_map": "model",
            "seed": float(seed),
            "version": bayestouch.__version__,
            "largest_load": fit.chain.largest_load,
            "typical_load": typical,
        },
        statistics={
            **_statistics(fit, rows, typical),
            "ess_bulk": float(drawn.ess_bulk.min()),
            "rhat": float(drawn.rhat.max()),
            "acceptance": float(drawn.acceptance.min()),
        },
        extra={} if rest is None else {"rest_reading": rest},
        notes=new_notes,
    )
    return calibration if e_map == "model" else _with_identified_map(calibration, fit)


def _with_identified_map(calibration: Calibration, fit: FingerFit) -> Calibration:
    """The calibration with its E map identified directly, as a regression about the elastic one."""
    from bayestouch.calibration.empirical import fit_empirical

    identified = fit_empirical(fit)
    lack_of_fit = float(np.nanmean(identified.lack_of_fit))
    notes = calibration.notes
    if lack_of_fit > 1.5:
        notes += (
            f"Lack of fit stays at {lack_of_fit:.2f} with the identified E map: what is missing is no property of "
            "place (drift and nonlinear gains are not), and the map may mislead.",
        )
    return replace(
        calibration,
        noise=identified.calibration.noise,
        rows=replace(calibration.rows, predicted=identified.predicted, sd=identified.sd),
        settings={**calibration.settings, "e_map": "empirical"},
        statistics={**calibration.statistics, "lack_of_fit_empirical": lack_of_fit},
        extra={**calibration.extra, **identified.calibration.arrays()},
        notes=notes,
    )


def layout(n_elements: int) -> tuple[str, ...]:
    """Names of the rows of a finger's covariance (angles in rad, μ as its logarithm)."""
    by_element = [f"{name}[{e}]" for name in ("response", "r_s", "theta_s_rad") for e in range(n_elements)]
    return (*by_element, "sigma", "log_mu")


def finger_chain(calibration: Calibration) -> FingerChain:
    """The finger at the mode of its calibration."""
    finger = calibration.sensor.body
    assert isinstance(finger, Finger)
    mode = calibration.mode
    return FingerChain(
        core_radius_mm=finger.core_radius_mm,
        outer_radius_mm=finger.outer_radius_mm,
        response=np.asarray(mode["response"]),
        sensing_radius_mm=np.asarray(mode["r_s"]),
        angle=np.radians(mode["theta_s"]),
        offset=np.zeros(finger.n_elements),
        poisson_ratio=float(mode["sigma"]),
        shear_modulus_MPa=float(mode["mu"]),
        largest_load=float(calibration.settings["largest_load"]),
        contact=str(calibration.settings["contact"]),
    )


def _file(dataset: DataSet) -> str | None:
    return None if dataset.path is None else str(dataset.path)


def _public_mode(fit: FingerFit) -> dict[str, FloatArray]:
    chain = fit.chain
    return {
        "sigma": np.asarray(chain.poisson_ratio),
        "mu": np.asarray(chain.shear_modulus_MPa),
        "r_s": chain.sensing_radius_mm,
        "theta_s": np.degrees(chain.angle),
        "response": chain.response,
        "gain": chain.gain,
        "noise_sd": fit.noise.tactile_sd,
        "discrepancy_sd": fit.noise.discrepancy_sd,
    }


def _public_draws(fit: FingerFit, vectors: FloatArray, pure_error_dof: FloatArray, seed: int) -> dict[str, FloatArray]:
    """Draws of every parameter, (chain, draw[, m]), from flat vectors (chain, draw, d).

    Gains follow from response, depth, σ and μ. The noise of an element is drawn from its own posterior, a scaled
    inverse chi-square with the degrees of freedom of the repeats: it hardly depends on the rest.
    """
    rng = np.random.default_rng([seed, 1])
    m = fit.chain.n_elements
    flat = vectors.reshape(-1, vectors.shape[-1])
    response, depth, angle = flat[:, :m], flat[:, m : 2 * m], flat[:, 2 * m : 3 * m]
    sigma, log_mu = flat[:, 3 * m], flat[:, 3 * m + 1]
    peak = np.stack([_peak_strain(fit.chain, float(s), d) for s, d in zip(sigma, depth, strict=True)])
    dof = np.where(np.isfinite(pure_error_dof) & (pure_error_dof > 0), pure_error_dof, len(fit.predicted) - 3.0)
    noise = fit.noise.tactile_sd * np.sqrt(dof / rng.chisquare(np.maximum(dof, 1.0), size=(len(sigma), m)))
    values = {
        "sigma": sigma,
        "mu": np.exp(log_mu),
        "r_s": depth,
        "theta_s": np.degrees(angle),
        "response": response,
        "gain": response * 1000 * np.exp(log_mu)[:, None] / peak,
        "noise_sd": noise,
    }
    return {name: value.reshape(*vectors.shape[:2], *value.shape[1:]) for name, value in values.items()}


def sample_density(
    density: FingerDensity, laplace: LaplaceFit, draws: int, seed: int, progress: Progress | None
) -> BlockDraws:
    """Draw the flat vectors with emcee: one block, proposals from the Laplace normal with slightly heavier tails."""
    root: FloatArray = np.asarray(np.linalg.cholesky(laplace.covariance), dtype=np.float64)
    # One round: the first shape is as good as it gets in so many dimensions, and the grade says how good.
    return sample_blocks(
        lambda x, blocks: density(x),
        StudentT(laplace.mode[None], root[None], PROPOSAL_DOF),
        walkers=CHAINS,
        draws=-(-draws // CHAINS),
        seed=seed,
        rounds=1,
        progress=progress,
    )


def _peak_strain(chain: FingerChain, poisson_ratio: float, depth: FloatArray) -> FloatArray:
    """Compressive strain (m,) under a knife edge of 1 N/mm above each element at μ = 1 MPa."""
    from bayestouch.body.annulus import solve_annulus
    from bayestouch.chain.response import modes_needed

    modes = np.arange(modes_needed(float(depth.max()), chain.outer_radius_mm) + 1)
    strain = solve_annulus(
        modes,
        core_radius_mm=chain.core_radius_mm,
        outer_radius_mm=chain.outer_radius_mm,
        poisson_ratio=poisson_ratio,
    ).radial_strain(depth)
    return np.asarray((strain[:, 0] + 2 * strain[:, 1:].sum(axis=1)) / (2 * np.pi * chain.outer_radius_mm))


def _statistics(fit: FingerFit, rows: TouchRows, typical_load: float) -> dict[str, float]:
    peak = np.abs(fit.chain.response) * typical_load
    present = ~np.isnan(rows.observed)
    squares = np.where(present, rows.observed - rows.predicted, 0.0) ** 2
    alive = present.any(axis=0)
    error = np.sqrt(squares.sum(axis=0)[alive] / present.sum(axis=0)[alive]) / peak[alive] * 100
    return {
        "touches": float(len(rows.touch)),
        "lack_of_fit": fit.lack_of_fit,
        "error_percent_peak": float(error.mean()),
        "noise_percent_peak": float((fit.noise.tactile_sd / peak)[alive].mean() * 100),
    }
