"""Simulation-based calibration of the calibration posterior of a finger.

Draw all parameters from their priors, simulate the calibration touches, calibrate, and rank the truth among the draws.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from bayestouch.calibration.finger import fit_finger
from bayestouch.calibration.finger_density import FingerDensity
from bayestouch.calibration.finger_flat import FlatLayout, FlatPrior
from bayestouch.calibration.finger_likelihood import LOAD_REACH, chain_at, softest
from bayestouch.calibration.finger_noise import public_noise
from bayestouch.calibration.finger_priors import FingerPriors
from bayestouch.calibration.finger_sampling import sample_fit
from bayestouch.calibration.finger_touches import KnownTouches
from bayestouch.cluster import on_cluster
from bayestouch.dataset import DataSet
from bayestouch.errors import InputError
from bayestouch.grouping import grouped_mean, groups
from bayestouch.parameters import LogNormal, Prior
from bayestouch.progress import Progress
from bayestouch.ranks import RankStatistics, of_ranks, rank
from bayestouch.sensor import Finger
from bayestouch.touches import Touches

FloatArray = NDArray[np.float64]

# Fingers like the one at hand, where the user states no prior: responses and noise within these factors of its own.
RESPONSE_FACTOR, NOISE_FACTOR = 1.3, 1.5
# Fewer simulations than this are done sooner than other processes have started.
WORTH_PROCESSES = 16

Ranked = dict[str, tuple[int, bool]]


@dataclass(frozen=True, eq=False)
class CalibrationDesign:
    """Calibration touches to be simulated, and what their parameters are drawn from.

    Attributes
    ----------
    finger : Finger
        Geometry as built.
    priors : FingerPriors
        All of them stated: none depends on data.
    prior : FlatPrior
        The same, coordinate by coordinate.
    known : KnownTouches
        The touches of the data set, whose measured mean loads are kept.
    touches : Touches
        Their samples.
    contact : str
        Contact model.
    draws : int
        Posterior draws of each simulation.
    seed : int
        Seed of everything.
    """

    finger: Finger
    priors: FingerPriors
    prior: FlatPrior
    known: KnownTouches
    touches: Touches
    contact: str
    draws: int
    seed: int

    @classmethod
    def of(
        cls, dataset: DataSet, stated: Mapping[str, Prior], contact: str, draws: int, seed: int
    ) -> CalibrationDesign:
        """Design of a data set's calibration; priors that are not stated follow from its sensor and readings."""
        finger, table = dataset.sensor.body, dataset.calibration
        if not isinstance(finger, Finger):
            raise InputError("simulation-based calibration is offered for fingers")
        if table is None:
            raise InputError("simulation-based calibration needs a data set with calibration touches")
        touches = table.baseline_corrected()
        touches = touches.select(touches.in_contact & np.isfinite(touches.load)).with_(reads=None, readings_sd=None)
        fit, used = fit_finger(touches.averaged(), finger, FingerPriors.of(dataset.sensor)[0], contact=contact)
        if not used.all():
            raise InputError("simulation-based calibration needs touches that are all known")
        priors = FingerPriors.of(dataset.sensor)[0].with_stated(stated, finger)
        size, noise = float(np.median(np.abs(fit.chain.response))), float(np.median(fit.noise.tactile_sd))
        priors = replace(
            priors,
            response=priors.response or LogNormal(size, float(np.log(RESPONSE_FACTOR))),
            noise=priors.noise or LogNormal(noise, float(np.log(NOISE_FACTOR))),
            force_noise=priors.force_noise or LogNormal(fit.noise.force_sd, float(np.log(NOISE_FACTOR))),
        )
        known = fit.likelihood.known
        return cls(finger, priors, priors.flat(finger, known), known, touches, contact, draws, seed)


def check_calibration(
    design: CalibrationDesign, simulations: int, progress: Progress | None, scheduler: str | None = None
) -> RankStatistics:
    """Ranks of every parameter, of the first and the last touch's true load, and of the log density.

    The log density of the posterior is a function of parameters and data: its rank finds what marginal ranks may
    hide (Modrák et al. 2023, doi:10.1214/23-BA1404).
    """
    found: dict[int, Ranked] = {}
    for number, piece in _numbered(design, range(simulations), scheduler):
        found[number] = piece
        if progress is not None:
            progress(len(found) / simulations)
    pieces = [found[number] for number in range(simulations)]
    ranks = {name: np.array([piece[name][0] for piece in pieces]) for name in pieces[0]}
    return of_ranks(ranks, {name: float(np.mean([piece[name][1] for piece in pieces])) for name in pieces[0]})


