"""Readings of known touches as functions of a finger's parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.calibration.finger_flat import FlatLayout, FlatPrior
from bayestouch.calibration.finger_noise import Errors, errors
from bayestouch.calibration.finger_touches import KnownTouches
from bayestouch.chain.finger import FingerChain
from bayestouch.fit import LaplaceFit, least_squares_map, whiten_rank_one
from bayestouch.sensor import Finger

FloatArray = NDArray[np.float64]

# Contacts are tabulated up to this many times the largest calibration load: touches may be harder.
LOAD_REACH = 3.2
# Steps of the central differences, in the unit of each parameter; their error is far below the noise.
STEP_RADIUS_MM, STEP_ANGLE, STEP_POISSON, STEP_LOG_MODULUS = 1e-3, 1e-4, 1e-4, 1e-3
STEP_LOAD = 0.02


class FingerLikelihood:
    """Readings of known touches as functions of the flat parameter vector (see `FlatLayout`).

    The true load of a touch is not the measured one; its error moves all elements together and is integrated out:
    over the width of that error the chain is linear in the load.

    Parameters
    ----------
    known : KnownTouches
        t touches.
    finger : Finger
        Geometry as built.
    prior : FlatPrior
        Of all coordinates.
    start : (3 m + 2,) array
        Where fits start.
    sign : (m,) array
        1, or -1 for an element whose reading falls when it is squeezed.
    contact : str
        Contact model.
    """

    def __init__(
        self,
        known: KnownTouches,
        finger: Finger,
        prior: FlatPrior,
        start: FloatArray,
        sign: FloatArray,
        contact: str,
    ) -> None:
        self.known, self.finger, self.prior, self.start = known, finger, prior, start
        self.sign, self.contact = sign, contact
        self.missing = known.missing
        self._last: tuple[bytes, FingerChain, FloatArray, FloatArray] | None = None

    @property
    def layout(self) -> FlatLayout:
        """What stands where in the vector."""
        return self.prior.layout

    @property
    def largest_load(self) -> float:
        """Load in N/m up to which contacts are tabulated."""
        return LOAD_REACH * float(self.known.load.max())

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lowest and highest value of each coordinate.

        The rubber is at least so stiff that a flat under the largest load keeps to a quarter of the circumference,
        where linear contact has long lost its meaning.
        """
        low, high = (ends.copy() for ends in self.prior.bounds)
        softest = np.log(self.largest_load / 1000 / (10 * self.finger.outer_radius_mm))
        low[self.layout.log_mu] = max(low[self.layout.log_mu], softest)
        return low, high

    def chain(self, vector: FloatArray) -> FingerChain:
        """The finger with these parameters."""
        at = self.layout
        return FingerChain(
            core_radius_mm=self.finger.core_radius_mm,
            outer_radius_mm=self.finger.outer_radius_mm,
            response=self.sign * np.exp(vector[at.response]),
            sensing_radius_mm=vector[at.depth],
            angle=vector[at.angle],
            offset=np.zeros(at.n_elements),
            poisson_ratio=float(vector[at.sigma]),
            shear_modulus_MPa=float(np.exp(vector[at.log_mu])),
            largest_load=self.largest_load,
            contact=self.contact,
        )

    def predict(self, chain: FingerChain, share: float = 1.0) -> FloatArray:
        """Readings (t, m) of a finger under the touches with this share of their loads."""
        return chain.predict(self.known.radius_mm, self.known.angle, share * self.known.load)

    def predicted(self, vector: FloatArray) -> tuple[FingerChain, FloatArray, FloatArray]:
        """Chain, its prediction and that's derivative with respect to the load; remembered for the last vector."""
        key = vector.tobytes()
        if self._last is None or self._last[0] != key:
            chain = self.chain(vector)
            self._last = (key, chain, *prediction_and_slope(lambda share: self.predict(chain, share), self.known))
        return self._last[1:]

    def derivatives(self, vector: FloatArray) -> FloatArray:
        """Derivative of the prediction, (3 m + 2, t, m); an element's own parameters move that element alone."""
        m = self.layout.n_elements
        chain, predicted, _ = self.predicted(vector)
        moved = [
            predicted,
            self._central(chain, "sensing_radius_mm", STEP_RADIUS_MM),
            self._central(chain, "angle", STEP_ANGLE),
        ]
        out = np.zeros((self.layout.n_chain, *predicted.shape))
        for block, derivative in enumerate(moved):
            for element in range(m):
                out[block * m + element, :, element] = derivative[:, element]
        for row, step in ((self.layout.sigma, STEP_POISSON), (self.layout.log_mu, STEP_LOG_MODULUS)):
            shift = np.zeros_like(vector)
            shift[row] = step
            up, down = self.chain(vector + shift), self.chain(vector - shift)
            out[row] = (self.predict(up) - self.predict(down)) / (2 * step)
        return out

    def _central(self, chain: FingerChain, name: str, step: float) -> FloatArray:
        value = getattr(chain, name)
        up, down = chain.with_(**{name: value + step}), chain.with_(**{name: value - step})
        return np.asarray((self.predict(up) - self.predict(down)) / (2 * step))

    def errors(self, vector: FloatArray) -> Errors:
        """Standard deviations of readings and loads that a whole vector implies."""
        return errors(self.known, self.layout, vector)

    def whiten(self, rows: FloatArray, slope: FloatArray, spread: Errors) -> FloatArray:
        """Whiten (..., t, m) rows with the readings' standard deviations and the load's shared error."""
        direction = np.where(self.missing, 0.0, slope) * spread.load_sd[..., None]
        return whiten_rank_one(np.where(self.missing, 0.0, rows), spread.sd, direction)

    def maximum(self, spread: Errors) -> LaplaceFit:
        """Mode and Laplace covariance of the coordinates of the chain, for given errors."""
        n = self.layout.n_chain
        mean, width = self.prior.mean[:n], self.prior.spread[:n]

        def residuals(vector: FloatArray) -> FloatArray:
            _, predicted, slope = self.predicted(vector)
            data = self.whiten(self.known.readings - predicted, slope, spread)
            return np.concatenate([data.ravel(), (vector - mean) / width])

        def jacobian(vector: FloatArray) -> FloatArray:
            _, _, slope = self.predicted(vector)
            rows = -self.whiten(self.derivatives(vector), slope, spread)
            return np.concatenate([rows.reshape(len(vector), -1).T, np.diag(1 / width)])

        low, high = (ends[:n] for ends in self.bounds)
        return least_squares_map(residuals, jacobian, np.clip(self.start, low, high), (low, high))

    def with_loads(self, load: FloatArray) -> FingerLikelihood:
        """The same touches with other estimates of their loads."""
        known = replace(self.known, load=load)
        return FingerLikelihood(known, self.finger, self.prior, self.start, self.sign, self.contact)


def prediction_and_slope(predict: Callable[[float], FloatArray], known: KnownTouches) -> tuple[FloatArray, FloatArray]:
    """Prediction (t, m), and its derivative with respect to the load, by central differences in the load."""
    up, down = predict(1 + STEP_LOAD), predict(1 - STEP_LOAD)
    return predict(1.0), (up - down) / (2 * STEP_LOAD * known.load[:, None])
