"""Second-order shift of the coordinates of a finger, as a function of the values of its effects."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.parallel.parts import of_parts

# Number of points for each coefficient; their spread over that of the normal approximation; number of standard
# deviations beyond which the shift is constant.
POINTS, WIDER, FARTHEST = 2.0, 1.3, 4.0
# Length of a shift, in standard deviations of the other coordinates, below which it is not needed; and below which, at
# the first few points, no more are looked at: a shift of second order grows with the square of the distance.
SLIGHT, STRAIGHT, FEW = 0.5, 0.1, 5


@dataclass(frozen=True, eq=False)
class Bend:
    """Shift of n coordinates of the chain as a function of k values of effects: a polynomial of second order.

    If the effects are linear in their values, the mode of the other coordinates is linear in them too, and no shift is
    needed. A creep of unknown size and time is not linear: it changes the responses by a product of both.

    Attributes
    ----------
    centre : (k,) array
        Values at the centre of the normal approximation.
    scale : (k, k) array
        Inverse Cholesky factor of the covariance of the values.
    coefficients : (c, n) array
        Coefficients of the `terms` of the standardised values.
    """

    centre: FloatArray
    scale: FloatArray
    coefficients: FloatArray

    def __call__(self, values: FloatArray) -> FloatArray:
        """Shifts (p, n) for values (p, k)."""
        z = np.clip((values - self.centre) @ self.scale.T, -FARTHEST, FARTHEST)
        return np.asarray(terms(z) @ self.coefficients)

    @classmethod
    def of(
        cls,
        step: Callable[[FloatArray], tuple[FloatArray, float]],
        centre: FloatArray,
        covariance: FloatArray,
        ends: tuple[FloatArray, FloatArray],
        rng: np.random.Generator,
    ) -> Bend | None:
        """Shift fitted to the steps at random values; None if all steps are short.

        Parameters
        ----------
        step : callable
            Function of values (k,). It returns the step (n,) from the linear prediction of the other coordinates to
            their mode, and the length of this step in standard deviations.
        centre, covariance : (k,), (k, k) arrays
            Mean and covariance of the values.
        ends : pair of (k,) arrays
            Bounds of the values.
        rng : Generator
            Random numbers.
        """
        root, k = np.linalg.cholesky(covariance), len(centre)
        count = int(POINTS * terms(np.zeros((1, k))).shape[1])
        margin = 1e-3 * np.sqrt(np.diag(covariance))
        z = WIDER * rng.standard_normal((count, k))
        values = np.clip(centre + z @ root.T, ends[0] + margin, ends[1] - margin)
        found = [step(each) for each in values[:FEW]]
        if max(length for _, length in found) < STRAIGHT:
            return None
        found += of_parts(step, list(values[FEW:]))
        if max(length for _, length in found) < SLIGHT:
            return None
        scale = np.asarray(np.linalg.inv(root), dtype=np.float64)
        at = np.clip((values - centre) @ scale.T, -FARTHEST, FARTHEST)
        shifts = np.array([shift for shift, _ in found])
        return cls(centre, scale, np.asarray(np.linalg.lstsq(terms(at), shifts, rcond=None)[0]))


def terms(x: FloatArray) -> FloatArray:
    """Terms (n, c) of a polynomial of second order in x (n, k): one, each x, and each product of two."""
    first, second = np.triu_indices(x.shape[1])
    return np.concatenate([np.ones((len(x), 1)), x, x[:, first] * x[:, second]], axis=1)
