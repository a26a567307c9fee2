"""Distribution of the readings and loads of touches on a calibrated pad, given location and load."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.pad.corrected import PadEffects
from bayestouch.pad.reading.reader import PadReader, PadTouches
from bayestouch.priors.parameters import Parameter
from bayestouch.reading.touch_reader import Drawn
from bayestouch.sampling.normals import NormalsWithSharedError


@dataclass(frozen=True, eq=False)
class PadTouchModel:
    """Distribution of readings and loads of t touches. A `bayestouch.reading.requested.TouchModel`.

    The prior of the load is that of a touch without a measured load. If the load is measured, the measurement replaces
    this prior: the log prior of P is then zero, and draws from the prior are distributed like loads of the calibration.

    Attributes
    ----------
    reader : PadReader
        The calibrated pad.
    touches : PadTouches
        Readings and prior loads of the touches.
    parameters : tuple of Parameter
        x, y (mm) and P.
    load, load_shown : (t,) arrays
        Acting loads, and loads as read by the force sensor; NaN if not measured or not used.
    effects : PadEffects or None
        Effects for which loads are corrected.
    """

    reader: PadReader
    touches: PadTouches
    parameters: tuple[Parameter, ...]
    load: FloatArray
    load_shown: FloatArray
    effects: PadEffects | None = None

    @property
    def observed(self) -> FloatArray:
        """Mean readings, (t, m); NaN where missing or left out."""
        return np.where(self.touches.present, self.touches.readings, np.nan)

    @property
    def load_sd(self) -> FloatArray:
        """Standard error of each measured load, (t,)."""
        return self.touches.load_sd

    @property
    def n_parameters(self) -> int:
        """Number of parameters: coordinates of the location, and the load."""
        return len(self.parameters)

    def readings(self, draws: Drawn, touches: slice) -> NormalsWithSharedError:
        """Distribution of the mean readings of some touches at draws (n, some)."""
        counts = self.touches.counts[touches]
        location = np.stack([draws[each.name] for each in self.parameters[:-1]], axis=-1)
        load = self.measured_load(draws)
        # What elements share of the errors of noise and calibration counts as independent here.
        signal, variance = self.reader.apart.predict(location, load, counts)
        common = self.reader.map.shared_at(location)
        variance = variance + ((load[..., None, None] * common) ** 2).sum(axis=-2)
        shared = signal * (self.touches.load_scatter / np.maximum(load, 1e-300))[..., None]
        return NormalsWithSharedError(
            self.reader.map.offset + signal, np.where(counts > 0, variance, np.inf), np.where(counts > 0, shared, 0.0)
        )

    def measured_load(self, draws: Drawn) -> FloatArray:
        """Acting load, to which measured loads are corrected."""
        load = draws["P"]
        return load if self.effects is None else self.effects.acting_of_pressed(load.ravel()).reshape(load.shape)

    def log_prior(self, draws: Drawn, touches: slice) -> Drawn:
        """Log prior density of location (per mm) and load at draws (n, some)."""
        logs = {each.name: each.prior.log_density(draws[each.name]) for each in self.parameters}
        return {**logs, "P": np.where(np.isfinite(self.load[touches]), 0.0, logs["P"])}

    def prior(self, uniform: FloatArray) -> Drawn:
        """Location and load from uniform random numbers (parameters, n, some)."""
        return {each.name: each.prior.quantile(u) for each, u in zip(self.parameters, uniform, strict=True)}
