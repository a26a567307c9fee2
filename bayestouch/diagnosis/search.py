"""Greedy search for the effects that are missing: score all, refit the best, keep what predicts held-out touches."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.affected.fitting import Fitted, fit, fit_from_both
from bayestouch.affected.linear import held_out_density
from bayestouch.diagnosis.candidates import Candidate, refine_drift, score_effects
from bayestouch.diagnosis.noise_fit import with_noise
from bayestouch.diagnosis.noise_search import NoiseCandidate, score_noise
from bayestouch.diagnosis.placed import Correction, correct
from bayestouch.diagnosis.significance import at_least_one
from bayestouch.effects.effect import Effect, Values
from bayestouch.effects.noise import NoiseEffect
from bayestouch.effects.random import RandomEffect
from bayestouch.progress import Progress

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# Folds, and touches of a block: blocks in time, so that neither a neighbour in place nor one in time gives away
# what is held out.
FOLDS, BLOCK = 8, 8
# Candidates that are refitted in a round, and effects that are added at most.
LEADING, MOST_EFFECTS = 5, 4
# An effect is real if chance makes one like it among all that were tried less often than this ...
CHANCE = 0.01
# ... if it predicts held-out touches better by so many standard errors ...
ERRORS = 3.0
# ... if what it explains is at least a tenth of the noise of an averaged touch (root mean square) ...
MATERIAL = 0.1
# ... and if it explains this share of what can be explained: less is what an unlisted cause lends to its likes.
SHARE = 0.4
# Candidates whose held-out density is within so many standard errors of the winner's cannot be told from it.
ALIKE = 2.0


@dataclass(frozen=True, eq=False)
class Tried:
    """A candidate as it stood in one round.

    Attributes
    ----------
    effect : Effect
        What was tried.
    z : float
        Normal score.
    seen : float
        Share of its signature that base parameters do not absorb.
    start : tuple of float
        Values of the score, or of the refit where there was one.
    gain, gain_se : float
        Held-out log density gained, and its standard error over touches; NaN where it was not refitted.
    share : float
        What it explains of what can be explained.
    fitted : Fitted or None
        Model with it, where it was refitted.
    difference : (t,) array or None
        Gain of each touch.
    signature : (t, m) array or None
        What it does to mean readings.
    noise : NoiseCandidate or None
        Where it is an effect of the noise.
    alike : tuple of str
        Other candidates that cannot be told from it.
    """

    effect: Effect
    z: float
    seen: float
    start: Values
    gain: float = float("nan")
    gain_se: float = float("nan")
    share: float = float("nan")
    fitted: Fitted | None = None
    difference: FloatArray | None = None
    signature: FloatArray | None = None
    noise: NoiseCandidate | None = None
    alike: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Round:
    """One round of the search.

    Attributes
    ----------
    before : Fitted
        Model at its beginning.
    tried : tuple of Tried
        All candidates, best first.
    best_share : float
        Half the sum of squares beyond noise, or what a correction without a cause gains: what can be explained.
    correction : Correction or None
        Correction on top of the model.
    correction_gain : float
        Held-out log density that it gains.
    added : Tried or None
        What was added.
    """

    before: Fitted
    tried: tuple[Tried, ...]
    best_share: float
    correction: Correction | None
    correction_gain: float
    correction_se: float
    added: Tried | None


def folds(n_touches: int, time: FloatArray) -> IntArray:
    """Fold of each touch, (t,): blocks of touches that follow each other in time, dealt out in turn."""
    size = max(1, min(BLOCK, n_touches // (2 * FOLDS)))
    rank = np.empty(n_touches, dtype=np.int64)
    rank[np.argsort(time, kind="stable")] = np.arange(n_touches)
    return np.asarray((rank // size) % FOLDS)


def density(fitted: Fitted) -> FloatArray:
    """Held-out log predictive density of each touch, (t,)."""
    observed = fitted.model.known
    return held_out_density(fitted.linear, folds(observed.n_touches, observed.touch_time_s))


def paired(difference: FloatArray) -> tuple[float, float]:
    """Sum of differences over touches, and its standard error."""
    n = len(difference)
    return float(difference.sum()), float(np.sqrt(n * difference.var(ddof=1))) if n > 1 else float("nan")


def search(fitted: Fitted, effects: tuple[Effect, ...], progress: Progress | None = None) -> tuple[Round, ...]:
    """Rounds of the search, the last of which adds nothing."""
    rounds: list[Round] = []
    while True:
        current = one_round(fitted, effects)
        if len(rounds) == MOST_EFFECTS and current.added is not None:
            current = replace(current, added=None)
        rounds.append(current)
        if progress is not None:
            progress(len(rounds) / (len(rounds) + 1))
        if current.added is None or current.added.fitted is None:
            return tuple(rounds)
        fitted = settled(current.added.fitted)


def settled(fitted: Fitted) -> Fitted:
    """The model fitted once more under its own whitening; what effects explain within touches is no noise any more."""
    noise = fitted.noise
    if fitted.linear.deviation_jacobian is not None:
        observed = fitted.model.known
        spent = np.bincount(observed.row_touch, minlength=observed.n_touches)
        freedom = (~np.isnan(observed.deviation)).sum(axis=0) - int((spent > 0).sum())
        square = (fitted.linear.deviation**2).sum(axis=0) / np.maximum(freedom, 1)
        noise = noise.with_(sd=np.where(freedom > 0, np.sqrt(square) * noise.sd, noise.sd))
    return fit(fitted.model, fitted.vector, noise, fitted.drifts)


def one_round(fitted: Fitted, effects: tuple[Effect, ...]) -> Round:
    """Score all effects, refit the leading ones, and choose."""
    scored = score_effects(fitted, effects)
    noise = tuple(e for e in effects if isinstance(e, NoiseEffect) and e.name not in fitted.names)
    scattered = score_noise(fitted, noise)
    trials = sum(each.trials for each in scored) + len(scattered)
    before = density(fitted)
    n_readings = int((fitted.whitening.root != 0).any(axis=2).sum())
    least = 0.5 * MATERIAL**2 * n_readings
    leading = [c for c in scored if _passes(c.z, trials) and c.gain > 0][:LEADING]
    refitted = {c.effect.name: _refit(fitted, c, before) for c in leading}
    correction = correct(fitted)
    correction_gain, correction_se = 0.0, 0.0
    if correction is not None:
        observed = fitted.model.known
        after = held_out_density(correction.linear, folds(observed.n_touches, observed.touch_time_s))
        correction_gain, correction_se = paired(after - before)
    excess = 0.5 * (fitted.chi_square() - n_readings)
    possible = max(correction_gain, excess, least)
    tried = []
    for c in scored:
        done = refitted.get(c.effect.name)
        if done is None:
            done = Tried(c.effect, c.z, c.seen, c.start, signature=c.signature)
        tried.append(replace(done, share=_share(done, c, possible)))
    for n in scattered:
        gain, error = paired(n.difference)
        tried.append(Tried(n.effect, n.z, 1.0, n.values, gain, error, 1.0, None, n.difference, None, n))
    tried.sort(key=lambda each: -(each.gain if np.isfinite(each.gain) else -1e9 + abs(each.z)))
    real = [each for each in tried if _is_real(each, trials, least, correction_gain)]
    # What samples do one after the other is no noise: an effect within touches comes before those of the noise.
    within = [each for each in real if each.effect.needs_samples and each.noise is None]
    if within and real[0].noise is not None:
        real = within
    added = _plainest(real) if real else None
    if added is not None:
        added = replace(added, alike=_alike(added, tried))
        if added.noise is not None:
            added = replace(added, fitted=with_noise(fitted, added.noise))
    return Round(fitted, tuple(tried), possible, correction, correction_gain, correction_se, added)


def _plainest(real: list[Tried]) -> Tried:
    """The best, or where that is a random function of time the best effect with a course of its own that is as good."""
    best = real[0]
    if isinstance(best.effect, RandomEffect):
        for other in real[1:]:
            if other.noise is None and not isinstance(other.effect, RandomEffect) and _as_good(other, best):
                return other
    return best


def _as_good(other: Tried, best: Tried) -> bool:
    """Whether one predicts held-out touches as well as the best, within the error of the difference."""
    if other.difference is None or best.difference is None:
        return False
    gain, error = paired(best.difference - other.difference)
    return gain < ALIKE * error


def _passes(z: float, trials: int) -> bool:
    from scipy.special import ndtr

    return at_least_one(float(2 * ndtr(-abs(z))), trials) < CHANCE


def _is_real(tried: Tried, trials: int, least: float, correction_gain: float) -> bool:
    if not np.isfinite(tried.gain) or not _passes(tried.z, trials):
        return False
    if tried.gain < ERRORS * tried.gain_se or tried.gain < min(least, 50.0) or tried.share < SHARE:
        return False
    # A random function of time can follow whatever the order of the touches goes with: it must do better than a
    # function of place.
    return not isinstance(tried.effect, RandomEffect) or tried.gain > correction_gain


def _share(tried: Tried, scored: Candidate, possible: float) -> float:
    gain = tried.gain if np.isfinite(tried.gain) else scored.gain
    return float(np.clip(gain / possible, 0.0, 1.0))


def _alike(added: Tried, tried: list[Tried]) -> tuple[str, ...]:
    """Names of refitted candidates that predict held-out touches as well, within the error of the difference."""
    out = []
    for each in tried:
        if each.effect.name == added.effect.name or each.noise is not None or added.noise is not None:
            continue
        if _as_good(each, added):
            out.append(each.effect.name)
    return tuple(out)


def _refit(fitted: Fitted, candidate: Candidate, before: FloatArray) -> Tried:
    """Add a candidate to a model and fit all of it anew, under the same whitening so that densities compare."""
    effect = candidate.effect
    if isinstance(effect, RandomEffect):
        values, _ = refine_drift(fitted, effect)
        drifts = (*fitted.drifts, (effect, values))
        new = fit(fitted.model, fitted.vector, fitted.noise, drifts, whitening=fitted.whitening)
    else:
        model = fitted.model.with_effects((*fitted.model.effects, effect))
        start = model.extended(fitted.vector, candidate.start)
        new = fit_from_both(model, start, fitted.noise, fitted.drifts, whitening=fitted.whitening)
        values = model.values(new.vector)[-1]
    difference = density(new) - before
    gain, error = paired(difference)
    return Tried(
        effect=effect,
        z=candidate.z,
        seen=candidate.seen,
        start=values,
        gain=gain,
        gain_se=error,
        fitted=new,
        difference=difference,
        signature=candidate.signature,
    )
