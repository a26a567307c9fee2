"""`Calibration` of a finger with effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.chain.noise import Noise
from bayestouch.data.sensor import Sensor
from bayestouch.effects import Effect, Setting
from bayestouch.finger.calibration import layout
from bayestouch.finger.model import finger_model
from bayestouch.finger.peak_strain import peak_strain
from bayestouch.finger.priors import FingerPriors
from bayestouch.model.added import AddedEffect
from bayestouch.model.effect_list import EffectList
from bayestouch.model.fitting import Fitted
from bayestouch.model.left_over import discrepancy, force_noise
from bayestouch.priors.parameters import Prior
from bayestouch.results.data import TouchRows
from bayestouch.results.keys import E_MAP, EFFECT_PEAK, MODEL_MAP, REST_READING
from bayestouch.results.objects import Calibration
from bayestouch.version import __version__

CHAINS = 4


def calibration_with_effects(
    fitted: Fitted,
    added: Sequence[AddedEffect],
    *,
    sensor: Sensor,
    setting: Setting,
    rest: FloatArray | None,
    draws: int,
    seed: int,
    notes: tuple[str, ...] = (),
    extra: Mapping[str, FloatArray] | None = None,
    stated: Mapping[str, Prior] | None = None,
) -> Calibration:
    """The calibration: draws from the normal approximation about the mode.

    Parameters
    ----------
    fitted : Fitted
        The fit.
    added : list of AddedEffect
        Its effects, in the order in which they were added.
    sensor : Sensor
        The finger, with its nominal dimensions.
    setting : Setting
        Setting by which the effects chose their priors.
    rest : (m,) array or None
        Rest reading that was subtracted.
    draws, seed : int
        How many draws to keep, and their seed.
    notes : tuple of str
        Notes for the calibration.
    extra : mapping of arrays, optional
        Further arrays: those of a correction.
    stated : mapping of str to Prior, optional
        Priors stated by the user, as in `bayestouch.calibrate`.
    """
    model = finger_model(fitted.model)
    means = model.known.means
    m, at = model.n_elements, model.layout
    covariance = fitted.linear.covariance()
    rng = np.random.default_rng([seed, 2])
    vectors = _draws(fitted, covariance, draws, rng)
    response = model.sign * np.exp(fitted.vector[at.response])
    scale = np.ones(len(fitted.vector))
    scale[:m] = response
    chain, noise = model.chain(fitted.vector), fitted.noise
    missed = discrepancy(fitted)
    force_sd = force_noise(fitted)
    listed = EffectList(setting, tuple(each.effect for each in added), noise.added)
    predicted = model.predict(fitted.vector).touches + fitted.drifted
    counts = np.where(np.isnan(means.readings), 0, means.counts)
    spread = Noise(noise.sd, missed, 0.0, force_sd)
    angle = means.angle_deg
    assert angle is not None
    rows = TouchRows(
        touch=means.touch,
        location={"theta_c": angle},
        radius_mm=means.indenter_radius_mm,
        load=means.load,
        observed=means.readings,
        predicted=predicted,
        sd=spread.mean_sd(counts, predicted),
        counts=counts,
    )
    mode, posterior = _public(fitted, added, vectors, missed, force_sd, rng)
    priors = FingerPriors.of(sensor)[0].with_stated(stated or {}, model.finger)
    of_chain = [name for each in model.effects for name in _rows_of(each)]
    own = tuple(p for each in added for p in each.effect.public_parameters())
    readings = int((counts > 0).sum())
    peak = np.abs(response) * model.reference_load
    return Calibration(
        sensor=sensor,
        parameters=(*priors.parameters(sensor.reading_unit, discrepancy=True), *own),
        mode=mode,
        posterior=posterior,
        covariance=covariance * np.outer(scale, scale),
        layout=(*layout(m), *of_chain),
        noise=spread,
        rows=rows,
        settings={
            "body": "finger",
            "contact": model.contact,
            E_MAP: MODEL_MAP,
            "seed": float(seed),
            "version": __version__,
            "largest_load": chain.largest_load,
            "typical_load": model.reference_load,
            "sampler": "normal approximation",
            **listed.settings,
        },
        statistics={
            "touches": float(model.known.n_touches),
            "lack_of_fit": fitted.chi_square() / max(readings - model.n_base, 1),
            "error_percent_peak": float(
                100
                * np.mean(
                    np.sqrt(np.nanmean((means.readings - predicted)[:, _alive(counts)] ** 2, axis=0))
                    / peak[_alive(counts)]
                )
            ),
            "noise_percent_peak": float(100 * np.mean((noise.sd / peak)[_alive(counts)])),
        },
        extra={EFFECT_PEAK: model.peak, **({} if rest is None else {REST_READING: rest}), **(extra or {})},
        notes=notes,
    )


def _alive(counts: NDArray[np.int64]) -> NDArray[np.bool_]:
    return np.asarray((counts > 0).any(axis=0))


def _rows_of(effect: Effect) -> list[str]:
    """Names of the rows of an effect in the covariance."""
    pairs = zip(effect.public_parameters(), effect.parameters, strict=True)
    return [f"log {public.name}" if own.logarithmic else public.name for public, own in pairs]


def _draws(fitted: Fitted, covariance: FloatArray, draws: int, rng: np.random.Generator) -> FloatArray:
    """Draws (n, d) about the mode; those beyond a bound are drawn again, and finally moved onto it."""
    _, _, low, high = fitted.model.prior()
    count = CHAINS * -(-draws // CHAINS)
    root = np.linalg.cholesky(covariance + np.diag(1e-12 * np.diag(covariance)))
    out = fitted.vector + rng.standard_normal((count, len(covariance))) @ root.T
    for _ in range(20):
        outside = np.flatnonzero(((out < low) | (out > high)).any(axis=1))
        if not len(outside):
            break
        out[outside] = fitted.vector + rng.standard_normal((len(outside), len(covariance))) @ root.T
    return np.asarray(np.clip(out, low, high))


def _public(
    fitted: Fitted,
    added: Sequence[AddedEffect],
    vectors: FloatArray,
    missed: FloatArray,
    force_sd: float,
    rng: np.random.Generator,
) -> tuple[dict[str, FloatArray], dict[str, FloatArray]]:
    """Mode and draws of all parameters, effects and noise, by public name."""
    model = finger_model(fitted.model)
    at = model.layout
    chain = model.chain(fitted.vector)
    dof = np.maximum(np.nan_to_num(model.known.means.pure_error_dof), 1.0)
    noise = fitted.noise.sd * np.sqrt(dof / rng.chisquare(dof, size=(len(vectors), model.n_elements)))
    response = model.sign * np.exp(vectors[:, at.response])
    sigma, depth, mu = vectors[:, at.sigma], vectors[:, at.depth], np.exp(vectors[:, at.log_mu])
    peak = peak_strain(chain, sigma, depth)
    draws: dict[str, FloatArray] = {
        "sigma": sigma,
        "mu": mu,
        "r_s": depth,
        "theta_s": np.degrees(vectors[:, at.angle]),
        "response": response,
        "gain": response * 1000 * mu[:, None] / peak,
        "noise_sd": noise,
        "discrepancy_sd": np.broadcast_to(missed, noise.shape),
        "force_noise_sd": np.full(len(vectors), force_sd),
    }
    mode: dict[str, FloatArray] = {
        "sigma": np.asarray(chain.poisson_ratio),
        "mu": np.asarray(chain.shear_modulus_MPa),
        "r_s": chain.sensing_radius_mm,
        "theta_s": np.degrees(chain.angle),
        "response": chain.response,
        "gain": chain.response
        * 1000
        * chain.shear_modulus_MPa
        / peak_strain(chain, chain.poisson_ratio, chain.sensing_radius_mm),
        "noise_sd": fitted.noise.sd,
        "discrepancy_sd": missed,
        "force_noise_sd": np.asarray(force_sd),
    }
    place = {effect.name: i for i, effect in enumerate(model.effects)}
    start = np.cumsum([model.n_base, *(len(effect.parameters) for effect in model.effects)])
    for each in added:
        effect = each.effect
        for i, (public, own) in enumerate(zip(effect.public_parameters(), effect.parameters, strict=True)):
            mode[public.name] = np.asarray(each.values[i])
            if effect.name not in place:
                # Values of drifts and noise effects are not in the vector of the chain.
                draws[public.name] = each.draws(i, rng.standard_normal(len(vectors)))
            else:
                column = vectors[:, start[place[effect.name]] + i]
                draws[public.name] = np.exp(column) if own.logarithmic else column
    shaped = {name: value.reshape(CHAINS, -1, *value.shape[1:]) for name, value in draws.items()}
    return mode, shaped
