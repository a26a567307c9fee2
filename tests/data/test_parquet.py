"""Parquet tables that are larger than the memory."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bayestouch.data import parquet


def test_memory_does_not_grow_with_the_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What pyarrow holds at most while a table is read in pieces is a small part of a table of many pieces."""
    pa = pytest.importorskip("pyarrow", reason="pyarrow is not installed")
    monkeypatch.setattr(parquet, "CHUNK", 500)
    rng, n, path = np.random.default_rng(0), 50_000, tmp_path / "touches.parquet"
    columns = {f"e{k:02d}": rng.normal(size=n) for k in range(8)}
    parquet.write_parquet(path, columns)
    pool, rows, most = pa.default_memory_pool(), 0, 0
    before = pool.bytes_allocated()
    for piece in parquet.parquet_pieces(path, lambda header: set(header.names)):
        rows, most = rows + len(piece.line), max(most, pool.bytes_allocated() - before)
    assert rows == n
    assert most < 0.3 * sum(values.nbytes for values in columns.values())
