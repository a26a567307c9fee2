"""`Calibration` of a pad, from a fitted model."""

from __future__ import annotations

import numpy as np

from bayestouch.chain.pad import COORDINATES
from bayestouch.chain.pad_map import PadMap
from bayestouch.data.arrays import read_once
from bayestouch.data.sensor import Sensor
from bayestouch.pad.candidates import PadCandidate
from bayestouch.pad.known_touches import prior_of_loads
from bayestouch.pad.load import load_statistics
from bayestouch.pad.posterior import PadPosterior
from bayestouch.pad.problem import PadProblem
from bayestouch.pad.shared_errors import with_shared_errors
from bayestouch.pad.table import tabulate
from bayestouch.pad.tied import note_on_tie
from bayestouch.priors.far_from_priors import far_from_priors
from bayestouch.results.data import TouchRows
from bayestouch.results.keys import USABLE
from bayestouch.results.objects import Calibration
from bayestouch.sampling.rank_one import DiagonalPlusRankOne
from bayestouch.version import __version__

ONE_LOAD = (
    "every calibration touch has the same load: the prior of a load that is not measured is as wide as this load itself"
)


def pad_calibration_of(
    sensor: Sensor,
    problem: PadProblem,
    name: str,
    model: PadCandidate,
    rivals: dict[str, PadCandidate],
    posterior: PadPosterior,
    notes: list[str],
    map_: PadMap | None = None,
) -> Calibration:
    """Calibration of a pad from the chosen model, its name and its posterior; `rivals` are all fitted models by name.

    Touches are read with `map_`, by default with the tables of the model.
    """
    known = problem.known
    load_unit = sensor.body.load_unit if problem.load_measured else ""
    mean_load, load_sd = prior_of_loads(known.load) if problem.load_measured else (1.0, model.load_spread)
    notes = [*notes, *_model_notes(problem, model, name, rivals)]
    if problem.load_measured and np.ptp(known.load) == 0:
        notes.append(ONE_LOAD)
    if map_ is None:
        map_ = with_shared_errors(tabulate(model), model, problem.priors.of(model.kernel))
    parameters = problem.priors.parameters(model.kernel, sensor.reading_unit, load_unit)
    nominal = {f"{axis}_s": column for axis, column in zip(COORDINATES, problem.priors.position.T, strict=False)}
    notes += far_from_priors(parameters, posterior.draws, nominal)
    made = Calibration(
        sensor=sensor,
        parameters=parameters,
        mode=posterior.mode,
        posterior=posterior.draws,
        covariance=posterior.covariance,
        layout=posterior.layout,
        groups=posterior.groups,
        noise=model.noise,
        rows=_rows(problem, model),
        settings={
            "body": "pad",
            "kernel": model.kernel.name,
            "empirical_map": "yes" if model.has_map else "no",
            "samples": problem.samples,
            "load_measured": float(problem.load_measured),
            "load_mean": mean_load,
            "load_sd": load_sd,
            "load_unit": load_unit or "1",
            "seed": float(problem.seed),
            "version": __version__,
        },
        statistics=_statistics(problem, model, rivals) | _load_statistics(problem, rivals) | posterior.grades,
        extra=map_.arrays() | {USABLE: problem.usable.astype(float)},
        notes=tuple(dict.fromkeys(notes)),
    )
    return made.with_rest_reading(problem.rest, problem.rest_reads)


def _rows(problem: PadProblem, model: PadCandidate) -> TouchRows:
    known, left_out = problem.known, model.left_out
    noise = model.noise.mean_sd(read_once(known.counts), left_out.signal) ** 2
    variance = noise + left_out.variance + (model.load_errors[:, None] * left_out.signal) ** 2
    return TouchRows(
        touch=known.touch,
        location={name: known.location[:, axis] for axis, name in enumerate(COORDINATES[: known.location.shape[1]])},
        radius_mm=known.indenter_radius_mm,
        load=known.load if problem.load_measured else np.full(known.n_touches, np.nan),
        observed=known.readings,
        predicted=known.readings - left_out.residual,
        sd=np.sqrt(variance),
        counts=known.counts,
        samples=known.samples,
        load_reads=known.reads_of_load,
    )


