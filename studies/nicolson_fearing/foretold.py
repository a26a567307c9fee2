"""What the studies of sweet spots share: a bias that was predicted, beside the one that was seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.reliability import BiasMap, Explained, explained_sign, explained_size


@dataclass(frozen=True, eq=False)
class Foretold:
    """Bias of R on one finger, predicted from residuals and seen; (k, n) by tip and place, mm.

    Attributes
    ----------
    predicted : (k, n) array
        Before any of these touches.
    seen : BiasMap
        Of posterior means of averages.
    """

    name: str
    predicted: np.ndarray
    seen: BiasMap

    @property
    def score(self) -> Explained:
        """Of the signed error."""
        return explained_sign(self.predicted, self.seen.error)

    @property
    def size_score(self) -> Explained:
        """Of the absolute error."""
        return explained_size(np.abs(self.predicted) / np.sqrt(2 / np.pi), self.seen.error)

    @property
    def left(self) -> np.ndarray:
        """Error when the prediction is taken off."""
        return self.seen.error - self.predicted
