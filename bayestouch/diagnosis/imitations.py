"""Probabilities of causes that allow for formulas that nobody tried.

The probabilities of a search compare the models that were fitted, as if one of them were right. Often none is: an
effect of a real sensor follows a formula of its own, and a cause that no catalogue has may imitate an effect. Then the
fit needs a second effect to repair the formula of the first, or blames an effect that is not there. Touches of one
sensor cannot say how often this happens. It was counted on simulated fingers whose causes are known: those of the five
blind studies, whose formulas nobody had seen (docs/diagnosis.md).

* Each named cause of a set is there with a share that was counted: one share if the set has no other named one, another
  if it is the first of several. The second has two shares, by whether the first one is there. Further ones have one.
* A cause that was tried and not named was passed over: it has a share of its own. But it counts as named in a set
  without its rival: a named cause, or something in place, from which these data do not distinguish it.
* A set that loses its last cause is `SOMETHING_ELSE`; where the verdict names none and finds no structure, `NOTHING`.
  With one more share something else is there beside the causes that are.
* Where something in place is all that is left, an effect of the catalogue may hide in it: with one more share it is the
  effect that predicted best of those that were tried.

Where the verdict finds structure and names no cause, nothing was passed over: all that was tried counts as named.

The search compares how well models predict. It does not know whether the best of them is good enough: where no model
predicts better than the one without a cause, "nothing" is probable, however large the lack of fit is. The test of the
lack of fit knows it. Where this is above its limit without effects, "nothing" is shared out between chance and
`SOMETHING_ELSE`, by the p-value of the test (`by_chance`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod

from bayestouch.diagnosis.causes import IN_TIME, IN_TOUCHES, NOTHING, Causes, Names, causes
from bayestouch.diagnosis.place_or_time import IN_PLACE
from bayestouch.diagnosis.rounds import SearchRound

#: Name of a cause that a set does not name.
SOMETHING_ELSE = "something else"
#: Names of sets of causes that are not effects.
NO_EFFECTS = {NOTHING, IN_PLACE, IN_TIME, IN_TOUCHES, SOMETHING_ELSE}


@dataclass(frozen=True)
class Shares:
    """How often causes were there that a diagnosis named, or passed over.

    Attributes
    ----------
    alone : float
        Share of the causes that were there, where one was named.
    first : float
        Share of the first of several.
    beside, instead : float
        Share of the second of several where the first one was there, and where it was not.
    further : float
        Share of the third and of later ones.
    more : float
        Share of fingers with a cause that was not named, of those with one that was.
    passed_over, in_time : float
        Share of the causes that were there, of those that were tried and not named: effects, and something in time.
    unlisted, hidden : float
        Share of fingers with the verdict "unattributed" whose cause was in no catalogue, and on which the effect that
        predicted best was simulated, and no other.
    """

    alone: float
    first: float
    beside: float
    instead: float
    further: float
    more: float
    passed_over: float
    in_time: float
    unlisted: float
    hidden: float


#: Shares by whether the diagnosis found structure that no cause explains. Counted by studies/imitations.py, which its
#: test compares.
SHARES = {
    False: Shares(
        alone=0.89,
        first=0.74,
        beside=0.37,
        instead=0.56,
        further=0.06,
        more=0.01,
        passed_over=0.04,
        in_time=0.01,
        unlisted=0.49,
        hidden=0.21,
    ),
    True: Shares(
        alone=0.79,
        first=0.70,
        beside=0.56,
        instead=0.42,
        further=0.25,
        more=0.18,
        passed_over=0.31,
        in_time=0.01,
        unlisted=0.49,
        hidden=0.21,
    ),
}


@dataclass(frozen=True)
class Named:
    """What a verdict says of causes.

    Attributes
    ----------
    effects : tuple of str
        Effects that it names.
    structure_left : bool
        Whether the diagnosis found structure that none of the causes explains.
    not_distinguishable : tuple of tuple of str
        Pairs of causes between which the data do not decide, with the names that sets of causes have.
    chance : float
        Share of "nothing" that it keeps, as from `by_chance`; one if the model without effects has no lack of fit.
    """

    effects: Names
    structure_left: bool
    not_distinguishable: tuple[Names, ...] = ()
    chance: float = 1.0

    @property
    def adequate(self) -> bool:
        """Whether no effect is named, and no structure is left."""
        return not self.effects and not self.structure_left

    def passed_over(self, name: str, names: Names) -> bool:
        """Whether a cause in a set of causes was passed over: none was if structure is left and no effect is named."""
        if not self.effects:
            return self.adequate
        rivals = {each for pair in self.not_distinguishable if name in pair for each in pair if each != name}
        return name not in self.effects and rivals & {*self.effects, IN_PLACE} <= {*names}


def with_imitations(found: Sequence[Causes], named: Named) -> tuple[Causes, ...]:
    """Sets of causes and their probabilities, which sum to one, most probable first.

    Parameters
    ----------
    found : sequence of Causes
        Sets that were fitted, and their probabilities as if one of them were right, most probable first.
    named : Named
        What the verdict names.
    """
    return allowing(found, named, SHARES[named.structure_left], best_effect(found))


def by_chance(p_value: float, tried: int) -> float:
    """Probability that nothing is missing from a model with a lack of fit, if it is none of the causes that were tried.

    Something else has the prior odds of one cause among `tried`, as each of these has. A p-value p favours it by at
    most ``-1 / (e p ln p)`` (Sellke, Bayarri and Berger, Calibration of p values for testing precise null hypotheses,
    The American Statistician 55 (2001) 62); this bound is used.

    Parameters
    ----------
    p_value : float
        Probability of a lack of fit at least this large if nothing is missing; NaN without a test, where the result is
        one.
    tried : int
        Number of causes that were tried.
    """
    if math.isnan(p_value):
        return 1.0
    if p_value <= 0:
        return 0.0
    odds = tried * (-math.e * p_value * math.log(p_value) if p_value < 1 / math.e else 1.0)
    return odds / (1 + odds)


def most_probable_alone(one: SearchRound) -> str | None:
    """Name of the effect that, alone, is more probable than all else that a first round tried; None if there is none.

    It is counted as if it left structure, which is not known before it is fitted with others. Whether something else is
    there beside it does not matter. After another effect none is named like this: about half of such effects were there
    (`Shares.beside`, `Shares.instead`).
    """
    if one.before.names:
        return None
    there: dict[str, float] = {}
    for each in with_imitations(causes((one,)), Named((), structure_left=True)):
        effects = [name for name in each.names if name != SOMETHING_ELSE]
        if len(effects) == 1 and effects[0] not in NO_EFFECTS:
            there[effects[0]] = there.get(effects[0], 0.0) + each.probability
    return next((name for name, probability in there.items() if probability > 0.5), None)


def allowing(found: Iterable[Causes], named: Named, shares: Shares, best: Names | None) -> tuple[Causes, ...]:
    """`with_imitations` for any shares and any `best_effect`."""
    total: dict[Names, float] = {}
    for each in found:
        for names, share in split(each.names, named, shares, best):
            total[names] = total.get(names, 0.0) + share * each.probability
    return tuple(Causes(*each) for each in sorted(total.items(), key=lambda each: -each[1]))


def best_effect(found: Sequence[Causes]) -> Names | None:
    """The effect that predicts best by itself, from sets with the most probable first; None if none was tried."""
    alone = (each.names for each in found if len(each.names) == 1)
    return next((names for names in alone if names[0] not in NO_EFFECTS), None)


def split(names: Names, named: Named, shares: Shares, best: Names | None) -> Iterator[tuple[Names, float]]:
    """What of a set of causes may be there, each with its share; the shares sum to one.

    `best` is the `best_effect`, which may hide in something in place.
    """
    if names == (NOTHING,):
        yield names, named.chance
        if named.chance < 1:
            yield (SOMETHING_ELSE,), 1 - named.chance
        return
    tried = [each for each in names if each != IN_PLACE]
    over = [each for each in tried if named.passed_over(each, names)]
    chosen = [each for each in tried if each not in over]
    # What single touches have is fitted by a drift, and is passed over as often as one.
    of_each = [shares.in_time if each in (IN_TIME, IN_TOUCHES) else shares.passed_over for each in over]
    for there in product((True, False), repeat=len(tried)):
        of_chosen, of_over = there[: len(chosen)], there[len(chosen) :]
        probability = _of_named(of_chosen, shares) * _of_all(of_over, of_each)
        absent = {name for name, is_there in zip([*chosen, *over], there, strict=True) if not is_there}
        left = tuple(each for each in names if each not in absent)
        if any(there):
            yield left, probability * (1 - shares.more)
            yield (*left, SOMETHING_ELSE), probability * shares.more
        elif left and not chosen:
            yield from ((each, probability * share) for each, share in _of_place(left, shares, best))
        else:
            yield (NOTHING,) if named.adequate else (SOMETHING_ELSE,), probability


def _of_named(there: Sequence[bool], shares: Shares) -> float:
    """Probability that of the named causes in a set these are there, in the order in which they were added."""
    second = shares.beside if any(there[:1]) else shares.instead
    of_each = [shares.first, second, *[shares.further] * len(there[2:])] if there[1:] else [shares.alone]
    return _of_all(there, of_each[: len(there)])


def _of_all(there: Sequence[bool], of_each: Sequence[float]) -> float:
    return prod(share if is_there else 1 - share for is_there, share in zip(there, of_each, strict=True))


def _of_place(place: Names, shares: Shares, best: Names | None) -> Iterator[tuple[Names, float]]:
    """What something in place may be if nothing else is left."""
    hidden = 0.0 if best is None else shares.hidden
    yield place, shares.unlisted
    if best is not None:
        yield best, hidden
    yield (SOMETHING_ELSE,), 1 - shares.unlisted - hidden
