"""A small pad whose zeros and gains drift, and its fits, for the tests of pads with drifts."""

from __future__ import annotations

import numpy as np

from bayestouch.chain.kernels import Kernel
from bayestouch.chain.pad import PadChain
from bayestouch.data.touches import touches_from
from bayestouch.effects.effect import EffectParameter, Values
from bayestouch.effects.random import BaselineDrift, GainDrift, RandomEffect
from bayestouch.model.added import AddedEffect
from bayestouch.model.fitting import Fitted, fit
from bayestouch.model.noise import NoiseModel
from bayestouch.model.observations import Observations, history_of
from bayestouch.pad.candidates import kernel_shape
from bayestouch.pad.density import PadDensity
from bayestouch.pad.map_basis import MapBasis
from bayestouch.pad.model import PadModel
from bayestouch.pad.residual_map import MapDiscrepancy
from bayestouch.priors.parameters import LogNormal, Normal, Prior, Uniform

M = 2
LOAD_SD, SD = 0.02, np.array([0.05, 0.08])
SIZE, TIME = 0.05, LogNormal(60.0, 1.2)


def parameters() -> tuple[EffectParameter, EffectParameter]:
    return (
        EffectParameter("sd", "", "size", Normal(0.0, SIZE, 0.0), (0.01,), 0.0),
        EffectParameter("time", "s", "correlation time", TIME, (60.0,)),
    )


BASELINE = BaselineDrift(parameters())
GAIN = GainDrift((*parameters(), EffectParameter("own", "", "own", Uniform(0.0, 1.0), (0.0, 1.0))))


def pad_of(t: int, kernel: Kernel, *, with_map: bool = False, size: float = 0.04, length: float = 40.0) -> PadModel:
    """Two elements on a line, touched in random order; zeros drift by `size` of the peak; a reading is missing."""
    rng = np.random.default_rng(3)
    place, load = rng.permutation(np.linspace(-2.0, 8.0, t)), rng.uniform(0.6, 1.4, t)
    time = rng.permutation(np.cumsum(rng.uniform(5.0, 25.0, t)))
    values = np.array([2.5] * len(kernel.parameters))
    chain = PadChain(kernel, values, np.array([5.0, 7.0]), np.array([0.3, -0.2]), np.array([[0.2], [5.8]]))
    course = np.linalg.cholesky(matern(time, length) + 1e-9 * np.eye(t)) @ rng.standard_normal((t, M))
    readings = chain.predict(place[:, None], load) + size * chain.gain * course + SD * rng.standard_normal((t, M))
    readings[2, 1] = np.nan
    table = touches_from(np.arange(t), readings, x_mm=place, load=load + LOAD_SD * rng.standard_normal(t), contact=1.0)
    span = (float(time.min()), float(time.max()))
    # A table of its own for the last touches: drifts begin anew there.
    sessions = ((span[0], 60.0), (60.0, span[1]))
    observed = Observations.of(table, time, np.zeros(t), "s", history_of(table, time), span, sessions)
    basis = None
    if with_map:
        basis = map_of(chain, np.linspace(-2.0, 8.0, 5)[:, None], 3.0, np.array([5.0, 7.0]), 0.03, 0.05)
    priors: list[Prior] = [Normal(0.0, 60.0)] * M + [Normal(0.0, 20.0)] * M + [Normal(0.0, 3.0), Normal(6.0, 3.0)]
    return PadModel(
        observed=observed,
        peak=np.array([5.0, 7.0]),
        reference_load=1.0,
        pad=chain,
        priors=(*priors, *(each.prior for each in kernel.parameters)),
        element_place=(np.array([0.0, 6.0]),),
        map=basis,
    )


def map_of(
    chain: PadChain, inducing: np.ndarray, length: float, amplitude: np.ndarray, everywhere: float, of_kernel: float
) -> MapBasis:
    """Map of inducing touches at places (k, D) in mm, all of which are needed beside readings without noise."""
    none = np.full((len(inducing), len(amplitude)), 1e-12)
    misfit = MapDiscrepancy(
        location=inducing,
        load=np.ones(len(inducing)),
        variance=none,
        amplitude=amplitude,
        shape=kernel_shape(chain, inducing),
        misfit=everywhere,
        relative=of_kernel,
        length_mm=length,
    )
    return MapBasis(misfit, misfit.few_functions(none, len(inducing), 1e-3), chain)


def matern(time: np.ndarray, length: float) -> np.ndarray:
    lag = np.sqrt(3) * np.abs(time[:, None] - time) / length
    return np.asarray((1 + lag) * np.exp(-lag))


def fitted_pad(model: PadModel, *drifts: tuple[RandomEffect, Values], further: np.ndarray | None = None) -> Fitted:
    noise = NoiseModel(SD, np.full(model.known.n_touches, LOAD_SD), model.peak)
    return fit(model, model.start(model.pad), noise, drifts, further=further)


def density_of(fitted: Fitted) -> PadDensity:
    """With a normal approximation of sd 0.4 in log size and of 0.6 in log time."""
    sd = [(0.4 * values[0], 0.6 * values[1], *(float("nan") for _ in values[2:])) for _, values in fitted.drifts]
    pairs = zip(fitted.drifts, sd, strict=True)
    return PadDensity.of(fitted, [AddedEffect(drift, values, each) for (drift, values), each in pairs])


def vectors_near(density: PadDensity, n: int = 6) -> np.ndarray:
    return np.random.default_rng(1).multivariate_normal(density.mode, density.covariance, n)
