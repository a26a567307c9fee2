"""Input of the identification of an E map: known touches, and the elastic finger of the prior."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.noise import Noise
from bayestouch.finger.empirical.map import MapNeighbours, contact_neighbours
from bayestouch.finger.fit import FingerFit
from bayestouch.finger.layout import FlatPrior


@dataclass(frozen=True, eq=False)
class MapTouches:
    """Known touches with the signals before the effects; t touches, m elements.

    Attributes
    ----------
    elastic : FingerChain
        Finger whose contact is used, and on which the prior of E is centred.
    prior : FlatPrior
        Prior of the parameters of this finger.
    radius_mm, angle, load : (t,) arrays
        Composite radius R (mm), location (rad), load (N/m).
    signal : (t, m) array
        Mean signals; without effects these are the mean readings.
    sd : (t, m) array
        Standard deviation of the errors, from repeats and the error of the load; inf where missing.
    reading_sd : (t, m) array
        The same of the mean readings; without effects it is `sd`.
    counts : (t, m) array
        Number of raw readings in each mean; 0 where missing.
    repeated : (m,) bool array
        Elements whose noise is known from repeats.
    noise : Noise
        Noise of the model calibration.
    """

    elastic: FingerChain
    prior: FlatPrior
    radius_mm: FloatArray
    angle: FloatArray
    load: FloatArray
    signal: FloatArray
    sd: FloatArray
    reading_sd: FloatArray
    counts: FloatArray
    repeated: NDArray[np.bool_]
    noise: Noise

    @property
    def there(self) -> NDArray[np.bool_]:
        """Whether each signal is present (not missing), (t, m)."""
        return self.counts > 0

    @classmethod
    def of_fit(cls, fit: FingerFit, repeated: NDArray[np.bool_] | None = None) -> MapTouches:
        """Touches of a model calibration without effects.

        Parameters
        ----------
        fit : FingerFit
            The model calibration.
        repeated : (m,) bool array, optional
            Elements whose noise is known from repeats; by default all if the fit has a lack of fit.
        """
        known = fit.likelihood.known
        counts = np.where(fit.likelihood.missing, 0, known.counts)
        bare = replace(fit.noise, discrepancy_sd=np.zeros(counts.shape[1]))
        _, slope = fit.likelihood.predicted(fit.laplace.mode)
        by_load = slope * fit.likelihood.standard_errors(fit.vector).load_sd[:, None]
        sd = np.hypot(bare.mean_sd(counts, np.zeros(counts.shape)), by_load)
        return cls(
            elastic=fit.chain,
            prior=fit.likelihood.prior,
            radius_mm=known.radius_mm,
            angle=known.angle,
            load=known.load,
            signal=known.readings,
            sd=sd,
            reading_sd=sd,
            counts=counts,
            repeated=np.full(counts.shape[1], np.isfinite(fit.lack_of_fit)) if repeated is None else repeated,
            noise=fit.noise,
        )


@dataclass(frozen=True, eq=False)
class SharedParameter:
    """A parameter shared by all elements, with the input of the map at one step above and below its value.

    Attributes
    ----------
    near : MapNeighbours
        Fingers at these values.
    sides : (MapTouches, MapTouches)
        Touches at these values: above, then below.
    """

    near: MapNeighbours
    sides: tuple[MapTouches, MapTouches]


def contact_parameters(touches: MapTouches) -> tuple[SharedParameter, ...]:
    """Shared parameters σ and log μ of the contact."""

    def at(chain: FingerChain, factor: float) -> MapTouches:
        return replace(touches, elastic=chain, radius_mm=touches.radius_mm * factor)

    return tuple(
        SharedParameter(near, (at(*near.sides[0]), at(*near.sides[1]))) for near in contact_neighbours(touches.elastic)
    )
