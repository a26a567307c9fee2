"""Planned touches as two causes predict them, each fitted to the touches of a diagnosis."""

from __future__ import annotations

from collections.abc import Iterator

from bayestouch.data.averages import TouchMeans
from bayestouch.diagnosis.causes import NOTHING
from bayestouch.diagnosis.place_or_time import IN_PLACE
from bayestouch.diagnosis.result import Diagnosis
from bayestouch.diagnosis.rounds import SearchRound, Tried
from bayestouch.effects.kinds import of_noise
from bayestouch.errors import InputError, unknown_name
from bayestouch.model.correction import fit_correction
from bayestouch.model.fitting import Fitted
from bayestouch.model.joining import fit_with
from bayestouch.model.planned import PlannedReadings
from bayestouch.model.planned_fit import planned_readings


def probable_pair(diagnosis: Diagnosis) -> tuple[str, str]:
    """Two causes in which the most probable set of causes and the next one that differs by one cause differ.

    If one of these sets has a cause more than the other, this cause is compared with ``nothing``.

    Raises
    ------
    InputError
        The diagnosis has no two such sets.
    """
    first, *others = ([each for each in names if each != NOTHING] for names in diagnosis.causes)
    for other in others:
        one = [each for each in first if each not in other] or [NOTHING]
        two = [each for each in other if each not in first] or [NOTHING]
        if len(one) == len(two) == 1 and _round_of(diagnosis, (one[0], two[0])) is not None:
            return one[0], two[0]
    raise InputError("about: the diagnosis has no two causes to compare; name two")


def two_models(diagnosis: Diagnosis, causes: tuple[str, str], touches: TouchMeans) -> list[PlannedReadings]:
    """The touches by the model with each cause, besides what was found before in the search.

    Raises
    ------
    InputError
        The causes are equal, were not tried in one round of the search, or are found in the scatter of samples only.
    """
    for each in causes:
        _check(diagnosis, each)
    if causes[0] == causes[1]:
        raise InputError(f"about: expected two different causes, got {causes[0]} twice")
    found = _round_of(diagnosis, causes)
    if found is None:
        raise InputError(f"about: no round of the search tried both {causes[0]} and {causes[1]}")
    return [_readings(found, each, touches) for each in causes]


def _check(diagnosis: Diagnosis, cause: str) -> None:
    known = sorted({name for one in diagnosis.traced.rounds for name in _names(one)})
    if cause not in known:
        raise InputError(f"about: {unknown_name('cause', cause, known)}")


def _names(one: SearchRound) -> Iterator[str]:
    """Causes that a round compares by the means of touches."""
    yield from (each.effect.name for each in one.tried if not of_noise([each.effect]))
    if one.correction is not None:
        yield IN_PLACE
    yield NOTHING


def _round_of(diagnosis: Diagnosis, causes: tuple[str, str]) -> SearchRound | None:
    """The first round that added one of the causes and tried both, else the last that tried both."""
    both = [one for one in diagnosis.traced.rounds if set(causes) <= set(_names(one))]
    added = [one for one in both if one.added is not None and one.added.effect.name in causes]
    return next(iter((*added, *reversed(both))), None)


def _readings(one: SearchRound, cause: str, touches: TouchMeans) -> PlannedReadings:
    if cause == NOTHING:
        return planned_readings(one.before, touches)
    if cause == IN_PLACE:
        return planned_readings(one.before, touches, fit_correction(one.before))
    (tried,) = (each for each in one.tried if each.effect.name == cause)
    return planned_readings(_fitted(one, tried), touches)


def _fitted(one: SearchRound, tried: Tried) -> Fitted:
    if tried.fitted is not None:
        return tried.fitted
    return fit_with(tried.effect, one.before, lambda: tried.start, whitening=one.before.whitening).fitted
