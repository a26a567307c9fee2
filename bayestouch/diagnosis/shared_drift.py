"""Held-out loads that are read with a drift that all gains share: the touches of a correlation time have one error."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.diagnosis.blocks import LEAST_BLOCKS
from bayestouch.diagnosis.traced import EvaluatedModel

# Key of the load of a finger that is read without the force sensor. A drift that all gains share changes it as a change
# of all loads would, and only its course in the calibration distinguishes it from such a change, which no reader has:
# the loads of all touches within a correlation time have one error, by one draw of the drift. So they are one
# comparison, not one each. On a pad a drift counts as noise, and loads are read as without it.
LOAD_ALONE = "P_rms_N_per_m"
# Length of a block of such touches in correlation times: at this distance the correlation is 0.14 (Matérn 3/2).
DRIFT_BLOCK = 2.0


def blocks_of_drift(model: EvaluatedModel) -> IntArray | None:
    """Block of each held-out touch, (t,), for the loads that are read with a drift that all gains share; None without.

    Touches of one block have nearly the same drift, and those of others nearly another.
    """
    shared = [values for drift, values in model.fitted.drifts if not drift.own(values)]
    if not shared or model.held_out is None:
        return None
    longest = max(values[1] for values in shared)
    return np.floor(model.held_out.observed.touch_time_s / (DRIFT_BLOCK * longest)).astype(np.int64)


def by_block(values: FloatArray, block: IntArray) -> FloatArray:
    """Mean of the known values (t,) of each block; none if the blocks are too few for a standard error."""
    known = np.isfinite(values)
    means = [values[known & (block == each)].mean() for each in np.unique(block[known])]
    return np.array(means if len(means) >= LEAST_BLOCKS else [])