def _numbered(design: CalibrationDesign, numbers: range, scheduler: str | None) -> Iterator[tuple[int, Ranked]]:
    """Results of all simulations: of a cluster, or of all cores where there are enough simulations for them."""
    from concurrent.futures import ProcessPoolExecutor

    workers = os.cpu_count() or 1
    if scheduler is not None:
        yield from on_cluster(scheduler, simulate_and_rank, design, zip(numbers, numbers, strict=True))
    elif workers == 1 or len(numbers) < WORTH_PROCESSES:
        yield from ((number, simulate_and_rank(design, number)) for number in numbers)
    else:
        with ProcessPoolExecutor(workers) as pool:
            yield from zip(numbers, pool.map(partial(simulate_and_rank, design), numbers, chunksize=4), strict=True)


def simulate_and_rank(design: CalibrationDesign, number: int) -> Ranked:
    """Rank of the truth of one simulated calibration, and whether the 90 % interval holds it, by name."""
    rng = np.random.default_rng([design.seed, number])
    at = design.prior.layout
    true = _possible_draw(design, rng)
    loads, touches = simulate_touches(design, true, rng)
    fit, _ = fit_finger(touches.averaged(), design.finger, design.priors, contact=design.contact)
    flat = sample_fit(fit, design.draws, design.seed + number).draws.reshape(-1, at.size)
    density, known = FingerDensity.of(fit), fit.likelihood.known
    drawn, truth = quantities(known, at, flat), quantities(known, at, true[None])
    drawn["log density"], truth["log density"] = density(flat), density(true[None])
    centre, sd = density.true_loads(flat)
    for label, touch in (("P of the first touch", 0), ("P of the last touch", -1)):
        drawn[label] = centre[:, touch] + sd[:, touch] * rng.standard_normal(len(flat))
        truth[label] = loads[[touch]]
    out = {}
    for name, values in drawn.items():
        low, high = np.quantile(values, [0.05, 0.95])
        out[name] = int(rank(values[:, None], truth[name])[0]), bool(low <= truth[name][0] <= high)
    return out


def quantities(known: KnownTouches, at: FlatLayout, vectors: FloatArray) -> dict[str, FloatArray]:
    """Every parameter in public units, (n,) each, from flat vectors (n, d)."""
    noise, missed, force = public_noise(known, at, vectors)
    by_element = {
        "response": np.exp(vectors[:, at.response]),
        "r_s": vectors[:, at.depth],
        "theta_s": np.degrees(vectors[:, at.angle]),
        "noise_sd": noise,
        **({"discrepancy_sd": missed} if at.discrepancy else {}),
    }
    single = {"sigma": vectors[:, at.sigma], "mu": np.exp(vectors[:, at.log_mu]), "force_noise_sd": force}
    return single | {
        f"{name} e{element + 1:02d}": values[:, element]
        for name, values in by_element.items()
        for element in range(at.n_elements)
    }


def simulate_touches(
    design: CalibrationDesign, true: FloatArray, rng: np.random.Generator
) -> tuple[FloatArray, Touches]:
    """True loads (t,) and samples of the design's touches on a finger with the parameters `true`.

    The posterior takes every load as equally likely before it is measured. That is the same as to keep the measured
    mean and let the true load scatter about it, which is how loads are drawn here.
    """
    known, touches, at = design.known, design.touches, design.prior.layout
    noise, missed, force = (values[0] for values in public_noise(known, at, true[None]))
    ids, group = groups(touches.touch)
    loads = known.load + force / np.sqrt(known.load_reads) * rng.standard_normal(len(ids))
    chain = chain_at(design.finger, at, np.ones(at.n_elements), true, float(loads.max()), design.contact)
    clean = chain.predict(known.radius_mm, known.angle, loads)
    clean += missed * rng.standard_normal(clean.shape)
    readings = clean[group] + noise * rng.standard_normal(touches.readings.shape)
    scatter = force * rng.standard_normal(len(group))
    scatter -= grouped_mean(scatter, group, len(ids))[group]
    return loads, touches.with_(
        readings=np.where(np.isnan(touches.readings), np.nan, readings), load=known.load[group] + scatter
    )


def _possible_draw(design: CalibrationDesign, rng: np.random.Generator) -> FloatArray:
    """A vector from the prior whose rubber carries the loads."""
    lowest = softest(design.finger, LOAD_REACH * float(design.known.load.max()))
    while True:
        true = design.prior.draw(rng)
        if true[design.prior.layout.log_mu] > lowest:
            return true
