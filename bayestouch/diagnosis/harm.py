"""Choice of the calibration that is returned: none that reads touches worse than the calibration without effects."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.diagnosis.comparison import is_clear
from bayestouch.diagnosis.rounds import SearchRound
from bayestouch.diagnosis.shared_drift import LOAD_ALONE, blocks_of_drift, by_block
from bayestouch.diagnosis.traced import EvaluatedModel, Refused, Worse
from bayestouch.diagnosis.verdict import Remaining
from bayestouch.model.as_stated import moves_reference
from bayestouch.model.held_out import HeldOut
from bayestouch.model.touch_errors import TouchReading, summarised

# A quantity is read worse if its mean squared error is larger by more than so many standard errors.
STANDARD_ERRORS = 2.0
# The same for touches with other tips than edges alone, and for the ranks of differences (Wilcoxon's test) in place of
# their mean. There are some ten of these comparisons, so that about one model in a hundred that reads nothing worse
# would be refused by chance.
CLEARLY = 3.0
# Fewer touches with other tips are not compared alone.
LEAST_TOUCHES = 8
#: Key of the log predictive density of the readings of held-out touches.
DENSITY = "log_density"


def harmless(
    before: EvaluatedModel, models: Iterable[Callable[[], EvaluatedModel | None]], *, believed: bool
) -> tuple[EvaluatedModel, tuple[Refused, ...]]:
    """The first of the models that reads no quantity worse than `before`, which is returned if there is none.

    Parameters
    ----------
    before : EvaluatedModel
        Model without effects.
    models : iterable of callable
        Functions that make the models, best first; a function may give None.
    believed : bool
        Whether references are where the models say; else they are where the data set states them.

    Returns
    -------
    (EvaluatedModel, tuple of Refused)
        The model, and those that come before it.
    """
    refused: list[Refused] = []
    for make in models:
        model = make()
        if model is None:
            continue
        worse = worse_quantities_of(before, model, believed=believed)
        if not worse:
            return model, tuple(refused)
        refused.append(Refused(model, worse, believed))
    return before, tuple(refused)


def worse_quantities_of(before: EvaluatedModel, after: EvaluatedModel, *, believed: bool) -> tuple[Worse, ...]:
    """Quantities of which the squared error of held-out touches is larger after than before, touch by touch.

    These are R, location and load, as far as touches were read, and the log predictive density of readings. On a finger
    touches with other tips than edges are also compared alone: what a correction learns from edges that are not where
    they seem to be is wrong for all other tips. Edges are not: a damaged edge has another R than the data set states.
    """
    out = []
    if before.read is not None and after.read is not None:
        one, two = before.read.by_touch, _of_references(after.read, believed)
        blocks = blocks_of_drift(after)
        for key in (key for key in one if "rms" in key):
            for name, kind, limit in _kinds(before.read, len(one[key])):
                first, last = one[key][kind], two[key][kind]
                change = last**2 - first**2
                if blocks is not None and key == LOAD_ALONE:
                    change = by_block(change, blocks[kind])
                if _larger(change, limit):
                    out.append(Worse(key, summarised(key, first), summarised(key, last), name))
                    break
    if before.held_out is not None and after.held_out is not None:
        first_density, last_density = _densities(before.held_out, after.held_out)
        if _larger(first_density - last_density):
            out += densities_as_worse(before, after)
    return tuple(out)


def densities_as_worse(before: EvaluatedModel, after: EvaluatedModel) -> tuple[Worse, ...]:
    """The mean log densities of held-out touches, whichever is larger; empty if no touches were held out."""
    if before.held_out is None or after.held_out is None:
        return ()
    first, last = _densities(before.held_out, after.held_out)
    return (Worse(DENSITY, float(first.mean()), float(last.mean())),)


def predicts_better(before: HeldOut | None, after: HeldOut | None) -> bool:
    """Whether the second model predicts the readings of held-out touches clearly better (`ERRORS` standard errors)."""
    if before is None or after is None:
        return False
    first, last = _densities(before, after)
    return is_clear(last - first)


def references_believed(rounds: tuple[SearchRound, ...], remaining: Remaining, names: Iterable[str]) -> bool:
    """Whether the data show that references have the errors that the effects `names` of a search describe.

    They do if these effects, with the others that were found, explain held-out readings within the noise, and no other
    effect would do so as well.
    """
    found = set(names)
    clear = all(not each.added.indistinguishable for each in rounds if each.added and each.added.effect.name in found)
    return clear and not remaining.after.there


def moving_effects(model: EvaluatedModel) -> tuple[str, ...]:
    """Names of the effects of a model that say that references are off."""
    chain = model.fitted.model
    return tuple(each.name for each in chain.effects if moves_reference(each, chain.reference_stages))


def _of_references(read: TouchReading, believed: bool) -> Mapping[str, FloatArray]:
    return read.by_touch_corrected if believed else read.by_touch


def _densities(one: HeldOut, two: HeldOut) -> tuple[FloatArray, FloatArray]:
    """Densities of the touches of which both models have the same readings: a model may leave out wrong ones."""
    same = (one.present == two.present).all(axis=1)
    return one.log_density[same], two.log_density[same]


def _kinds(read: TouchReading, n_touches: int) -> Iterator[tuple[str, BoolArray, float]]:
    """All touches, and those with other tips than edges: name, mask, and limit in standard errors."""
    yield "", np.ones(n_touches, dtype=bool), STANDARD_ERRORS
    if read.with_edge is not None and 0 < read.with_edge.sum() <= n_touches - LEAST_TOUCHES:
        yield "with other tips", ~read.with_edge, CLEARLY


def _larger(difference: FloatArray, standard_errors: float = STANDARD_ERRORS) -> bool:
    """True if differences, one a touch, have a mean that is clearly above zero.

    It is beyond so many standard errors, or it is above zero and so are nearly all differences: of squared errors a few
    are often much larger than the others, so that the standard error hides what the others show.
    """
    known = difference[np.isfinite(difference)]
    if len(known) < 2 or not known.mean() > 0:
        return False
    if known.mean() > standard_errors * known.std(ddof=1) / np.sqrt(len(known)):
        return True
    from scipy.stats import norm, wilcoxon

    return bool(wilcoxon(known, alternative="greater").pvalue < norm.sf(CLEARLY))
