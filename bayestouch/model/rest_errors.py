"""Errors of the rest readings that touches share, as the touches themselves show them.

The mean of k readings without contact has an error of ``s/√k``. It is subtracted from every touch of a table that has
no rest reading of its own, so that the touches have the error in common: an offset of each element, with this standard
deviation as its prior. A fit without effects says how large it is. Its parameters absorb a part of an offset; the
estimate takes this into account to first order.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.stats import chi2

from bayestouch.array_types import FloatArray
from bayestouch.model.beginning import Beginning
from bayestouch.model.body import Body
from bayestouch.model.fitting import Fitted
from bayestouch.model.linear import Scorer
from bayestouch.model.split_data import SplitData

# Offsets that noise of rest readings gives once in a thousand data sets are of another cause, and left to its effect.
BY_CHANCE = 0.999
# An offset below this share of its prior's standard deviation is not worth another fit.
NEGLIGIBLE = 0.1


def begun_with_rest(body: Body, data: SplitData, **options: Any) -> tuple[SplitData, Beginning]:
    """The fit without effects, and its data without the errors of rest readings that touches share.

    Parameters
    ----------
    body : Body
        Body of the sensor.
    data : SplitData
        The touches.
    options
        As in `Body.begin`.

    Raises
    ------
    InputError
        For the reasons of `Body.begin`.
    """
    begun = body.begin(data, **options)
    errors = rest_errors(begun.fitted, data)
    if errors is None:
        return data, begun
    data = data.without_rest_errors(errors)
    return data, body.begin(data, **options)


def rest_errors(fitted: Fitted, data: SplitData) -> FloatArray | None:
    """What the errors of the rest readings of a `SplitData` add to the readings of the touches that share them.

    Returns
    -------
    (2, m) array or None
        Offset of each element by the rest reading of the calibration, and by that of the touches to be read; zero where
        no touch of the fit shares it. None if nothing is shared, or the errors are negligible, or larger than the noise
        of the rest readings allows.
    """
    reads, m = data.shared_reads, fitted.model.n_elements
    source = data.source_of_touches(fitted.model.known.means.touch)
    shared = np.array([(source == k).any() for k in range(len(reads))])
    known = shared[:, None] & (reads > 0) & np.isfinite(reads) & fitted.whitening.present.any(axis=0)
    if not known.any():
        return None
    columns = np.zeros((*known.shape, len(source), m))
    for k, e in zip(*np.nonzero(known), strict=True):
        columns[k, e, source == k, e] = 1.0
    score = Scorer(fitted.linear).of_columns(fitted.whitening.columns(columns[known]))
    # The model may lack something that the touches do not share: its scatter counts as noise.
    scatter = max(1.0, fitted.chi_square() / max(fitted.n_readings - len(fitted.vector), 1))
    information, slope = score.information / scatter, score.slope / scatter
    sd = np.broadcast_to(fitted.noise.sd, reads.shape)[known] / np.sqrt(reads[known])
    expected = information + information @ np.diag(sd**2) @ information
    statistic = float(slope @ np.linalg.lstsq(expected, slope)[0])
    if statistic > chi2.ppf(BY_CHANCE, len(sd)):
        return None
    found = np.linalg.solve(information + np.diag(sd**-2.0), slope)
    if np.abs(found / sd).max() < NEGLIGIBLE:
        return None
    out = np.zeros(known.shape)
    out[known] = found
    return out
