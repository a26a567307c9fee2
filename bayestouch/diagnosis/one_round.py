"""One round of the search: score all effects, refit the best ones, choose one or none."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.diagnosis.choice import indistinguishable_from, most_probable
from bayestouch.diagnosis.comparison import (
    density,
    gained_in_place,
    held_out_each_way,
    is_clear,
    refit_all,
    tried_noise,
)
from bayestouch.diagnosis.imitations import most_probable_alone
from bayestouch.diagnosis.place_or_time import Densities, Parts, PlaceOrTime, densities, is_better_beside, place_or_time
from bayestouch.diagnosis.rounds import SearchRound, Tried
from bayestouch.effects.effect import Effect
from bayestouch.effects.kinds import of_noise
from bayestouch.model.candidates import Candidate, score_effects, score_in_form
from bayestouch.model.correction import Correction, fit_correction, rejoined
from bayestouch.model.fitting import Fitted
from bayestouch.model.noise_search import score_noise
from bayestouch.model.noise_together import join_noise
from bayestouch.model.significance import at_least_one
from bayestouch.output.progress import Progress, tell
from bayestouch.parallel.beside import both

# Fractions of a round's time at the end of scoring, of refitting and of the correction; looser forms follow.
SCORED, REFITTED, CORRECTED = 0.25, 0.8, 0.85
# Number of candidates that are refitted, besides random functions of time.
LEADING = 5
# Conditions for an effect to be real. By chance, any of the effects that were tried has such a score with less than
# this probability.
CHANCE = 0.01
# What it explains is at least a tenth of the noise of an averaged touch (root mean square).
MATERIAL = 0.1
# A model leaves no relevant misfit if χ² over the number of readings is below 1 + this.
SMALL = 0.1
# However many readings there are, so large a gain of log density is relevant.
ENOUGH_GAIN = 50.0
# It explains this share of what can be explained.
SHARE = 0.3
# A random function of time is not tried if less than this share of it is distinct from the model.
VISIBLE = 0.2


def one_round(
    fitted: Fitted, effects: tuple[Effect, ...], progress: Progress, scheduler: str | None = None
) -> SearchRound:
    """One round: score all effects, refit the best ones, and choose one or none."""
    tell(progress, 0.0, "scores")
    scored = score_effects(fitted, effects)
    noise = tuple(each for each in of_noise(effects) if each.name not in fitted.names)
    scattered = score_noise(fitted, noise)
    trials = sum(each.trials for each in scored) + len(scattered)
    before, least = held_out_each_way(fitted, fitted.linear, density(fitted)), smallest_gain(fitted)
    leading = _leading([c for c in scored if _passes(c.z, trials) and c.gain > 0])
    part = (REFITTED - SCORED) / max(len(leading), 1)
    stages = [*(f"refit {each.effect.name}" for each in leading), "functions of place"]

    def refitting(number: int) -> None:
        tell(progress, SCORED + part * number, stages[number])

    refitting(0)
    again, (correction, correction_gain, correction_se, in_place) = both(
        lambda: refit_all(fitted, leading, before, least, scheduler, refitting),
        lambda tell: _in_place(fitted, before["times"]),
    )
    # The derivatives need much memory: those that the other process sent are the same as here.
    correction = correction and rejoined(correction, fitted)
    refitted = {each.effect.name: each for each in again}
    possible = max(correction_gain, fitted.excess, least)
    tried = []
    for c in scored:
        done = refitted.get(c.effect.name) or Tried(c.effect, c.z, c.seen, c.start)
        scored_gain = float("nan") if _passes(c.z, trials) else c.gain - float(np.log(c.trials))
        tried.append(replace(done, share=_share(done, c, possible), scored_gain=scored_gain))
    tried += [tried_noise(n, by_chance=not _passes(n.z, trials)) for n in scattered]
    tell(progress, CORRECTED, "looser forms")
    tried = _in_best_form(_best_first(tried), fitted, effects, before, least, possible, scheduler)
    progress(1.0)
    whole = SearchRound(
        fitted,
        tuple(tried),
        possible,
        correction,
        correction_gain,
        correction_se,
        added=None,
        held_out=densities(before),
        held_out_in_place=in_place,
    )
    whole = replace(whole, probable=most_probable_alone(whole))
    real = [each for each in tried if _is_real(each, trials, least, whole.probable) and not _as_a_drift(each, tried)]
    drifts = place_or_time(fitted, _held_out(each for each in real if each.effect.random), in_place)
    faced = (*drifts, *_imitating_place(fitted, [each for each in real if each.effect.remembers], in_place))
    real = [each for each in real if each.effect.name not in {one.drift for one in faced if not one.is_drift}]
    # Changes during a touch are not noise: effects within touches have priority over effects of the noise.
    within = [each for each in real if each.effect.needs_samples and each.noise is None]
    if within and real[0].noise is not None:
        real = within
    added = most_probable(real) if real else None
    if added is not None:
        added = replace(added, indistinguishable=indistinguishable_from(added, tried))
        if added.noise is not None:
            joined, found = join_noise(fitted, added.noise)
            added = replace(added, found_noise=found, fitted=joined)
        # Fits need much memory: keep only those that the advice on further measurements compares.
        kept = {added.effect.name, *added.indistinguishable, *(one.drift for one in faced if one.undecided)}
        tried = [each if each.effect.name in kept or is_near(each) else replace(each, fitted=None) for each in tried]
    others = tuple(each for each in real if each.fitted is not None)
    return replace(whole, tried=tuple(tried), added=added, real=others, place_or_time=faced)


def _in_place(fitted: Fitted, before: FloatArray) -> tuple[Correction | None, float, float, Densities | None]:
    """Functions of place for a model, and what `gained_in_place` says of them."""
    correction = fit_correction(fitted)
    return correction, *gained_in_place(fitted, correction, before)


def _imitating_place(fitted: Fitted, tried: list[Tried], places: Densities | None) -> list[PlaceOrTime]:
    """Effects of earlier touches that functions of place replace, also beside these."""
    models = {each.effect.name: each.fitted for each in tried}
    replaced = [one for one in place_or_time(fitted, _held_out(tried), places) if one.is_place]
    beside = ((one, models[one.drift]) for one in replaced)
    return [one for one, model in beside if model and places and not is_better_beside(model, places)]


def _held_out(tried: Iterable[Tried]) -> dict[str, Densities]:
    """Log densities of held-out touches by the effects that were refitted, by name."""
    return {each.effect.name: each.held_out for each in tried if each.held_out is not None}


def _leading(scored: list[Candidate]) -> list[Candidate]:
    """The best candidates, and every random function of time that is better than the last of them."""
    last = [k for k, each in enumerate(scored) if not each.effect.random][:LEADING]
    return scored[: last[-1] + 1] if len(last) == LEADING else scored


def _best_first(tried: list[Tried]) -> list[Tried]:
    """Candidates in decreasing order of the gain, then of the score."""
    return sorted(tried, key=lambda each: -(each.gain if np.isfinite(each.gain) else -1e9 + abs(each.z)))


def _in_best_form(
    tried: list[Tried],
    fitted: Fitted,
    effects: tuple[Effect, ...],
    before: Parts,
    least: float,
    possible: float,
    scheduler: str | None,
) -> list[Tried]:
    """The candidates; those that explain enough in their looser form where this is clearly better, else as given.

    The looser form is not wanted where the candidate leaves no relevant misfit as it is. A candidate that has begun in
    its looser form is tried as given, too: values that the data hardly need make the posterior a long, curved ridge.
    """
    given = {each.name: each for each in effects}
    refitted = [each for each in tried if each.fitted is not None and not each.effect.random and each.noise is None]
    enough = [each for each in refitted if each.gain > least and each.share >= SHARE]
    forms = [(each, _in_other_form(each, fitted, given)) for each in enough]
    pairs = [(each, candidate) for each, candidate in forms if candidate is not None]
    refits = refit_all(fitted, [candidate for _, candidate in pairs], before, least, scheduler)
    best: dict[str, Tried] = {}
    for (each, candidate), other in zip(pairs, refits, strict=True):
        other = replace(other, share=_share(other, candidate, possible))
        plain, looser = (other, each) if _is_looser(each, given) else (each, other)
        assert plain.difference is not None and looser.difference is not None
        better = is_clear(looser.difference - plain.difference) and not is_small(plain.fitted)
        best[each.effect.name] = looser if better else plain
    return _best_first([best.get(each.effect.name, each) for each in tried])


def _is_looser(tried: Tried, given: Mapping[str, Effect]) -> bool:
    """Whether a candidate has further parameters than the effect of this name that is given."""
    return len(tried.effect.parameters) > len(given[tried.effect.name].parameters)


def _in_other_form(tried: Tried, fitted: Fitted, given: Mapping[str, Effect]) -> Candidate | None:
    """The candidate in its looser form, which begins where it is, or as given if it is looser; None without another."""
    if _is_looser(tried, given):
        return score_in_form(fitted, given[tried.effect.name])
    looser = tried.effect.looser(fitted.model.n_elements)
    if looser is None or looser == tried.effect or is_small(tried.fitted):
        return None
    start = (*tried.start, *(0.0,) * (len(looser.parameters) - len(tried.start)))
    return Candidate(looser, start, tried.z, 1, tried.gain, tried.seen)


def is_small(left: Fitted | None) -> bool:
    """True if the misfit of a model is not relevant."""
    return left is not None and left.excess < 0.5 * SMALL * left.n_readings


def smallest_gain(fitted: Fitted) -> float:
    """Gain of the smallest effect that is relevant; for many readings a constant, smaller limit applies."""
    return min(0.5 * MATERIAL**2 * fitted.n_readings, ENOUGH_GAIN)


def _passes(z: float, trials: int) -> bool:
    from scipy.special import ndtr

    return at_least_one(float(2 * ndtr(-abs(z))), trials) < CHANCE


def _is_real(tried: Tried, trials: int, least: float, probable: str | None) -> bool:
    if not np.isfinite(tried.gain) or not _passes(tried.z, trials) or tried.gain < least:
        return False
    if tried.effect.name == probable:
        return True
    if not tried.clear:
        return False
    if tried.share < SHARE and not tried.by_itself:
        return False
    # A random function of time must be distinct from what the model already contains.
    return not tried.effect.random or tried.seen > VISIBLE


def _as_a_drift(one: Tried, tried: list[Tried]) -> bool:
    """True if an effect that can follow time, but is no drift, predicts no better than a drift does."""
    drifts = (each.gain for each in tried if each.effect.random and np.isfinite(each.gain))
    return one.effect.follows_time and not one.effect.random and one.gain <= max(drifts, default=-np.inf)


def is_near(tried: Tried) -> bool:
    """True if the effect may be real: it explains much, but is not certain."""
    return tried.gain > 0 and not tried.clear and tried.share >= SHARE


def _share(tried: Tried, scored: Candidate, possible: float) -> float:
    gain = scored.gain
    if np.isfinite(tried.gain):
        gain = tried.gain if tried.by_itself else tried.of_means
    return float(np.clip(gain / possible, 0.0, 1.0))
