"""Models with several noise effects: each is fitted beside the others.

An effect that is fitted before another one is there takes over a part of its noise. Wrong readings count as noise that
grows with the signal, and large deviations where the noise is large count as wrong readings.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.effects.noise import NoiseEffect, Outliers
from bayestouch.model.fitting import Fitted
from bayestouch.model.noise import AddedNoise
from bayestouch.model.noise_fit import with_noise
from bayestouch.model.noise_posterior import FoundNoise, rewhitened, settled_noise
from bayestouch.model.noise_search import NoiseCandidate, score_noise

# Each effect is fitted again beside the others until no value moves by more than this part of its sd. Where noise that
# grows with the signal is five times the own noise at the peak, this takes four times; where it is ten times, nine.
SETTLED = 0.1
# Largest number of times: twice that of the worst of these, so that a fit ends that goes to and fro.
MOST = 20


def join_noise(fitted: Fitted, scored: NoiseCandidate) -> tuple[Fitted, tuple[FoundNoise, ...]]:
    """The model with one more noise effect, and all its noise effects with their values in this model."""
    if not fitted.noise.effects:
        found = settled_noise(fitted, scored)
        return with_noise(fitted, found), (found,)
    effects = [*(effect for effect, _ in fitted.noise.effects), scored.effect]
    # A few wrong readings have most of the variance: they are removed before other noise is fitted.
    effects.sort(key=lambda effect: not isinstance(effect, Outliers))
    for effect in effects:
        fitted = without_noise(fitted, effect)
    candidates: dict[str, NoiseCandidate] = {}
    for effect in effects:
        (candidates[effect.name],) = score_noise(fitted, (effect,))
        fitted = with_noise(fitted, settled_noise(fitted, candidates[effect.name]))
    joined: dict[str, FoundNoise] = {}
    for _ in range(MOST):
        former = dict(joined)
        for name, candidate in candidates.items():
            fitted = without_noise(fitted, candidate.effect)
            joined[name] = settled_noise(fitted, candidate)
            fitted = with_noise(fitted, joined[name])
            candidates[name] = replace(candidate, values=joined[name].values)
        if all(_stays(found, former.get(name)) for name, found in joined.items()):
            break
    return fitted, tuple(joined.values())


def _stays(found: FoundNoise, former: FoundNoise | None) -> bool:
    """Whether the values of an effect are those of the former fit, to a part of their sd."""
    if former is None:
        return False
    moved = np.abs(np.subtract(found.values, former.values))
    return bool((moved <= SETTLED * np.array(found.sd)).all())


def without_noise(fitted: Fitted, effect: NoiseEffect) -> Fitted:
    """The model without a noise effect, with the readings that were removed by it; parameters are not fitted again."""
    noise = fitted.noise
    left = tuple(pair for pair in noise.effects if pair[0].name != effect.name)
    removed = set(effect.added(effect.probes[0]))
    if "common" in removed:
        removed.add("common_touch")
    none = AddedNoise()
    added = replace(noise.added, **{name: getattr(none, name) for name in removed})
    model = fitted.model
    if isinstance(effect, Outliers):
        model = model.with_readings(model.known.with_all_readings())
    return rewhitened(replace(fitted, model=model), noise.with_(effects=left, added=added))
