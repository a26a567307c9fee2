"""Where emcee puts the draws of many blocks."""

from __future__ import annotations

from typing import Any

import numpy as np
from emcee.backends import Backend
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray


class BlockBackend(Backend):  # type: ignore[misc]  # emcee has no types
    """Store emcee's steps straight into the arrays of the result, of which they may be a part.

    Walker ``w B + b`` is the w-th of block b.

    Parameters
    ----------
    draws : (W, n, B, d) array
        Room for n steps, filled in place.
    log_density : (W, n, B) array
        The same for the log density.
    """

    def __init__(self, draws: FloatArray, log_density: FloatArray) -> None:
        super().__init__()
        self._draws, self._log_density = np.moveaxis(draws, -1, 0), log_density

    def grow(self, ngrow: int, blobs: Any) -> None:
        """Nothing to do: there is room already."""

    def save_step(self, state: Any, accepted: NDArray[np.bool_]) -> None:
        """Store one step; called by emcee."""
        d, walkers, _, blocks = self._draws.shape
        self._draws[:, :, self.iteration] = state.coords.T.reshape(d, walkers, blocks)
        self._log_density[:, self.iteration] = state.log_prob.reshape(walkers, blocks)
        self.random_state = state.random_state
        self.iteration += 1
