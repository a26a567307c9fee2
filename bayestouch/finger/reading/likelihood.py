"""Distribution of the readings and loads of touches on a calibrated finger, given R, θ_c and P."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.arrays import nearest_turn
from bayestouch.finger.reading.reader import FingerPosterior
from bayestouch.priors.parameters import Parameter
from bayestouch.reading.touch_reader import Drawn
from bayestouch.sampling.normals import CorrelatedNormals


@dataclass(frozen=True, eq=False)
class FingerTouchModel:
    """Distribution of readings and loads of t touches. A `bayestouch.reading.requested.TouchModel`.

    Attributes
    ----------
    posterior : FingerPosterior
        Posterior density of the touches, with the whitener (t, m, m) used for the draws.
    parameters : tuple of Parameter
        R (mm), θ_c (degree) and P (N/m).
    load_shown : (t,) array
        Loads as the force sensor read them, N/m; NaN not measured.
    """

    posterior: FingerPosterior
    parameters: tuple[Parameter, ...]
    load_shown: FloatArray

    @cached_property
    def observed(self) -> FloatArray:
        """Mean readings, (t, m); NaN where missing or left out."""
        here = np.diagonal(self.posterior.whitener, axis1=1, axis2=2) > 0
        return np.where(here, self.posterior.touches.readings, np.nan)

    @property
    def load(self) -> FloatArray:
        """Measured loads as they were used, N/m, (t,)."""
        return self.posterior.touches.load

    @property
    def load_sd(self) -> FloatArray:
        """Standard error of each measured load, N/m, (t,)."""
        return self.posterior.touches.load_sd

    @property
    def n_parameters(self) -> int:
        """Three: R, θ_c, P."""
        return len(self.parameters)

    def readings(self, draws: Drawn, touches: slice) -> CorrelatedNormals:
        """Distribution of the mean readings of some touches at draws (n, some)."""
        numbers = np.arange(len(self.load))[touches]
        radius, angle, load = (np.ascontiguousarray(draws[name].T) for name in ("R", "theta_c", "P"))
        predicted = self.posterior.predicted(radius, np.radians(angle), load, numbers)
        mean = np.ascontiguousarray(np.swapaxes(predicted, 0, 1), dtype=np.float64)
        return CorrelatedNormals(mean, self.posterior.whitener[touches])

    def measured_load(self, draws: Drawn) -> FloatArray:
        """Expected measured load: the draws of P, N/m."""
        return draws["P"]

    def log_prior(self, draws: Drawn, touches: slice) -> Drawn:
        """Log prior density of R (1/mm), θ_c (1/degree) and P (m/N) at draws (n, some).

        For R of a tip it is the log prior probability of the tip.
        """
        middle = self.posterior.middle
        if middle is not None:
            draws = {**draws, "theta_c": nearest_turn(draws["theta_c"], float(np.degrees(middle)))}
        return {each.name: each.prior.log_density(draws[each.name]) for each in self.parameters}

    def prior(self, uniform: FloatArray) -> Drawn:
        """R, r_c, θ_c and P from uniform random numbers (3, n, some)."""
        values = {each.name: each.prior.quantile(u) for each, u in zip(self.parameters, uniform, strict=True)}
        outer = self.posterior.chain.outer_radius_mm
        with np.errstate(divide="ignore"):
            return {"r_c": values["R"] * outer / (outer - values["R"]), **values}
