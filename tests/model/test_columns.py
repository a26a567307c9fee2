"""Whitened columns: products by structure are those of the full matrix."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch.model.columns import UNSEEN, WhiteColumns, seen_columns
from bayestouch.model.linear import Functions, Linearised, Scorer

T, M = 9, 4


@pytest.fixture(params=["own and full", "own", "full", "none"])
def raw(request: pytest.FixtureRequest) -> np.ndarray:
    """Columns in mixed order: of one element each (uneven numbers of them, one of zeros), and of several."""
    rng = np.random.default_rng(0)
    full = rng.standard_normal((3, T, M))
    own = np.zeros((8, T, M))
    for column, element in enumerate([0, 2, 2, 3, 2, 0, 3]):
        own[column, :, element] = rng.standard_normal(T)
    own[4, :5] = 0
    parts = {"own and full": [own[:4], full[:2], own[4:], full[2:]], "own": [own], "full": [full]}
    return np.concatenate(parts.get(request.param, [full[:0]]))


def white_of(raw: np.ndarray) -> tuple[WhiteColumns, np.ndarray]:
    root = np.tril(np.random.default_rng(1).standard_normal((T, M, M)))
    root[2, 1] = root[2, :, 1] = 0  # a missing reading
    dense = np.einsum("tij,ctj->tic", root, raw).reshape(T * M, len(raw))
    return WhiteColumns.of(raw, root), dense


def test_products(raw: np.ndarray) -> None:
    columns, dense = white_of(raw)
    rng = np.random.default_rng(2)
    weights, rows = rng.standard_normal((len(raw), 2)), rng.standard_normal((T * M, 3))
    near = {"rtol": 1e-12, "atol": 1e-12}
    np.testing.assert_allclose(columns.dense(), dense, **near)
    np.testing.assert_allclose(columns.times(weights), dense @ weights, **near)
    np.testing.assert_allclose(columns.transposed(rows), dense.T @ rows, **near)
    np.testing.assert_allclose(columns.gram(), dense.T @ dense, **near)
    before = WhiteColumns.of(raw, np.broadcast_to(np.eye(M), (T, M, M)))
    np.testing.assert_allclose(before.whitened(columns.root).dense(), dense, **near)
    some = np.array([7, 2, 3])
    kept = dense.reshape(T, M, -1)[some].reshape(len(some) * M, -1)
    np.testing.assert_allclose(columns.of_touches(some).gram(), kept.T @ kept, **near)
    np.testing.assert_allclose(columns.of_touches(some).dense(), kept, **near)


@pytest.mark.parametrize("among", [False, True])
def test_scores_are_those_of_full_columns(raw: np.ndarray, among: bool) -> None:
    """With random functions in the model and without."""
    columns, dense = white_of(raw)
    rng = np.random.default_rng(4)
    others = np.zeros((3, T, M))
    others[0], others[1, :, 1], others[2, :, 2] = rng.standard_normal((T, M)), 1.0, rng.standard_normal(T)
    functions = Functions.of(others, white_of(others)[0]) if among else None
    scorer = Scorer(
        Linearised(
            residual=rng.standard_normal((T, M)),
            jacobian=rng.standard_normal((T * M, 2)),
            deviation=np.zeros((T, M)),
            deviation_jacobian=None,
            touch=np.arange(T),
            pull=np.zeros(2),
            precision=np.ones(2),
            functions=functions,
        )
    )
    if not len(raw):
        assert scorer.of_columns(columns).information.shape == (0, 0)
        return
    one, two = scorer.of_columns(columns), scorer(dense.T.reshape(len(raw), T, M))
    for name in ("slope", "information", "raw"):
        np.testing.assert_allclose(getattr(one, name), getattr(two, name), rtol=1e-10, atol=1e-10)


def test_seen_columns_have_the_distribution_of_all_but_for_what_noise_hides() -> None:
    """Sums of weighted columns: covariances over the noise, element by element, differ by less than the limit."""
    rng = np.random.default_rng(8)
    t, m, c = 40, 3, 30
    place = np.linspace(0, 1, t)
    raw = np.zeros((c + 2, t, m))
    for k in range(c):
        raw[k, :, k % m] = np.exp(-0.4 * (k // m) ** 2) * 3 * np.cos((k // m) * np.pi * place + k)
    raw[c:] = rng.standard_normal((2, t, m))
    raw[:, 5, 1] = np.nan
    sd = rng.uniform(0.5, 1.0, (t, m))
    seen = seen_columns(raw, sd)
    assert len(seen) < len(raw) - 6
    whole, kept = (np.nan_to_num(each / sd).reshape(len(each), -1) for each in (raw, seen))
    left = whole.T @ whole - kept.T @ kept
    assert np.linalg.eigvalsh(left).min() > -1e-9
    for e in range(m):
        assert np.linalg.eigvalsh(left[e::m, e::m]).max() < UNSEEN
    np.testing.assert_allclose(seen[:2], np.nan_to_num(raw[c:]))
