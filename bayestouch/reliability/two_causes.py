"""Planned touches as two causes predict them, each fitted to the touches of a diagnosis."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from bayestouch.data.averages import TouchMeans
from bayestouch.diagnosis.causes import NOTHING
from bayestouch.diagnosis.outcome import LEAST_PROBABILITY
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
from bayestouch.output.text import listed


@dataclass(frozen=True, eq=False)
class TwoCauses:
    """Which of two causes is right, beside those that a round of the search begins with.

    Attributes
    ----------
    title : str
        What is compared, with ``or`` between.
    causes : (str, str)
        The causes in which the two models differ.
    found : SearchRound
        The round that tried both.
    """

    title: str
    causes: tuple[str, str]
    found: SearchRound

    @classmethod
    def named(cls, diagnosis: Diagnosis, causes: tuple[str, str]) -> TwoCauses:
        """Question about two causes by their names.

        Raises
        ------
        InputError
            The causes are equal, were not tried in one round of the search, or are found in the scatter of samples
            only.
        """
        for each in causes:
            _check(diagnosis, each)
        if causes[0] == causes[1]:
            raise InputError(f"about: expected two different causes, got {causes[0]} twice")
        found = _round_of(diagnosis, causes)
        if found is None:
            raise InputError(f"about: no round of the search tried both {causes[0]} and {causes[1]}")
        return cls(" or ".join(causes), causes, found)

    @classmethod
    def probable(cls, diagnosis: Diagnosis) -> TwoCauses:
        """Question about the most probable set of causes, and the next one that differs from it by one cause.

        If one of these sets has a cause more than the other, this cause is compared with ``nothing``. Sets with a cause
        that was not tried have no model, and are left out; so are improbable ones, since they are no question.

        Raises
        ------
        InputError
            There are no two such sets.
        """
        rounds = diagnosis.traced.rounds
        tried = {NOTHING, IN_PLACE, *(each.effect.name for one in rounds for each in one.tried)}
        probable = [names for names, share in diagnosis.causes.items() if share >= LEAST_PROBABILITY]
        first, *others = [names for names in probable if tried.issuperset(names)] or [()]
        for other in others:
            common = {*first} & {*other}
            one, two = ([each for each in names if each not in common] or [NOTHING] for names in (first, other))
            found = [each for each in rounds if {*each.before.names} == common and {*one, *two} <= {*_names(each)}]
            if len(one) == len(two) == 1 and found:
                between = " or " if len(first) == len(other) == 1 else ", or "
                title = between.join(listed(list(each)) for each in (first, other))
                return cls(title, (one[0], two[0]), found[0])
        if first and not others:
            raise InputError(
                f"about: the causes that were tried are settled: the probability of {listed(list(first))} is "
                f"{100 * diagnosis.causes[first]:.0f} %, that of every other one less than "
                f"{100 * LEAST_PROBABILITY:.0f} %; name two causes to compare them all the same"
            )
        raise InputError("about: the diagnosis has no two causes to compare; name two")

    def models(self, touches: TouchMeans) -> list[PlannedReadings]:
        """The touches by the model with each cause, besides what was found before in the search."""
        return [_readings(self.found, each, touches) for each in self.causes]


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
