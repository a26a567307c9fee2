"""Calibration of a pad with effects.

Readings and loads are corrected for the effects at their most probable values. A calibration without effects is then
made from the corrected readings. It stores the effects, so that touches to be read are corrected in the same way. It
also stores the change of the map with the values of the effects, to first order: with it, the posterior of every touch
includes the uncertainty of these values.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.chain.pad_map import PadMap
from bayestouch.data.baseline import NO_REST, shared_rest_reads
from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import Sensor
from bayestouch.data.touches import Touches
from bayestouch.effects import Setting
from bayestouch.effects.noise import Outliers
from bayestouch.model.added import AddedEffect
from bayestouch.model.effect_list import EffectList
from bayestouch.model.fitting import Fitted
from bayestouch.model.timing import Timing
from bayestouch.pad.added_noise import NoiseByEffects, NoiseWithEffects
from bayestouch.pad.calibration import ChosenPad, choose_pad, drawn
from bayestouch.pad.candidates import PadCandidate
from bayestouch.pad.choice import CLEARLY_BETTER
from bayestouch.pad.corrected import PadEffects
from bayestouch.pad.density import PadDensity
from bayestouch.pad.effect_changes import changes_of, with_changes
from bayestouch.pad.finer_map import FinerMap
from bayestouch.pad.known_touches import choose_samples, faintest_readings, pad_readings
from bayestouch.pad.later_drifts import with_later_drifts
from bayestouch.pad.model import PadModel
from bayestouch.pad.posterior import PadPosterior
from bayestouch.pad.problem import OfLoads, stated_or_assumed_noise
from bayestouch.priors.parameters import Prior
from bayestouch.results.keys import FINER_MAP
from bayestouch.results.objects import Calibration
from bayestouch.results.targets import targets_missed

# Notes on the map of a calibration with a correction.
FINER = (
    "the diagnosis found a correction: touches are read with a map that is finer in the location, and, where loads "
    "vary, not in proportion to the load"
)
NO_FINER = "the diagnosis found a correction: the empirical map already has what a finer one would add"
# Note on the noise of first samples. The scatter of all samples of a touch that creeps does not measure it.
FIRST_WITHOUT_NOISE = (
    "readings creep, so touches are read by their first sample: effects of the noise, which were fitted to all "
    "samples, are not used in reading"
)


def pad_calibration(
    fitted: Fitted,
    added: tuple[AddedEffect, ...],
    *,
    corrected: bool = False,
    dataset: DataSet,
    table: Touches,
    clock: Timing,
    training: BoolArray,
    rest: FloatArray | None,
    setting: Setting,
    kernel: str,
    empirical: bool | Literal["auto"] = "auto",
    stated: Mapping[str, Prior] | None = None,
    draws: int,
    seed: int,
    notes: tuple[str, ...],
    groups: Sequence[str] = (),
    earlier: Mapping[str, PadCandidate] | None = None,
) -> Calibration:
    """Calibration of a pad from its training touches, corrected for the effects of a fit.

    Parameters
    ----------
    fitted : Fitted
        The fit.
    added : tuple of AddedEffect
        Effects of the fit, in the order in which they were added.
    corrected : bool
        Whether the fit has a correction: touches are then read with a `FinerMap`.
    dataset : DataSet
        Data set of a pad.
    table : Touches
        All rows, minus the rest reading.
    clock : Timing
        Times of the rows.
    training : (n,) bool array
        Rows used in the calibration.
    rest : (m,) array or None
        Rest reading that was subtracted.
    setting : Setting
        Setting from which the effects chose their priors.
    kernel, empirical, stated, draws, seed
        As in `bayestouch.pad.calibration.calibrate_pad`.
    notes : tuple of str
        Notes for the calibration.
    groups : sequence of str
        Groups of the ArviZ schema, see `bayestouch.results.schema.GROUPS`.
    earlier : mapping of str to PadCandidate, optional
        Models of all training touches without effects, by name, from the means of their samples. They are fitted if
        they are not given.

    Raises
    ------
    InputError
        For the reasons of `bayestouch.pad.calibration.calibrate_pad`.
    """
    effects = pad_effects(fitted, added, setting)
    sensor, calibration = dataset.sensor, dataset.calibration
    as_built, rest_reads = sensor, None if calibration is None else shared_rest_reads(calibration)
    # With creep the first sample is used: the mean creep is corrected, but creep differs from touch to touch.
    used = table.select(training)
    samples, _ = choose_samples(used, faintest_readings(used, rest))
    as_read = table
    relative_slope: OfLoads | None = None
    if samples == "first" and effects.by_effects is not None:
        effects, notes = replace(effects, by_effects=None), (*notes, FIRST_WITHOUT_NOISE)
    if added:
        table = effects.without_wrong(effects.corrected(as_read, clock))
        sensor, assumed = _with_acting_noise(sensor, as_read.select(training), effects)
        notes, relative_slope = (*notes, *assumed), effects.relative_slope
    known = table.select(training).with_(notes=())
    dataset = replace(dataset, sensor=sensor, calibration=known)
    # One sample in a touch has no scatter of its own, but tells by the noise whether it is wrong.
    alone = samples != "mean" and Outliers.name in effects.values
    known_noise = alone or effects.by_effects is not None
    chosen = choose_pad(
        dataset,
        kernel=kernel,
        empirical=empirical,
        stated=stated,
        samples=samples,
        seed=seed,
        relative_slope=relative_slope,
        noise=NoiseWithEffects(fitted.noise.sd, effects.by_effects) if known_noise else None,
        earlier=earlier if samples == "mean" and not added else None,
    )
    if added:
        posterior = PadPosterior.of(PadDensity.of(fitted, added), draws, seed, added=added, groups=groups)
    else:
        chosen, posterior = drawn(chosen, dataset, draws=draws, groups=groups, seed=seed)
    chosen, finer = finer_if_better(chosen) if corrected else (chosen, None)
    made = chosen.calibration(sensor, posterior, map_=finer)
    if finer is not None:
        made = replace(made, settings={**made.settings, FINER_MAP: 1.0})
    if added:

        def moved(values: PadEffects) -> Touches:
            return values.without_wrong(values.corrected(as_read, clock, near=table)).select(training)

        following = _following(effects, moved, chosen, PadMap.from_arrays(made.extra))
        made = replace(made, extra={**made.extra, **following.arrays()})
    # The rest reading is already subtracted from the table; touches read later need it.
    made = made.with_rest_reading(rest, rest_reads)
    of_table = [note for note in made.notes if rest is None or note != NO_REST]
    made = replace(made, sensor=as_built, notes=tuple(dict.fromkeys((*notes, *of_table))))
    if not added:
        return made
    noise, statistics = with_later_drifts(made.noise.without_effects(), fitted), made.statistics
    if np.isfinite(statistics["load_scatter"]):
        statistics = {**statistics, "load_scatter": noise.load_scatter}
    return replace(
        made,
        noise=noise,
        statistics=statistics,
        parameters=(*made.parameters, *(p for each in added for p in each.effect.public_parameters())),
        settings={**made.settings, **effects.listed.settings},
        extra={**made.extra, **effects.arrays()},
        notes=(*made.notes, *_notes(effects), *targets_missed(made.statistics, draws)),
    )


def _with_acting_noise(sensor: Sensor, known: Touches, effects: PadEffects) -> tuple[Sensor, list[str]]:
    """The sensor with the noise of acting loads at the reference load, and a note if the noise was assumed."""
    measured = known.load[known.in_contact & (known.load > 0)]
    if not len(measured):
        return sensor, []
    noise, assumed = stated_or_assumed_noise(sensor, measured)
    return replace(sensor, force_noise_sd=noise * effects.load_slope), assumed


def has_finer_map(calibration: Calibration) -> bool:
    """Whether touches are read with a finer map than that of a calibration without a correction."""
    return FINER_MAP in calibration.settings


def finer_if_better(chosen: ChosenPad) -> tuple[ChosenPad, PadMap | None]:
    """The model with a finer map, and the tables of this map, if this map predicts left-out readings clearly better.

    Else the same model with a note, and None.
    """
    finer, first = (make(chosen.problem, chosen.model) for make in (FinerMap.of, FinerMap.first))
    if finer.model.score <= first.model.score + CLEARLY_BETTER:
        return replace(chosen, notes=[*chosen.notes, NO_FINER]), None
    return replace(chosen, model=finer.model, notes=[*chosen.notes, FINER]), finer.tabulated()


def pad_effects(fitted: Fitted, added: tuple[AddedEffect, ...], setting: Setting) -> PadEffects:
    """Effects of a fit with their values, in the form that corrects readings and loads."""
    model, noise = fitted.model, fitted.noise
    assert isinstance(model, PadModel)
    listed = EffectList(setting, tuple(each.effect for each in added), noise.added)
    values = {each.effect.name: each.values for each in added}
    zero = model.chain(fitted.vector).offset
    effects = PadEffects(listed, values, model.peak, zero, model.element_place, sd=noise.sd)
    if noise.added.adds:
        effects = replace(effects, by_effects=NoiseByEffects(noise.added, model.peak, zero))
    rows_of = {e.name: np.r_[place] for e, place in zip(model.effects, model.value_places, strict=True)}
    rows = [rows_of[effect.name] for effect in effects.corrected_for]
    if not rows:
        return effects
    chosen = np.concatenate(rows)
    covariance = fitted.linear.covariance()[np.ix_(chosen, chosen)]
    root = np.linalg.cholesky(covariance + np.diag(1e-12 * np.diag(covariance) + 1e-300))
    return replace(effects, root=np.asarray(root))


def _following(effects: PadEffects, moved: Callable[[PadEffects], Touches], chosen: ChosenPad, map_: PadMap) -> PadMap:
    """The map, and its change per standard deviation of each independent cause of the values of the effects.

    Parameters
    ----------
    effects : PadEffects
        The effects.
    moved : callable
        From effects with other values to the known touches, corrected with these values.
    chosen : ChosenPad
        The model of the pad.
    map_ : PadMap
        The map of the model.
    """
    if not len(effects.root):
        return map_
    problem, known = chosen.problem, chosen.problem.known

    def columns(values: PadEffects) -> FloatArray:
        means = pad_readings(moved(values).baseline_corrected(), known.location.shape[1], problem.samples)
        return np.column_stack([means.readings, means.load])[np.isin(means.touch, known.touch)]

    changes = np.nan_to_num(changes_of(effects, columns))
    return with_changes(map_, chosen.model, changes[:, :, :-1], changes[:, :, -1])


def _notes(effects: PadEffects) -> list[str]:
    notes = []
    if effects.left_to_map:
        notes.append(f"{' and '.join(effects.left_to_map)}: left to the empirical map, as it goes with the location")
    if effects.listed.drifts:
        names = " and ".join(effect.name for effect in effects.listed.drifts)
        notes.append(f"{names}: readings are not corrected for it; it counts as noise")
    return notes
