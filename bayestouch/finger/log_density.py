"""The posterior density of the calibration of a finger as a `LogDensity`."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain
from bayestouch.finger.density import FingerDensity
from bayestouch.finger.fit import FingerFit
from bayestouch.finger.fit_with_effects import EffectFit
from bayestouch.finger.known_touches import KnownTouches
from bayestouch.finger.layout import FlatLayout
from bayestouch.finger.noise import NoiseShape
from bayestouch.finger.public import draws_by_name
from bayestouch.model.log_density import LogDensity


def density_of_fit(fit: FingerFit, reading_unit: str) -> LogDensity:
    """Density of a finger without effects."""
    likelihood = fit.likelihood
    density, transform = FingerDensity.of(fit), _Transform(fit.chain, likelihood.known, likelihood.layout, ())
    return LogDensity(
        names=transform.names,
        units=transform.units(reading_unit),
        start=fit.vector,
        covariance=_covariance(likelihood.layout, fit.laplace.covariance, fit.noise_shape),
        bounds=likelihood.bounds,
        posterior=density.__call__,
        prior=likelihood.prior.log_density,
        touches=density.touch_log_likelihood,
        values=transform.values,
        coordinates=transform.coordinates,
    )


def density_with_effects(fit: EffectFit, reading_unit: str) -> LogDensity:
    """Density of a finger with effects."""
    posterior, n = fit.posterior, fit.posterior.layout.n_chain
    density = fit.density
    names = [
        (f"{effect.name}_{p.name}", p.logarithmic, p.unit)
        for effect in posterior.model.effects
        for p in effect.parameters
    ]
    names += [(f"{drift.name}_{p.name}", True, p.unit) for drift, _ in posterior.drifts for p in drift.parameters[:2]]
    names += [(f"{e.name}_{p.name}", p.logarithmic, p.unit) for e in posterior.effects for p in e.parameters]
    chain = posterior.model.chain(fit.vector[:n])
    transform = _Transform(chain, posterior.known, posterior.layout, tuple(names))
    return LogDensity(
        names=transform.names,
        units=transform.units(reading_unit),
        start=fit.vector,
        covariance=_covariance(posterior.layout, fit.covariance, fit.shape, fit.to_vectors.further_sd),
        bounds=posterior.bounds,
        posterior=density.__call__,
        prior=posterior.prior.log_density,
        touches=None if density.tied else density.touch_log_likelihood,
        values=transform.values,
        coordinates=transform.coordinates,
    )


class _Transform:
    """Parameters by name from flat vectors, and back."""

    def __init__(
        self, chain: FingerChain, known: KnownTouches, at: FlatLayout, effects: tuple[tuple[str, bool, str], ...]
    ) -> None:
        self._chain, self._known, self._at, self._effects = chain, known, at, effects
        self._places = [*range(at.n_base, at.n_chain), *range(at.further.start, at.size)]

    @property
    def names(self) -> tuple[str, ...]:
        m, at = range(self._at.n_elements), self._at
        effects = [f"log {name}" if log else name for name, log, _ in self._effects]
        return (
            *(f"{name}[{e}]" for name in ("log response", "r_s", "theta_s") for e in m),
            *("sigma", "log mu", *effects[: at.n_values]),
            *(f"log noise_sd[{e}]" for e in m),
            *(f"log discrepancy_sd[{e}]" for e in m if at.discrepancy),
            *("log force_noise_sd", *effects[at.n_values :]),
        )

    def units(self, reading: str) -> tuple[str, ...]:
        at, m = self._at, self._at.n_elements
        effects = [unit for _, _, unit in self._effects]
        by_element = [f"{reading}/(N/m)"] * m + ["mm"] * m + ["rad"] * m
        noise = [reading] * m + ["noise of the mean of a touch"] * (m if at.discrepancy else 0)
        return (*by_element, "", "MPa", *effects[: at.n_values], *noise, "N/m", *effects[at.n_values :])

    def values(self, points: FloatArray) -> dict[str, FloatArray]:
        out = {k: v[0] for k, v in draws_by_name(self._chain, self._known, self._at, points[None]).items()}
        for (name, logarithmic, _), place in zip(self._effects, self._places, strict=True):
            out[name] = np.exp(points[:, place]) if logarithmic else points[:, place].copy()
        return out

    def coordinates(self, values: Mapping[str, FloatArray]) -> FloatArray:
        at = self._at
        out = np.empty((len(values["sigma"]), at.size))
        out[:, at.response] = np.log(np.abs(values["response"]))
        out[:, at.depth], out[:, at.angle] = values["r_s"], np.radians(values["theta_s"])
        out[:, at.sigma], out[:, at.log_mu] = values["sigma"], np.log(values["mu"])
        out[:, at.noise] = np.log(values["noise_sd"])
        if at.discrepancy:
            share = values["discrepancy_sd"] / values["noise_sd"] * np.sqrt(self._known.typical_reads)
            out[:, at.log_discrepancy] = np.log(share)
        out[:, at.force_noise] = np.log(values["force_noise_sd"])
        for (name, logarithmic, _), place in zip(self._effects, self._places, strict=True):
            out[:, place] = np.log(values[name]) if logarithmic else values[name]
        return out


def _covariance(
    at: FlatLayout, chain: FloatArray, shape: NoiseShape, further_sd: FloatArray | None = None
) -> FloatArray:
    """Covariance (d, d) of the normal approximation, in which chain and noise are independent."""
    out = np.zeros((at.size, at.size))
    n = at.n_chain
    out[:n, :n] = chain
    out[n:, n:] = shape.covariance
    if shape.quantiles is not None:
        # The covariance is that of the normal variables of the log discrepancies: half the middle 68 % is their sd.
        one = np.ones((1, at.n_elements))
        sd = 0.5 * (shape.quantiles(one)[0] - shape.quantiles(-one)[0])[0]
        scale = np.ones(at.size)
        scale[at.log_discrepancy] = sd
        out *= np.outer(scale, scale)
    if further_sd is not None:
        out[at.further, at.further] = np.diag(further_sd**2)
    return out
