"""Probabilities of the causes between which a search chose.

Every model that the search fitted is a sum of causes: listed effects, smooth functions of place (the correction), or
none. Its weight is pseudo-BMA+ [1]_: the predictive log density of held-out touches is summed over touches, and a
Bayesian bootstrap over the blocks that were held out together says how certain the differences are; the probability is
the mean of the normalised weights. Three things are added to this.

* Touches are held out in blocks of times and in blocks of places, as in `bayestouch.diagnosis.place_or_time`; the log
  density of a model is the mean of both. Blocks of times alone are unfair to a drift, blocks of places alone to
  functions of place.
* The prior odds of each cause are one to the number K of causes that were tried, so that about one cause is expected,
  however long the catalogue is: among many effects, one that predicts a little better by chance is likely.
* An effect whose score chance explains is not fitted. Its weight is that of the model without it, times the prior odds
  and the approximate marginal likelihood ratio of its score (Schwarz). So "nothing" is never certain: an effect may be
  too small for these touches.

Stacking would weigh models to predict best together, and shares the weight of two similar effects in any proportion.
Marginal likelihoods by the Laplace approximation depend on the width of the priors of effects, which was chosen for
fits, and are not defined for functions whose size is an estimate. Both have no standard error.

The models of one round differ from the model at its beginning by one cause, with the same whitening. The scatter
within touches counts with the noise that is estimated from what a model leaves of it: an effect within touches, which
makes the noise smaller, and an effect of the noise, which describes the larger scatter, are then compared fairly. The
next round begins with the chosen one, fitted to the end with its own noise, so that its density is taken as that of the
chosen one, also where an earlier effect was left out because touches are predicted as well without it.

.. [1] Y. Yao, A. Vehtari, D. Simpson, A. Gelman, Using stacking to average Bayesian predictive distributions, Bayesian
   Analysis 13 (2018) 917, https://doi.org/10.1214/17-BA1091
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import softmax

from bayestouch.array_types import FloatArray
from bayestouch.diagnosis.place_or_time import IN_PLACE, Densities, blocks_of, sums_of_blocks
from bayestouch.diagnosis.rounds import SearchRound, Tried

#: Name of the cause if only drifts that were not added explain the readings; and name of the model without a cause.
IN_TIME, NOTHING = "something in time", "nothing"
#: Name of the cause if such a drift predicts no touch: the misfit changes from touch to touch.
IN_TOUCHES = "something in single touches"
# Number of draws of the bootstrap: the Monte Carlo error of a probability is below 0.008.
DRAWS = 4000

Names = tuple[str, ...]


@dataclass(frozen=True)
class Causes:
    """A set of causes that together explain the readings, and its probability.

    Attributes
    ----------
    names : tuple of str
        Names of effects in the order in which they were added, ``something in place``, ``something in time`` or
        ``something in single touches``; only ``nothing`` for the model without a cause.
    probability : float
        Probability among all sets that the search tried.
    """

    names: Names
    probability: float


@dataclass(frozen=True, eq=False)
class Compared:
    """A model of the search as a sum of causes.

    Attributes
    ----------
    names : tuple of str
        Causes in the order in which they were added; none of the model without a cause.
    gain : mapping of str to (t,) array
        Log density of each held-out touch minus that by the model without a cause, by what is held out.
    scored : float
        Log of the marginal likelihood ratio of a last cause that was only scored; zero if it was fitted.
    predicts : bool
        `Tried.predicts` of the last cause, if it was fitted.
    """

    names: Names
    gain: Densities
    scored: float = 0.0
    predicts: bool = True

    @property
    def known(self) -> bool:
        """Whether the densities are finite: a fit that went astray counts for nothing."""
        return all(bool(np.isfinite(each).all()) for each in self.gain.values())


def causes(rounds: Sequence[SearchRound]) -> tuple[Causes, ...]:
    """Sets of causes with their probabilities, which sum to one, most probable first."""
    models = compared_models(rounds)
    tried = np.log(number_tried(rounds))
    prior = np.array([each.scored - len(each.names) * tried for each in models])
    blocks = blocks_of(rounds[0].before)
    gains = [sums_of_blocks([each.gain[way] for each in models], blocks[way]) for way in _ways(rounds)]
    probability = weights(gains, prior)
    called = dict.fromkeys(drifts_not_added(rounds), IN_TIME)
    total: dict[Names, float] = {}
    for model, share in zip(models, probability.tolist(), strict=True):
        astray = () if model.predicts else model.names[-1:]
        by = {**called, **{each: IN_TOUCHES for each in astray if each in called}}
        names = tuple(dict.fromkeys(by.get(each, each) for each in model.names)) or (NOTHING,)
        total[names] = total.get(names, 0.0) + share
    return tuple(Causes(*each) for each in sorted(total.items(), key=lambda each: -each[1]))


def number_tried(rounds: Sequence[SearchRound]) -> int:
    """Number of causes that were tried in the first round: the effects, and functions of place."""
    return len(rounds[0].tried) + 1


def drifts_not_added(rounds: Sequence[SearchRound]) -> set[str]:
    """Names of the drifts that a search tried and did not add: as a cause they are something in time."""
    drifts = {each.effect.name for one in rounds for each in one.tried if each.effect.random}
    return drifts - set(rounds[-1].before.names)


def weights(gains: Sequence[FloatArray], log_prior: FloatArray) -> FloatArray:
    """Mean posterior weight of each model over a Bayesian bootstrap of blocks, (k,); k models.

    Parameters
    ----------
    gains : sequence of (k, b) arrays
        Log density of each block by each model, up to a constant of the block. There is one array for each way to hold
        out all touches; the log density of a model is the mean of these ways.
    log_prior : (k,) array
        Logarithm of the prior weight of each model.
    """
    rng = np.random.default_rng(0)
    total = np.zeros((DRAWS, len(log_prior)))
    for each in gains:
        share = rng.dirichlet(np.ones(each.shape[1]), DRAWS)
        total += each.shape[1] * share @ each.T / len(gains)
    return np.asarray(softmax(total + log_prior, axis=1).mean(axis=0))


def compared_models(rounds: Sequence[SearchRound]) -> tuple[Compared, ...]:
    """All models of a search, each set of causes once: as it was fitted last."""
    found: dict[frozenset[str], Compared] = {}
    order: list[str] = []
    ways = _ways(rounds)
    start: Densities = {way: np.zeros(rounds[0].before.model.known.n_touches) for way in ways}
    for one in rounds:
        names = tuple(sorted(one.before.names, key=order.index))
        models = [Compared(names, start), *_of_round(one, names, start)]
        found |= {frozenset(each.names): each for each in models if each.known}
        if one.added is not None:
            order.append(one.added.effect.name)
            start = found[frozenset((*names, one.added.effect.name))].gain
    return tuple(found.values())


def _of_round(one: SearchRound, names: Names, start: Densities) -> Iterable[Compared]:
    """Models with one cause more than that at the beginning of a round."""
    for each in one.tried:
        if np.isfinite(each.scored_gain):
            # The score of a random function is the best of all sizes: Schwarz' criterion for one value more.
            size = 0.5 * float(np.log(one.before.model.known.n_touches)) if each.effect.random else 0.0
            yield Compared((*names, each.effect.name), start, each.scored_gain - size)
        elif (gain := _gain(each, one, start)) is not None:
            yield Compared((*names, each.effect.name), gain, predicts=each.predicts)
    if one.held_out_in_place is not None:
        yield Compared((*names, IN_PLACE), _added(start, one.held_out_in_place, one.held_out))


def _gain(tried: Tried, one: SearchRound, start: Densities) -> Densities | None:
    """Gain of a model with a candidate; None if it was not fitted."""
    if tried.held_out is not None:
        return {way: gain + tried.noise_again for way, gain in _added(start, tried.held_out, one.held_out).items()}
    if tried.difference is not None:
        # The scatter within touches does not depend on what else is held out.
        return {way: gain + tried.difference for way, gain in start.items()}
    return None


def _added(start: Densities, after: Densities, before: Densities | None) -> Densities:
    assert before is not None
    return {way: gain + after[way] - before[way] for way, gain in start.items()}


def _ways(rounds: Sequence[SearchRound]) -> list[str]:
    """What was held out in every round."""
    kinds: list[Mapping[str, FloatArray]] = [each.held_out for each in rounds if each.held_out is not None]
    return [way for way in kinds[0] if all(way in each for each in kinds)]
