"""Candidates and results of each round of a search."""

from __future__ import annotations

from dataclasses import dataclass, replace

from bayestouch.array_types import FloatArray
from bayestouch.diagnosis.place_or_time import Densities, PlaceOrTime
from bayestouch.effects.effect import Effect, Values
from bayestouch.model.correction import Correction
from bayestouch.model.fitting import Fitted
from bayestouch.model.noise_posterior import FoundNoise
from bayestouch.model.noise_search import NoiseCandidate


@dataclass(frozen=True, eq=False)
class Tried:
    """A candidate effect with its results in one round.

    Attributes
    ----------
    effect : Effect
        The candidate.
    z : float
        Normal score.
    seen : float
        Share of its signature that base parameters do not absorb.
    start : tuple of float
        Values from the score, or from the refit if there was one.
    gain, gain_se : float
        Gain of held-out log density, and its standard error over touches; NaN if it was not refitted.
    clear : bool
        Whether the gain is clear, see `bayestouch.diagnosis.comparison.is_clear`.
    of_means : float
        Decrease of half the squared error of the means of held-out touches, in units of the noise. Unlike this, the
        gain of density is positive even for a random function that predicts nothing, because it is uncertain.
    by_itself : bool
        True if the effect is visible in what hardly any other effect changes: drift or scatter within a touch.
    share : float
        Share that it explains of what can be explained.
    fitted : Fitted or None
        Model with the effect, if it was refitted; kept where the advice on further measurements may need it.
    difference : (t,) array or None
        Gain of each touch.
    held_out : mapping of str to (t,) array, or None
        Log density of each touch held out with its block, by what is held out, if it was refitted.
    predicts : bool
        Whether it lowers the squared error of held-out touches in some way to hold them out. A random function that
        does not is only uncertain by as much as the misfit.
    noise_again : (t,) array or float
        Further gain of each touch if the noise is estimated again from the scatter that is left within touches; zero
        for what does not change this scatter.
    scored_gain : float
        Approximate gain of log marginal likelihood by the score, at least, as the mean over the signatures that were
        tried; NaN where chance does not explain the score.
    noise : NoiseCandidate or None
        Candidate of the noise, if the effect is one of the noise.
    found_noise : tuple of FoundNoise
        Posteriors of all effects of the noise in the model, if it is one and was added; else empty.
    indistinguishable : tuple of str
        Other candidates that are indistinguishable from it.
    """

    effect: Effect
    z: float
    seen: float
    start: Values
    gain: float = float("nan")
    gain_se: float = float("nan")
    clear: bool = False
    of_means: float = float("nan")
    by_itself: bool = False
    share: float = float("nan")
    fitted: Fitted | None = None
    difference: FloatArray | None = None
    noise: NoiseCandidate | None = None
    found_noise: tuple[FoundNoise, ...] = ()
    indistinguishable: tuple[str, ...] = ()
    held_out: Densities | None = None
    predicts: bool = True
    noise_again: FloatArray | float = 0.0
    scored_gain: float = float("nan")


@dataclass(frozen=True, eq=False)
class SearchRound:
    """One round of the search.

    Attributes
    ----------
    before : Fitted
        Model at the beginning of the round.
    tried : tuple of Tried
        All candidates, best first.
    possible : float
        What can be explained: half the sum of squares beyond noise, or the gain of a correction without a cause.
    correction : Correction or None
        Correction in addition to the model.
    correction_gain, correction_se : float
        Its gain of held-out log density, and the standard error.
    added : Tried or None
        Effect that was added.
    dropped : tuple of str
        Effects of earlier rounds that the added one makes unnecessary.
    real : tuple of Tried
        All effects that could have been added, with their fits; only in the first round, during the search.
    place_or_time : tuple of PlaceOrTime
        For each drift that explains enough, whether it or functions of place predict better; and each effect of earlier
        touches that functions of place replace.
    held_out, held_out_in_place : mapping of str to (t,) array, or None
        Log density of each touch held out with its block, by what is held out: by the model at the beginning, and with
        the correction if there is one.
    probable : str or None
        Name of the effect that is more probable than all other causes together; None if there is no such effect.
    """

    before: Fitted
    tried: tuple[Tried, ...]
    possible: float
    correction: Correction | None
    correction_gain: float
    correction_se: float
    added: Tried | None
    dropped: tuple[str, ...] = ()
    real: tuple[Tried, ...] = ()
    place_or_time: tuple[PlaceOrTime, ...] = ()
    held_out: Densities | None = None
    held_out_in_place: Densities | None = None
    probable: str | None = None


def with_undecided_drift(last: SearchRound) -> tuple[SearchRound, ...]:
    """The last round with the best drift added that is ahead of functions of place in each way, but not certainly."""
    ahead = {each.drift for each in last.place_or_time if each.undecided and (each.standardised > 0).all()}
    return tuple(replace(last, added=each) for each in last.tried if each.effect.name in ahead)[:1]
