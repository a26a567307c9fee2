"""Signals of many vectors with effects on the strain of the elements: as those of each vector by itself."""

from __future__ import annotations

import numpy as np
import pytest
from independent.finger import SMALL
from model_cases import Case, three_times

from bayestouch.effects.catalogue import effect_classes
from bayestouch.effects.listing import FINGER
from bayestouch.finger.local_series import TOGETHER
from bayestouch.finger.model import FingerModel
from bayestouch.finger.prediction_with_effects import EffectPrediction
from bayestouch.finger.strain_series import StrainSeries


@pytest.fixture(scope="module")
def case() -> Case:
    return three_times()


def with_effects(case: Case, *names: str) -> tuple[FingerModel, np.ndarray]:
    """The model with effects in their looser form, and vectors near that of the case for more than one part."""
    suited = [effect_classes()[name].suited(FINGER) for name in names]
    model = case.quick.with_effects(
        tuple(effect.looser(SMALL.n_elements) or effect for effect in suited if effect is not None)
    )
    rng, count = np.random.default_rng(4), TOGETHER + 2
    shape = model.value_priors
    values = shape[:, 0] + 0.4 * shape[:, 1] * rng.standard_normal((count, len(shape)))
    near = case.vector + 1e-3 * rng.standard_normal((count, case.vector.size))
    return model, np.concatenate([near, np.clip(values, *shape[:, 2:].T)], axis=1)


@pytest.mark.parametrize("names", [("aperture",), ("tangential_load",), ("tangential_load", "aperture")])
def test_signals_are_those_of_each_vector(case: Case, names: tuple[str, ...]) -> None:
    model, vectors = with_effects(case, *names)
    assert model.evaluator is not None
    signals, slopes = StrainSeries(model, model.evaluator)(vectors)
    load, step = case.press.load, 0.01 * case.press.load
    for vector, signal, slope in zip(vectors, signals, slopes, strict=True):
        wanted = model.signal(vector).signal
        np.testing.assert_allclose(signal, wanted, atol=1e-12 * np.abs(wanted).max())
        up, down = (model.signal(vector, load + sign * step).signal for sign in (1, -1))
        # Differences with another step than that of the series.
        np.testing.assert_allclose(slope, (up - down) / (2 * step[:, None]), atol=1e-3 * np.abs(slope).max())


def test_the_series_is_used_where_effects_change_the_strain_alone(case: Case) -> None:
    model, vectors = with_effects(case, "aperture", "crosstalk")
    found = EffectPrediction.of(model, vectors[0], np.zeros(vectors.shape[1]), np.ones_like(case.press.load)[:, None])
    assert isinstance(found.signals, StrainSeries)
