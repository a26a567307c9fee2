"""Groups of rows: distinct ids in order, group means and first values."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray, IntArray


def groups(touch: IntArray) -> tuple[IntArray, IntArray]:
    """Distinct ids in order of appearance, shape (t,), and the index of each row's id among them, shape (n,)."""
    ids, first, inverse = np.unique(touch, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")
    rank = np.empty(len(ids), dtype=np.int64)
    rank[order] = np.arange(len(ids))
    return ids[order], rank[inverse]


def index_among(ids: IntArray, touch: IntArray) -> IntArray:
    """Index of each row's id, shape (n,), among distinct ids in any order, shape (t,), which have all of them."""
    order = np.argsort(ids)
    return np.asarray(order[np.searchsorted(ids[order], touch)])


def grouped_mean(values: FloatArray, group: IntArray, n: int, weights: FloatArray | None = None) -> FloatArray:
    """Mean of the values that are not NaN in each of n groups; NaN for a group without values. Shape (n,).

    The function averages deviations from the group's first value. Equal values then give that value exactly,
    and a small scatter on a large offset loses no digits.
    """
    first = first_of(values, group, n)
    some = ~np.isnan(values)
    weights = np.ones(len(values)) if weights is None else weights
    total = np.bincount(group[some], weights=weights[some], minlength=n)
    excess = np.bincount(group[some], weights=(weights * (values - first[group]))[some], minlength=n)
    return np.asarray(first + np.divide(excess, total, out=np.zeros(n), where=total > 0), dtype=np.float64)


def readings_of_groups(present: BoolArray, group: IntArray, n: int) -> FloatArray:
    """Number of readings of each element in each of n groups, (n, m), from whether each row has it, (rows, m)."""
    return np.stack([np.bincount(group, column, minlength=n) for column in present.T], axis=1)


def uneven_groups(present: BoolArray, group: IntArray, n: int) -> BoolArray:
    """Whether a row of each of n groups has some, but not all, of the elements that the group has. Shape (n,)."""
    of_row, of_group = present.sum(axis=1), (readings_of_groups(present, group, n) > 0).sum(axis=1)
    partly = (of_row > 0) & (of_row < of_group[group])
    return np.asarray(np.bincount(group, partly, minlength=n) > 0)


def first_of(values: FloatArray, group: IntArray, n: int) -> FloatArray:
    """First value that is not NaN in each of n groups; NaN for a group without values. Shape (n,)."""
    first = np.full(n, np.nan)
    some = np.flatnonzero(~np.isnan(values))
    members, at = np.unique(group[some], return_index=True)
    first[members] = values[some[at]]
    return first


def all_equal(values: FloatArray, group: IntArray, n: int) -> BoolArray:
    """Whether each of n groups has two or more values that are not NaN, and all of these are equal. Shape (n,)."""
    some = ~np.isnan(values)
    count = np.bincount(group[some], minlength=n)
    other = np.bincount(group[some], weights=(values != first_of(values, group, n)[group])[some], minlength=n)
    return np.asarray((count > 1) & (other == 0))


def beginnings(time_s: FloatArray, in_contact: BoolArray, group: IntArray, n: int) -> FloatArray:
    """Earliest time in contact of each of n groups; inf for a group without one. Shape (n,)."""
    begin = np.full(n, np.inf)
    np.minimum.at(begin, group, np.where(np.isnan(time_s) | ~in_contact, np.inf, time_s))
    return begin
