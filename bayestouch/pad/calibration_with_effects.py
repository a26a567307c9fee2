"""A pad with effects as a calibration that can be saved, and used to read touches.

Readings and loads are corrected for the effects at their most probable values. The calibration is an ordinary one of
the corrected readings. It holds the effects, so that touches to be read are corrected in the same way; and, to first
order, how the map would have come out under other values, so that touches know what the values leave open.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.chain.pad_map import PadMap
from bayestouch.data.dataset import DataSet
from bayestouch.data.touches import Touches
from bayestouch.effects import Setting
from bayestouch.model.added import AddedEffect
from bayestouch.model.effect_list import EffectList
from bayestouch.model.fitting import Fitted
from bayestouch.model.timing import Timing
from bayestouch.pad.calibration import calibrate_pad
from bayestouch.pad.candidates import PadCandidate
from bayestouch.pad.corrected import PadEffects
from bayestouch.pad.effect_changes import changes_of, with_changes
from bayestouch.pad.known_touches import choose_samples, pad_readings
from bayestouch.pad.model import PadModel
from bayestouch.results.objects import Calibration


def pad_calibration(
    fitted: Fitted,
    added: tuple[AddedEffect, ...],
    *,
    dataset: DataSet,
    table: Touches,
    clock: Timing,
    training: NDArray[np.bool_],
    rest: FloatArray | None,
    setting: Setting,
    kernel: str,
    draws: int,
    seed: int,
    notes: tuple[str, ...],
) -> Calibration:
    """Calibration of a pad from its training touches, corrected for the effects that were found.

    Parameters
    ----------
    fitted : Fitted
        The fit.
    added : tuple of AddedEffect
        Its effects in the order in which they were added.
    dataset : DataSet
        Of a pad.
    table : Touches
        All rows, rest reading subtracted.
    clock : Timing
        Of the rows.
    training : (n,) bool array
        Rows to calibrate with.
    rest : (m,) array or None
        Rest reading that was subtracted.
    setting : Setting
        What the effects suited themselves to.
    kernel, draws, seed
        As `bayestouch.pad.calibration.calibrate_pad`.
    notes : tuple of str
        For the report.
    """
    effects = pad_effects(fitted, added, setting)
    sensor = dataset.sensor
    # Creep that differs from touch to touch is best kept out, whether its mean is known or not.
    samples, _ = choose_samples(table.select(training))
    stated = table
    if added:
        table = effects.corrected(stated, clock)

    def further(model: PadCandidate, map_: PadMap) -> PadMap:
        """The map, and how it follows the values of the effects."""
        known = model.fit.known

        def columns(effects: PadEffects) -> FloatArray:
            moved = effects.corrected(stated, clock, near=table).select(training).baseline_corrected()
            means = pad_readings(moved, known.location.shape[1], samples)
            row = np.flatnonzero(np.isin(means.touch, known.touch))
            return np.column_stack([means.readings, means.load])[row]

        changes = np.nan_to_num(changes_of(effects, columns))
        return with_changes(map_, model, changes[:, :, :-1], changes[:, :, -1])

    if added and sensor.force_noise_sd is not None:
        sensor = replace(sensor, force_noise_sd=sensor.force_noise_sd * effects.load_slope)
    known = table.select(training).with_(notes=())
    made = calibrate_pad(
        replace(dataset, sensor=sensor, calibration=known),
        kernel=kernel,
        samples=samples,
        draws=draws,
        seed=seed,
        further=further if len(effects.root) else None,
    )
    # The table has no rest reading any more: what was subtracted from it is what touches to come need.
    made = made.with_rest_reading(rest)
    made = replace(made, sensor=dataset.sensor, notes=tuple(dict.fromkeys((*notes, *made.notes))))
    if not added:
        return made
    posterior, mode = dict(made.posterior), dict(made.mode)
    shape = next(iter(posterior.values())).shape[:2]
    rng = np.random.default_rng([seed, 3])
    for each in added:
        for i, parameter in enumerate(each.effect.public_parameters()):
            mode[parameter.name] = np.asarray(each.values[i])
            posterior[parameter.name] = each.draws(i, rng.standard_normal(shape))
    return replace(
        made,
        parameters=(*made.parameters, *(p for each in added for p in each.effect.public_parameters())),
        mode=mode,
        posterior=posterior,
        settings={**made.settings, **effects.listed.settings},
        extra={**made.extra, **effects.arrays()},
        notes=(*made.notes, *_notes(effects)),
    )


def pad_effects(fitted: Fitted, added: tuple[AddedEffect, ...], setting: Setting) -> PadEffects:
    """Effects of a fit, ready to free readings of them."""
    model, noise = fitted.model, fitted.noise
    assert isinstance(model, PadModel)
    listed = EffectList(setting, tuple(each.effect for each in added), noise.added)
    values = {each.effect.name: each.values for each in added}
    effects = PadEffects(listed, values, model.peak, model.chain(fitted.vector).offset, model.element_place)
    first = np.cumsum([model.n_base, *(len(effect.parameters) for effect in model.effects)])
    rows_of = {e.name: np.arange(a, b) for e, a, b in zip(model.effects, first[:-1], first[1:], strict=True)}
    rows = [rows_of[effect.name] for effect in effects.corrected_for]
    if not rows:
        return effects
    chosen = np.concatenate(rows)
    covariance = fitted.linear.covariance()[np.ix_(chosen, chosen)]
    root = np.linalg.cholesky(covariance + np.diag(1e-12 * np.diag(covariance) + 1e-300))
    return replace(effects, root=np.asarray(root))


def _notes(effects: PadEffects) -> list[str]:
    notes = []
    if effects.left_to_map:
        notes.append(f"{' and '.join(effects.left_to_map)}: left to the empirical map, as it goes with the location")
    if effects.listed.drifts:
        names = " and ".join(effect.name for effect in effects.listed.drifts)
        notes.append(f"{names}: not taken out of readings; it counts as noise")
    return notes
