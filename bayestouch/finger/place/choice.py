"""Choice of the functions of place of a finger: those that predict held-out places best, or none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.finger.fit import FingerFit
from bayestouch.finger.place.evidence import (
    OWN_LENGTHS,
    SURFACE_LENGTHS,
    TIME_LENGTHS,
    Scored,
    with_own,
    with_surface,
    without_functions,
)
from bayestouch.finger.place.functions import (
    MAP,
    PLACE,
    PlaceFunctions,
    by_curvature,
    felt_modes,
    fourier,
    per_weight,
    process_modes,
)
from bayestouch.finger.place.linear import LinearElement, LinearPosterior, linear_elements

# Largest and smallest number of groups of neighbouring places that are held out, and smallest number of places in each;
# with fewer places than that, no choice is made.
MOST_FOLDS, LEAST_FOLDS, PLACES_A_FOLD = 24, 6, 3
LEAST_PLACES = LEAST_FOLDS * PLACES_A_FOLD
# Functions are tried on held-out places only if they increase the log marginal likelihood by more than LEAST_GAIN.
# Own functions together with a surface are chosen only if they are better than one of them by more than so many
# standard errors of the difference; so are functions instead of none.
LEAST_GAIN, STANDARD_ERRORS = 3.0, 2.0


@dataclass(frozen=True)
class Choice:
    """Functions of place that were chosen, with the reason.

    Attributes
    ----------
    functions : PlaceFunctions
        The functions.
    gain, gain_sd : float
        Increase of the log density of held-out places over that with errors which are independent from touch to
        touch, and its standard error.
    """

    functions: PlaceFunctions
    gain: float
    gain_sd: float

    @property
    def note(self) -> str:
        """The choice and its reason, for the notes of a calibration."""
        parts = []
        own, surface = self.functions.own, self.functions.surface
        if own is not None:
            where = "its E map" if self.functions.kind == MAP else "its readings"
            parts.append(f"each element differs from the model in {where}, by {100 * own.sd:.2g} % of the peak")
        if surface is not None:
            parts.append(f"the curvature of the surface varies by {100 * surface.sd:.2g} %")
        return (
            f"Discrepancy as a function of place: {' and '.join(parts)}. It predicts held-out places better than "
            f"errors that are independent from touch to touch do (log density {self.gain:+z.0f} ± {self.gain_sd:.0f})."
        )


def choose_functions(fit: FingerFit, *, wanted: bool = False) -> Choice | None:
    """Functions of place that predict held-out places of a fitted finger best.

    Parameters
    ----------
    fit : FingerFit
        The finger without functions of place.
    wanted : bool
        Choose the best functions even if the gain is small.

    Returns
    -------
    Choice or None
        None if there are too few places (see `place_folds`). None also, unless `wanted`, if errors that are independent
        from touch to touch predict held-out places as well, or if drifts in the order of the touches explain the
        readings as well: the model error may then depend on time instead of place.
    """
    known, chain = fit.likelihood.known, fit.chain
    folds = place_folds(known.angle)
    if folds is None:
        return None
    elements = linear_elements(fit.likelihood, fit.vector)
    touch = (known.radius_mm, known.angle, known.load)
    n_modes = process_modes(min(OWN_LENGTHS))
    own = fourier(known.angle[:, None] - chain.angle, n_modes)
    own *= (known.load[:, None] * np.abs(chain.response))[:, :, None]
    surface = fourier(known.angle, process_modes(min(SURFACE_LENGTHS)))
    surface = (by_curvature(chain, *touch) / chain.outer_radius_mm)[:, :, None] * surface[:, None, :]
    independent = without_functions(elements)
    kinds = [
        with_own(
            elements, kind, own * per_weight(felt_modes(chain, kind, known.radius_mm, known.load, n_modes))[:, None]
        )
        for kind in (MAP, PLACE)
    ]
    best = max(kinds, key=lambda each: each.log_evidence)
    simple = [*kinds, with_surface(elements, independent, np.zeros((len(known.load), chain.n_elements, 0)), surface)]
    both = with_surface(elements, best, best.functions.own_columns(chain, *touch), surface)
    if not wanted and _drifts(elements, fit) > max(each.log_evidence for each in simple) - LEAST_GAIN:
        return None
    kept = [each for each in simple if wanted or each.log_evidence > independent.log_evidence + LEAST_GAIN]
    if not kept:
        return None
    if both.log_evidence > best.log_evidence + LEAST_GAIN:
        kept.append(both)

    def density(scored: Scored) -> FloatArray:
        functions = scored.functions
        columns = functions.own_columns(chain, *touch), functions.surface_columns(chain, *touch)
        return LinearPosterior.of(elements, scored.factor, *columns).held_out(folds)

    base = density(independent)
    chosen, ahead = kept[0], density(kept[0]) - base
    for scored in kept[1:]:
        gained = density(scored) - base
        more = (gained - ahead).sum()
        if more > (STANDARD_ERRORS * _standard_error(gained - ahead) if scored is both else 0.0):
            chosen, ahead = scored, gained
    gain, gain_sd = float(ahead.sum()), _standard_error(ahead)
    if gain < STANDARD_ERRORS * gain_sd and not wanted:
        return None
    return Choice(chosen.functions, gain, gain_sd)


def _drifts(elements: Sequence[LinearElement], fit: FingerFit) -> float:
    """Log marginal likelihood of a drift of each element: a smooth function of the order of the touches."""
    chain, n = fit.chain, len(fit.likelihood.known.load)
    turn = fourier(np.pi * np.arange(n) / n, process_modes(min(TIME_LENGTHS)))
    columns = turn[:, None, :] * (np.abs(chain.response) * fit.likelihood.known.typical_load)[:, None]
    return with_own(elements, "", columns, TIME_LENGTHS).log_evidence


def place_folds(angle: FloatArray) -> IntArray | None:
    """Index (t,) of the group of neighbouring places of each touch; None with fewer than `LEAST_PLACES` places."""
    places, which = np.unique(angle.round(9), return_inverse=True)
    folds = min(MOST_FOLDS, len(places) // PLACES_A_FOLD)
    return np.asarray(which * folds // len(places)) if folds >= LEAST_FOLDS else None


def _standard_error(differences: FloatArray) -> float:
    """Standard error of the sum of differences over groups of places."""
    return float(differences.std(ddof=1) * np.sqrt(len(differences)))
