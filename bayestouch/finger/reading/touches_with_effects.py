"""Preparation of touches for a finger with effects: times, drifts, true loads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.noise import Noise
from bayestouch.chain.recording import Recording
from bayestouch.data.touches import Touches
from bayestouch.effects.noise import Outliers
from bayestouch.finger.chain_with_effects import ChainWithEffects
from bayestouch.finger.reading.draws import FingerSampler
from bayestouch.finger.reading.drift import LOOSE, TouchEvidence, drift_of_others
from bayestouch.finger.reading.effects import (
    EffectContext,
    timed_rows,
    timed_samples,
    timed_scale_and_shift,
    timed_signal,
    timed_slopes,
)
from bayestouch.finger.reading.modes import difference_steps, find_modes, with_whitener
from bayestouch.finger.reading.reader import (
    FingerPosterior,
    TouchReadings,
    full_whitener,
    noise_whitener,
)
from bayestouch.finger.reading.true_load import changes_load, true_loads
from bayestouch.model.few_samples import FewSamples, doubtful_samples
from bayestouch.model.fitting import drift_basis, spread_over_elements
from bayestouch.model.missing import missing_in
from bayestouch.model.observations import Observations, history_of
from bayestouch.model.outliers import RightReadings, without_wrong
from bayestouch.model.timing import Timing

# Number of rounds of fits of the touches and estimates of the drifts; the third changes the result negligibly.
ROUNDS = 3


def observe(
    corrected: Touches, effects_chain: ChainWithEffects, noise: Noise, each_sample: bool
) -> tuple[Observations, FewSamples | None, str]:
    """Touches of a table with times, without readings that are probably wrong.

    Also the samples that are too few to say which are wrong, and a note on the assumed times.
    """
    timing = Timing.in_unit(corrected, effects_chain.listed.setting.time_unit)
    right = RightReadings(noise.tactile_sd, effects_chain.model.peak, effects_chain.listed.noise)
    table, doubtful = _without_wrong(corrected, effects_chain, right, timing)
    setting, n_calibrated = effects_chain.listed.setting, len(effects_chain.calibrated)
    missing_s = missing_in(table, timing, effects_chain.model.effects, setting, n_calibrated)
    history = replace(history_of(table, timing.time_s), missing_s=missing_s)
    if each_sample:
        rows = {"touch": np.arange(table.n_rows), "sample": np.zeros(table.n_rows, dtype=np.int64)}
        table, doubtful = table.with_(**rows), doubtful.with_(**rows)
    span = (float(timing.time_s.min()), float(timing.time_s.max()))
    observed = Observations.of(table, timing.time_s, timing.held_s, timing.unit, history, span)
    if each_sample:
        # One touch per row, with the numbers of its touch and its sample in the table.
        row = observed.means.touch
        means = replace(observed.means, touch=corrected.touch[row], sample=corrected.sample[row])
        observed = replace(observed, means=means)
    few = None
    if Outliers.name in effects_chain.values:
        few = FewSamples.of(doubtful, effects_chain.values[Outliers.name], right)
    return observed, few, timing.note


def _without_wrong(
    table: Touches, effects_chain: ChainWithEffects, right: RightReadings, timing: Timing
) -> tuple[Touches, Touches]:
    """The table without readings that are probably wrong, and with only those for which this cannot be said.

    A change within a touch that an effect makes is not wrong.
    """
    if not effects_chain.listed.of_noise:
        return table, table
    growth = np.ones(table.readings.shape)
    if len(timed_rows(effects_chain)):
        history = history_of(table, timing.time_s)
        span = (float(timing.time_s.min()), float(timing.time_s.max()))
        observed = Observations.of(table, timing.time_s, timing.held_s, timing.unit, history, span)
        signal = timed_signal(effects_chain, observed)
        factor = timed_samples(effects_chain, observed, effects_chain.vector, signal)[0]
        growth[table.in_contact] = factor / observed.of_touches(factor)[observed.row_touch]
    kept = table
    for effect in effects_chain.listed.of_noise:
        kept = without_wrong(kept, effect, effects_chain.values[effect.name], right, growth)
    return kept, doubtful_samples(table.with_(readings=table.readings / growth), kept)


def prepare(
    readings: TouchReadings,
    observed: Observations,
    effects_chain: ChainWithEffects,
    sampler: FingerSampler,
    *,
    time_s: FloatArray,
    plug_in: bool,
) -> TouchReadings:
    """Readings with the effects at the time of each touch, with estimated drifts and corrected loads.

    `time_s` (t,) is the time of each touch on the clock of the calibration, infinite after its end; `observed` has the
    times on the clock of the table.
    """
    noise = sampler.noise
    signal = timed_signal(effects_chain, observed)
    scale, shift = timed_scale_and_shift(effects_chain, observed, effects_chain.vector, signal)
    unknown = effects_chain.left_by_missing(
        readings.readings, observed.touch_time_s, observed.history.missing_s, observed.history.end_s
    )
    context = EffectContext(
        effects_chain=effects_chain,
        scale=scale,
        shift=shift,
        extra=unknown,
        counts=readings.counts,
        slopes=timed_slopes(effects_chain, observed, signal),
        exact=plug_in,
        time_s=time_s,
    )
    readings = replace(readings, context=context)
    corrects_load = changes_load(effects_chain)
    if not effects_chain.listed.drifts and not corrects_load:
        return readings
    start = None
    raw_load, raw_sd = readings.load, readings.load_sd
    for _ in range(ROUNDS):
        current = readings.context
        assert isinstance(current, EffectContext)
        posterior = FingerPosterior(
            sampler.chain, readings, sampler.search, noise_whitener(noise, readings), sampler.table
        )
        mode = find_modes(posterior, start)
        radius = posterior.radius(mode[:, 0])
        covariance = current.covariance(radius, mode[:, 1], mode[:, 2])
        posterior = with_whitener(posterior, full_whitener(noise, readings, covariance))
        mode = find_modes(posterior, mode)
        start = mode
        if corrects_load:
            loads = true_loads(effects_chain, time_s, np.degrees(mode[:, 1]), raw_load, raw_sd, exact=plug_in)
            current = current.with_loads(loads, posterior.radius(mode[:, 0]), mode[:, 1], mode[:, 2])
            readings = replace(readings, load=loads.load, load_sd=loads.sd, context=current)
        if effects_chain.listed.drifts:
            without = replace(current, scale=scale, shift=shift, extra=unknown)
            evidence = _evidence(replace(posterior, touches=replace(readings, context=without)), mode, noise)
            signal = _predicted(posterior, mode, without)
            columns = _columns(effects_chain, observed, signal)
            precision, information = evidence.about_addition()
            mean, spread = drift_of_others(columns, precision, information)
            readings = replace(
                readings, context=replace(current, scale=scale, shift=shift + mean, extra=unknown + spread)
            )
    return readings


def _predicted(posterior: FingerPosterior, mode: FloatArray, context: EffectContext) -> FloatArray:
    """Readings of the touches at their modes, (t, m)."""
    touch = posterior.radius(mode[:, 0]), mode[:, 1], mode[:, 2]
    return np.asarray(context.readings(posterior.chain.predict(*touch), *touch, np.arange(len(mode))))


def _columns(effects_chain: ChainWithEffects, observed: Observations, signal: FloatArray) -> FloatArray:
    """Change of the readings of each touch per unit of each weight of the drifts, (t, m, k)."""
    model = effects_chain.model
    recording = Recording(
        indenter_radius_mm=np.full(len(signal), np.nan),
        place=(np.zeros(len(signal)),),
        load=np.zeros(len(signal)),
        time_s=observed.touch_time_s,
        held_s=np.zeros(len(signal)),
        element_place=(np.asarray(model.finger.element_angles_deg),),
        peak=model.peak,
        reference_load=model.reference_load,
        signal=np.nan_to_num(signal),
    )
    out = []
    for drift in effects_chain.listed.drifts:
        values = effects_chain.values[drift.name]
        basis = drift_basis(drift, values, observed)
        out.append(spread_over_elements(basis.T, drift.scale(recording), own=drift.own(values)))
    return np.moveaxis(np.concatenate(out), 0, -1)


def _evidence(posterior: FingerPosterior, mode: FloatArray, noise: Noise) -> TouchEvidence:
    """Information of each touch on an addition to its readings."""
    readings, context = posterior.touches, posterior.touches.context
    assert isinstance(context, EffectContext)
    steps = difference_steps(mode)
    slopes = []
    for i in range(3):
        move = steps * np.eye(3)[i]
        difference = _predicted(posterior, mode + move, context) - _predicted(posterior, mode - move, context)
        slopes.append(difference / (2 * steps[:, i : i + 1]))
    radius = posterior.radius(mode[:, 0])
    sd = noise.mean_sd(readings.counts, np.zeros(readings.counts.shape))
    missing = ~np.isfinite(sd) | np.isnan(readings.readings)
    variance = np.where(missing, (100 * context.effects_chain.model.peak) ** 2, np.where(missing, 1.0, sd) ** 2)
    covariance = context.covariance(radius, mode[:, 1], mode[:, 2])
    covariance = covariance + np.einsum("ti,ij->tij", variance, np.eye(variance.shape[1]))
    measured = np.isfinite(readings.load)
    loose = np.tile(1 / (LOOSE * np.array([1.0, 1.0, context.effects_chain.model.reference_load])) ** 2, (len(mode), 1))
    loose[:, 2] = np.where(measured, 1 / readings.load_sd**2, loose[:, 2])
    shift = np.zeros_like(mode)
    shift[:, 2] = np.where(measured, readings.load - mode[:, 2], 0.0)
    residual = np.where(missing, 0.0, readings.readings - _predicted(posterior, mode, context))
    return TouchEvidence(residual, np.stack(slopes, axis=-1), covariance, shift, loose)
