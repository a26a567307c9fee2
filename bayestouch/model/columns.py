"""Whitened columns of a linear model with many random functions, most of which change one element only.

A function of time for each of m elements has k m columns; before whitening only one entry in m is not zero. Whitened
columns are full, but products with them are computed from the sparse columns and the whitening.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayestouch.array_types import FloatArray, IntArray

# A column of one element is left out if its square over the noise variance, summed over the touches, is not above this.
# This is 3.5 times as fast; log densities differ from the exact ones by 0.014 (standard deviation over proposals; a
# finger of 16 elements, 468 touches and 1130 columns).
UNSEEN = 0.03


def seen_columns(raw: FloatArray, sd: FloatArray) -> FloatArray:
    """Fewer columns (k, t, m), whose weighted sum has the same distribution except for parts far below the noise.

    Weights are standard normal. Columns that change one element only are therefore replaced by their principal
    components, without the small ones (`UNSEEN`).

    Parameters
    ----------
    raw : (c, t, m) array
        Columns before whitening, NaN missing.
    sd : (t, m) array
        Standard deviation of the noise of each reading.
    """
    white = WhiteColumns.of(raw, np.broadcast_to(np.eye(raw.shape[2]), (*raw.shape[1:], raw.shape[2])))
    kept = [np.where(np.isnan(raw), 0.0, raw)[white.full_index]]
    for e, own in enumerate(white.own):
        axes, sizes, _ = np.linalg.svd(own / sd[:, e], full_matrices=False)
        columns = np.zeros((int((sizes**2 > UNSEEN).sum()), *raw.shape[1:]))
        columns[:, :, e] = axes[:, : len(columns)].T @ own
        kept.append(columns)
    return np.concatenate(kept)


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
        missing = np.isnan(raw)
        if missing.any():  # a copy of hundreds of columns takes longer than all that follows
            raw = np.where(missing, 0.0, raw)
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
        """From columns that change one element each, before whitening, (c_e, t) of each element; `root` (t, m, m)."""
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
        m, most = self.own_index.shape
        out = np.zeros((self.count + 1, self.count + 1))
        with_full = self.transposed(self.full)
        out[:-1, self.full_index] = with_full
        out[self.full_index, :-1] = with_full.T
        precision = np.ascontiguousarray((np.swapaxes(self.root, 1, 2) @ self.root).transpose(1, 2, 0))
        blocks = np.zeros((m, most, m, most))
        for e in range(m):
            with_later = (self.own[e] * precision[e, e:, None]) @ self.own[e:].transpose(0, 2, 1)
            with_later[0] /= 2
            blocks[e, :, e:] = with_later.transpose(1, 0, 2)
        of_own = blocks.reshape(m * most, m * most)
        index = self.own_index.ravel()
        out[index[:, None], index] = of_own + of_own.T
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
        """The columns with the whitening matrices `root` (t, m, m); the matrices so far must be identities."""
        t, m = self.shape
        return replace(self, full=(root @ self.full.reshape(t, m, -1)).reshape(t * m, -1), root=root)

    def of_touches(self, which: IntArray) -> WhiteColumns:
        """The columns for some of the touches only, with indices `which`."""
        t, m = self.shape
        full = self.full.reshape(t, m, -1)[which].reshape(len(which) * m, -1)
        return replace(self, full=full, own=np.ascontiguousarray(self.own[:, :, which]), root=self.root[which])
