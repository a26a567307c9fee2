"""Comparison of models that differ by one effect, by their predictions of held-out touches."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.diagnosis.blocks import FOLDS, time_blocks
from bayestouch.diagnosis.place_or_time import (
    Densities,
    Parts,
    blocks_of,
    densities,
    lowers_errors,
    parts_of_held_out,
)
from bayestouch.diagnosis.rounds import Tried
from bayestouch.model.candidates import Candidate
from bayestouch.model.correction import Correction
from bayestouch.model.fitting import SETTLED, Fitted
from bayestouch.model.joining import fit_with
from bayestouch.model.linear import Linearised
from bayestouch.model.noise_search import NoiseCandidate
from bayestouch.model.predictive import gained, held_out_density
from bayestouch.parallel.cluster import in_order

# The fit of a candidate stops when a step gains less than this share of what there is to explain. The fit of the chosen
# candidate continues to convergence.
ROUGHLY = 3e-4
# Condition for a gain of held-out log density to be clear, in standard errors.
ERRORS = 3.0
# Largest gain or loss of one touch that counts if a few touches have most of the gain, nats. By chance a touch gains so
# much with a probability below e^-10.
MOST_OF_A_TOUCH = 10.0


def folds(fitted: Fitted) -> IntArray:
    """Fold of each touch, (t,): blocks of touches that are contiguous in time, assigned to the folds in turn."""
    return time_blocks(fitted) % FOLDS


def density(fitted: Fitted) -> FloatArray:
    """Held-out log predictive density of each touch, (t, 3), see `held_out_density`."""
    return held_out_density(fitted.linear, folds(fitted))


def density_of_readings(fitted: Fitted) -> FloatArray:
    """Held-out log density of the readings of each touch, (t,), comparable between models of different noise."""
    white = fitted.whitening
    return np.asarray(gained(density(fitted)) + white.log_volume + white.log_volume_within(fitted.linear.touch))


def gained_by_noise(fitted: Fitted) -> FloatArray:
    """Gain of log density of each touch, (t,), if the noise is estimated again from the scatter that a model leaves.

    Deviations of samples have unit variance with the noise of the model. With the sd s of those that the model leaves,
    n deviations, of which ν are free, gain ``½ (1 - 1/s²) Σ d² - ν ln s`` for each element.
    """
    linear = fitted.linear
    present = np.isfinite(fitted.whitening.sample_sd)
    count = np.zeros((len(linear.residual), present.shape[1]))
    squares = np.zeros_like(count)
    np.add.at(count, linear.touch, present)
    np.add.at(squares, linear.touch, linear.deviation**2)
    free = np.maximum(count - 1, 0)
    total, left = free.sum(axis=0), squares.sum(axis=0)
    # An element without repeats, or that is read exactly, has no scatter to estimate.
    variance = np.where((total > 0) & (left > 0), left / np.maximum(total, 1), 1.0)
    return np.asarray((0.5 * (1 - 1 / variance) * squares - 0.5 * free * np.log(variance)).sum(axis=1))


def held_out_each_way(fitted: Fitted, model: Linearised, by_time: FloatArray) -> Parts:
    """Parts of the density of each touch by a model, with the blocks of `fitted`; by times it is known already."""
    others = {kind: block for kind, block in blocks_of(fitted).items() if kind != "times"}
    return {"times": by_time, **parts_of_held_out(model, others)}


def gained_in_place(
    fitted: Fitted, correction: Correction | None, before: FloatArray
) -> tuple[float, float, Densities | None]:
    """Gain of held-out log density by a correction, its standard error, and its density each way.

    A correction that does not lower the squared error of held-out touches is as none: zero, zero and None.
    """
    after = before if correction is None else held_out_density(correction.linear, folds(fitted))
    if correction is None or not lowers_errors(before, after):
        return 0.0, 0.0, None
    return *paired(gained(after - before)), densities(held_out_each_way(fitted, correction.linear, after))


def paired(difference: FloatArray) -> tuple[float, float]:
    """Sum of differences over touches, and its standard error."""
    n = len(difference)
    return float(difference.sum()), float(np.sqrt(n * difference.var(ddof=1))) if n > 1 else float("nan")


def is_clear(difference: FloatArray) -> bool:
    """Whether a gain, from the gain (t,) of each touch, is above zero by `ERRORS` standard errors.

    Rare events, such as outliers, change few touches, but these very much: then the standard error is large because the
    gain is. So a gain is also clear if it is so where no touch counts more than `MOST_OF_A_TOUCH`.

    Fits end when a step gains less than `SETTLED`, so that a smaller sum says nothing, however equal its terms are: one
    of rounding alone may be many standard errors above zero.
    """
    limited = np.clip(difference, -MOST_OF_A_TOUCH, MOST_OF_A_TOUCH)
    return difference.sum() > SETTLED and any(
        gain > ERRORS * error for gain, error in map(paired, (difference, limited))
    )


def tried_noise(noise: NoiseCandidate, *, by_chance: bool) -> Tried:
    """Result of a candidate of the noise, which needs no refit; `by_chance` if chance explains its score."""
    gain, error = paired(noise.difference)
    clear, scored_gain = is_clear(noise.difference), noise.gain if by_chance else float("nan")
    # Nothing else can explain a scatter: one that is clear is explained by it.
    share = 1.0 if clear else float("nan")
    one = Tried(noise.effect, noise.z, 1.0, noise.values, gain, error, clear, of_means=0.0, by_itself=True, share=share)
    return replace(one, difference=noise.difference, noise=noise, scored_gain=scored_gain)


def refit_all(
    fitted: Fitted,
    candidates: Sequence[Candidate],
    before: Parts,
    least: float,
    scheduler: str | None,
    progress: Callable[[int], None] = lambda number: None,
) -> list[Tried]:
    """Result of `refit` for each candidate, from the cluster at `scheduler` if given; reports how many are done."""
    return in_order(scheduler, _refit_one, (fitted, before, least), candidates, progress)


def _refit_one(shared: tuple[Fitted, Parts, float], candidate: Candidate) -> Tried:
    fitted, before, least = shared
    return refit(fitted, candidate, before, least)


def refit(fitted: Fitted, candidate: Candidate, before: Parts, least: float) -> Tried:
    """Result of a model with a candidate added and fitted again, with the same whitening so that densities compare.

    Parameters
    ----------
    fitted : Fitted
        The model without the candidate.
    candidate : Candidate
        The candidate to add.
    before : mapping of str to (t, 3) array
        Density of the model without the candidate, see `held_out_each_way`.
    least : float
        Gain within touches above which the effect is visible by itself, if it is also above `ERRORS` standard errors.
    """
    effect = candidate.effect
    enough = max(SETTLED, ROUGHLY * fitted.excess)
    again = fit_with(effect, fitted, lambda: candidate.start, whitening=fitted.whitening, enough=enough)
    new = again.fitted
    after = held_out_each_way(fitted, new.linear, density(new))
    difference = after["times"] - before["times"]
    gain, error = paired(gained(difference))
    within, within_se = paired(difference[:, 1])
    return Tried(
        effect=effect,
        z=candidate.z,
        seen=candidate.seen,
        start=again.values,
        gain=gain,
        gain_se=error,
        clear=is_clear(gained(difference)),
        of_means=float(difference[:, 2].sum()),
        by_itself=within > max(ERRORS * within_se, least),
        fitted=new,
        difference=gained(difference),
        noise_again=gained_by_noise(new) - gained_by_noise(fitted),
        held_out=densities(after),
        predicts=any(lowers_errors(before[way], after[way]) for way in before),
    )
