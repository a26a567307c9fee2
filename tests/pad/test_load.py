"""How much of the residuals goes with the load."""

from __future__ import annotations

import numpy as np

from bayestouch.pad.load import _trend_share


def test_share_that_a_parabola_explains() -> None:
    """One element all, one none (it is at right angles to a parabola), one half of its variance; one too few."""
    load = np.array([1.0, 2.0, 3.0, 4.0, 5.0])
    trend, other = np.array([-2.0, -1, 0, 1, 2]), np.array([-1.0, 2, 0, -2, 1])  # orthogonal; squares 10 and 10
    few = np.array([1.0, 5.0, np.nan, 2.0, np.nan])
    columns = [3 * trend + load**2, other, trend + other, few]
    shares = [_trend_share(column[:, None], load) for column in columns]
    np.testing.assert_allclose(shares, [1.0, 0.0, 0.5, np.nan], atol=1e-12)
    np.testing.assert_allclose(_trend_share(np.stack(columns, axis=1), load), 0.5)
    np.testing.assert_allclose(_trend_share(np.full((5, 1), 7.0), load), 1.0)
    four = np.array([1.0, -1.0, -1.0, 1.0, np.nan])
    np.testing.assert_allclose(_trend_share(four[:, None], load), 1.0)
