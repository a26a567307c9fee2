"""What effects leave open of a touch: derivatives by differences, against a function whose derivative is known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from bayestouch.effects.element import Proximity
from bayestouch.effects.listing import FINGER
from bayestouch.finger.reading import effects


def test_derivatives_are_local_beside_the_standard_deviation(monkeypatch: pytest.MonkeyPatch) -> None:
    """Factor exp(10 v) and addition 3 v for a value of standard deviation 0.1: at v = 0 the derivatives are 10 and 3.

    The first has an error of (10 · 0.001)²/6, a relative 2e-5, at a hundredth of the standard deviation; a step as
    large as the standard deviation is off by 18 %.
    """

    def scale_and_shift(_chain: Any, _observed: Any, vector: np.ndarray, _signal: Any) -> np.ndarray:
        return np.array([np.exp(10 * vector[1]), 3 * vector[1]]).reshape(2, 1, 1)

    monkeypatch.setattr(effects, "timed_rows", lambda _chain: np.array([1]))
    monkeypatch.setattr(effects, "timed_scale_and_shift", scale_and_shift)
    chain = SimpleNamespace(
        covariance=np.diag([25.0, 0.01]), vector=np.array([7.0, 0.0]), model=SimpleNamespace(n_elements=1)
    )
    slopes = effects.timed_slopes(cast(Any, chain), cast(Any, SimpleNamespace(n_touches=1)), np.ones((1, 1)))
    assert slopes.shape == (1, 2, 1, 1)
    np.testing.assert_allclose(slopes.ravel(), [10.0, 3.0], rtol=1e-4)


def test_a_reading_depends_on_the_tip_that_is_assumed() -> None:
    """For each radius R of a density the effect gets the radius of the indenter, 1/(1/R - 1/r_b)."""
    plain = Proximity.suited(FINGER)
    assert plain is not None
    looser = plain.looser(3)
    assert looser is not None
    outer, angles = FINGER.radii_mm[1], np.array([-10.0, 0.0, 10.0])
    model = SimpleNamespace(
        effects=(looser,),
        finger=SimpleNamespace(element_angles_deg=angles, outer_radius_mm=outer),
        peak=np.ones(3),
        reference_load=200.0,
    )
    chain = SimpleNamespace(
        model=model,
        values={"proximity": (0.0, 20.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.06)},
        correction_table=None,
    )
    blank = np.zeros((4, 3))
    context = effects.EffectContext(
        cast(Any, chain),
        np.ones((4, 3)),
        blank,
        np.zeros((4, 3, 3)),
        np.ones((4, 3)),
        np.zeros((0, 2, 4, 3)),
        exact=True,
        time_s=np.full(4, np.inf),
    )
    share = np.array([0.0, 0.25, 0.5, 1.0])
    found = context.readings(np.ones((4, 3)), share * outer, np.zeros(4), np.full(4, 200.0), np.arange(4))
    # right above the middle element the bell is 1
    np.testing.assert_allclose(found[:, 1], 1 + 0.06 * share, rtol=1e-12)
