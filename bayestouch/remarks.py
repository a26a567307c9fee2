"""What is odd about a touch table although it can be read: told to the user, changed in nothing."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bayestouch.arrays import FloatArray
from bayestouch.touches import Touches

#: A column whose largest (or smallest) value comes back in more than this share of its rows has piled up
#: there. Noise that the readout resolves makes an extreme value unique: 0.1 % is much.
STUCK_SHARE = 0.2

#: Below this many rows with readings an extreme comes back by chance.
STUCK_ROWS = 10


def remarks(touches: Touches) -> Iterator[str]:
    """Tell, one line each, what a reader of the results should know about the table."""
    if touches.n_touches == 1:
        yield "one touch only: there is nothing to compare it with"
    yield from _contact(touches)
    yield from _loads(touches)
    yield from _locations(touches)
    yield from _missing(touches)
    yield from _stuck(touches)


def stuck_shares(touches: Touches) -> tuple[FloatArray, FloatArray]:
    """Share of each element's in-contact readings that equal its smallest, and its largest.

    Returns
    -------
    lowest, highest : array, shape (m,)
        1 and 1 for a constant element; NaN where fewer than `STUCK_ROWS` rows have a reading.
    """
    lowest, highest = np.full(touches.n_elements, np.nan), np.full(touches.n_elements, np.nan)
    for k, values in enumerate(touches.readings[touches.in_contact].T):
        there = values[~np.isnan(values)]
        if len(there) >= STUCK_ROWS:
            lowest[k], highest[k] = np.mean(there == there.min()), np.mean(there == there.max())
    return lowest, highest


def _contact(touches: Touches) -> Iterator[str]:
    away = ~touches.in_contact
    if away.any():
        yield f"{_count(away.sum(), touches.n_rows, 'row')} without contact (contact, depth or load is 0)"
    if (odd := (touches.contact == 1) & away).any():
        rows = _count(odd.sum(), touches.n_rows, "row")
        yield f"{rows} with contact = 1 but a depth or a load of 0, taken as without contact"


def _loads(touches: Touches) -> Iterator[str]:
    missing = np.isnan(touches.load)
    if missing.all():
        yield "no load measured"
    elif missing.any():
        yield f"{_count(missing.sum(), touches.n_rows, 'row')} without a measured load"
    if (negative := touches.load < 0).any():
        yield (
            f"{_count(negative.sum(), touches.n_rows, 'row')} with a load below zero "
            f"(lowest {np.nanmin(touches.load):g}), kept: noise or offset of the force sensor"
        )


def _locations(touches: Touches) -> Iterator[str]:
    there = [v for v in (touches.angle_deg, touches.x_mm, touches.y_mm) if v is not None]
    if not there:
        yield "no reference location"
    elif (missing := np.isnan(there).any(axis=0)).any():
        yield f"{_count(missing.sum(), touches.n_rows, 'row')} without a reference location"


def _missing(touches: Touches) -> Iterator[str]:
    missing = np.isnan(touches.readings)
    if not missing.any():
        return
    gone = missing.all(axis=0)
    for k in np.flatnonzero(gone):
        yield f"e{k + 1:02d}: no reading in any row, so nothing is learnt from this element"
    if count := int(missing[:, ~gone].sum()):
        worst = int(np.argmax(np.where(gone, -1, missing.sum(axis=0))))
        share = 100 * missing[:, worst].mean()
        yield f"{count} readings missing, the most in e{worst + 1:02d} ({share:.3g} % of its rows)"
    if (rows := missing.all(axis=1)).any():
        yield f"{_count(rows.sum(), touches.n_rows, 'row')} without any reading"


def _stuck(touches: Touches) -> Iterator[str]:
    lowest, highest = stuck_shares(touches)
    rows = touches.in_contact
    for k, values in enumerate(touches.readings.T):
        there = values[~np.isnan(values)]
        if len(there) > 1 and there.min() == there.max():
            yield f"e{k + 1:02d}: constant at {there[0]:g}, so nothing is learnt from this element"
            continue
        for share, extreme, which in ((lowest[k], np.nanmin, "smallest"), (highest[k], np.nanmax, "largest")):
            if share > STUCK_SHARE:
                yield (
                    f"e{k + 1:02d}: {100 * share:.0f} % of the readings in contact are exactly its {which}, "
                    f"{extreme(values[rows]):g}: the element may be saturated there"
                )


def _count(part: int, whole: int, noun: str) -> str:
    return f"{int(part)} of {whole} {noun if whole == 1 else noun + 's'}"
