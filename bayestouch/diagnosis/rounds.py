"""What a search tries in each round, and what it finds."""

from __future__ import annotations

from dataclasses import dataclass

from bayestouch.array_types import FloatArray
from bayestouch.effects.effect import Effect, Values
from bayestouch.model.correction import Correction
from bayestouch.model.fitting import Fitted
from bayestouch.model.noise_posterior import FoundNoise
from bayestouch.model.noise_search import NoiseCandidate


@dataclass(frozen=True, eq=False)
class Tried:
    """A candidate as it was in one round.

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
    of_means : float
        By how much half the squared error of the means of held-out touches falls, in units of the noise. A random
        function that predicts nothing gains density all the same, by saying that it is uncertain.
    by_itself : bool
        Whether it shows where hardly anything else does: in how readings move or scatter within a touch.
    share : float
        What it explains of what can be explained.
    fitted : Fitted or None
        Model with it, where it was refitted; kept for what was added, and for what cannot be told from that.
    difference : (t,) array or None
        Gain of each touch.
    signature : (t, m) array or None
        What it does to mean readings.
    noise : NoiseCandidate or None
        Where it is an effect of the noise.
    found_noise : FoundNoise or None
        Its posterior, where it was added.
    indistinguishable : tuple of str
        Other candidates that cannot be told from it.
    """

    effect: Effect
    z: float
    seen: float
    start: Values
    gain: float = float("nan")
    gain_se: float = float("nan")
    of_means: float = float("nan")
    by_itself: bool = False
    share: float = float("nan")
    fitted: Fitted | None = None
    difference: FloatArray | None = None
    signature: FloatArray | None = None
    noise: NoiseCandidate | None = None
    found_noise: FoundNoise | None = None
    indistinguishable: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class SearchRound:
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
    correction_gain, correction_se : float
        Held-out log density that it gains, and its standard error.
    added : Tried or None
        What was added.
    dropped : tuple of str
        Effects of earlier rounds that are not needed beside what was added.
    real : tuple of Tried
        All that might have been added, with their fits; of a first round, while the search is under way.
    """

    before: Fitted
    tried: tuple[Tried, ...]
    best_share: float
    correction: Correction | None
    correction_gain: float
    correction_se: float
    added: Tried | None
    dropped: tuple[str, ...] = ()
    real: tuple[Tried, ...] = ()
