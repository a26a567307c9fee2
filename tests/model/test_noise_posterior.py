"""Likelihood of the samples of a touch under effects of the noise, written out; and modes and sds of their values."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats
from scipy.linalg import block_diag, helmert

from bayestouch.effects.effect import Values
from bayestouch.effects.noise import CommonModeNoise, NoiseEffect, Outliers, SignalDependentNoise
from bayestouch.model.base import Predicted
from bayestouch.model.noise import AddedNoise, NoiseModel
from bayestouch.model.noise_posterior import noise_posterior, terms_beside_others, terms_of
from bayestouch.model.noise_search import TouchScatter

TOUCHES, SAMPLES, M = 12, 4, 3
PEAK = np.array([0.8, 1.0, 1.2])
SD = np.array([0.02, 0.03, 0.05])
#: k - 1 contrasts of k samples, orthonormal: all that does not depend on the mean of the touch.
CONTRASTS = helmert(SAMPLES)


def scattered() -> tuple[TouchScatter, np.ndarray]:
    """Scatter about the means of touches, and the samples themselves over the sd, (t, k, m)."""
    rng = np.random.default_rng(11)
    samples = rng.standard_normal((TOUCHES, SAMPLES, M))
    samples[2, 1, 0], samples[5, 3, 2], samples[5, 0, 2], samples[8, 2, 1] = 9.0, -6.0, 5.0, -20.0
    signal = rng.uniform(-0.2, 1.1, (TOUCHES, 1, M))
    share = 1 - 1 / SAMPLES
    deviation = samples - samples.mean(axis=1, keepdims=True)
    return TouchScatter(
        z=deviation.reshape(-1, M) / np.sqrt(share),
        signal=np.repeat(signal, SAMPLES, axis=1).reshape(-1, M),
        sd=SD,
        peak=PEAK,
        weight=np.full(TOUCHES * SAMPLES, share),
        touch=np.repeat(np.arange(TOUCHES), SAMPLES),
        half=np.zeros(TOUCHES * SAMPLES, dtype=int),
    ), samples


def common(samples: np.ndarray, signal: np.ndarray, values: Values, own: np.ndarray) -> float:
    """Each contrast is an error of its own of the elements and one that they share."""
    size = values[0] * PEAK ** -values[1] / SD
    law = stats.multivariate_normal(np.zeros(M), np.diag(own) + np.outer(size, size))
    return float(law.logpdf(np.einsum("ck,tkm->tcm", CONTRASTS, samples)).sum())


def with_the_signal(samples: np.ndarray, signal: np.ndarray, values: Values, own: np.ndarray) -> float:
    variance = own + (values[0] * np.abs(signal) ** values[1] / SD) ** 2
    contrasts = np.einsum("ck,tkm->tcm", CONTRASTS, samples)
    return float(stats.norm(0, np.sqrt(variance)[:, None]).logpdf(contrasts).sum())


def wrong(samples: np.ndarray, signal: np.ndarray, values: Values, own: np.ndarray) -> float:
    """Sum over which of the samples are wrong: normal contrasts under each."""
    probability, size = values
    total = 0.0
    for touch, e in product(range(TOUCHES), range(M)):
        contrasts, density = CONTRASTS @ samples[touch, :, e], 0.0
        for which in product((0, 1), repeat=SAMPLES):
            variance = own[e] + np.array(which) * (size / SD[e]) ** 2
            law = stats.multivariate_normal(np.zeros(SAMPLES - 1), CONTRASTS * variance @ CONTRASTS.T)
            share = np.prod(np.where(which, probability, 1 - probability))
            density += share * law.pdf(contrasts)
        total += np.log(density)
    return total


CASES = [
    (CommonModeNoise(), common, [(0.005, 0.0), (0.02, 0.5), (0.05, 1.0)]),
    (SignalDependentNoise(), with_the_signal, [(0.01, 1.0), (0.03, 0.5), (0.1, 2.0)]),
    (Outliers(), wrong, [(0.01, 0.2), (0.05, 0.1), (0.2, 0.4)]),
]


@pytest.mark.parametrize(("effect", "law", "values"), CASES, ids=lambda each: getattr(each, "name", ""))
def test_likelihood_is_that_of_the_samples_whatever_their_mean(
    effect: NoiseEffect, law: object, values: list[Values]
) -> None:
    scatter, samples = scattered()
    terms = terms_of(scatter, effect)
    signal = scatter.signal.reshape(TOUCHES, SAMPLES, M)[:, 0]
    pairs = list(product(values, (np.array([0.6, 0.9, 0.7]), np.array([1.2, 0.5, 1.0]))))
    found = np.array([terms(*pair).sum() for pair in pairs])
    wanted = np.array([law(samples, signal, *pair) for pair in pairs])  # type: ignore[operator]
    # Nodes of the mean of a touch reach three sd beyond its samples.
    np.testing.assert_allclose(found - found[0], wanted - wanted[0], atol=0.02, rtol=1e-3)


def test_a_sample_that_is_missing_and_one_that_is_alone() -> None:
    """Two samples have one contrast, their difference; an element with one sample in a touch says nothing there."""
    scatter, _ = scattered()
    effect, values, own = Outliers(), (0.05, 0.1), np.ones(M)
    z = scatter.z.reshape(TOUCHES, SAMPLES, M).copy()

    def of_first(*samples: float) -> np.ndarray:
        z[0, :, 0] = np.nan
        z[0, : len(samples), 0] = np.subtract(samples, np.mean(samples)) / np.sqrt(1 - 1 / SAMPLES)
        return terms_of(replace(scatter, z=z.reshape(-1, M)), effect)(values, own)

    def pair(difference: float) -> float:
        variance = 2 + np.arange(3) * (values[1] / SD[0]) ** 2
        return float(stats.binom(2, values[0]).pmf(range(3)) @ stats.norm(0, np.sqrt(variance)).pdf(difference))

    whole, alone, same, apart = (
        terms_of(scatter, effect)(values, own),
        of_first(0.7),
        of_first(0.7, 0.7),
        of_first(-3.0, 2.0),
    )
    np.testing.assert_allclose(alone[1:], whole[1:])
    np.testing.assert_array_equal(of_first(-5.0), alone)
    assert apart[0] - same[0] == pytest.approx(np.log(pair(5.0) / pair(0.0)), abs=0.01)


@pytest.mark.parametrize("separate", [True, False])
def test_mode_and_sd_of_a_normal_posterior(separate: bool) -> None:
    """Share and logarithm of the power tied to each element's log variance: a normal density, its mode by algebra."""
    effect = SignalDependentNoise()
    rng = np.random.default_rng(5)
    # Each element sees five linear combinations of share/0.01, log power and its own logarithm.
    design = rng.standard_normal((M, 5, 3)) * np.array([1.0, 5.0, 10.0])
    at = np.array([3.0, np.log(0.9), 0.0])
    seen = design @ at + rng.standard_normal((M, 5))

    def terms(values: Values, own: np.ndarray) -> np.ndarray:
        x = np.column_stack([np.full(M, values[0] / 0.01), np.full(M, np.log(values[1])), np.log(own)])
        out = -0.5 * ((seen - np.einsum("mik,mk->mi", design, x)) ** 2).sum(axis=1)
        return out if separate else out.sum(keepdims=True)

    # Priors of share/0.01 and of the log of power: normal about 0 with sd 5, and about log 0.8 with sd 0.4.
    rows, data = np.zeros((2 + 5 * M, 2 + M)), np.zeros(2 + 5 * M)
    rows[0, 0], rows[1, 1], data[1] = 1 / 5, 1 / 0.4, np.log(0.8) / 0.4
    for e in range(M):
        part = slice(2 + 5 * e, 7 + 5 * e)
        rows[part, :2], rows[part, 2 + e], data[part] = design[e, :, :2], design[e, :, 2], seen[e]
    covariance = np.linalg.inv(rows.T @ rows)
    mode, spread = covariance @ rows.T @ data, np.sqrt(np.diag(covariance))
    values, sd, own = noise_posterior(terms, effect, (0.01, 1.0), np.ones(M))
    assert values[0] == pytest.approx(0.01 * mode[0], rel=1e-3)
    assert values[1] == pytest.approx(np.exp(mode[1]), rel=1e-3)
    np.testing.assert_allclose(np.log(own), mode[2:], atol=1e-3)
    assert sd[0] == pytest.approx(0.01 * spread[0], rel=1e-3)
    assert sd[1] == pytest.approx(values[1] * spread[1], rel=1e-3)


