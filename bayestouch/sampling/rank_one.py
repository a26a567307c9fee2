"""Covariances of independent errors plus a few shared errors; independent of tactile sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray


@dataclass(frozen=True, eq=False)
class DiagonalPlusRankOne:
    """Covariance ``Σ = diag(sd²) + v vᵀ`` of the m entries of a row, for any number of rows.

    Source: G. H. Golub and C. F. Van Loan, Matrix Computations (2013), section 2.1.4 (Sherman-Morrison).

    Attributes
    ----------
    sd : (..., m) array
        Standard deviation of the independent errors; ``inf`` excludes an entry.
    direction : (..., m) array
        ``v``: change of each entry by one standard deviation of the shared error; always finite.
    """

    sd: FloatArray
    direction: FloatArray

    @cached_property
    def scaled(self) -> FloatArray:
        """``u = v/sd``, (..., m): the shared error in units of the independent ones."""
        return self.direction / self.sd

    @cached_property
    def length2(self) -> FloatArray:
        """``|u|²``, (...)."""
        return np.asarray((self.scaled * self.scaled).sum(axis=-1))

    def whiten(self, rows: FloatArray) -> FloatArray:
        """Return ``Σ^(-1/2)`` times rows (..., m), with the symmetric root; zero for excluded entries."""
        z, u, length2 = rows / self.sd, self.scaled, self.length2[..., None]
        # (I + u uᵀ)^(-1/2) = I - c u uᵀ with c = (1 - 1/sqrt(1 + |u|²)) / |u|², finite as |u| goes to 0.
        root = np.sqrt(1 + length2)
        factor = 1 / (root * (1 + root))
        return np.asarray(z - factor * u * (u * z).sum(axis=-1, keepdims=True))

    def squared_distance(self, rows: FloatArray) -> FloatArray:
        """Return ``xᵀ Σ^-1 x`` for rows x (..., m), shape (...)."""
        z, u = rows / self.sd, self.scaled
        return np.asarray((z * z).sum(axis=-1) - (u * z).sum(axis=-1) ** 2 / (1 + self.length2))


def log_density_of_contrasts(
    spread: DiagonalPlusRankOne, rows: FloatArray, group: NDArray[np.int64], n: int
) -> FloatArray:
    """Log density of rows (r, m) in n groups whatever the mean of each entry in each group, (n,), up to a constant.

    It is that of orthonormal contrasts of the present rows of each entry, without its powers of 2π: the residual
    likelihood of H. D. Patterson and R. Thompson, Biometrika 58, 545 (1971). Rows may lack any entries.

    Parameters
    ----------
    spread : DiagonalPlusRankOne
        Covariance of the rows, (r, m).
    rows : (r, m) array
        The rows, relative to any origin of each entry in each group; zero where excluded.
    group : (r,) int array
        Group of each row, from 0 to n - 1.
    """
    m = rows.shape[1]
    weight, length = spread.sd**-2.0, 1 + spread.length2
    pulled = weight * spread.direction / np.sqrt(length)[:, None]
    along = weight * rows - pulled * (pulled * rows).sum(axis=1, keepdims=True)
    log_variance = np.where(weight > 0, -np.log(np.where(weight > 0, weight, 1.0)), 0.0).sum(axis=1) + np.log(length)
    own = np.bincount(group, spread.squared_distance(rows) + log_variance, minlength=n)
    size = np.bincount(group, minlength=n)
    order = np.argsort(group, kind="stable")
    place = group[order], np.arange(len(group)) - (np.cumsum(size) - size)[group[order]]
    placed = np.zeros((4, n, int(size.max(initial=0)), m))
    placed[:, place[0], place[1]] = np.stack([weight, pulled, along, weight > 0])[:, order]
    total, _, score, count = placed.sum(axis=2)
    precision = -np.swapaxes(placed[1], 1, 2) @ placed[1]
    np.einsum("gii->gi", precision)[:] += np.where(count > 0, total, 1.0)
    _, log_determinant = np.linalg.slogdet(precision)
    moved = np.linalg.solve(precision, score[:, :, None])[:, :, 0]
    lost = log_determinant - np.log(np.maximum(count, 1)).sum(axis=1) - (moved * score).sum(axis=1)
    return np.asarray(-0.5 * (own + lost))


def inverse_root(variance: FloatArray, directions: Sequence[FloatArray], present: NDArray[np.bool_]) -> FloatArray:
    """``L^-1`` of ``diag(variance) + Σ v vᵀ = L Lᵀ`` for t rows of m entries with several shared errors, (t, m, m).

    Parameters
    ----------
    variance : (t, m) array
        Variance of the independent errors; above zero also for absent entries.
    directions : sequence of (t, m) arrays
        Change of the entries by one standard deviation of each shared error.
    present : (t, m) bool array
        True for present entries; rows and columns of the others are zero.
    """
    if not directions:
        return np.asarray(np.einsum("ti,ij->tij", present / np.sqrt(variance), np.eye(variance.shape[1])))
    first, *others = (np.where(present, direction, 0.0) for direction in directions)
    root = _inverse_root(variance, first)
    for direction in others:
        # In units of what came before, the covariance of each row is the identity.
        seen = (root @ direction[:, :, None])[:, :, 0]
        root = _inverse_root(np.ones_like(seen), seen) @ root
    return root * present[:, :, None]


def _inverse_root(variance: FloatArray, direction: FloatArray) -> FloatArray:
    """`inverse_root` with one shared error s, without a factor of any matrix.

    Entry after entry is predicted from those before: of these, s has the mean ``Σ v x/variance`` over the precision.
    """
    weight = direction / variance
    precision = 1 + np.cumsum(direction * weight, axis=1)
    before = np.concatenate([np.ones_like(precision[:, :1]), precision[:, :-1]], axis=1)
    inverse_sd = np.sqrt(before / (variance * precision))
    out = (-direction * inverse_sd / before)[:, :, None] * weight[:, None, :]
    out *= np.tri(variance.shape[1], k=-1)
    np.einsum("tii->ti", out)[:] = inverse_sd
    return np.asarray(out)


def normal_log_density(root: FloatArray, rows: FloatArray) -> float:
    """Return the joint log density of all rows (t, m) up to a constant, from `inverse_root`; NaN in absent entries."""
    z = np.einsum("tij,tj->ti", root, np.nan_to_num(rows))
    diagonal = np.einsum("tii->ti", root)
    volume = np.log(np.maximum(diagonal, 1e-300))
    return float(-0.5 * (z**2).sum() + np.where(diagonal > 0, volume, 0.0).sum())


def shared_directions(weight: FloatArray, shared: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Inverse of ``diag(1/weight) + Σ v_j v_jᵀ`` as ``diag(weight) - Σ u_j u_jᵀ``, for rows of m entries.

    One shared error after the other (Sherman-Morrison), without a factor of any matrix: many rows with few shared
    errors.

    Parameters
    ----------
    weight : (..., m) array
        Inverse variance of the independent errors; zero leaves an entry out.
    shared : (..., q, m) array
        ``v_j``: change of each entry by one standard deviation of each shared error.

    Returns
    -------
    (..., q, m) array, (...) array
        ``u_j``, and the log determinant of the covariance over that of its diagonal.
    """
    out = np.empty(shared.shape)
    log_determinant = np.zeros(shared.shape[:-2])
    for j in range(shared.shape[-2]):
        v = shared[..., j, :]
        pulled = weight * v
        for i in range(j):
            pulled = pulled - out[..., i, :] * np.einsum("...m,...m->...", out[..., i, :], v)[..., None]
        length = 1 + np.einsum("...m,...m->...", pulled, v)
        out[..., j, :] = pulled / np.sqrt(length)[..., None]
        log_determinant += np.log(length)
    return out, log_determinant


