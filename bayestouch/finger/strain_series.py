"""Signals of calibration touches by the series, with effects that change only the strain of the elements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.finger.local_series import TOGETHER
from bayestouch.finger.model import FingerModel
from bayestouch.finger.series import TouchSeries
from bayestouch.parallel.parts import of_parts


@dataclass(frozen=True, eq=False)
class StrainSeries:
    """Signals of many vectors by sums over Fourier modes.

    Depth and width of an element can replace each other. So both may be so uncertain that no polynomial follows the
    signals over their ranges; the touches stay where they are, which makes the sums nearly as fast.

    Attributes
    ----------
    model : FingerModel
        The finger; all of its effects that change poses or the finger change only the strain of its elements.
    series : TouchSeries
        Its fast evaluator.
    """

    model: FingerModel
    series: TouchSeries

    def __call__(self, vectors: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Signals (n, t, m) at the measured loads, and their derivative over the load (n, t, m)."""
        parts = [vectors[first : first + TOGETHER] for first in range(0, len(vectors), TOGETHER)]
        signals, slopes = zip(*of_parts(self._summed, parts), strict=True)
        return np.concatenate(signals), np.concatenate(slopes)

    def _summed(self, vectors: FloatArray) -> tuple[FloatArray, FloatArray]:
        chains = [self.model.chain(vector) for vector in vectors]
        return self.series.with_strain_of(chains)(vectors[:, : self.model.n_base])
