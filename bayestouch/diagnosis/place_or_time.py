"""Whether a drift or functions of place explain a misfit: both predict touches across times and across places.

Touches are held out in blocks of time, and in blocks of places with whatever was touched there at any time. A drift
does not know a time that was held out, functions of place do not know a place. Each is named only if it predicts better
in one way and not worse in the other; if neither does, the order of the touches does not distinguish them.

Functions of place count for nothing unless they lower the squared error of touches that are held out across times.
Where the misfit changes from touch to touch, as with places that are wrong at random, they are uncertain by as much as
the misfit, and this alone increases the log density, while their mean predicts worse than the model without them. So is
a drift: one that lowers the squared error in neither way says that single touches have errors, and nothing of time.

In a scan the touches before are those of the places beside, so that an effect of earlier touches can follow errors that
belong to a place. Where functions of place predict better in one way and not worse in the other, it stays only if it is
better also beside them. Where they do not, it stays: unlike a drift it follows a formula, and cannot follow everything.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.diagnosis.blocks import FOLDS, place_blocks, time_blocks
from bayestouch.effects.effect import Effect
from bayestouch.model.correction import fit_correction
from bayestouch.model.fitting import Fitted
from bayestouch.model.joining import fit_without
from bayestouch.model.linear import Linearised
from bayestouch.model.predictive import gained, held_out_density

#: Name of functions of place in results, next to the names of effects.
IN_PLACE = "something in place"
# Standard errors of a difference of held-out density beyond which one of two explanations is better.
BETTER = 2.0

#: Difference of held-out log density and its standard error.
Difference = tuple[float, float]
#: Log density of each touch held out with its block, (t,), by what is held out: ``times`` and perhaps ``places``.
Densities = Mapping[str, FloatArray]
#: The same in its parts, (t, 3), as `bayestouch.model.predictive.held_out_density` gives them.
Parts = Mapping[str, FloatArray]


@dataclass(frozen=True)
class PlaceOrTime:
    """A drift, or an effect of earlier touches, against functions of place, fitted to the same touches.

    Attributes
    ----------
    drift : str
        Name of the drift or effect.
    across : mapping of str to (float, float)
        Log density of held-out touches by the drift minus that by functions of place, and its standard error over
        blocks; by what was held out, ``times`` and ``places``. Where the touches have too few places, only ``times``.
    """

    drift: str
    across: dict[str, Difference]

    @property
    def standardised(self) -> FloatArray:
        """Each difference in units of its standard error."""
        return _standardised(self.across)

    @property
    def is_drift(self) -> bool:
        """True if the drift predicts better in one way and not worse in any."""
        return _is_better(self.standardised)

    @property
    def is_place(self) -> bool:
        """True if functions of place predict better in one way and not worse in any."""
        return _is_better(-self.standardised)

    @property
    def undecided(self) -> bool:
        """True if these data do not distinguish the two."""
        return not (self.is_drift or self.is_place)

    @property
    def probability_of_drift(self) -> dict[str, float]:
        """Probability that the drift predicts further touches better, by what is held out."""
        return {name: float(ndtr(z)) for name, z in zip(self.across, self.standardised, strict=True)}


def place_or_time(fitted: Fitted, drifts: Mapping[str, Densities], places: Densities | None) -> tuple[PlaceOrTime, ...]:
    """Drifts by name, each added to a model, against functions of place added to the same model; none without these."""
    if places is None or not drifts:
        return ()
    blocks = blocks_of(fitted)
    return tuple(PlaceOrTime(name, differences(drift, places, blocks)) for name, drift in drifts.items())


def is_better_beside(fitted: Fitted, places: Densities) -> bool:
    """True if a model with an effect and functions of place predicts better than these without the effect."""
    blocks, correction = blocks_of(fitted), fit_correction(fitted)
    if correction is None:
        return True
    return _is_better(_standardised(differences(densities_of_held_out(correction.linear, blocks), places, blocks)))


def still_drift(effect: Effect, fitted: Fitted) -> bool:
    """True if a drift of a model is not replaced by functions of place, or if it is not in the model any more."""
    if effect.name not in {drift.name for drift, _ in fitted.drifts}:
        return True
    less = fit_without(effect, fitted)
    blocks, correction = blocks_of(less), fit_correction(less)
    if correction is None:
        return True
    places = parts_of_held_out(correction.linear, blocks)
    if not lowers_errors(held_out_density(less.linear, blocks["times"] % FOLDS), places["times"]):
        return True
    drift = densities_of_held_out(fitted.linear, blocks)
    return all(each.is_drift for each in place_or_time(less, {effect.name: drift}, densities(places)))


def lowers_errors(model: FloatArray, functions: FloatArray) -> bool:
    """True if functions of place, or of time, lower the squared error of held-out touches.

    Parameters
    ----------
    model, functions : (t, 3) array
        Result of `bayestouch.model.predictive.held_out_density`, by a model without and with them.
    """
    return bool(functions[:, 2].sum() > model[:, 2].sum())


def in_place(fitted: Fitted, model: Densities | None, places: Densities | None) -> dict[str, Difference] | None:
    """What functions of place gain over the model without them, as in `PlaceOrTime`; None unless they are certain."""
    if model is None or places is None:
        return None
    gained = differences(places, model, blocks_of(fitted))
    return gained if _is_better(_standardised(gained)) else None


def _standardised(differences: Mapping[str, Difference]) -> FloatArray:
    return np.array([gain / max(error, 1e-300) for gain, error in differences.values()])


def _is_better(standardised: FloatArray) -> bool:
    """True if differences are above zero in one way and not below in any."""
    return bool((standardised > BETTER).any() and (standardised > -BETTER).all())


def blocks_of(fitted: Fitted) -> dict[str, IntArray]:
    """Block of each touch, (t,), by what is held out: ``times`` and, if the touches have enough places, ``places``."""
    of_places = place_blocks(fitted)
    return {"times": time_blocks(fitted), **({} if of_places is None else {"places": of_places})}


def parts_of_held_out(model: Linearised, blocks: Mapping[str, IntArray]) -> Parts:
    """Parts of the log density of each touch held out with its block, (t, 3), by what is held out."""
    return {kind: held_out_density(model, block % FOLDS) for kind, block in blocks.items()}


def densities(parts: Parts) -> Densities:
    """Log density of each touch, (t,), by what is held out."""
    return {kind: gained(each) for kind, each in parts.items()}


def densities_of_held_out(model: Linearised, blocks: Mapping[str, IntArray]) -> Densities:
    """Log density of each touch held out with its block, (t,), by what is held out."""
    return densities(parts_of_held_out(model, blocks))


def differences(one: Densities, other: Densities, blocks: Mapping[str, IntArray]) -> dict[str, Difference]:
    """`over_blocks` of the densities by one model minus those by another, by what is held out."""
    return {kind: over_blocks(one[kind] - other[kind], block) for kind, block in blocks.items()}


def sums_of_blocks(gains: Iterable[FloatArray], block: IntArray) -> FloatArray:
    """Sums of the gains of touches, each (t,), over the touches of each block, (k, b)."""
    inside = np.unique(block, return_inverse=True)[1]
    return np.array([np.bincount(inside, weights=each) for each in gains])


def over_blocks(difference: FloatArray, block: IntArray) -> Difference:
    """Sum over touches (t,) and its standard error over blocks: touches of a block are not independent."""
    (sums,) = sums_of_blocks([difference], block)
    return float(sums.sum()), float(np.sqrt(len(sums)) * sums.std(ddof=1)) if len(sums) > 1 else float("inf")