def precision_times(weight: FloatArray, directions: FloatArray, rows: FloatArray) -> FloatArray:
    """Inverse covariance times rows (..., m), from `weight` (..., m) and the directions of `shared_directions`."""
    out = weight * rows
    for j in range(directions.shape[-2]):
        along = np.einsum("...m,...m->...", directions[..., j, :], rows)
        out = out - along[..., None] * directions[..., j, :]
    return np.asarray(out)


def shared_error(
    rows: FloatArray, slope: FloatArray, sd: FloatArray, shared_sd: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return b and precision q (...) of the shared error given the rows: its mean is b/q, its variance 1/q.

    Parameters
    ----------
    rows, slope : (..., m) arrays
        Errors of the entries, and their change by a shared error of 1; always finite.
    sd : (..., m) array
        Standard deviation of the independent errors; ``inf`` excludes an entry.
    shared_sd : (...) array
        Prior standard deviation of the shared error.
    """
    weight = 1 / sd**2
    return (slope * rows * weight).sum(axis=-1), (slope**2 * weight).sum(axis=-1) + shared_sd**-2.0


@dataclass(frozen=True, eq=False)
class AlongError:
    """Weighted sums over the entries of rows of m along what a shared error of one does to them.

    Attributes
    ----------
    pulled : (n, t, m) array
        That change of each entry times its weight.
    squares, rows : (n, t) arrays
        Weighted sums of the change times itself, and times the errors of the entries.
    """

    pulled: FloatArray
    squares: FloatArray
    rows: FloatArray

    @classmethod
    def of(cls, rows: FloatArray, slope: FloatArray, weight: FloatArray) -> AlongError:
        """Of the errors of the entries, their change by a shared error of one, and their weights, (n, t, m) each.

        A weight is the inverse variance of the independent error of an entry; zero leaves it out. All are finite.
        """
        pulled = weight * slope
        return cls(pulled, *(np.einsum("ntm,ntm->nt", pulled, each) for each in (slope, rows)))


def log_density_with_shared_error(
    rows: FloatArray, weight: FloatArray, of_error: AlongError, shared_sd: FloatArray
) -> FloatArray:
    """Log density (n,) of all rows (n, t, m), each row of m with a shared error of its own.

    Up to the sum of half the logarithms of `weight`, which is the caller's. As `DiagonalPlusRankOne`, in as few passes
    over the readings as there can be.

    Parameters
    ----------
    rows, weight : (n, t, m) arrays
        Errors of the entries, and inverse variance of the independent ones, as in `AlongError.of`.
    of_error : AlongError
        The sums over these entries.
    shared_sd : (n, t) array
        Standard deviation of the shared error.
    """
    length2 = shared_sd**2 * of_error.squares
    along = (shared_sd * of_error.rows) ** 2 / (1 + length2)
    squares = np.einsum("ntm,ntm,ntm->n", weight, rows, rows)
    return np.asarray(-0.5 * (squares - along.sum(axis=1) + np.log1p(length2).sum(axis=1)))


def log_density_with_shared_errors(rows: FloatArray, slopes: FloatArray, weight: FloatArray) -> FloatArray:
    """Log density (n, t) of rows (n, t, m), each row of m with several shared errors of its own.

    As `log_density_with_shared_error`, for each row and for k shared errors of standard deviation one.

    Parameters
    ----------
    rows : (n, t, m) array
        Errors of the entries; finite everywhere.
    slopes : (k, n, t, m) array
        Change of the entries by a shared error of 1; finite everywhere.
    weight : (n, t, m) array
        Inverse variance of the independent errors; zero leaves an entry out.
    """
    pulled = weight * slopes
    gram = np.einsum("kntm,lntm->ntkl", pulled, slopes) + np.eye(len(slopes))
    along = np.einsum("kntm,ntm->ntk", pulled, rows)
    root = np.linalg.cholesky(gram)
    white = np.linalg.solve(root, along[..., None])[..., 0]
    volume = np.log(np.diagonal(root, axis1=2, axis2=3)).sum(axis=2)
    squares = np.einsum("ntm,ntm,ntm->nt", weight, rows, rows)
    return np.asarray(-0.5 * (squares - (white**2).sum(axis=2)) - volume)
