"""Second-order shift of the coordinates of a finger by the values of its effects."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray

# Points for each coefficient, and how much wider than the normal approximation they are spread. Beyond FARTHEST
# standard deviations the shift stays what it is there.
POINTS, WIDER, FARTHEST = 2.0, 1.3, 4.0
# Shift, in standard deviations of the other coordinates, below which chains need none.
SLIGHT = 0.5


@dataclass(frozen=True, eq=False)
class Bend:
    """Shift of n coordinates of the chain by k values of effects: a polynomial of second order.

    The mode of the other coordinates given the values is linear in these where effects are: the change of the responses
    by a creep of unknown size and time is a product of both.

    Attributes
    ----------
    centre : (k,) array
        Values of which the others are at their mode.
    scale : (k, k) array
        Inverse Cholesky factor of the covariance of the values.
    coefficients : (c, n) array
        Of one, each standard variable of the values, and each product of two.
    """

    centre: FloatArray
    scale: FloatArray
    coefficients: FloatArray

    def __call__(self, values: FloatArray) -> FloatArray:
        """Shifts (p, n) at values (p, k)."""
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
        """The shift that the steps at random values show; None if all of them are slight.

        Parameters
        ----------
        step : callable
            From values (k,) to the step (n,) from the linear prediction to the mode of the others, and its length in
            standard deviations.
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
        steps, lengths = zip(*(step(each) for each in values), strict=True)
        if max(lengths) < SLIGHT:
            return None
        scale = np.asarray(np.linalg.inv(root), dtype=np.float64)
        at = np.clip((values - centre) @ scale.T, -FARTHEST, FARTHEST)
        return cls(centre, scale, np.asarray(np.linalg.lstsq(terms(at), np.array(steps), rcond=None)[0]))


def terms(x: FloatArray) -> FloatArray:
    """Terms of a polynomial of second order in x (n, k): one, each x, and each product of two; (n, c)."""
    first, second = np.triu_indices(x.shape[1])
    return np.concatenate([np.ones((len(x), 1)), x, x[:, first] * x[:, second]], axis=1)
