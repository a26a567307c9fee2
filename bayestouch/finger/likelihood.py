"""Readings of known touches as functions of a finger's parameters, and the fit of these."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain
from bayestouch.data.sensor import Finger
from bayestouch.finger.known_touches import KnownTouches
from bayestouch.finger.layout import FlatLayout, FlatPrior
from bayestouch.finger.noise import Errors, errors
from bayestouch.finger.series import Reach, TouchSeries
from bayestouch.sampling.laplace import LaplaceFit, least_squares_map
from bayestouch.sampling.rank_one import DiagonalPlusRankOne

# Contacts are tabulated up to this many times the largest calibration load: touches may be harder.
LOAD_REACH = 3.2
# Steps of the central differences: log response, depth (mm), angle, σ, log μ. Their error is far below the noise.
STEPS = 1e-3, 1e-3, 1e-4, 1e-4, 1e-3
# A series is good for so many standard deviations of the prior before the fit, and of the posterior after it.
PRIOR_REACH, POSTERIOR_REACH = 4.0, 6.0


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
    series : TouchSeries, optional
        Solved contacts, if there are any already.
    """

    def __init__(
        self,
        known: KnownTouches,
        finger: Finger,
        prior: FlatPrior,
        start: FloatArray,
        sign: FloatArray,
        contact: str,
        series: TouchSeries | None = None,
    ) -> None:
        self.known, self.finger, self.prior, self.start = known, finger, prior, start
        self.sign, self.contact = sign, contact
        self.missing = known.missing
        n = prior.layout.n_chain
        self.series = series or self._series(self._reach(start, prior.spread[:n], PRIOR_REACH))
        self._last: tuple[bytes, FloatArray, FloatArray] | None = None

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
        """Lowest and highest value of each coordinate."""
        low, high = (ends.copy() for ends in self.prior.bounds)
        low[self.layout.log_mu] = max(low[self.layout.log_mu], softest(self.finger, self.largest_load))
        return low, high

    def _reach(self, centre: FloatArray, sd: FloatArray, times: float) -> Reach:
        """Parameters so many standard deviations about a vector, inside the bounds."""
        at, (low, high) = self.layout, self.bounds
        below = np.maximum(centre - times * sd, low[: at.n_chain])
        above = np.minimum(centre + times * sd, high[: at.n_chain])
        return Reach(
            sigma=(float(below[at.sigma]), float(above[at.sigma])),
            log_mu=(float(below[at.log_mu]), float(above[at.log_mu])),
            depth=float(above[at.depth].max()),
        )

    def _series(self, reach: Reach) -> TouchSeries:
        return TouchSeries.of(self.known, self.finger, self.layout, self.sign, reach, self.contact)

    def posterior_series(self, fit: LaplaceFit) -> TouchSeries:
        """The series, no wider than the posterior."""
        return self.series.down_to(self._reach(fit.mode, fit.sd, POSTERIOR_REACH).depth)

    def chain(self, vector: FloatArray) -> FingerChain:
        """The finger with these parameters."""
        return chain_at(self.finger, self.layout, self.sign, vector, self.largest_load, self.contact)

    def predicted(self, vector: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Readings (t, m), and their derivative with respect to the load; remembered for the last vector."""
        key = vector.tobytes()
        if self._last is None or self._last[0] != key:
            predicted, slope = self.series(vector[None])
            self._last = (key, predicted[0], slope[0])
        return self._last[1:]

    def derivatives(self, vector: FloatArray) -> FloatArray:
        """Derivative of the readings, (3 m + 2, t, m); an element's own parameters move that element alone."""
        at, m = self.layout, self.layout.n_elements
        own = (at.response, at.depth, at.angle)
        places: tuple[slice | int, ...] = (*own, at.sigma, at.log_mu)
        moved = np.repeat(vector[None], 2 * len(places), axis=0)
        for up, down, place, step in zip(moved[::2], moved[1::2], places, STEPS, strict=True):
            up[place] += step
            down[place] -= step
        readings, _ = self.series(moved)
        by_place = (readings[::2] - readings[1::2]) / (2 * np.array(STEPS)[:, None, None])
        out = np.zeros((at.n_chain, *readings.shape[1:]))
        for i, place in enumerate(own):
            for element in range(m):
                out[place.start + element, :, element] = by_place[i, :, element]
        out[at.sigma], out[at.log_mu] = by_place[3:]
        return out

    def errors(self, vector: FloatArray) -> Errors:
        """Standard deviations of readings and loads that a whole vector implies."""
        return errors(self.known, self.layout, vector)

    def whiten(self, rows: FloatArray, slope: FloatArray, spread: Errors) -> FloatArray:
        """Whiten (..., t, m) rows with the readings' standard deviations and the load's shared error."""
        return self.covariance(slope, spread).whiten(np.where(self.missing, 0.0, rows))

    def covariance(self, slope: FloatArray, spread: Errors) -> DiagonalPlusRankOne:
        """Covariance of the readings of each touch: their own errors, and the load's, which moves all elements."""
        return DiagonalPlusRankOne(spread.sd, np.where(self.missing, 0.0, slope) * spread.load_sd[..., None])

    def maximum(self, spread: Errors) -> LaplaceFit:
        """Mode and Laplace covariance of the coordinates of the chain, for given errors.

        Contacts are solved anew where the posterior reaches beyond those there are.
        """
        fit = self._maximum(spread)
        reach = self._reach(fit.mode, fit.sd, POSTERIOR_REACH)
        while not self.series.reach.covers(reach):
            self.series, self._last, self.start = self._series(reach), None, fit.mode
            fit = self._maximum(spread)
            # A posterior that ended at the edge of the old series goes on beyond it.
            reach = self._reach(fit.mode, fit.sd, POSTERIOR_REACH / 2)
        return fit

    def _maximum(self, spread: Errors) -> LaplaceFit:
        at, n = self.layout, self.layout.n_chain
        mean, width = self.prior.mean[:n], self.prior.spread[:n]

        def residuals(vector: FloatArray) -> FloatArray:
            predicted, slope = self.predicted(vector)
            data = self.whiten(self.known.readings - predicted, slope, spread)
            return np.concatenate([data.ravel(), (vector - mean) / width])

        def jacobian(vector: FloatArray) -> FloatArray:
            _, slope = self.predicted(vector)
            rows = -self.whiten(self.derivatives(vector), slope, spread)
            return np.concatenate([rows.reshape(len(vector), -1).T, np.diag(1 / width)])

        low, high = (ends[:n].copy() for ends in self.bounds)
        for place, ends in ((at.sigma, self.series.reach.sigma), (at.log_mu, self.series.reach.log_mu)):
            low[place], high[place] = max(low[place], ends[0]), min(high[place], ends[1])
        high[at.depth] = np.minimum(high[at.depth], self.series.reach.depth)
        return least_squares_map(residuals, jacobian, np.clip(self.start, low, high), (low, high))

    def with_known(self, known: KnownTouches) -> FingerLikelihood:
        """The same touches with other readings, or other estimates of unmeasured loads."""
        series = replace(self.series, known=known)
        return FingerLikelihood(known, self.finger, self.prior, self.start, self.sign, self.contact, series)


def softest(finger: Finger, largest_load: float) -> float:
    """Least log μ (MPa): a flat under the largest load (N/m) keeps to a quarter of the circumference.

    Linear contact has long lost its meaning there.
    """
    return float(np.log(largest_load / 1000 / (10 * finger.outer_radius_mm)))


def chain_at(
    finger: Finger, at: FlatLayout, sign: FloatArray, vector: FloatArray, largest_load: float, contact: str
) -> FingerChain:
    """A finger with the parameters of a flat vector."""
    return FingerChain(
        core_radius_mm=finger.core_radius_mm,
        outer_radius_mm=finger.outer_radius_mm,
        response=sign * np.exp(vector[at.response]),
        sensing_radius_mm=vector[at.depth],
        angle=vector[at.angle],
        offset=np.zeros(at.n_elements),
        poisson_ratio=float(vector[at.sigma]),
        shear_modulus_MPa=float(np.exp(vector[at.log_mu])),
        largest_load=largest_load,
        contact=contact,
    )
