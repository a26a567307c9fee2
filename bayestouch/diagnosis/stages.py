"""Models with the effects of the first rounds of a search alone, with and without a correction.

The search adds effects by touches that belong to the fit. An effect that it added may still read other touches worse
than the model before it did, and so may all effects together though the first of them help. Then a model with fewer
effects is better than none. Each round of the search has kept such a model.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

from bayestouch.diagnosis.comparison import ERRORS
from bayestouch.diagnosis.evaluation import ToEvaluate, both_evaluated
from bayestouch.diagnosis.harm import DENSITY, densities_as_worse, harmless, predicts_better, worse_quantities_of
from bayestouch.diagnosis.rounds import SearchRound
from bayestouch.diagnosis.traced import EvaluatedModel, Refused, Worse
from bayestouch.effects import Values
from bayestouch.model.added import AddedEffect, added_effects, moved_to
from bayestouch.model.correction import corrected_fit
from bayestouch.model.drift_posterior import settled_drifts
from bayestouch.model.fitting import Fitted
from bayestouch.model.held_out import HeldOut
from bayestouch.model.load_noise import with_load_noise_of


@dataclass(frozen=True, eq=False)
class EvaluatedStage:
    """A model with effects, with and without a correction.

    Attributes
    ----------
    plain : EvaluatedModel
        The model without a correction.
    corrected : EvaluatedModel or None
        The model with a correction; None if there is none, or if touches cannot be read with it.
    """

    plain: EvaluatedModel
    corrected: EvaluatedModel | None


@dataclass(frozen=True, eq=False)
class Stages:
    """Models after each round of a search.

    Attributes
    ----------
    rounds : tuple of SearchRound
        Rounds of the search, the last of which adds nothing.
    found : ToEvaluate
        Model with all effects.
    before : EvaluatedModel
        Model without effects.
    in_place : bool
        Whether corrections are asked for: the model with all effects leaves structure.
    """

    rounds: tuple[SearchRound, ...]
    found: ToEvaluate
    before: EvaluatedModel
    in_place: bool

    @property
    def last(self) -> int:
        """Number of rounds that added an effect."""
        return len(self.rounds) - 1

    def plain(self, n_rounds: int) -> ToEvaluate:
        """Model with the effects of the first rounds, with the noise of the loads that all effects leave."""
        if n_rounds == self.last:
            return self.found
        if n_rounds == 0:
            return replace(self.found, fitted=self.before.fitted, added=())
        fitted, spreads = settled_drifts(self.rounds[n_rounds].before)
        fitted = with_load_noise_of(self.found.fitted, fitted)
        return replace(self.found, fitted=fitted, added=effects_as_added(self.rounds[:n_rounds], fitted, spreads))

    def corrected(self, n_rounds: int, plain: ToEvaluate) -> ToEvaluate | None:
        """The model `plain` with a correction; None if none is asked for, or if the touches show none clearly."""
        one = self.rounds[n_rounds]
        if not (self.in_place and one.correction_gain > ERRORS * one.correction_se > 0):
            return None
        new = corrected_fit(plain.fitted)
        return new and replace(plain, fitted=new[0], added=moved_to(new[0], plain.added), correction=new[1])

    def evaluated(self, n_rounds: int) -> EvaluatedStage:
        """A stage before the last, with calibrations and errors. The model without effects has them already."""
        plain = self.plain(n_rounds)
        without, corrected = both_evaluated(plain if n_rounds else None, self.corrected(n_rounds, plain))
        return EvaluatedStage(without or self.before, usable(plain, corrected))


@dataclass(frozen=True, eq=False)
class Chosen:
    """The model that is returned.

    Attributes
    ----------
    model : EvaluatedModel
        The model.
    stage : EvaluatedStage
        The stage with the correction that is reported: that of the model, or else that with all effects.
    refused : tuple of Refused
        Models that come before it.
    """

    model: EvaluatedModel
    stage: EvaluatedStage
    refused: tuple[Refused, ...]


def choose(
    stages: Stages,
    whole: EvaluatedStage,
    at_stated: Callable[[], EvaluatedModel | None],
    used: int,
    *,
    believed: bool,
) -> Chosen:
    """The first model that reads no quantity worse than the model without effects, from that with most effects on.

    Parameters
    ----------
    stages : Stages
        Models with fewer effects.
    whole : EvaluatedStage
        Model with all effects.
    at_stated : callable
        Makes the model without those effects that move references.
    used : int
        As from `rounds_used`.
    believed : bool
        As in `harmless`, for models with all effects. With fewer, references are where the data set states them.
    """
    before, found = stages.before, whole.plain
    with_all = (lambda: whole.corrected, lambda: found, at_stated) if used == stages.last else ()
    model, refused = harmless(before, with_all, believed=believed)
    chosen = Chosen(model, whole, refused)
    if found is before:
        return chosen
    if model is before:
        chosen = _with_fewer(stages, used, chosen)
    elif model is found:
        chosen = _in_place_of_last(stages, chosen, stages.last)
    if all(each is not found for each in (chosen.model, *(one.model for one in chosen.refused))) and (
        chosen.model is not whole.corrected
    ):
        worse = worse_quantities_of(chosen.model, found, believed=believed) or densities_as_worse(chosen.model, found)
        chosen = replace(chosen, refused=(Refused(found, worse, believed), *chosen.refused))
    return chosen


def _with_fewer(stages: Stages, used: int, chosen: Chosen) -> Chosen:
    """The harmless model with most effects that predicts held-out touches clearly better than that without effects."""
    before, refused = stages.before, chosen.refused
    for n_rounds in reversed(range(min(used + 1, stages.last))):
        stage = stages.evaluated(n_rounds)
        better = [
            each
            for each in (stage.corrected, stage.plain)
            if each is not None and predicts_better(before.held_out, each.held_out)
        ]
        model, harmful = harmless(before, [partial(_itself, each) for each in better], believed=False)
        refused = (*refused, *harmful)
        if model is stage.corrected:
            return Chosen(model, stage, refused)
        if model is not before:
            return _in_place_of_last(stages, replace(chosen, model=model, refused=refused), n_rounds)
    return replace(chosen, refused=refused)


def _in_place_of_last(stages: Stages, chosen: Chosen, n_rounds: int) -> Chosen:
    """The model with a correction in place of the effect of the last of these rounds, if it reads touches better.

    Where structure of place is left, this effect may be a bad substitute for functions of place. How well touches are
    read decides, where they were: the map of a pad with a correction is not that of its predictions.
    """
    found, fewer = chosen.model, n_rounds - 1
    plain = stages.plain(fewer)
    corrected = stages.corrected(fewer, plain)
    model = None if corrected is None else usable(plain, corrected.evaluated())
    if model is None or worse_quantities_of(stages.before, model, believed=False):
        return chosen
    if _read_worse(found, model) or not _read_worse(model, found):
        return chosen
    without = plain.evaluated() if fewer else stages.before
    return replace(chosen, model=model, stage=EvaluatedStage(without, model))


def _read_worse(one: EvaluatedModel, other: EvaluatedModel) -> tuple[Worse, ...]:
    """What the other model reads worse; the predictions of readings count if no touches were read."""
    worse = worse_quantities_of(one, other, believed=False)
    return worse if other.read is None else tuple(each for each in worse if each.key != DENSITY)


def _itself(model: EvaluatedModel) -> EvaluatedModel:
    return model


def usable(model: ToEvaluate, corrected: EvaluatedModel | None) -> EvaluatedModel | None:
    """A model with a correction, if its calibration reads touches with it: else its errors are not those of touches."""
    used = corrected is not None and model.evaluation.uses_correction(corrected.calibration)
    return corrected if used else None


def effects_as_added(
    rounds: tuple[SearchRound, ...], fitted: Fitted, spreads: Mapping[str, Values]
) -> tuple[AddedEffect, ...]:
    """Effects of the last model, in the order in which they were added; drifts with their standard deviations."""
    chosen = [each.added for each in rounds if each.added is not None]
    # The last effect of the noise that was added changed the values of those before it.
    noise = next((each.found_noise for each in reversed(chosen) if each.found_noise), ())
    by_name = {each.effect.name: each for each in added_effects(fitted, noise, spreads)}
    return tuple(by_name[each.effect.name] for each in chosen if each.effect.name in by_name)


def rounds_used(steps: Sequence[HeldOut]) -> int:
    """Number of rounds whose effects are used: no model with fewer predicts the held-out touches clearly better.

    Parameters
    ----------
    steps : sequence of HeldOut
        Held-out residuals without effects, and with those of one round after the other.
    """
    used = len(steps) - 1
    for fewer in reversed(range(used)):
        if predicts_better(steps[used], steps[fewer]):
            used = fewer
    return used
