"""Values of a drift at which the chain of a finger is linearised, and interpolation between them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.finger.layout import FlatLayout
from bayestouch.model.fitting import Drift
from bayestouch.model.joint_drifts import FREE, DriftEntries

# Nodes of a value of the drift from the centre, in its standard deviations; the centre is first. Within two of them is
# 95 % of the posterior. Farther nodes would leave more room between, where proposals are too wide.
OFFSETS = np.array([0.0, -2.0, 2.0])
# The variance of the mean of a drift goes with the square of its sd and with its correlation time.
POWERS = (2.0, 1.0)


@dataclass(frozen=True, eq=False)
class DriftNodes:
    """Nodes of the log sd and the log correlation time of a drift: all nine combinations, first that of the centre.

    The drift is one that all elements share, as that of a common gain: the responses together are as wide as it lets
    them be. Where each element drifts by itself, the responses together are known from many drifts, and the width at
    the fitted values is enough.

    Attributes
    ----------
    first : int
        Position of the values of the drift in the flat vector.
    centre : (2,) array
        Values of the drift at the centre.
    steps : (2, 3) array
        Nodes of both values less those at the centre.
    """

    first: int
    centre: FloatArray
    steps: FloatArray

    @classmethod
    def of(
        cls, drifts: tuple[Drift, ...], at: FlatLayout, vector: FloatArray, further_sd: FloatArray
    ) -> DriftNodes | None:
        """Nodes about a flat vector (d,), from the standard deviations of the further values.

        None without a drift, with two drifts, or if each element drifts by itself.
        """
        if len(drifts) != 1 or any(drift.own(values) for drift, values in drifts):
            return None
        return cls(at.further.start, vector[at.further][:FREE], further_sd[:FREE, None] * OFFSETS)

    def others(self, drifts: tuple[Drift, ...]) -> list[tuple[Drift, ...]]:
        """The drift with its values at each node but the first."""
        return [DriftEntries(drifts).at(self.centre + steps) for steps in list(product(*self.steps))[1:]]

    def weights(self, vectors: FloatArray) -> FloatArray:
        """Convex weights (n, 9) of the nodes for flat vectors (n, d), constant beyond the outer nodes.

        They are linear in the inverse variance of the mean of the drift. The precision of the chain is a concave
        function of the inverse of the square of the drift's sd: between nodes it is rather too small than too large.
        """
        total = np.ones((len(vectors), 1))
        for k, (power, steps) in enumerate(zip(POWERS, self.steps, strict=True)):
            order = np.argsort(-steps)
            step = np.clip(vectors[:, self.first + k] - self.centre[k], steps.min(), steps.max())
            at, nodes = np.exp(-power * step), np.exp(-power * steps[order])
            own = np.column_stack([np.interp(at, nodes, unit[order]) for unit in np.eye(len(steps))])
            total = (total[:, :, None] * own[:, None]).reshape(len(vectors), -1)
        return total
