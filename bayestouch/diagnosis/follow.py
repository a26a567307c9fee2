"""Course of a diagnosis on any body: fit, search, models before and after, remaining misfit."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

from bayestouch.data.dataset import DataSet
from bayestouch.diagnosis.evaluation import ToEvaluate, both_evaluated
from bayestouch.diagnosis.harm import moving_effects, references_believed
from bayestouch.diagnosis.measure import advice
from bayestouch.diagnosis.rounds import SearchRound
from bayestouch.diagnosis.search import search
from bayestouch.diagnosis.stages import EvaluatedStage, Stages, choose, effects_as_added, rounds_used, usable
from bayestouch.diagnosis.traced import EvaluatedModel, Traced
from bayestouch.diagnosis.verdict import Remaining, lack_of_fit
from bayestouch.model.added import moved_to
from bayestouch.model.beginning import Evaluation
from bayestouch.model.body import Body
from bayestouch.model.drift_posterior import settled_drifts
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
    steps = _steps(rounds, begun.evaluation, before.held_out, explaining.held_out)
    used = rounds_used(steps) if steps else len(rounds) - 1
    stages = Stages(rounds, replace(explaining, fitted=final), before, in_place=remaining.after.there)
    # A correction is of no use for a model that is not returned.
    with_correction = stages.corrected(stages.last, stages.found) if used == stages.last else None
    with_found, corrected = both_evaluated(with_effects, with_correction)
    explained = with_found or before
    chosen = choose(
        stages,
        EvaluatedStage(explained, usable(explaining, corrected)),
        lambda: _at_stated(explained, explaining),
        used,
        believed=references_believed(rounds, remaining, moving_effects(explained)),
    )
    compared(1.0)
    return Traced(
        data=data,
        rounds=rounds,
        steps=steps,
        added=added,
        before=before,
        explained=explained,
        uncorrected=chosen.stage.plain,
        corrected=chosen.stage.corrected,
        remaining=remaining,
        after=chosen.model,
        refused=chosen.refused,
        advice=advice(rounds),
    )


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


def _steps(
    rounds: tuple[SearchRound, ...], evaluation: Evaluation, before: HeldOut | None, explained: HeldOut | None
) -> tuple[HeldOut, ...]:
    """Held-out residuals at the beginning of each round; empty if no touches could be held out."""
    between = [evaluation.held_out(each.before, None) for each in rounds[1:-1]]
    steps = (before, *between, explained)[: len(rounds)]
    return tuple(each for each in steps if each is not None)
