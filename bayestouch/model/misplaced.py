"""Elements that read most at another place than stated, as by columns or places in a wrong order."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray, IntArray
from bayestouch.data.arrays import turned
from bayestouch.data.averages import TouchMeans
from bayestouch.output.text import listed

# An element is at another place if it reads there twice as much for the same load. Gains and tips that differ from
# touch to touch change a reading less than that. Where a swap of neighbours changes less, it also does less harm.
MOST_AT_ITS_PLACE = 0.5
# With less than this share of the median element's largest reading, an element may be dead: its noise is anywhere.
WEAK = 0.1
# Touches with less than this share of the mean load have readings that noise may have made.
LIGHT = 0.25
# Elements that are named; more make no advice clearer.
NAMED = 4


def misplaced(known: TouchMeans, places: FloatArray, columns: tuple[str, ...], unit: str) -> Iterator[str]:
    """Yield a line if elements read most at the stated places of others.

    The reading for the same load is compared, in the median of the touches within half of the distance to the next
    element. This is not the search for swapped wires of `infer`: that one needs a calibration of the right elements.

    Parameters
    ----------
    known : TouchMeans
        Means of t touches with references, readings at rest subtracted. Those without a measured load do not count.
    places : (m, D) array
        Stated places of the elements, in degree or mm.
    columns : tuple of str
        Names of the D columns of locations.
    unit : str
        "°", for places on a circle, or " mm".
    """
    located = [values for name in columns if (values := getattr(known, name)) is not None]
    if len(places) < 2 or len(located) != len(columns):
        return
    circle = unit == "°"
    between = element_distances(places, places, circle)
    half = 0.5 * np.where(between > 0, between, np.inf).min(axis=1)
    read = _read_at(known, element_distances(places, np.stack(located, axis=1), circle) <= half[:, None])
    wrong, most = _wrong(read)
    if not wrong.any():
        return
    names = [
        f"e{e + 1:02d} (stated at {_named(places[e])}{unit}) at {_named(places[most[e]])}{unit}"
        for e in np.flatnonzero(wrong)
    ]
    rest = len(names) - NAMED
    several = [*names[:NAMED], f"{rest} more likewise"] if rest > 0 else names
    yield (
        f"{_mirrored(read, most, places, columns, circle)}elements read most at the places of others: "
        f"{listed(several)}; state the elements in the order of the columns, and all places in one direction"
    )


def _named(place: FloatArray) -> str:
    text = ", ".join(f"{value:g}" for value in place)
    return text if len(place) == 1 else f"({text})"


def element_distances(one: FloatArray, other: FloatArray, circle: bool) -> FloatArray:
    """Distances (m, t) between places (m, D) and (t, D)."""
    apart = one[:, None] - other[None]
    return np.asarray(np.sqrt(((turned(apart) if circle else apart) ** 2).sum(axis=2)))


def _read_at(known: TouchMeans, near: BoolArray) -> FloatArray:
    """Absolute reading per load of each element at each stated place, (m, m); NaN where there is none.

    `near` (m, t) has the touches at each place.
    """
    load = known.load
    pressed = np.isfinite(load) & (load > 0)
    if pressed.any():
        pressed &= load > LIGHT * np.where(pressed, load, 0.0).sum() / pressed.sum()
    per_load = np.abs(known.readings) / np.where(pressed, load, np.nan)[:, None]
    out = np.full((len(near), len(near)), np.nan)
    for f, at in enumerate(near & pressed):
        some = np.isfinite(per_load[at]).any(axis=0)
        out[some, f] = np.nanmedian(per_load[at][:, some], axis=0)
    return out


def _wrong(read: FloatArray) -> tuple[BoolArray, IntArray]:
    """Elements (m,) that read most at the place of another one, and the place at which each reads most."""
    known = np.where(np.isnan(read), -1.0, read)
    most = known.argmax(axis=1)
    largest = known.max(axis=1)
    own = np.diag(read)
    alive = largest > WEAK * np.median(largest)
    return alive & (own < MOST_AT_ITS_PLACE * largest), np.asarray(most)


def _mirrored(read: FloatArray, most: IntArray, places: FloatArray, columns: tuple[str, ...], circle: bool) -> str:
    """What looks reversed, as the beginning of a clause; "" if nothing that lets all read most at their own place."""
    judged = np.isfinite(np.diag(read))
    ends = places.min(axis=0) + places.max(axis=0)
    tried = {
        "the angles look" if circle else f"{name} looks": np.where(np.arange(len(ends)) == c, ends - places, places)
        for c, name in enumerate(columns)
    }
    for name, other in (tried | {"the order of the elements looks": places[::-1]}).items():
        nearest = element_distances(other, places, circle).argmin(axis=1)
        if judged.sum() > 2 and (nearest[judged] == most[judged]).all():
            return f"{name} reversed, as "
    return ""
