"""Points of a lattice where random numbers are expected."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from bayestouch.finger.reading.even_points import EvenPoints


def test_points_are_powers_of_the_generalised_golden_ratio() -> None:
    """The root of x⁵ = x + 1; each dimension takes the next power, and every block the same points."""
    ratio = float(max(np.roots([1, 0, 0, 0, -1, -1]).real))
    points = EvenPoints(2)
    first, second = points.uniform(3), points.uniform(2, 3)
    assert first.shape == (2, 3) and second.shape == (2, 2, 3) and len(points) == 2
    steps = np.arange(1, 4)
    for block in range(2):
        np.testing.assert_allclose(first[block], (0.5 + steps / ratio) % 1)
        np.testing.assert_allclose(second[block], [(0.5 + steps / ratio**2) % 1, (0.5 + steps / ratio**3) % 1])
    points.uniform(3)
    with pytest.raises(ValueError, match="4 dimensions"):
        points.uniform(1)
    assert EvenPoints(1).uniform(4, 2).shape == (1, 4, 2)


def test_other_distributions() -> None:
    """By their quantiles at the same points."""
    u = EvenPoints(1).uniform(50)
    np.testing.assert_allclose(EvenPoints(1).normal(50), stats.norm.ppf(u))
    np.testing.assert_allclose(EvenPoints(1).gamma(2.5, 50), stats.gamma(2.5).ppf(u))
    np.testing.assert_allclose(EvenPoints(1).exponential(50), stats.expon.ppf(u))
