"""Changes of the map of a pad, and of touches read with it, by the uncertainty of the values of effects.

Readings of the calibration and of touches to be read are corrected for effects with the same values. If these values
are wrong, both corrections are wrong, and the map has absorbed most of the error: the error of a touch is the
difference of the two. All changes are for one standard deviation of one independent cause, a column of
`bayestouch.pad.corrected.PadEffects.root`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.pad_map import PadMap
from bayestouch.data.averages import TouchMeans
from bayestouch.data.touches import Touches
from bayestouch.effects.noise import Outliers
from bayestouch.model.few_samples import FewSamples, doubtful_samples
from bayestouch.model.noise import AddedNoise
from bayestouch.pad.candidates import PadCandidate, kernel_shape
from bayestouch.pad.corrected import PadEffects
from bayestouch.pad.known_touches import counted_samples, pad_readings

# Step of central differences, as a share of the standard deviation of a cause.
STEP = 0.1
# Grid points of a map that are computed together: 16 MB with 1,400 touches.
CHUNK = 1500


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class CorrectedMeans(TouchMeans):
    """Touches whose readings and loads are corrected for effects; q causes, t touches, m elements.

    Attributes
    ----------
    load_as_read : (t,) array
        Mean loads as read by the force sensor; NaN where none was measured.
    changes : (t, q, m + 1) array or None
        Change of the corrected readings; last, the change of the corrected load minus that of the acting load at the
        same true load. None if the values of the effects count as exact.
    by_missing : (t, k, m) array
        Change of the corrected readings by one standard deviation of each of k errors, independent in each touch, due
        to touches that may be missing in the table; k is 0 if no effect remembers touches.
    few : FewSamples or None
        Samples that are too few to say which are outliers, of all touches that were averaged together.
    """

    load_as_read: FloatArray
    by_missing: FloatArray
    changes: FloatArray | None = None
    few: FewSamples | None = None


def changes_of(effects: PadEffects, of: Callable[[PadEffects], FloatArray]) -> FloatArray:
    """Change of the result (...) of a function of the effects by one standard deviation of each cause, (q, ...)."""
    if not len(effects.root):
        return np.empty((0, *of(effects).shape))
    moved = ([of(effects.moved(cause, sign * STEP)) for sign in (1, -1)] for cause in range(len(effects.root)))
    return np.stack([(up - down) / (2 * STEP) for up, down in moved])


def corrected_means(
    effects: PadEffects, touches: Touches, dimensions: int, samples: str, *, exact: bool = False
) -> CorrectedMeans:
    """Means of the touches of a table, corrected for effects, with the changes of the means.

    Parameters
    ----------
    effects : PadEffects
        Effects of the calibration.
    touches : Touches
        Table with the rest reading subtracted.
    dimensions, samples
        As in `bayestouch.pad.known_touches.pad_readings`.
    exact : bool
        Whether the values of the effects count as exact.

    Raises
    ------
    InputError
        No touch is in contact.
    """
    corrected = effects.corrected(touches)
    kept = effects.without_wrong(corrected)
    means, few = pad_readings(kept, dimensions, samples), None
    if effects.right is not None and Outliers.name in effects.values:
        doubtful = counted_samples(doubtful_samples(corrected, kept), samples)
        # Where touches are read without effects of the noise, that noise is a part of what other elements expect.
        right = effects.right if effects.by_effects is not None else replace(effects.right, added=AddedNoise())
        few = FewSamples.of(doubtful, effects.values[Outliers.name], right)
    of_means = {each.name: getattr(means, each.name) for each in fields(TouchMeans)}
    out = CorrectedMeans(
        **of_means,
        load_as_read=pad_readings(touches, dimensions, samples).load,
        by_missing=roots_of(effects.left_by_missing_of(corrected, means.readings)),
        few=few,
    )
    if exact:
        return out

    def columns(effects: PadEffects) -> FloatArray:
        means = pad_readings(effects.without_wrong(effects.corrected(touches, near=corrected)), dimensions, samples)
        return np.column_stack([means.readings, means.load])

    changes = np.nan_to_num(changes_of(effects, columns))
    # With other values the same true load gives another acting load: only the rest of the change of a load is an error.
    of_load = changes_of_load(effects, np.nan_to_num(means.load, nan=effects.reference_load))
    changes[:, :, -1] -= np.where(np.isnan(means.load), 0.0, of_load)
    return replace(out, changes=changes.swapaxes(0, 1))


def roots_of(square: FloatArray) -> FloatArray:
    """Columns (t, k, m) whose products sum to covariances (t, m, m); k is 0 if all of these are zero."""
    if not square.any():
        return np.zeros((len(square), 0, square.shape[-1]))
    size, direction = np.linalg.eigh(square)
    return np.asarray((direction * np.sqrt(np.maximum(size, 0.0))[:, None]).swapaxes(1, 2))


def changes_of_load(effects: PadEffects, acting: FloatArray) -> FloatArray:
    """Change (q, n) of acting loads (n,) by one standard deviation of each cause, at the same true loads."""
    pressing = effects.pressing(acting)
    return changes_of(effects, lambda moved: moved.acting_of_pressed(pressing))


def with_changes(map_: PadMap, model: PadCandidate, readings: FloatArray, load: FloatArray) -> PadMap:
    """The map, with the changes that follow from changes of the touches of the calibration.

    The changes are linear, about the mode of the calibration. The noise, and the length and the size of the empirical
    map, are fixed.

    Parameters
    ----------
    map_ : PadMap
        Tables of the model.
    model : PadCandidate
        A calibrated pad; n touches, m elements.
    readings, load : (q, n, m), (q, n) arrays
        Changes of the readings and loads of the touches.
    """
    fit = model.fit
    chain, m = fit.chain, fit.chain.n_elements
    signal = fit.predicted() - chain.offset
    moved = readings - load[:, :, None] * signal / fit.known.load[:, None]
    moved = np.where(fit.misfit.present, moved, 0.0)
    pull = np.zeros((len(chain.flat), len(readings)))
    covariances = fit.misfit.covariances
    for e, (columns, jacobian) in enumerate(fit.jacobian):
        pull[columns] += covariances[e].solve(jacobian).T @ moved[:, :, e].T
    flat = fit.laplace.covariance @ pull
    grid = np.stack(
        np.meshgrid(
            *(a + s * np.arange(n) for a, s, n in zip(map_.origin, map_.step, map_.sensitivity.shape, strict=False)),
            indexing="ij",
        ),
        axis=-1,
    )
    points = grid.reshape(-1, grid.shape[-1])
    weights = [
        covariances[e].weights(moved[:, :, e].T - jacobian @ flat[columns])
        for e, (columns, jacobian) in enumerate(fit.jacobian)
    ]
    parts = [_followed(model, points[i : i + CHUNK], flat, weights) for i in range(0, len(points), CHUNK)]
    by_effect = np.concatenate(parts).reshape(*grid.shape[:-1], -1)
    return replace(map_, by_effect=by_effect, offset_by_effect=flat[m : 2 * m].T)


def _followed(model: PadCandidate, points: FloatArray, flat: FloatArray, weights: list[FloatArray]) -> FloatArray:
    """Change of the sensitivity at points (k, D), (k, q m), from the changes of the chain (d, q) and of the map.

    The change of the map is given by m arrays (k, q): the change of the weights of its functions.
    """
    fit = model.fit
    derivative, shape = fit.chain.sensitivity_derivatives(points), kernel_shape(model.shape, points)
    out = np.empty((len(points), flat.shape[1], fit.chain.n_elements))
    for e, (columns, _) in enumerate(fit.jacobian):
        out[:, :, e] = derivative[:, e, columns] @ flat[columns]
        if model.has_map:
            out[:, :, e] += fit.misfit.functions_at(e, points, shape[:, e]) @ weights[e]
    return out.reshape(len(points), -1)