def test_what_samples_say_nothing_of_is_as_uncertain_as_its_prior() -> None:
    """Whether an error of no size is of each element's own peak or of the mean peak: uniform from 0 to 1."""
    rng = np.random.default_rng(2)
    samples = rng.standard_normal((40, SAMPLES, M))
    deviation = (samples - samples.mean(axis=1, keepdims=True)).reshape(-1, M)
    deviation /= np.sqrt((deviation**2).mean(axis=0))
    scatter, _ = scattered()
    plain = replace(scatter, z=deviation, weight=np.full(len(deviation), 0.75))
    values, sd, own = noise_posterior(terms_of(plain, CommonModeNoise()), CommonModeNoise(), (0.0, 0.5), np.ones(M))
    assert values[0] < 2 * sd[0]
    assert sd[1] < 0.35
    # 120 independent deviations of each element: their variance is known to 13 %.
    np.testing.assert_allclose(own, 1.0, atol=4 * 0.13)


@pytest.mark.parametrize(
    ("effect", "values", "before"),
    [
        (SignalDependentNoise(), (0.03, 0.7), AddedNoise(common=0.04, common_shared=0.4)),
        (CommonModeNoise(), (0.04, 0.4), AddedNoise(share=0.03, power=0.7)),
    ],
)
@pytest.mark.parametrize("single", [False, True])
def test_variances_of_two_effects_of_the_noise_add_up(
    effect: NoiseEffect, values: Values, before: AddedNoise, single: bool
) -> None:
    """In either order of the effects: the normal density of contrasts; elements of touches or samples are missing."""
    rng = np.random.default_rng(7)
    samples, signal = rng.standard_normal((TOUCHES, SAMPLES, M)), rng.uniform(-0.2, 1.1, (TOUCHES, M))
    samples[3, :, 1] = np.nan
    if single:
        samples[5, 0, 0], samples[6, :2, 2], samples[6, 3, 0], samples[7, 1] = np.nan, np.nan, np.nan, np.nan
        samples[8, 1:, 1] = np.nan
    here = ~np.isnan(samples)
    means = np.where(here, samples, 0.0).sum(axis=1, keepdims=True) / np.maximum(here.sum(axis=1, keepdims=True), 1)
    known: Any = SimpleNamespace(
        deviation=(samples - means).reshape(-1, M),
        row_touch=np.repeat(np.arange(TOUCHES), SAMPLES),
        n_touches=TOUCHES,
        weight=np.ones(TOUCHES * SAMPLES),
        means=SimpleNamespace(pure_error_dof=np.ones(M)),
    )
    model: Any = SimpleNamespace(known=known, predict=lambda vector: Predicted(signal, None))
    noise = NoiseModel(SD, np.ones(TOUCHES), PEAK, before)
    fitted: Any = SimpleNamespace(model=model, vector=None, noise=noise)
    own, scale = np.array([0.5, 0.8, 1.2]), np.array([0.3, 0.2, 0.1])
    shared = 0.04 * PEAK**0.6 * PEAK.mean() ** 0.4
    wanted = 0.0
    for touch in range(TOUCHES):
        grown = (0.03 * PEAK * np.abs(signal[touch] / PEAK) ** 0.7) ** 2
        covariance = np.kron(np.diag(own * scale**2 + grown) + np.outer(shared, shared), np.eye(SAMPLES))
        there = ~np.isnan(samples[touch].T)
        parts = [helmert(int(some.sum())) if some.any() else np.zeros((0, 0)) for some in there]
        contrasts, some = block_diag(*parts), there.ravel()
        law = contrasts @ covariance[np.ix_(some, some)] @ contrasts.T
        seen = contrasts @ samples[touch].T.ravel()[some]
        wanted += stats.multivariate_normal(np.zeros(len(seen)), law).logpdf(seen)
        wanted += 0.5 * len(seen) * np.log(2 * np.pi)
    (found,) = terms_beside_others(fitted, effect, scale)(values, own)
    assert found == pytest.approx(wanted, rel=1e-12)
