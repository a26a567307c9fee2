"""Bells that fall off in other ways."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bayestouch.effects.bell import TAILS, bell

LOW, HIGH = TAILS.prior.support
tails = st.floats(LOW, HIGH)


@given(tails)
def test_a_bell_is_one_in_the_middle_and_a_half_at_its_half_width(tails: float) -> None:
    assert bell(np.array([0.0, 1.0]), tails) == pytest.approx([1.0, 0.5], rel=1e-9)


@given(tails)
def test_a_bell_falls(tails: float) -> None:
    values = bell(np.linspace(0, 5, 200) ** 2, tails)
    assert np.all(np.diff(values) <= 0) and np.all(values >= 0)


def test_known_bells() -> None:
    u2 = np.linspace(0, 3, 50) ** 2
    np.testing.assert_allclose(bell(u2, 0.0), np.exp(-np.log(2) * u2))
    # The next order in the tails is at most tails · (ln 2 u²)²/2 · bell, 0.3 of them.
    np.testing.assert_allclose(bell(u2, 1e-7), bell(u2, 0.0), atol=1e-7)
    np.testing.assert_allclose(bell(u2, 1.0), 1 / (1 + u2))
    np.testing.assert_allclose(bell(u2, -1.0), np.maximum(1 - u2 / 2, 0), atol=1e-11)
