"""Other places at which a live reader looks: the readings of a touch on few elements may fit at several of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.arrays import nearest_turn
from bayestouch.finger.reading.live_nodes import Nodes
from bayestouch.finger.reading.modes import other_minima
from bayestouch.finger.reading.reader import TURN

ELSEWHERE = "a distant location fits about as well"
# What another place may change: the mean in sd, and the variance in shares of it. They are the errors of mean and sd
# that the documentation states.
OF_MEAN, OF_VARIANCE = 0.1, 0.1


@dataclass(frozen=True, eq=False)
class Fits:
    """How well the templates fit a touch; n templates, by location and then by radius.

    Attributes
    ----------
    load : (n,) array
        Best load over the typical one.
    misfit : (n,) array
        Sum of squares of the whitened residuals, less that of the readings.
    bound : float
        Misfit of a place that leaves a share `UNEXPLAINED` of the readings unexplained.
    """

    load: FloatArray
    misfit: FloatArray
    bound: float

    @property
    def best(self) -> int:
        """Template that fits best."""
        return int(self.misfit.argmin())

    def other_place(self, angles: FloatArray, n_radii: int, mode: float) -> int | None:
        """Template that explains the readings best of the `modes.other_minima`, one for each radius; None without any.

        Parameters
        ----------
        angles : (a,) array
            Locations of the templates, rad.
        n_radii : int
            Number of radii of the templates at each location.
        mode : float
            Location of the mode, rad.
        """
        by_radius = self.misfit.reshape(-1, n_radii).T
        radius, k = other_minima(by_radius, np.full(n_radii, self.bound), angles, np.full(n_radii, mode))
        k = k * n_radii + radius
        return int(k[self.misfit[k].argmin()]) if len(k) else None


@dataclass(frozen=True, eq=False)
class Branch:
    """Where the posterior of a touch may continue: centre x (3,) of (w, θ_c, P), covariance (3, 3).

    `alone` is whether there is a mode; else the location may have a mode near it for other radii than that of the mode.
    """

    x: FloatArray
    covariance: FloatArray
    alone: bool


def left_out(known: Nodes, other: Nodes, tips: int) -> bool:
    """Whether the places of other nodes change mean or sd of the location, beside those that are known.

    The first `tips` nodes of both are for known tips.
    """
    far = np.abs(other.mode - known.mode) > known.reach
    if len(far) > tips:
        radius, knots = other.radius[tips:], known.radius[tips:]
        mode, reach = (np.interp(radius, knots, each[tips:]) for each in (known.mode, known.reach))
        far[tips:] = (np.abs(other.mode[tips:] - mode) > reach) | (radius < knots[0]) | (radius > knots[-1])
    if not far.any():
        return False
    top = max(known.log_mass.max(), other.log_mass[far].max())
    mass, more = np.exp(known.log_mass - top), np.exp(other.log_mass[far] - top)
    mean, variance = _moments(known.log_mass, known.mean[0], known.covariance[0])
    off = nearest_turn(other.mean[0, far] - mean, 0.0, TURN)
    both = float(mass.sum() + more.sum())
    moved = float(more @ off) / both
    wider = float(more @ (other.covariance[0, far] + off**2 - variance)) / both - moved**2
    return bool(abs(moved) > OF_MEAN * np.sqrt(variance) or wider > OF_VARIANCE * variance)


def _moments(log_mass: FloatArray, mean: FloatArray, variance: FloatArray) -> tuple[float, float]:
    """Mean and variance of a mixture of parts with log masses, means and variances (g,)."""
    mass = np.exp(log_mass - log_mass.max())
    mass /= mass.sum()
    middle = float(mass @ mean)
    return middle, float(mass @ (variance + (mean - middle) ** 2))
