"""emcee's sampler for log densities that take arrays of points."""

from __future__ import annotations

from typing import Any

from emcee import EnsembleSampler

from bayestouch.array_types import FloatArray


class ArraySampler(EnsembleSampler):  # type: ignore[misc]  # emcee has no types
    """Sampler of emcee with a vectorised log density that returns an array.

    `emcee.EnsembleSampler` converts each value to a Python number, as the function that it calls may return almost
    anything. For the touches of a table this takes half as long as the densities themselves. It also prints a traceback
    for each exception in the function, Ctrl-C included, and all points: the function is called without that. It copies
    the state of its random numbers after every step, too, which no one asks for: none is kept.
    """

    @property
    def random_state(self) -> None:
        """State of the random numbers: not copied. A state can be set."""

    @random_state.setter
    def random_state(self, state: Any) -> None:
        EnsembleSampler.random_state.fset(self, state)

    def compute_log_prob(self, coords: FloatArray) -> tuple[FloatArray, None]:
        """Return the log density (n,) of points (n, d), and no blobs; moves of emcee call this."""
        return self.log_prob_fn.f(coords), None
