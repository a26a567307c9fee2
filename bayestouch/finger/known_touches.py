"""Known touches for the calibration of a finger: pose, load and mean readings."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.contact import composite_radius
from bayestouch.data.arrays import responding, turned
from bayestouch.data.averages import TouchMeans
from bayestouch.data.sensor import Finger
from bayestouch.errors import InputError

# Standard deviation of the prior of an unmeasured load about its estimate from the readings, over the mean load: nearly
# flat. The density has a factor 1/P in addition, see `bayestouch.finger.density.log_prior_of_loads`.
UNMEASURED_LOAD_SD = 10.0
# Range in which a load that is not known is searched: from and to so many times the mean load, or farther, to half of
# the smallest and half as much again as the largest load that was measured. Contacts are tabulated farther, up to
# `bayestouch.finger.likelihood.LOAD_REACH` times the largest load.
LEAST_LOAD, MOST_LOAD = 0.05, 3.0
BELOW_SMALLEST, ABOVE_LARGEST = 0.5, 1.5
# Largest angle between element and touch, degree, for the starting value of the response of the element.
NEAR_DEG = 15.0


def hardest_load(typical: float, largest: float) -> float:
    """Load up to which a load that is not known is searched, from the mean and the largest load of the calibration."""
    return max(MOST_LOAD * typical, ABOVE_LARGEST * largest)


@dataclass(frozen=True, eq=False)
class KnownTouches:
    """Touches with known indenter and location, averaged over samples; t touches, m elements.

    Attributes
    ----------
    radius_mm, angle, load : (t,) arrays
        Composite radius R (mm), contact location (rad), load (N/m), measured or estimated.
    load_reads : (t,) array
        Number of readings of the force sensor in each load; 0 where it was not measured.
    readings : (t, m) array
        Mean readings, NaN missing.
    counts : (t, m) array
        Number of raw readings in each mean; 0 where missing.
    scatter, scatter_dof : (m,) arrays
        Sum of squares of raw readings about the mean of their touch, and its degrees of freedom (0 without repeats).
    force_scatter, force_scatter_dof : float
        Sum of squares of the readings of the force sensor, (N/m)², and its degrees of freedom.
    """

    radius_mm: FloatArray
    angle: FloatArray
    load: FloatArray
    load_reads: FloatArray
    readings: FloatArray
    counts: FloatArray
    scatter: FloatArray
    scatter_dof: FloatArray
    force_scatter: float = 0.0
    force_scatter_dof: float = 0.0

    @classmethod
    def of(cls, means: TouchMeans, finger: Finger) -> tuple[KnownTouches, NDArray[np.bool_]]:
        """Known touches among `means`, and the mask of their rows.

        The readings of an element that are equal in all touches count as missing. Touches whose mean load is not above
        zero are left out.

        Raises
        ------
        InputError
            If there are no angles, no touch is known, or none has a load above zero.
        """
        if means.angle_deg is None:
            raise InputError("no calibration touch has a location: angle_deg needed")
        known = ~np.isnan(means.indenter_radius_mm) & ~np.isnan(means.angle_deg)
        pressed = ~(means.load <= 0)
        if not known.any():
            raise InputError(
                "no touch has a known indenter and location, so that nothing of the sensor is identifiable: "
                "calibration needs indenter_radius_mm (0 for a knife edge, inf for a flat) and angle_deg"
            )
        if not (known & pressed).any():
            raise InputError(
                "no touch has a load above zero, so that gains, depths and the rubber are not identifiable; "
                "touch with a load, or leave load_N_per_m empty where it was not measured"
            )
        known &= pressed
        load = means.load[known]
        measured = np.isfinite(load)
        if not measured.any():
            raise InputError(
                "no calibration touch has a measured load: gains and the shear modulus are not identifiable without "
                "one; fill in load_N_per_m for some touches at least"
            )
        typical = float(load[measured].mean())
        readings = means.readings[known]
        counts = np.where(np.isnan(readings), 0, means.counts[known])
        dead = ~responding(np.where(counts > 0, readings, np.nan))
        dof = means.pure_error_dof
        scatter = np.where(dof > 0, np.nan_to_num(means.pure_error_variance) * dof, 0.0)
        load_dof = means.load_error_dof
        return (
            cls(
                radius_mm=composite_radius(means.indenter_radius_mm[known], finger.outer_radius_mm),
                angle=np.radians(finger.near(means.angle_deg[known])),
                load=np.where(measured, load, typical),
                load_reads=np.where(measured, means.reads_of_load[known], 0.0),
                readings=np.where(dead, np.nan, readings),
                counts=np.where(dead, 0, counts),
                scatter=np.where(dead, 0.0, scatter),
                scatter_dof=np.where(dead, 0.0, dof),
                force_scatter=means.load_error_variance * load_dof if load_dof > 0 else 0.0,
                force_scatter_dof=load_dof,
            ),
            known,
        )

    @property
    def missing(self) -> NDArray[np.bool_]:
        """Whether each reading is missing, (t, m)."""
        return ~(self.counts > 0) | np.isnan(self.readings)

    @cached_property
    def shares(self) -> FloatArray:
        """Variance of each mean over that of one reading, (t, m); inf where missing."""
        share = np.full(self.counts.shape, np.inf)
        np.divide(1.0, self.counts, out=share, where=~self.missing)
        return share

    @cached_property
    def share_values(self) -> FloatArray:
        """Distinct values of `shares`, (k,)."""
        return np.asarray(np.unique(self.shares[~self.missing]))

    @cached_property
    def share_counts(self) -> FloatArray:
        """Number of means of each element with each of `share_values`, (k, m)."""
        return np.asarray((self.shares == self.share_values[:, None, None]).sum(axis=1), dtype=np.float64)

    @property
    def repeated(self) -> bool:
        """Whether all elements with readings have repeats, so that noise and model error can be distinguished."""
        read = (self.counts > 0).any(axis=0)
        return bool(read.any() and (self.scatter_dof[read] > 0).all())

    @property
    def typical_load(self) -> float:
        """Mean of the measured loads, N/m."""
        return float(self.load[self.load_reads > 0].mean())

    @property
    def typical_reads(self) -> float:
        """Median number of raw readings in a mean."""
        return float(np.median(self.counts[self.counts > 0]))

    @property
    def searched_loads(self) -> tuple[float, float]:
        """Lowest and highest load that is searched for a touch whose load was not measured, N/m."""
        measured = self.load[self.load_reads > 0]
        low = min(LEAST_LOAD * self.typical_load, BELOW_SMALLEST * float(measured.min()))
        return low, hardest_load(self.typical_load, float(measured.max()))

    def load_range(self) -> tuple[FloatArray, FloatArray]:
        """Lowest and highest load (t,) at which each touch is evaluated, N/m."""
        measured = self.load_reads > 0
        low, high = self.searched_loads
        return np.where(measured, 0.97 * self.load, low), np.where(measured, 1.03 * self.load, high)

    def load_sd(self, force_sd: float | FloatArray) -> FloatArray:
        """Standard deviation (..., t) of the true load about `load`, N/m, for noise (...) of the force sensor, N/m."""
        measured = np.asarray(force_sd)[..., None] / np.sqrt(np.maximum(self.load_reads, 1.0))
        return np.where(self.load_reads > 0, measured, UNMEASURED_LOAD_SD * self.typical_load)

    def apparent_response(self, finger: Finger, expected: FloatArray) -> FloatArray:
        """Response of each element, reading per N/m, (m,), for the start of a fit.

        It is the largest reading per N/m among the touches near the element. Touches that are only beside it read much
        less, with the other sign where the rubber is stretched. Then the response is from a regression on the expected
        readings. For an element without readings it is the median of the others.

        Parameters
        ----------
        finger : Finger
            Nominal geometry.
        expected : (t, m) array
            Readings of these touches if the finger is as its priors say and all responses are 1.
        """
        share = np.where(self._near(finger), np.nan_to_num(self.readings) / self.load[:, None], 0.0)
        response = np.take_along_axis(share, np.abs(share).argmax(axis=0)[None], axis=0)[0]
        expected = np.where(self.missing, 0.0, expected)
        regressed = (expected * np.where(self.missing, 0.0, self.readings)).sum(axis=0)
        regressed /= np.maximum((expected**2).sum(axis=0), np.finfo(float).tiny)
        # No touch reads more than an edge above the element. If the largest reading is less than half of what this edge
        # would read, no touch is above the element. The reading of a dead element is noise, and its mean is smaller.
        response = np.where(np.abs(regressed) > 2 * np.abs(response), regressed, response)
        alive = response != 0
        return np.where(alive, response, np.median(response[alive]) if alive.any() else 1.0)

    def check_near(self, finger: Finger) -> None:
        """Raise an error if an element that has readings has no touch near it.

        Raises
        ------
        InputError
            The message names the elements.
        """
        unreached = ~self._near(finger).any(axis=0) & ~self.missing.all(axis=0)
        if unreached.any():
            names = ", ".join(f"e{i + 1:02d}" for i in np.flatnonzero(unreached))
            raise InputError(
                f"no calibration touch comes within {NEAR_DEG:g} degrees of element {names}: its gain, depth and angle "
                "are not identifiable; touch the finger there, or leave the element out"
            )

    def _near(self, finger: Finger) -> NDArray[np.bool_]:
        """Whether each touch is near each element, and the element was read, (t, m)."""
        away = np.abs(turned(np.degrees(self.angle)[:, None] - finger.element_angles_deg))
        return (away < NEAR_DEG) & ~self.missing
