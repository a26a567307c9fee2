"""Score tests of effects: the signature of each effect is compared with the residual of a fit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import singledispatch
from itertools import product

import numpy as np
from scipy.linalg import solve_triangular

from bayestouch.array_types import FloatArray
from bayestouch.chain.recording import Recording
from bayestouch.effects.effect import Effect, Values
from bayestouch.effects.noise import NoiseEffect
from bayestouch.effects.random import RandomEffect
from bayestouch.model.base import Predicted, SensorModel
from bayestouch.model.fitting import Fitted, drift_columns
from bayestouch.model.linear import Score, Scorer
from bayestouch.model.significance import normal_score, quadratic_score

# Trial standard deviations of random functions, as a share of the peak or of the gain.
DRIFT_SIZES = tuple(np.geomspace(1e-3, 0.3, 10).tolist())


@dataclass(frozen=True, eq=False)
class Candidate:
    """An effect with the result of its score test.

    Attributes
    ----------
    effect : Effect
        The effect.
    start : tuple of float
        Values from which to refit.
    z : float
        Normal score of the best signature; has the sign of the amplitude if the effect has one amplitude.
    trials : int
        Number of signatures that were tried.
    gain : float
        Approximate increase of the log likelihood if the effect is added.
    seen : float
        Share of the sum of squares of the signature that the parameters of the model do not absorb.
    """

    effect: Effect
    start: Values
    z: float
    trials: int
    gain: float
    seen: float


def score_effects(fitted: Fitted, effects: tuple[Effect, ...]) -> tuple[Candidate, ...]:
    """Score of every effect that is not in the model and not a noise effect, in decreasing order of the gain."""
    scorer = Scorer(fitted.linear)
    left = (each for each in effects if not {each.name, each.contained_in} & set(fitted.names))
    scored = (_scored(effect, fitted, scorer) for effect in left)
    return tuple(sorted((each for each in scored if each is not None), key=lambda each: -each.gain))


def score_in_form(fitted: Fitted, effect: Effect) -> Candidate:
    """Score of an effect of the chain in the form that is given, even where a looser one gains more."""
    return _of_form(effect, fitted, Scorer(fitted.linear))


@singledispatch
def _scored(effect: Effect, fitted: Fitted, scorer: Scorer) -> Candidate | None:
    """Best signature of an effect, in its looser form where that has further amplitudes and they gain more."""
    plain = _of_form(effect, fitted, scorer)
    looser = effect.looser(fitted.model.n_elements)
    if looser is None or len(looser.amplitudes) == len(effect.amplitudes):
        return plain
    other = _of_form(looser, fitted, scorer)
    best = plain if plain.gain >= other.gain else other
    return replace(best, trials=plain.trials + other.trials)


def _of_form(effect: Effect, fitted: Fitted, scorer: Scorer) -> Candidate:
    """Best signature of an effect: the difference between the predictions at a probe and at null amplitude."""
    changes_at = _changes(effect, fitted)
    best: tuple[float, Values, Score, int] | None = None
    for probe in effect.probes:
        changes = changes_at(probe)
        raw = np.stack([each.touches for each in changes])
        samples = None if changes[0].samples is None else np.stack([np.asarray(each.samples) for each in changes])
        score = scorer(fitted.whitening.touches(raw), None if samples is None else fitted.whitening.samples(samples))
        chi_square = _allowed(effect, score)
        if best is None or chi_square > best[0]:
            best = (chi_square, probe, score, _read(changes, score))
    assert best is not None
    chi_square, probe, score, count = best
    amplitude = score.estimate(1e-6 * score.raw)
    start = list(probe)
    for place, i in enumerate(effect.amplitudes):
        null, prior = effect.parameters[i].null or 0.0, effect.parameters[i].prior
        if np.isfinite(null):
            low, high = prior.support
            reach = 3 * float(prior.quantile(0.841) - prior.quantile(0.5))
            estimate = null + amplitude[place] * (probe[i] - null)
            start[i] = float(np.clip(estimate, max(low, null - reach), min(high, null + reach)))
    z = normal_score(chi_square, count)
    if len(effect.amplitudes) == 1 and score.slope[0] < 0:
        z = -z
    return Candidate(
        effect=effect,
        start=tuple(start),
        z=z,
        trials=len(effect.probes),
        gain=0.5 * chi_square - 0.5 * count * np.log(max(float(fitted.model.known.n_touches), 2.0)),
        seen=score.seen,
    )


def _read(changes: Sequence[Predicted], score: Score) -> int:
    """Number of amplitudes, at least one, without those that change nothing but elements without readings."""
    moved = [each.touches.any() or (each.samples is not None and each.samples.any()) for each in changes]
    return max(len(changes) - int((np.array(moved) & (score.raw == 0)).sum()), 1)


def _changes(effect: Effect, fitted: Fitted) -> Callable[[Values], list[Predicted]]:
    """Change of the prediction by each amplitude of an effect that is not in the model, at a probe.

    What the probes have in common is computed once: the prediction at null amplitude, where the effect changes nothing,
    the signal before an effect that acts on the signal, and the one derivative of an effect whose values act through a
    basis (`Effect.by_place`).
    """
    model = fitted.model.with_effects((*fitted.model.effects, effect))
    nothing = effect.without(effect.probes[0])
    before = model.extended(fitted.vector, nothing)
    slopes = model.of_basis(effect, before)
    if slopes is not None:
        return lambda probe: [_times(probe[i] - nothing[i], slopes[i]) for i in effect.amplitudes]
    begun = None if effect.changes_pose or effect.changes_finger else model.signal(before)
    at_null = _predicted(model, before, begun)

    def at(probe: Values) -> list[Predicted]:
        null = effect.without(probe)
        alone = ((*null[:i], probe[i], *null[i + 1 :]) for i in effect.amplitudes)
        vectors = (model.extended(fitted.vector, values) for values in alone)
        return [_less(_predicted(model, vector, begun), at_null) for vector in vectors]

    return at


def _predicted(model: SensorModel, vector: FloatArray, begun: Recording | None) -> Predicted:
    """Prediction at a vector, from the signal before the effects on the signal where it is known."""
    return model.predict(vector) if begun is None else model.readings(begun, vector)


def _less(one: Predicted, other: Predicted) -> Predicted:
    """Difference of two predictions."""
    samples = None if one.samples is None or other.samples is None else one.samples - other.samples
    return Predicted(one.touches - other.touches, samples)


def _times(factor: float, one: Predicted) -> Predicted:
    """A change of the prediction times a factor."""
    return Predicted(factor * one.touches, None if one.samples is None else factor * one.samples)


def _allowed(effect: Effect, score: Score) -> float:
    """Chi-square of a score; zero if the single amplitude would be outside the support of its prior."""
    chi_square = score.chi_square()
    if len(effect.amplitudes) == 1:
        parameter = effect.parameters[effect.amplitudes[0]]
        null = parameter.null if parameter.null is not None else 0.0
        if np.isinf(null) or null <= parameter.prior.support[0]:
            # The estimate must be on the same side as the probe, which is inside the support.
            return chi_square if score.slope[0] > 0 else 0.0
    return chi_square


@_scored.register
def _(effect: NoiseEffect, fitted: Fitted, scorer: Scorer) -> None:
    """None: a noise effect changes how samples scatter, see `bayestouch.model.noise_search`."""


@_scored.register
def _(effect: RandomEffect, fitted: Fitted, scorer: Scorer) -> Candidate:
    """Score of a random function of time, as a variance component, at the middle one of the trial correlation times."""
    times = effect.parameters[1].probes
    time = times[len(times) // 2]
    best: tuple[float, float, Values, Score] | None = None
    for kind in effect.kinds:
        raw = drift_columns(fitted.model, fitted.vector, ((effect, (1.0, time, *kind)),))
        score = scorer.of_columns(fitted.whitening.columns(raw))
        size, gain = best_size(score)
        if best is None or gain > best[0]:
            best = (gain, size, kind, score)
    assert best is not None
    gain, size, kind, score = best
    return Candidate(
        effect=effect,
        start=(size, time, *kind),
        z=quadratic_score(score.slope, score.information),
        trials=len(effect.kinds),
        gain=gain,
        seen=score.seen,
    )


def best_size(score: Score) -> tuple[float, float]:
    """Trial sd of a random function with the largest marginal likelihood, and the log of its ratio to that of sd 0."""
    gains = []
    for size in DRIFT_SIZES:
        root = np.linalg.cholesky(np.eye(len(score.slope)) + size**2 * score.information)
        white = solve_triangular(root, size * score.slope, lower=True)
        gains.append(0.5 * float(white @ white) - float(np.log(np.diag(root)).sum()))
    k = int(np.argmax(gains))
    return DRIFT_SIZES[k], gains[k]


def refine_drift(fitted: Fitted, effect: RandomEffect) -> Values:
    """Values of a drift with the largest marginal likelihood; `fitted` is the model without the drift."""
    scorer = Scorer(fitted.linear)
    found = list[tuple[float, Values]]()
    for time, *kind in product(*(each.probes for each in effect.parameters[1:])):
        raw = drift_columns(fitted.model, fitted.vector, ((effect, (1.0, time, *kind)),))
        size, gain = best_size(scorer.of_columns(fitted.whitening.columns(raw)))
        found.append((gain, (size, time, *kind)))
    return max(found, key=lambda each: each[0])[1]
