"""Uncertainty of drifts and of effects of the noise, and sizes of corrections, by closed forms."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from bayestouch.diagnosis import drift_posterior
from bayestouch.diagnosis.correction_basis import SIZES, _best_sizes, _gain
from bayestouch.diagnosis.drift_posterior import _at_its_mode, _marginal, _peak
from bayestouch.diagnosis.follow import _steps, effects_as_added
from bayestouch.diagnosis.noise_posterior import GROUPS, jackknife, rescaled
from bayestouch.diagnosis.noise_search import TouchScatter
from bayestouch.effects.effect import EffectParameter
from bayestouch.effects.noise import NoiseEffect
from bayestouch.model.linear import Linearised, Score
from bayestouch.priors.parameters import Uniform

SLOPE, INFORMATION = np.array([60.0, -150.0]), np.array([[400.0, 100.0], [100.0, 900.0]])


def evidence(slope: np.ndarray, information: np.ndarray, size: np.ndarray) -> float:
    """Log density of a slope whose weights have these sds, over that without."""
    wide = information + information @ np.diag(size**2) @ information
    zero = np.zeros(len(slope))
    return float(
        stats.multivariate_normal(zero, wide).logpdf(slope) - stats.multivariate_normal(zero, information).logpdf(slope)
    )


def test_gain_of_a_correction() -> None:
    score = Score(SLOPE, INFORMATION, np.diag(INFORMATION))
    for size in ([0.1, 0.03], [0.0, 0.1], [0.2, 0.0]):
        assert _gain(score, np.array(size)) == pytest.approx(evidence(SLOPE, INFORMATION, np.array(size)))
    assert _gain(score, np.zeros(2)) == 0.0


def test_sizes_of_the_parts_of_a_correction() -> None:
    """Independent parts of one and of two functions: each has its own best size."""
    assert SIZES == (0.0, 0.003, 0.01, 0.03, 0.1)
    information = np.diag([1e4, 1e4, 1e4])
    slope = np.array([400.0, 50.0, -60.0])
    score, part = Score(slope, information, np.diag(information)), np.array([0, 1, 1])
    sizes, gain = _best_sizes(score, part, 2)
    best = max(((a, b) for a in SIZES for b in SIZES), key=lambda s: evidence(slope, information, np.array(s)[part]))
    assert tuple(sizes) == best and gain == pytest.approx(evidence(slope, information, np.array(best)[part]))
    nothing, gain = _best_sizes(Score(np.zeros(3), information, np.ones(3)), part, 2)
    assert not nothing.any() and gain == 0.0


def test_peak_of_a_parabola() -> None:
    """Place and sd; a step and a width at the least and the most."""
    x = np.linspace(0.0, 2.0, 5)
    assert _peak(x, -0.5 * ((x - 1.2) / 0.3) ** 2) == pytest.approx((1.2, 0.3))
    assert _peak(x, -0.5 * ((x - 0.3) / 0.4) ** 2) == pytest.approx((0.3, 0.4))
    assert _peak(x, -0.5 * ((x - 5.0) / 0.4) ** 2) == pytest.approx((2.0, 0.4)), "a step beyond the last but one"
    assert _peak(x, -0.5 * ((x + 5.0) / 0.4) ** 2) == pytest.approx((0.0, 0.4))
    assert _peak(x, -0.5 * ((x - 1.0) / 9.0) ** 2)[1] == 0.5 and _peak(x, -0.5 * ((x - 1.0) / 0.01) ** 2)[1] == 0.02


def linear() -> Linearised:
    rng = np.random.default_rng(0)
    return Linearised(
        residual=rng.standard_normal((3, 2)),
        jacobian=rng.standard_normal((6, 2)),
        deviation=rng.standard_normal((4, 2)),
        deviation_jacobian=rng.standard_normal((8, 2)),
        touch=np.zeros(4, dtype=np.int64),
        pull=rng.standard_normal(2),
        precision=np.array([1.0, 3.0]),
    )


def test_moved_to_its_mode_a_model_has_no_slope() -> None:
    before = linear()
    moved = _at_its_mode(before)
    np.testing.assert_allclose(moved.gradient(), 0.0, atol=1e-7)
    assert moved.cost() < before.cost()
    half = _at_its_mode(replace(before, deviation_jacobian=None))
    np.testing.assert_allclose(half.gradient(), 0.0, atol=1e-7)
    np.testing.assert_array_equal(half.deviation, before.deviation)


def test_marginal_likelihood_of_sizes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drift_posterior, "drift_columns", lambda model, vector, drifts: None)
    fitted: Any = SimpleNamespace(model=None, vector=None, whitening=SimpleNamespace(columns=lambda raw: None))
    scorer: Any = SimpleNamespace(of_columns=lambda columns: Score(SLOPE, INFORMATION, np.zeros(2)))
    sizes = np.array([0.01, 0.2])
    found = _marginal(fitted, scorer, None, sizes)  # type: ignore[arg-type]
    np.testing.assert_allclose(found, [evidence(SLOPE, INFORMATION, np.full(2, size)) for size in sizes])


class Wider(NoiseEffect):
    """The most probable size is the root mean square of z."""

    name, stage, summary = "wider", "noise", ""
    parameters = (EffectParameter("size", "", "", Uniform(0.01, 50.0), (0.5, 3.0), 1.0),)

    def log_density(self, scatter: Any, values: tuple[float, ...]) -> np.ndarray:
        return np.asarray(stats.norm.logpdf(scatter.z, 0, values[0]).sum(axis=1))


def scatter(z: np.ndarray) -> TouchScatter:
    n, m = z.shape
    return TouchScatter(
        z=z,
        signal=np.arange(n * m).reshape(n, m) / 10,
        sd=np.full(m, 0.5),
        peak=np.ones(m),
        weight=np.where(np.arange(n) % 2, 1.0, 0.5),
        touch=np.arange(n),
        half=np.zeros(n, dtype=np.int64),
    )


def test_some_samples_with_their_own_scale() -> None:
    """Weights 1 and 1/2: a mean square of (9 + 1/2 · 1)/1.5 of the first element; the second never scatters."""
    made = scatter(np.array([[5.0, 0.0], [3.0, 0.0], [1.0, np.nan], [7.0, 2.0]]))
    found = rescaled(made, np.array([False, True, True, False]))
    size = np.sqrt(9.5 / 1.5)
    np.testing.assert_allclose(found.z, np.array([[3.0, 0.0], [1.0, np.nan]]) / [size, 1.0])
    np.testing.assert_allclose(found.sd, [0.5 * size, 0.5])
    np.testing.assert_array_equal(found.touch, [1, 2])
    np.testing.assert_array_equal(found.weight, [1.0, 0.5])
    np.testing.assert_allclose(found.signal, [[0.2, 0.3], [0.4, 0.5]])


def test_jackknife(monkeypatch: pytest.MonkeyPatch) -> None:
    """Eight groups of touches by their number: sqrt(7/8 times the squares about the mean of eight fits)."""
    from bayestouch.diagnosis import noise_posterior

    assert GROUPS == 8
    left_out: list[np.ndarray] = []
    fits = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0])
    given = scatter(np.ones((16, 2)))
    monkeypatch.setattr(noise_posterior.TouchScatter, "of", classmethod(lambda cls, fitted: given))
    monkeypatch.setattr(noise_posterior, "rescaled", lambda made, rows: left_out.append(np.flatnonzero(~rows)) or made)
    values = iter(fits)
    monkeypatch.setattr(noise_posterior, "maximum", lambda effect, likelihood: ((float(next(values)),), 0.0))
    (sd,) = jackknife(None, Wider())  # type: ignore[arg-type]
    assert sd == pytest.approx(np.sqrt(7 / 8 * 42))
    assert [each.tolist() for each in left_out] == [[k, k + 8] for k in range(8)]
    monkeypatch.setattr(noise_posterior.TouchScatter, "of", classmethod(lambda cls, fitted: None))
    assert np.isnan(jackknife(None, Wider())).all()  # type: ignore[arg-type]


def test_held_out_residuals_at_the_beginning_of_each_round() -> None:
    """Before, at each round between, and with all that was found."""
    evaluate: Any = SimpleNamespace(held=lambda fitted, correction: f"held {fitted}")
    before, after = (SimpleNamespace(held_out=name) for name in ("first", "last"))
    rounds = tuple(SimpleNamespace(before=k) for k in range(4))
    for n, wanted in ((1, ("first",)), (2, ("first", "last")), (4, ("first", "held 1", "held 2", "last"))):
        assert _steps(rounds[:n], evaluate, before, after) == wanted  # type: ignore[arg-type]
    none: Any = SimpleNamespace(held_out=None)
    assert _steps(rounds[:2], evaluate, none, none) == ()  # type: ignore[arg-type]


def test_effects_in_the_order_in_which_they_were_added() -> None:
    """Drifts with their own standard deviations; one that was dropped later is not among them."""

    def effect(name: str) -> Any:
        return SimpleNamespace(name=name, parameters=(SimpleNamespace(logarithmic=False),))

    first, drift = effect("first"), effect("drift")
    model = SimpleNamespace(effects=(first,), n_base=0, values=lambda vector: ((1.0,),))
    fitted: Any = SimpleNamespace(
        model=model, vector=None, linear=SimpleNamespace(covariance=lambda: np.eye(1)), drifts=((drift, (2.0,)),)
    )
    names = (drift, effect("dropped"), first, None)
    rounds = tuple(
        SimpleNamespace(before=None, added=None if each is None else SimpleNamespace(effect=each, noise=None))
        for each in names
    )
    found = effects_as_added(rounds, fitted, {"drift": (0.3,)})  # type: ignore[arg-type]
    assert [(each.effect.name, each.values, each.sd) for each in found] == [
        ("drift", (2.0,), (0.3,)),
        ("first", (1.0,), (1.0,)),
    ]
