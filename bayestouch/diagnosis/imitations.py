"""Probabilities of causes that allow for formulas that nobody tried.

The probabilities of a search compare the models that were fitted, as if one of them were right. Often none is: an
effect of a real sensor follows a formula of its own, and a cause that no catalogue has may imitate an effect. Then the
fit needs a second effect to repair the formula of the first, or blames an effect that is not there. Touches of one
sensor cannot say how often this happens. It was counted on simulated fingers whose causes are known: those of the three
blind studies, whose formulas nobody had seen (docs/diagnosis.md).

Each named cause is there with the share that was counted, independently of the others; a set that loses its last cause
is `SOMETHING_ELSE`. Where something in place is all that is left, an effect of the catalogue may hide in it: with one
more share it is the effect that predicted best of those that were tried. "Nothing" is left as it is: it was right as
often as the search says.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod

from bayestouch.diagnosis.causes import IN_TIME, NOTHING, Causes, Names, causes
from bayestouch.diagnosis.place_or_time import IN_PLACE
from bayestouch.diagnosis.rounds import SearchRound

#: Name of a cause that was not tried: it is in no catalogue, or follows another formula than the catalogue's.
SOMETHING_ELSE = "something else"
#: Names of sets of causes that are not effects.
NO_EFFECTS = {NOTHING, IN_PLACE, IN_TIME, SOMETHING_ELSE}


@dataclass(frozen=True)
class Shares:
    """How often causes that a diagnosis named were there.

    Attributes
    ----------
    first, later : float
        Share of the causes that were named first, and of those that were added to others.
    in_place, hidden : float
        Share of fingers with "something in place" alone on which no effect of the catalogue was simulated, and on which
        the effect that predicted best was, and no other.
    """

    first: float
    later: float
    in_place: float
    hidden: float


# Counted by studies/imitations.py, which its test compares.
NOTHING_LEFT = Shares(first=0.85, later=0.36, in_place=0.60, hidden=0.16)
STRUCTURE_LEFT = Shares(first=0.77, later=0.50, in_place=0.60, hidden=0.16)


def with_imitations(found: Sequence[Causes], structure_left: bool) -> tuple[Causes, ...]:
    """Sets of causes and their probabilities, which sum to one, most probable first.

    Parameters
    ----------
    found : sequence of Causes
        Sets that were fitted, and their probabilities as if one of them were right, most probable first.
    structure_left : bool
        Whether the diagnosis found structure that none of the causes explains.
    """
    return allowing(found, STRUCTURE_LEFT if structure_left else NOTHING_LEFT, best_effect(found))


def most_probable_alone(one: SearchRound) -> str | None:
    """Name of the effect that, alone, is more probable than all else that a first round tried; None if there is none.

    It is counted as if it left structure, which is not known before it is fitted with others. After another effect none
    is: such an effect was there in half of the fingers (`STRUCTURE_LEFT`).
    """
    if one.before.names:
        return None
    first = with_imitations(causes((one,)), structure_left=True)[0]
    alone = len(first.names) == 1 and first.names[0] not in NO_EFFECTS
    return first.names[0] if alone and first.probability > 0.5 else None


def allowing(found: Sequence[Causes], shares: Shares, best: Names | None) -> tuple[Causes, ...]:
    """`with_imitations` for any shares and any `best_effect`."""
    total: dict[Names, float] = {}
    for each in found:
        for names, share in split(each.names, shares, best):
            total[names] = total.get(names, 0.0) + share * each.probability
    return tuple(Causes(*each) for each in sorted(total.items(), key=lambda each: -each[1]))


def best_effect(found: Sequence[Causes]) -> Names | None:
    """The effect that predicts best by itself, from sets with the most probable first; None if none was tried."""
    alone = (each.names for each in found if len(each.names) == 1)
    return next((names for names in alone if names[0] not in NO_EFFECTS), None)


def split(names: Names, shares: Shares, best: Names | None) -> Iterator[tuple[Names, float]]:
    """What of a set of causes may be there, each with its share; the shares sum to one.

    `best` is the `best_effect`, which may hide in something in place.
    """
    if names == (NOTHING,):
        yield names, 1.0
        return
    named = tuple(each for each in names if each != IN_PLACE)
    if not named:
        hidden = 0.0 if best is None else shares.hidden
        yield names, shares.in_place
        if best is not None:
            yield best, hidden
        yield (SOMETHING_ELSE,), 1 - shares.in_place - hidden
        return
    of_each = (shares.first, *[shares.later] * (len(named) - 1))
    for there in product((True, False), repeat=len(named)):
        absent = {name for name, is_there in zip(named, there, strict=True) if not is_there}
        left = tuple(each for each in names if each not in absent) if any(there) else (SOMETHING_ELSE,)
        yield left, prod(one if is_there else 1 - one for one, is_there in zip(of_each, there, strict=True))
