"""Other places at which a live reader looks: the readings of a touch on few elements may fit at several of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.finger.reading.live_nodes import Nodes
from bayestouch.finger.reading.modes import OWN

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

    def other_place(self, places: FloatArray, n_radii: int, angle: float) -> int | None:
        """Template that explains the readings best beside the place of the mode, at location `angle` (rad).

        As `modes.other_places`: a minimum over the location for the radius of the template. None if there is none.

        Parameters
        ----------
        places : (n, 2) array
            Coordinate w and location (rad) of the templates.
        n_radii : int
            Number of radii of the templates at each location.
        angle : float
            Location of the mode, rad.
        """
        k = np.flatnonzero(self.misfit < self.bound)
        beyond = np.full(n_radii, np.inf)
        misfit = np.concatenate([beyond, self.misfit, beyond])
        k = k[(self.misfit[k] < misfit[k]) & (self.misfit[k] <= misfit[k + 2 * n_radii])]
        off, radius = np.abs(places[k, 1] - angle), k % n_radii
        nearest = np.full(n_radii, OWN)
        np.minimum.at(nearest, radius, off)
        k = k[off > nearest[radius]]
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
    off = other.mean[0, far] - mean
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
