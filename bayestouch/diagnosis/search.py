"""Search for missing effects: one round after the other adds the best, and other beginnings are tried."""

from __future__ import annotations

from dataclasses import replace

from bayestouch.diagnosis.choice import indistinguishable_from
from bayestouch.diagnosis.comparison import ERRORS, density, density_of_readings, paired
from bayestouch.diagnosis.one_round import is_small, one_round, smallest_gain
from bayestouch.diagnosis.place_or_time import still_drift
from bayestouch.diagnosis.rounds import SearchRound, with_undecided_drift
from bayestouch.effects.effect import Effect
from bayestouch.model.fitting import Fitted
from bayestouch.model.joining import fit_without
from bayestouch.model.peaks import settled
from bayestouch.model.predictive import gained
from bayestouch.output.progress import Progress, staged

# Largest number of rounds that add an effect.
MOST_EFFECTS = 4
# An effect explains this share, together with the effects found after it. A cause that is not in the catalogue can make
# a similar effect appear to explain half of it.
TOGETHER = 0.75
# The same for a random function of time, whose values between touches are not known: a lower limit.
TOGETHER_RANDOM = 0.6
# Number of other effects that are tried as the first one if the best one does not lead to a model within the noise.
OTHER_STARTS = 2


def search(
    fitted: Fitted, effects: tuple[Effect, ...], progress: Progress | None = None, scheduler: str | None = None
) -> tuple[SearchRound, ...]:
    """Rounds of the search, the last of which adds nothing; candidates are refitted by the cluster at `scheduler`.

    If there are two causes, a third effect that is similar to both can appear to explain both. Therefore, if the best
    first effect does not lead to a model within the noise, other beginnings are tried: from the last round with a drift
    that functions of place only perhaps replace, and with other real effects as the first one. The first of them is
    taken that leads to a model within the noise, whose rounds are all retained, and in which that drift is one.
    """
    rounds = _greedy(one_round(fitted, effects, _part(progress, 0), scheduler), effects, progress, scheduler)
    found = _retained(rounds, effects, scheduler)
    # If time is place, a drift could follow everything, so it is not tried as another first effect.
    if rounds[0].added is not None and not fitted.model.time_is_place and not _within_noise(found):
        done = len(rounds)
        undecided = map(_with_rivals, with_undecided_drift(found[-1]))
        starts = [*((found[:-1], each) for each in undecided), *(((), each) for each in _other_firsts(rounds[0]))]
        for number, (kept, begun) in enumerate(starts, start=2):
            dropped = {name for each in kept for name in each.dropped}
            left = tuple(each for each in effects if each.name not in dropped)
            again = (*kept, *_greedy(begun, left, progress, scheduler, done, f"start {number}", len(kept)))
            done += len(again)
            drift = begun.added is None or still_drift(begun.added.effect, again[-1].before)
            if drift and _count_retained(again) == len(again) - 1 and _within_noise(again):
                return (replace(again[0], real=()), *again[1:])
    return (replace(found[0], real=()), *found[1:])


def _other_firsts(first: SearchRound) -> list[SearchRound]:
    """The first round with other real effects added."""
    others = [each for each in first.real if first.added and each.effect.name != first.added.effect.name][:OTHER_STARTS]
    return [_with_rivals(replace(first, added=other, dropped=())) for other in others]


def _with_rivals(begun: SearchRound) -> SearchRound:
    """A round with the candidates that cannot be distinguished from the effect that it adds, and their fits."""
    assert begun.added is not None
    rivals = indistinguishable_from(begun.added, begun.tried)
    fits = {each.effect.name: each.fitted for each in begun.real}
    tried = (replace(each, fitted=fits.get(each.effect.name, each.fitted)) for each in begun.tried)
    return replace(begun, tried=tuple(tried), added=replace(begun.added, indistinguishable=rivals))


def _within_noise(rounds: tuple[SearchRound, ...]) -> bool:
    """True if the model of the last round leaves no relevant misfit."""
    return is_small(rounds[-1].before)


