"""Course of a diagnosis on any body: fit, search, models before and after, remaining misfit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from bayestouch.data.dataset import DataSet
from bayestouch.diagnosis.comparison import ERRORS
from bayestouch.diagnosis.evaluation import ToEvaluate, both_evaluated
from bayestouch.diagnosis.harm import harmless, moving_effects, references_believed
from bayestouch.diagnosis.measure import advice
from bayestouch.diagnosis.rounds import SearchRound
from bayestouch.diagnosis.search import search
from bayestouch.diagnosis.traced import EvaluatedModel, Traced
from bayestouch.diagnosis.verdict import Remaining, lack_of_fit
from bayestouch.effects import Values
from bayestouch.model.added import AddedEffect, added_effects, moved_to
from bayestouch.model.beginning import Evaluation
from bayestouch.model.body import Body
from bayestouch.model.correction import corrected_fit
from bayestouch.model.drift_posterior import settled_drifts
from bayestouch.model.fitting import Fitted
from bayestouch.model.held_out import HeldOut
from bayestouch.model.joining import fit_without
from bayestouch.model.load_noise import with_load_noise_of
from bayestouch.model.rest_errors import begun_with_rest
from bayestouch.model.split_data import SplitData
from bayestouch.output.progress import Progress, staged
from bayestouch.parallel.beside import both

# Fractions of the time at the end of the first fit, and of the search.
START, SEARCHED = 0.1, 0.75


def trace(
    dataset: DataSet,
    body: Body,
    *,
    draws: int,
    sample: bool,
    seed: int,
    progress: Progress | None,
    scheduler: str | None,
    fold: int = 2,
    **options: Any,
) -> Traced:
    """Results of fit, search, and comparison of the models before and after; see `bayestouch.diagnose`.

    Parameters
    ----------
    dataset : DataSet
        Sensor and touches.
    body : Body
        Body of the sensor.
    draws, sample, seed, progress, scheduler
        As in `bayestouch.diagnose`.
    fold
        As in `SplitData.of`.
    options
        Options of this body.
    """
    data = SplitData.of(dataset, fold).thinned(body.most_touches, seed)
    staged(progress, 0.0, START, "fit")
    data, begun = begun_with_rest(body, data, draws=draws, seed=seed, **options)
    fitted = begun.fitted
    without = ToEvaluate(begun.evaluation, sample, fitted)
    searching = staged(progress, START, SEARCHED, "search")
    rounds, found = both(partial(search, fitted, begun.effects, searching, scheduler), without.posteriors)
    compared = staged(progress, SEARCHED, 1.0, "compare before and after") or (lambda fraction: None)
    last = rounds[-1]
    final, spreads = settled_drifts(last.before)
    added = effects_as_added(rounds, final, spreads)
    # One yardstick: what counts as noise of the loads is the same before and after.
    fitted = with_load_noise_of(final, fitted)
    before = replace(without, fitted=fitted).with_posteriors(found)
    with_effects = replace(without, fitted=final, added=added) if added else None
    explaining = with_effects or without
    remaining = Remaining(before=lack_of_fit(fitted, before.held_out), after=lack_of_fit(final, explaining.held_out))
    in_place = remaining.after.there and last.correction_gain > ERRORS * last.correction_se > 0
    with_correction = _corrected(replace(explaining, fitted=final)) if in_place else None
    with_found, corrected = both_evaluated(with_effects, with_correction)
    # The errors of a model with a correction are not those of a calibration that reads touches without it.
    if corrected is not None and not begun.evaluation.uses_correction(corrected.calibration):
        corrected = None
    explained = with_found or before
    after, refused = harmless(
        before,
        (lambda: corrected, lambda: explained, lambda: _at_stated(explained, explaining)),
        believed=references_believed(rounds, remaining, moving_effects(explained)),
    )
    compared(1.0)
    return Traced(
        data=data,
        rounds=rounds,
        steps=_steps(rounds, begun.evaluation, before, explained),
        added=added,
        before=before,
        explained=explained,
        corrected=corrected,
        remaining=remaining,
        after=after,
        refused=refused,
        advice=advice(rounds),
    )


def _corrected(model: ToEvaluate) -> ToEvaluate | None:
    """The model with a correction; None if no correction is found."""
    new = corrected_fit(model.fitted)
    return new and replace(model, fitted=new[0], added=moved_to(new[0], model.added), correction=new[1])


def _at_stated(explained: EvaluatedModel, model: ToEvaluate) -> EvaluatedModel | None:
    """Model fitted again without the effects that move references; None if none of these or nothing else was found."""
    moving = moving_effects(explained)
    kept = tuple(each for each in model.added if each.effect.name not in moving)
    if not moving or not kept:
        return None
    fitted = explained.fitted
    for each in model.added:
        if each.effect.name in moving:
            fitted = fit_without(each.effect, fitted)
    return replace(model, fitted=fitted, added=moved_to(fitted, kept)).evaluated()


def effects_as_added(
    rounds: tuple[SearchRound, ...], fitted: Fitted, spreads: Mapping[str, Values]
) -> tuple[AddedEffect, ...]:
    """Effects of the last model, in the order in which they were added; drifts with their standard deviations."""
    chosen = [each.added for each in rounds if each.added is not None]
    noise = tuple((n.effect, n.values, n.sd) for n in (each.found_noise for each in chosen) if n is not None)
    by_name = {
        each.effect.name: replace(each, sd=spreads.get(each.effect.name, each.sd))
        for each in added_effects(fitted, noise)
    }
    return tuple(by_name[each.effect.name] for each in chosen if each.effect.name in by_name)


def _steps(
    rounds: tuple[SearchRound, ...], evaluation: Evaluation, before: EvaluatedModel, explained: EvaluatedModel
) -> tuple[HeldOut, ...]:
    """Held-out residuals at the beginning of each round; empty if no touches could be held out."""
    between = [evaluation.held_out(each.before, None) for each in rounds[1:-1]]
    steps = (before.held_out, *between, explained.held_out)[: len(rounds)]
    return tuple(each for each in steps if each is not None)
