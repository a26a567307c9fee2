"""Linear algebra of normal approximations."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch.sampling.laplace import solve_lower


@pytest.mark.parametrize("transposed", [False, True])
def test_triangular_systems_are_solved(transposed: bool) -> None:
    rng = np.random.default_rng(0)
    root = np.tril(rng.normal(size=(5, 7, 7))) + 3 * np.eye(7)
    x = rng.normal(size=(5, 7))
    rows = np.stack([(one.T if transposed else one) @ each for one, each in zip(root, x, strict=True)])
    kept = rows.copy()
    np.testing.assert_allclose(solve_lower(root, rows, transposed=transposed), x, rtol=1e-10, atol=1e-12)
    np.testing.assert_array_equal(rows, kept)
