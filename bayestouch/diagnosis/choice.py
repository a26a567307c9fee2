"""Choice among the candidates of a round that are real: the most probable one, and those that are like it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayestouch.diagnosis.comparison import paired
from bayestouch.diagnosis.rounds import Tried

# Candidates are indistinguishable from the best if their held-out density is within this many standard errors of its.
INDISTINGUISHABLE = 2.0
# A cause is preferred to a random function of time if it explains this share of what that explains of the means.
# A cause that changes with time is not, even if it predicts as well: it can follow a part of what the function is.
NEARLY = 0.9


def most_probable(real: list[Tried]) -> Tried:
    """Effect to add: the best one or, among other effects that are as good, the most probable one.

    Random functions of time can follow much that they do not cause. Of several equally good effects, the better guess
    has fewer values, or values closer to what was expected (Schwarz' criterion).
    """
    best = real[0]
    if best.noise is not None:
        return best
    # An effect that can follow time is not preferred to one that gains more.
    others = [each for each in real[1:] if each.noise is None and not each.effect.follows_time]
    equal = [each for each in others if as_good(each, best)]
    if not best.effect.random:
        return min([best, *equal], key=schwarz_criterion)
    if equal:
        return min(equal, key=schwarz_criterion)
    # If a cause explains nearly as much, take it first; the next round can add the random function. The comparison uses
    # touch means, because a random function also gains density by being uncertain.
    most = max(others, key=lambda each: each.of_means, default=best)
    return most if most.of_means > NEARLY * best.of_means else best


def as_good(other: Tried, best: Tried) -> bool:
    """True if an effect predicts held-out touches as well as the best, within the error of the difference."""
    if other.difference is None or best.difference is None:
        return False
    gain, error = paired(best.difference - other.difference)
    return gain < INDISTINGUISHABLE * error


def schwarz_criterion(tried: Tried) -> float:
    """Cost of a fit, plus half the number of values times the logarithm of the number of touches."""
    assert tried.fitted is not None
    touches = tried.fitted.model.known.n_touches
    return tried.fitted.linear.cost() + 0.5 * len(tried.effect.parameters) * float(np.log(touches))


def indistinguishable_from(added: Tried, tried: Sequence[Tried]) -> tuple[str, ...]:
    """Names of refitted candidates that predict left-out touches as well or better, within the error."""
    out = []
    for each in tried:
        if each.effect.name == added.effect.name or each.noise is not None or added.noise is not None:
            continue
        if as_good(each, added):
            out.append(each.effect.name)
    return tuple(out)
