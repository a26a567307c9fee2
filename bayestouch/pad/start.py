"""Start of every fit of a pad with effects: the pad without effects, and its noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray, IntArray
from bayestouch.data.arrays import read_once
from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import Pad, pad_of
from bayestouch.data.touches import Touches
from bayestouch.model.columns import WhiteColumns
from bayestouch.model.fitting import Fitted, fit
from bayestouch.model.linear import Functions
from bayestouch.model.noise import NoiseModel
from bayestouch.model.observations import Observations
from bayestouch.model.whitening import Whitening
from bayestouch.pad.candidates import PadCandidate
from bayestouch.pad.choice import choose_model
from bayestouch.pad.map_basis import MapBasis
from bayestouch.pad.model import PadModel
from bayestouch.pad.problem import PadProblem, pad_problem
from bayestouch.priors.parameters import Prior
from bayestouch.sampling.rank_one import inverse_root

# A reading is far from the touch if the predicted signal is below this share of the peak.
FAR = 0.03
# The noise is estimated from readings far from the touch only if there are at least so many of them.
ENOUGH_FAR = 30
# Median absolute deviation of a normal variable over its standard deviation.
MAD = 0.6745
# Mean squared steps of touches, over those of a random order, above which the touches are no scan: 0.06 to 0.2 for the
# scans in measured data, and 1 with a standard deviation of about 1/√n for n touches in random order; the smallest
# number of touches for which these are well apart.
SHUFFLED, FEWEST = 0.6, 20
# Relative range below which a coordinate is constant.
SAME = 1e-9
# Largest number of functions of the empirical map for all elements together (their covariance takes 50 MB). Each
# element may have the second number of functions in any case.
MOST_FUNCTIONS, LEAST_FUNCTIONS = 2500, 40
# The fit ends when the gain of a step (half sum of squares) is below this: a hundredth of a standard deviation.
SETTLED = 1e-4


def pad_fit(
    observed: Observations,
    table: Touches,
    dataset: DataSet,
    *,
    kernel: str = "auto",
    empirical: bool | Literal["auto"] = "auto",
    stated: Mapping[str, Prior] | None = None,
    seed: int = 0,
) -> tuple[Fitted, dict[str, PadCandidate]]:
    """Fit of a pad without effects, with the kernel and the map of its calibration; and the models it is chosen from.

    Parameters
    ----------
    observed : Observations
        Touches with known location.
    table : Touches
        The same touches as a table.
    dataset : DataSet
        Data set of a pad.
    kernel, empirical, stated, seed
        As in `bayestouch.pad.calibration.calibrate_pad`.

    Raises
    ------
    InputError
        For the reasons of `bayestouch.pad.calibration.calibrate_pad`.
    """
    pad = pad_of(dataset.sensor)
    problem, _ = pad_problem(dataset.sensor, table, samples="mean", seed=seed, kernel=kernel, stated=stated)
    chosen, models = choose_model(problem, dataset, kernel, empirical)
    model = pad_model(problem, chosen, observed, pad)
    sd = pad_noise(model, model.start(chosen.fit.chain))
    if chosen.has_map:
        model = replace(model, map=MapBasis.of(chosen, sd))
    vector = model.start(chosen.fit.chain)
    reads = observed.means.reads_of_load
    # Without the load scatter: an effect that the model lacks is an error that the elements share, too.
    share = chosen.load_spread if np.isfinite(chosen.load_spread) else problem.force_sd / np.sqrt(reads) / model.load
    load_sd = np.broadcast_to(share * model.load, model.load.shape).copy()
    noise = NoiseModel(sd, load_sd, model.peak)
    first = fit(model, vector, noise)
    return fit(model, first.vector, noise.with_(sd=pad_noise(model, first.vector))), models


def pad_model(problem: PadProblem, chosen: PadCandidate, observed: Observations, pad: Pad) -> PadModel:
    """A pad without effects for the touches `observed`, with the chosen kernel and no map."""
    chain, load = chosen.fit.chain, problem.known.load
    sensitivity = np.abs(chosen.fit.predicted() - chain.offset) / load[:, None]
    reference = float(np.median(load))
    return PadModel(
        observed=observed,
        peak=np.maximum(sensitivity.max(axis=0), 1e-300) * reference,
        reference_load=reference,
        pad=chain,
        priors=problem.priors.of(chain.kernel),
        element_place=tuple(np.asarray(axis, dtype=float) for axis in pad.places_mm.values()),
    )


def fit_without_effects(problem: PadProblem, chosen: PadCandidate, pad: Pad) -> Fitted:
    """Fit of a pad without effects, with the chosen kernel; the map and the errors of the loads are integrated out.

    The noise, and the size and the length of the map, are fixed at the values of the chosen model.
    """
    known, observed = problem.known, problem.observed
    model = pad_model(problem, chosen, observed, pad)
    signal = chosen.left_out.signal
    noise = NoiseModel.of(chosen.noise, chosen.load_errors * known.load, model.peak)
    whitening = Whitening.of(observed, noise, signal, signal / known.load[:, None])
    further = None
    if chosen.has_map:
        most = max(MOST_FUNCTIONS // known.n_elements, LEAST_FUNCTIONS)
        variance = noise.mean_variance(signal, read_once(known.counts))
        columns, left = chosen.fit.misfit.functions(variance, most)
        by_load = signal * (noise.load_sd / known.load)[:, None]
        present = known.counts > 0
        whitening = replace(whitening, root=inverse_root(variance + left, (by_load,), present))
        further = Functions.whitened(WhiteColumns.of_elements(columns, whitening.root))
    return fit(model, model.start(chosen.fit.chain), noise, whitening=whitening, further=further, enough=SETTLED)


def pad_noise(model: PadModel, vector: FloatArray) -> FloatArray:
    """Standard deviation of one reading, (m,): from repeats if there are any, else from touches that are similar.

    The model error varies slowly between consecutive touches of a scan, the noise does not: with residuals r, the
    second difference ``r_{i-1} - 2 r_i + r_{i+1}`` has six times the variance of the noise. The median of its absolute
    value is used, because the ends of the lines of a scan hardly change a median. If enough readings are far from the
    touch, only these are used.

    Where touches are in random order, consecutive ones are at other places with other model errors. Then the difference
    of each touch and the two that are nearest to it in place and load is taken, too. It includes what changes with
    time, as the other includes what changes with the place: the smaller of the two estimates is nearer to the noise.
    """
    observed = model.known
    means = observed.means
    repeated = np.sqrt(means.pure_error_variance)
    predicted = model.predict(vector).touches
    residual, reads = means.readings - predicted, read_once(means.counts)
    signal = np.abs(predicted - model.chain(vector).offset)
    order = np.argsort(observed.touch_time_s, kind="stable")
    triples = [(order[:-2], order[1:-1], order[2:])]
    spread = _in_units_of_spread([*means.location.T, model.load])
    if len(order) >= FEWEST and _is_shuffled(spread[order]):
        triples.append(_with_neighbours(spread))
    sd = np.full(model.n_elements, np.nan)
    for before, here, after in triples:
        second = (residual[before] - 2 * residual[here] + residual[after]) * np.sqrt(reads[here] / 6)
        sd = np.fmin(sd, _typical(second, signal[here] < FAR * model.peak))
    sd = np.where(np.isfinite(repeated) & (repeated > 0), repeated, sd)
    typical = np.nanmedian(sd / model.peak) if np.isfinite(sd).any() else 0.01
    return np.maximum(np.where(np.isfinite(sd), sd, typical * model.peak), 1e-6 * model.peak)


def _typical(second: FloatArray, far: BoolArray) -> FloatArray:
    """Standard deviation (m,) from differences (n, m): of those far from the touch if there are enough of them."""
    sd = np.full(second.shape[1], np.nan)
    for e, column in enumerate(second.T):
        known = np.isfinite(column)
        some = known & far[:, e]
        rows = column[some] if some.sum() >= ENOUGH_FAR else column[known]
        if len(rows):
            sd[e] = np.median(np.abs(rows)) / MAD
    return sd


def _in_units_of_spread(columns: Sequence[FloatArray]) -> FloatArray:
    """Coordinates of touches, each over its standard deviation, (t, k); without those that are constant or unknown."""
    varied = [each for each in columns if np.isfinite(each).all() and np.ptp(each) > SAME * np.abs(each).max()]
    return np.stack([each / each.std() for each in varied], axis=1) if varied else np.zeros((len(columns[0]), 0))


def _is_shuffled(spread: FloatArray) -> bool:
    """Whether touches (t, k) in the order of time are no scan: mean squared steps are those of a random order."""
    # The mean square of a difference of two independent values of variance one is two.
    return spread.shape[1] > 0 and float((np.diff(spread, axis=0) ** 2).mean()) > 2 * SHUFFLED


def _with_neighbours(spread: FloatArray) -> tuple[IntArray, IntArray, IntArray]:
    """Each touch (t, k) between the two that are nearest to it."""
    from scipy.spatial import KDTree

    here = np.arange(len(spread))
    nearest: IntArray = np.asarray(KDTree(spread).query(spread, k=3)[1])
    # Of touches at one place, the first that is found need not be the touch itself.
    lost = ~(nearest == here[:, None]).any(axis=1)
    nearest[lost, 2] = here[lost]
    others = nearest[nearest != here[:, None]].reshape(-1, 2)
    return others[:, 0], here, others[:, 1]