def _retained(
    rounds: tuple[SearchRound, ...], effects: tuple[Effect, ...], scheduler: str | None
) -> tuple[SearchRound, ...]:
    """Rounds whose effects are retained, and one that adds nothing."""
    kept = _count_retained(rounds)
    if kept == len(rounds) - 1:
        return rounds
    # Remove the first round that is not retained, and all after it; try their effects that show by themselves again.
    removed = rounds[kept]
    by_themselves = {
        each.added.effect.name for each in rounds[kept:] if each.added is not None and each.added.by_itself
    }
    if not by_themselves:
        return (*rounds[:kept], replace(removed, added=None, dropped=()))
    left = tuple(each for each in effects if each.name in by_themselves)
    first = one_round(removed.before, left, _part(None, 0), scheduler)
    again = _greedy(first, left, None, scheduler, earlier=kept)
    others = tuple(each for each in removed.tried if each.effect.name not in by_themselves)
    return (*rounds[:kept], replace(again[0], real=(), tried=(*again[0].tried, *others)), *again[1:])


def _greedy(
    first: SearchRound,
    effects: tuple[Effect, ...],
    progress: Progress | None,
    scheduler: str | None,
    done: int = 0,
    start: str = "",
    earlier: int = 0,
) -> tuple[SearchRound, ...]:
    """All rounds: the first, and further ones until one adds nothing.

    `done` rounds belong to other starts; `earlier` rounds of this one have added an effect before the first.
    """
    rounds: list[SearchRound] = []
    current = first if earlier < MOST_EFFECTS else replace(first, added=None)
    while current.added is not None and current.added.fitted is not None:
        fitted, dropped = _needed(_settled(current.added.fitted), current)
        effects = tuple(each for each in effects if each.name not in dropped)
        rounds.append(replace(current, dropped=dropped))
        current = replace(one_round(fitted, effects, _part(progress, len(rounds), done, start), scheduler), real=())
        if earlier + len(rounds) == MOST_EFFECTS:
            current = replace(current, added=None)
    return (*rounds, current)


def _settled(fitted: Fitted) -> Fitted:
    """The model with its own peaks and noise, or as it is if this predicts held-out touches clearly better.

    Peaks and limits in shares of them may move together for long, away from what the readings show.
    """
    found = settled(fitted)
    gain, error = paired(density_of_readings(found) - density_of_readings(fitted))
    return fitted if gain < -ERRORS * error else found


def _part(progress: Progress | None, number: int, before: int = 0, start: str = "") -> Progress:
    """Progress of a round of a start. The number of rounds is not known, so each takes a smaller part of the rest."""
    done = number + before
    first, last = done / (done + 1), (done + 1) / (done + 2)
    name = ", ".join(filter(None, (start, f"round {number + 1}")))
    return staged(progress, first, last, name) or (lambda share: None)


def _count_retained(rounds: tuple[SearchRound, ...]) -> int:
    """Number of rounds to retain: the effect of each explains, with the retained ones after it, most of the misfit."""
    kept = sum(each.added is not None for each in rounds)
    while True:
        not_retained = [k for k in range(kept) if not _is_retained(rounds[k:kept])]
        if not not_retained:
            return kept
        kept = not_retained[-1]


def _is_retained(rounds: tuple[SearchRound, ...]) -> bool:
    """True if the effect of the first round is probable, or with those of the others explains enough of the misfit."""
    added = [each.added for each in rounds if each.added is not None]
    if added[0].effect.name == rounds[0].probable:
        return True
    explained = sum(each.of_means for each in added if not each.by_itself)
    required = TOGETHER_RANDOM if added[0].effect.random else TOGETHER
    return added[0].by_itself or explained >= required * rounds[0].possible


def _needed(fitted: Fitted, last: SearchRound) -> tuple[Fitted, tuple[str, ...]]:
    """Model without earlier effects that the new effect makes unnecessary, and the names of these effects."""
    dropped: list[str] = []
    earlier: list[Effect] = [drift for drift, _ in last.before.drifts]
    if last.added is None or not last.added.effect.random:
        # A random function of time can imitate a cause, so it cannot make a cause unnecessary.
        earlier = [*last.before.model.effects, *earlier]
    for effect in earlier:
        less = fit_without(effect, fitted)
        gain, error = paired(gained(density(fitted) - density(less)))
        if gain < ERRORS * error or gain < smallest_gain(fitted):
            fitted = less
            dropped.append(effect.name)
    return fitted, tuple(dropped)
