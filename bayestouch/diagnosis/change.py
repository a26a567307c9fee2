"""Standard errors of the changes of a diagnosis' errors, from differences touch by touch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.diagnosis.shared_drift import LOAD_ALONE, blocks_of_drift, by_block
from bayestouch.diagnosis.traced import EvaluatedModel
from bayestouch.model.held_out import HeldOut
from bayestouch.model.touch_errors import summarised


def standard_errors(before: EvaluatedModel, after: EvaluatedModel) -> dict[str, float]:
    """Standard error of each change (error after, against stated references, minus error before), by key; NaN unknown.

    The same touches are compared before and after, so that common parts cancel. Summaries are linearised in the
    squares of the errors (a root mean square r changes by ``d(e²) / (2 r)``). The standard error is that of a mean over
    touches, which are independent; of loads that share a drift, that of a mean over blocks (`shared_drift`).
    """
    parts: list[tuple[str, FloatArray, FloatArray]] = []
    if before.held_out is not None and after.held_stated is not None:
        one, two = before.held_out, after.held_stated
        parts.append(("prediction_error_percent_peak", _of_error(one), _of_error(two)))
        if one.samples is not None:
            first, last = (_of_error(replace(held, samples=None)) for held in (one, two))
            parts.append(("touch_error_percent_peak", first, last))
        parts.append(("lack_of_fit", _of_lack(one), _of_lack(two)))
    if before.read is not None and after.read is not None:
        for key, values in before.read.by_touch.items():
            parts.append((key, _influence(key, values), _influence(key, after.read.by_touch[key])))
    out = {key: _of_mean(last - first) for key, first, last in parts}
    blocks = blocks_of_drift(after)
    if blocks is None or LOAD_ALONE not in out or before.read is None or after.read is None:
        return out
    loads = before.read.by_touch[LOAD_ALONE], after.read.by_touch[LOAD_ALONE]
    first, last = (_influence(LOAD_ALONE, values) for values in loads)
    means = by_block(last - first, blocks)
    # Of the size of a single draw no more is known than the draw itself.
    single = abs(summarised(LOAD_ALONE, loads[1]) - summarised(LOAD_ALONE, loads[0]))
    return {**out, LOAD_ALONE: _of_mean(means) if len(means) else single}


def _influence(key: str, values: FloatArray) -> FloatArray:
    """Contribution of each touch to its summary, (t,); up to a constant, the summary is the mean of these."""
    if "rms" in key:
        return np.asarray(values**2 / (2 * summarised(key, values)))
    # The size of a bias counts, whatever its sign.
    return np.asarray(values * np.sign(summarised(key, values)) if "bias" in key else values)


def _of_error(held: HeldOut) -> FloatArray:
    """Contributions to `HeldOut.error_percent_peak`, a mean over elements of root mean squares, (t,)."""
    alive = np.isfinite(held.errors).any(axis=0)
    squares = held.errors[:, alive] ** 2
    mean = np.nanmean(squares, axis=0)
    # Weights of the mean over an element's readings, some of which may be missing.
    weight = len(squares) / np.isfinite(squares).sum(axis=0)
    each = 100 * np.nansum(weight * squares / (2 * np.sqrt(mean)), axis=1) / alive.sum()
    if held.samples is None:
        return np.asarray(each)
    row, n = held.observed.row_touch, held.observed.n_touches
    # Touches with more samples have a larger weight.
    return np.asarray(np.bincount(row, weights=each, minlength=n) * n / len(row))


def _of_lack(held: HeldOut) -> FloatArray:
    """Contributions to `HeldOut.lack_of_fit`, (t,)."""
    n = held.observed.n_touches
    return np.asarray((held.whitened**2).sum(axis=1) * n / held.freedom if held.freedom >= 1 else np.full(n, np.nan))


def _of_mean(values: FloatArray) -> float:
    values = values[np.isfinite(values)]
    return float(values.std(ddof=1) / np.sqrt(len(values))) if len(values) > 1 else float("nan")
