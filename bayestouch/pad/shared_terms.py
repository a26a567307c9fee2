"""Functions of the shared entries of a pad, of which the entries of the elements are weighted sums."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray

# Middles and width of the bell functions of log size and of log correlation time of a drift, in standard deviations.
SIZES, TIMES, WIDTH = (-2.6, -1.3, 0.0, 1.3, 2.6), (-1.5, 0.0, 1.5), 1.3


@dataclass(frozen=True, eq=False)
class SharedTerms:
    """Polynomials of second order in k shared entries, and bell functions of the entries of drifts.

    What the readings determine depends on the size of a drift as a step does: it is constant for a drift far below the
    noise, and also for one far above. A polynomial does not follow this.

    Attributes
    ----------
    centre : (k,) array
        Middle of the entries.
    scale : (k, k) array
        Inverse Cholesky factor of the covariance of the entries: the polynomials are in standard units.
    sd : (2 q,) array
        Standard deviations of the last entries, log size and log correlation time of q drifts.
    """

    centre: FloatArray
    scale: FloatArray
    sd: FloatArray

    @classmethod
    def of(cls, centre: FloatArray, spread: FloatArray, drifts: int) -> SharedTerms:
        """Terms about a centre (k,) with covariance `spread` (k, k); the last `drifts` entries are those of drifts."""
        scale = np.linalg.inv(np.linalg.cholesky(spread)) if len(centre) else spread
        return cls(centre, np.asarray(scale), np.sqrt(np.diag(spread))[len(centre) - drifts :])

    def __call__(self, shared: FloatArray) -> FloatArray:
        """Terms (n, c) at shared entries (n, k)."""
        x = (shared - self.centre) @ self.scale.T
        first, second = np.triu_indices(x.shape[1])
        terms = np.concatenate([np.ones((len(x), 1)), x, x[:, first] * x[:, second]], axis=1)
        bells = [self._bells(shared, i) for i in range(0, len(self.sd), 2)]
        return np.concatenate([terms, *bells], axis=1) if bells else terms

    def _bells(self, shared: FloatArray, i: int) -> FloatArray:
        """Bell functions (n, c) of the drift whose entries are those with the indices i and i + 1 of the last ones."""
        at = len(self.centre) - len(self.sd) + i
        z = (shared[:, at : at + 2] - self.centre[at : at + 2]) / self.sd[i : i + 2]
        pairs = zip(z.T, (SIZES, TIMES), strict=True)
        size, time = (np.exp(-0.5 * ((u[:, None] - middles) / WIDTH) ** 2) for u, middles in pairs)
        return np.asarray((size[:, :, None] * time[:, None, :]).reshape(len(z), -1))
