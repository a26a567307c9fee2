"""`Calibration` of a finger with effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.noise import Noise
from bayestouch.data.sensor import Sensor
from bayestouch.effects import Effect, Setting
from bayestouch.effects.readout import RestOffset
from bayestouch.finger.calibration import about_offsets, far_from_stated, layout
from bayestouch.finger.density_with_effects import EffectPosterior
from bayestouch.finger.fit_with_effects import EffectFit, effect_fit
from bayestouch.finger.lacking import shear_modulus_from_prior
from bayestouch.finger.model import finger_model
from bayestouch.finger.noise import noise_of
from bayestouch.finger.polarity import other_polarity
from bayestouch.finger.priors import FingerPriors
from bayestouch.finger.public import draws_by_name, linear_vectors
from bayestouch.finger.requested import groups_with_effects
from bayestouch.finger.sampling_with_effects import sample_effects
from bayestouch.model.added import AddedEffect
from bayestouch.model.effect_list import EffectList
from bayestouch.model.fitting import Fitted
from bayestouch.model.observations import Observations
from bayestouch.results.data import TouchRows
from bayestouch.results.keys import E_MAP, EFFECT_PEAK, MODEL_MAP, REST_READING
from bayestouch.results.objects import Calibration
from bayestouch.results.schema import LOG_DENSITY
from bayestouch.results.targets import targets_missed
from bayestouch.sampling.draws import thinned
from bayestouch.version import __version__


def calibration_with_effects(
    fitted: Fitted,
    added: Sequence[AddedEffect],
    *,
    sensor: Sensor,
    priors: FingerPriors,
    raw: Observations,
    setting: Setting,
    rest: FloatArray | None,
    draws: int,
    seed: int,
    notes: tuple[str, ...] = (),
    extra: Mapping[str, FloatArray] | None = None,
    groups: Sequence[str] = (),
    moves: Any = None,
) -> Calibration:
    """Calibration of a fitted finger with effects: draws by emcee from the exact posterior of all parameters.

    Parameters
    ----------
    fitted : Fitted
        The fit.
    added : list of AddedEffect
        Effects of the fit, in the order in which they were added.
    sensor : Sensor
        The finger, with its nominal dimensions.
    priors : FingerPriors
        Priors of the finger without effects.
    raw : Observations
        The touches with all readings, including those that an effect classified as wrong.
    setting : Setting
        Setting by which the effects chose their priors.
    rest : (m,) array or None
        Rest reading that was subtracted.
    draws, seed, groups, moves
        As in `bayestouch.calibrate`.
    notes : tuple of str
        Notes for the calibration.
    extra : mapping of arrays, optional
        Further arrays: those of a correction.
    """
    model = finger_model(fitted.model)
    posterior = EffectPosterior.of(fitted, priors, raw)
    fit = effect_fit(fitted, tuple(added), posterior)
    made = sample_effects(fit, draws, seed, moves=moves)
    drawn = thinned(made, draws)
    every, vectors = made.draws[:, :, 0], drawn.draws[:, :, 0]
    at, known = posterior.layout, posterior.known
    grades = {
        "ess_bulk": float(drawn.ess_bulk.min()),
        "rhat": float(drawn.rhat.max()),
        "acceptance": float(drawn.acceptance.min()),
    }
    from_prior = shear_modulus_from_prior(every[..., at.log_mu], float(posterior.prior.spread[at.log_mu]))
    spread = noise_of(known, at, every.reshape(-1, at.size))
    rows = touch_rows(fitted, spread)
    listed = EffectList(setting, tuple(each.effect for each in added), fitted.noise.added)
    own = tuple(p for each in added for p in each.effect.public_parameters())

    def in_vectors(vectors: FloatArray) -> dict[str, FloatArray]:
        chain = draws_by_name(model.chain(fitted.vector), known, at, vectors)
        return {**chain, **_values_by_name(posterior, vectors)}

    named = draws_by_name(model.chain(fitted.vector), known, at, vectors)
    return Calibration(
        sensor=sensor,
        parameters=(*priors.parameters(sensor.reading_unit, discrepancy=at.discrepancy), *own),
        mode=_mode(fit, fitted.vector, added),
        posterior={
            **named,
            **_effect_draws(posterior, added, vectors, np.random.default_rng([seed, 2])),
        },
        covariance=np.cov(linear_vectors(at, model.sign, every).T),
        layout=(*layout(at.n_elements), *(name for each in model.effects for name in _rows_of(each))),
        noise=spread,
        rows=rows,
        settings={
            "body": "finger",
            "contact": model.contact,
            E_MAP: MODEL_MAP,
            "seed": float(seed),
            "version": __version__,
            "largest_load": model.chain(fitted.vector).largest_load,
            "typical_load": model.reference_load,
            **listed.settings,
        },
        statistics={**fit_statistics(fitted, rows, spread), **grades},
        extra={EFFECT_PEAK: model.peak, **({} if rest is None else {REST_READING: rest}), **(extra or {})},
        notes=(
            *about_offsets(notes, fitted=RestOffset.name in fitted.names),
            *from_prior,
            *other_polarity(model.chain(fitted.vector).response, rows.observed),
            *far_from_stated(priors, sensor, named),
            *targets_missed(grades, draws),
        ),
        groups={
            "sample_stats": {LOG_DENSITY: drawn.log_density[:, :, 0]},
            **groups_with_effects(fit, vectors, groups, seed, in_vectors),
        },
    )


def touch_rows(fitted: Fitted, spread: Noise) -> TouchRows:
    """Readings of the touches and their predictions, with the standard deviations from the noise `spread`."""
    means = fitted.model.known.means
    assert means.angle_deg is not None
    signal = fitted.model.predict(fitted.vector).touches
    predicted = signal + fitted.drifted
    counts = np.where(np.isnan(means.readings), 0, means.counts)
    return TouchRows(
        touch=means.touch,
        location={"theta_c": finger_model(fitted.model).finger.near(means.angle_deg)},
        radius_mm=means.indenter_radius_mm,
        load=means.load,
        observed=means.readings,
        predicted=predicted,
        sd=_sd(fitted, spread, signal, counts),
        counts=counts,
        samples=means.samples,
        load_reads=means.reads_of_load,
    )


def _sd(fitted: Fitted, spread: Noise, signal: FloatArray, counts: FloatArray) -> FloatArray:
    """Standard deviation (t, m) of reading minus prediction: noise, noise of effects, and the error of the load."""
    model, means = fitted.model, fitted.model.known.means
    of_noise = spread.mean_variance(counts, signal) + fitted.noise.added.mean_variance(signal, model.peak, counts)
    load_sd = np.where(np.isfinite(means.load), spread.mean_load_sd(means.reads_of_load), 0.0)
    return np.hypot(np.sqrt(of_noise), model.by_load(fitted.vector) * load_sd[:, None])


def fit_statistics(fitted: Fitted, rows: TouchRows, spread: Noise) -> dict[str, float]:
    """Lack of fit, and error and noise in percent of the peak: means over the elements with readings."""
    model = finger_model(fitted.model)
    peak = np.exp(fitted.vector[model.layout.response]) * model.reference_load
    counts = np.nan_to_num(rows.counts)
    alive = (counts > 0).any(axis=0)
    error = np.sqrt(np.nanmean((rows.observed - rows.predicted)[:, alive] ** 2, axis=0)) / peak[alive]
    return {
        "touches": float(model.known.n_touches),
        "lack_of_fit": fitted.chi_square() / max(int((counts > 0).sum()) - model.layout.n_determined(counts > 0), 1),
        "error_percent_peak": float(100 * error.mean()),
        "noise_percent_peak": float(100 * (spread.tactile_sd / peak)[alive].mean()),
    }


def _rows_of(effect: Effect) -> list[str]:
    """Names of the rows of an effect in the covariance."""
    pairs = zip(effect.public_parameters(), effect.parameters, strict=True)
    return [f"log {public.name}" if own.logarithmic else public.name for public, own in pairs]


def _mode(fit: EffectFit, fitted: FloatArray, added: Sequence[AddedEffect]) -> dict[str, FloatArray]:
    """Most probable value of every parameter, () or (m,).

    Parameters of the chain have the values of the fit, not those of the centre of the normal approximation, which
    differ by a fraction of a standard deviation: corrections and identified maps are relative to the fit.
    """
    posterior, at = fit.posterior, fit.posterior.layout
    vector = np.concatenate([fitted, fit.vector[at.n_chain :]])
    chain = posterior.model.chain(fitted)
    centre = draws_by_name(chain, posterior.known, at, vector[None, None])
    out = {name: value[0, 0] for name, value in centre.items()}
    for each in added:
        names = (public.name for public in each.effect.public_parameters())
        out.update((name, np.asarray(value)) for name, value in zip(names, each.values, strict=True))
    return out


def _values_by_name(posterior: EffectPosterior, vectors: FloatArray) -> dict[str, FloatArray]:
    """Values (chain, draw) of effects that are in vectors (chain, draw, d), by name."""
    at, drawn, place = posterior.layout, {}, posterior.layout.n_base
    for effect in posterior.model.effects:
        for public, parameter in zip(effect.public_parameters(), effect.parameters, strict=True):
            drawn[public.name] = np.exp(vectors[..., place]) if parameter.logarithmic else vectors[..., place]
            place += 1
    place = at.further.start
    for drift, _ in posterior.drifts:
        for public in drift.public_parameters()[:2]:
            drawn[public.name] = np.exp(vectors[..., place])
            place += 1
    for noise in posterior.effects:
        for public, parameter in zip(noise.public_parameters(), noise.parameters, strict=True):
            drawn[public.name] = np.exp(vectors[..., place]) if parameter.logarithmic else vectors[..., place]
            place += 1
    return drawn


def _effect_draws(
    posterior: EffectPosterior, added: Sequence[AddedEffect], vectors: FloatArray, rng: np.random.Generator
) -> dict[str, FloatArray]:
    """Draws (chain, draw) of the values of all effects, by name."""
    drawn, out = _values_by_name(posterior, vectors), {}
    for each in added:
        for i, public in enumerate(each.effect.public_parameters()):
            # The kind of a drift is not in the vector. A noise effect that is not in the vector has its own draws.
            values = drawn.get(public.name)
            out[public.name] = each.draws(i, rng.standard_normal(vectors.shape[:2])) if values is None else values
    return out