def _statistics(problem: PadProblem, model: PadCandidate, rivals: dict[str, PadCandidate]) -> dict[str, float]:
    known, usable = problem.known, problem.usable
    signal = np.abs(known.readings - model.fit.chain.offset)
    peak = np.where(np.isfinite(signal), signal, 0.0).max(axis=0)
    tactile = np.sqrt(known.pure_error_variance)
    noise = tactile[usable] / peak[usable] * 100
    out = {
        "touches": float(known.n_touches),
        "error_percent_peak": model.error_percent,
        "noise_percent_peak": float(noise.mean()) if np.isfinite(noise).all() else np.nan,
        "lack_of_fit": _lack_of_fit(problem, model),
        "load_spread": model.load_spread,
        "load_scatter": model.noise.load_scatter if problem.load_measured else np.nan,
        "place_error": model.place_error,
        "log_score": model.score,
    }
    if model.has_map:
        misfit = model.fit.misfit
        out |= {
            "map_length_mm": misfit.length_mm,
            "map_size_everywhere": misfit.misfit,
            "map_size_of_kernel": misfit.relative,
        }
    for name, rival in rivals.items():
        key = name.replace(" ", "_").replace("-", "_")
        out |= {f"log_score_{key}": rival.score, f"error_percent_peak_{key}": rival.error_percent}
    return out


def _load_statistics(problem: PadProblem, rivals: dict[str, PadCandidate]) -> dict[str, float]:
    return load_statistics(problem, min(rivals.values(), key=lambda rival: rival.error_percent))


def _lack_of_fit(problem: PadProblem, model: PadCandidate) -> float:
    """Squared distance of left-out residuals from zero, over the number of readings; NaN without repeats.

    The distance of a touch is that of pure error and prediction, and of its load, whose error all its elements share:
    the standard error of the force sensor, or the spread of loads that were not measured. Discrepancy, share of the
    signal and load scatter are not in it: they are what the model lacks.
    """
    pure, left_out = problem.known.pure_error_variance, model.left_out
    here = np.isfinite(left_out.residual) & (pure > 0)
    if not here.any():
        return float("nan")
    averaged = np.where(pure > 0, pure, np.nan) / read_once(problem.known.counts)
    sd = np.where(here, np.sqrt(averaged + left_out.variance), np.inf)
    errors = np.where(np.isnan(problem.load_share), model.load_spread, problem.load_share)
    covariance = DiagonalPlusRankOne(sd, errors[:, None] * np.where(here, left_out.signal, 0.0))
    squares = covariance.squared_distance(np.where(here, left_out.residual, 0.0))
    return float(squares.sum() / here.sum())


def _model_notes(problem: PadProblem, model: PadCandidate, name: str, rivals: dict[str, PadCandidate]) -> list[str]:
    notes = []
    if len(rivals) > 1:
        scores = ", ".join(
            f"{other} {rival.score - model.score:+z.0f}" for other, rival in rivals.items() if other != name
        )
        notes.append(
            f"of the models tried, {name} is chosen, by how well calibration readings left out are predicted "
            f"(log predictive density of the others against it: {scores})"
        )
    tie = note_on_tie(name, model, rivals)
    notes += [tie] if tie else []
    if model.place_error:
        notes.append(
            f"touches that are left out look as if they were {model.place_error:.2g} mm elsewhere, beyond the noise: "
            "places of the calibration are off, or the model is. Regions of the location allow for it"
        )
    if model.kernel.parameters and problem.priors.moved:
        notes.append(problem.priors.moved)
    for parameter, value in zip(model.kernel.parameters, model.fit.chain.values, strict=True):
        low, high = parameter.prior.support
        if min(value - low, high - value) < 1e-3 * (high - low if np.isfinite(high - low) else 1.0):
            bound = low if value - low < high - value else high
            notes.append(
                f"{parameter.description} ends at the bound of its prior, {bound:.4g} {parameter.unit}".rstrip()
            )
    if np.isfinite(problem.known.pure_error_variance).any():
        return notes
    if problem.samples != "mean":
        why = f"the {problem.samples} sample of each touch is used, as readings creep"
    else:
        why = "the samples of each touch are all equal" if problem.known.repeats_equal else "no touch was read twice"
    if np.isfinite(problem.read_variance).any():
        notes.append(
            f"{why}: the noise of one reading is that of the rest readings or of the other samples, and what is beyond "
            "it counts as model error, which averaging does not reduce"
        )
    else:
        notes.append(
            f"{why}: noise and model error cannot be distinguished, and all of it counts as model "
            "error, which averaging does not reduce; a mean rest reading that touches share counts as exact (five rest "
            "readings in one touch would tell its noise)"
        )
    return notes
