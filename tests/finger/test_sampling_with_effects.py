"""First guess of the noise beside functions with unknown weights."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch.finger.sampling_with_effects import _spent
from bayestouch.sampling.rank_one import inverse_root


def test_degrees_of_freedom_are_those_of_each_reading_as_it_is() -> None:
    """Not of whitened readings, which mix the elements of a touch: by inverses of whole covariances, written out."""
    rng = np.random.default_rng(3)
    t, m, c = 7, 4, 5
    own, by_load = rng.uniform(0.5, 2.0, (t, m)), 3 * rng.standard_normal((t, m))
    columns = rng.standard_normal((c, t, m))
    root = inverse_root(own, (by_load,), np.ones((t, m), dtype=bool))
    white = np.einsum("tij,ctj->cti", root, columns)
    gram = np.eye(c) + white.reshape(c, -1) @ white.reshape(c, -1).T
    half = np.linalg.solve(np.linalg.cholesky(gram), white.reshape(c, -1)).reshape(c, t, m)
    without = np.zeros((t * m, t * m))
    for i in range(t):
        part = slice(i * m, (i + 1) * m)
        without[part, part] = np.diag(own[i]) + np.outer(by_load[i], by_load[i])
    flat = columns.reshape(c, -1)
    less = np.linalg.inv(without) - np.linalg.inv(without + flat.T @ flat)
    expected = (np.diag(less).reshape(t, m) * own).sum(axis=0)
    assert _spent(half, root, own) == pytest.approx(expected, rel=1e-9)
    # All together they are fewer than the columns, which the errors of the loads partly hide.
    assert expected.sum() < c
