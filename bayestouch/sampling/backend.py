"""Storage for the draws of many blocks from emcee."""

from __future__ import annotations

from typing import Any

import numpy as np
from emcee.backends import Backend
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray


class BlockBackend(Backend):  # type: ignore[misc]  # emcee has no types
    """Backend that stores the steps of emcee directly in the arrays of the result (or in a part of them).

    Walker ``w B + b`` is the w-th walker of block b.

    Parameters
    ----------
    draws : (W, n, B, d) array
        Array for n steps, filled in place.
    log_density : (W, n, B) array
        The same for the log density.
    """

    def __init__(self, draws: FloatArray, log_density: FloatArray) -> None:
        super().__init__()
        self._draws, self._log_density = np.moveaxis(draws, -1, 0), log_density

    def grow(self, ngrow: int, blobs: Any) -> None:
        """Do nothing, because the arrays exist already."""

    def save_step(self, state: Any, accepted: NDArray[np.bool_]) -> None:
        """Store one step; emcee calls this."""
        d, walkers, _, blocks = self._draws.shape
        self._draws[:, :, self.iteration] = state.coords.T.reshape(d, walkers, blocks)
        self._log_density[:, self.iteration] = state.log_prob.reshape(walkers, blocks)
        self.random_state = state.random_state
        self.iteration += 1
