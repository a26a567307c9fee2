"""Whitened columns of a linear model with many random functions, most of which change one element only.

A function of time for each of m elements has k m columns; before whitening only one entry in m is not zero. Whitened
columns are full, but products with them are computed from the sparse columns and the whitening.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayestouch.array_types import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class WhiteColumns:
    """c whitened columns over t touches of m elements; columns of a single element are stored before whitening.

    Attributes
    ----------
    count : int
        Number of columns c.
    full, full_index : (t m, a) array, (a,) int array
        Columns that change several elements, whitened, and their indices.
    own, own_index : (m, b, t) array, (m, b) int array
        Columns that change one element only, before whitening, and their indices; an element with fewer than b
        columns has zeros with the index c.
    root : (t, m, m) array
        Whitening matrix of each touch.
    """

    count: int
    full: FloatArray
    full_index: IntArray
    own: FloatArray
    own_index: IntArray
    root: FloatArray

    @classmethod
    def of(cls, raw: FloatArray, root: FloatArray) -> WhiteColumns:
        """From columns before whitening (c, t, m), NaN missing, and the whitening matrix (t, m, m) of each touch."""
        raw = np.where(np.isnan(raw), 0.0, raw)
        count, t, m = raw.shape
        moves = raw.any(axis=1)
        alone = moves.sum(axis=1) == 1
        element = moves.argmax(axis=1)
        of_element = [np.flatnonzero(alone & (element == e)) for e in range(m)]
        most = max((len(each) for each in of_element), default=0)
        own, index = np.zeros((m, most, t)), np.full((m, most), count)
        for e, each in enumerate(of_element):
            own[e, : len(each)], index[e, : len(each)] = raw[each, :, e], each
        several = np.flatnonzero(~alone)
        full = np.einsum("tij,ctj->tic", root, raw[several], optimize=True).reshape(t * m, len(several))
        return cls(count, np.ascontiguousarray(full), several, own, index, root)

    @classmethod
    def of_elements(cls, columns: Sequence[FloatArray], root: FloatArray) -> WhiteColumns:
        """From columns as they are that move one element each, (c_e, t) for every element, and the whitening."""
        t, m = root.shape[:2]
        counts = [len(each) for each in columns]
        count, most = sum(counts), max(counts, default=0)
        own, index = np.zeros((m, most, t)), np.full((m, most), count)
        for e, (each, first) in enumerate(zip(columns, np.cumsum([0, *counts]), strict=False)):
            own[e, : len(each)], index[e, : len(each)] = each, first + np.arange(len(each))
        return cls(count, np.zeros((t * m, 0)), np.zeros(0, dtype=np.int64), own, index, root)

    @property
    def shape(self) -> tuple[int, int]:
        """Touches t and elements m."""
        return self.root.shape[0], self.root.shape[1]

    def times(self, weights: FloatArray) -> FloatArray:
        """Product of the columns with weights (c, q): whitened rows (t m, q)."""
        t, m = self.shape
        padded = np.concatenate([weights, np.zeros((1, weights.shape[1]))])
        each = np.swapaxes(self.own, 1, 2) @ padded[self.own_index]
        rows = (self.root @ each.transpose(1, 0, 2)).reshape(t * m, -1)
        return np.asarray(rows + self.full @ weights[self.full_index])

    def transposed(self, rows: FloatArray) -> FloatArray:
        """Scalar products (c, q) of the columns with whitened rows (t m, q)."""
        t, m = self.shape
        out = np.zeros((self.count + 1, rows.shape[1]))
        out[self.full_index] = self.full.T @ rows
        back = np.swapaxes(self.root, 1, 2) @ rows.reshape(t, m, -1)
        out[self.own_index] = self.own @ np.ascontiguousarray(back.transpose(1, 0, 2))
        return out[:-1]

    def gram(self) -> FloatArray:
        """Gram matrix of the columns, (c, c)."""
        m = self.shape[1]
        out = np.zeros((self.count + 1, self.count + 1))
        with_full = self.transposed(self.full)
        out[:-1, self.full_index] = with_full
        out[self.full_index, :-1] = with_full.T
        precision = np.ascontiguousarray((np.swapaxes(self.root, 1, 2) @ self.root).transpose(1, 2, 0))
        for e in range(m):
            for f in range(e, m):
                block = (self.own[e] * precision[e, f]) @ self.own[f].T
                out[np.ix_(self.own_index[e], self.own_index[f])] = block
                out[np.ix_(self.own_index[f], self.own_index[e])] = block.T
        return out[:-1, :-1]

    def dense(self) -> FloatArray:
        """The whitened columns as one array, (t m, c)."""
        t, m = self.shape
        out = np.zeros((t, m, self.count + 1))
        out[:, :, self.full_index] = self.full.reshape(t, m, -1)
        for e in range(m):
            out[:, :, self.own_index[e]] = self.root[:, :, e, None] * self.own[e].T[:, None]
        return out[:, :, :-1].reshape(t * m, self.count)

    def whitened(self, root: FloatArray) -> WhiteColumns:
        """These columns, so far with a whitening matrix of one, with the whitening matrix (t, m, m) of each touch."""
        t, m = self.shape
        return replace(self, full=(root @ self.full.reshape(t, m, -1)).reshape(t * m, -1), root=root)

    def of_touches(self, which: IntArray) -> WhiteColumns:
        """The columns for some of the touches only, with indices `which`."""
        t, m = self.shape
        full = self.full.reshape(t, m, -1)[which].reshape(len(which) * m, -1)
        return replace(self, full=full, own=np.ascontiguousarray(self.own[:, :, which]), root=self.root[which])
