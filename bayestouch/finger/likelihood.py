"""Likelihood of the readings of known touches, and its maximum over the parameters of a finger."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain
from bayestouch.errors import InputError
from bayestouch.finger.known_touches import KnownTouches
from bayestouch.finger.layout import FlatLayout
from bayestouch.finger.model import FingerModel
from bayestouch.finger.noise import StandardErrors
from bayestouch.finger.place.touches import ErrorsWithPlaces, TouchesWithPlaces
from bayestouch.finger.series import Reach, TouchSeries
from bayestouch.finger.softest_rubber import softest
from bayestouch.model.observations import UntimedTouches
from bayestouch.sampling.laplace import LaplaceFit, least_squares_map
from bayestouch.sampling.rank_one import DiagonalPlusRankOne

# Contacts are tabulated up to this many times the largest calibration load, for touches with larger loads.
LOAD_REACH = 3.2
# Range in which a series is valid: standard deviations of the prior before the fit, and of the posterior after it.
PRIOR_REACH, POSTERIOR_REACH = 4.0, 6.0
# Largest number of ranges that a fit tries; two are usual.
MOST_RANGES = 6
# With functions of place a fit ends when a step increases the log density by less than this.
NEGLIGIBLE = 1e-4


def too_soft(lowest_MPa: float) -> InputError:
    """Error for a prior of μ that is below the softest rubber on which the largest load has a contact, MPa."""
    return InputError(
        f"prior of mu: softer than {lowest_MPa:.3g} MPa, below which the contact of the largest load has no solution"
    )


class FingerLikelihood:
    """Likelihood of the readings of known touches for a finger without effects.

    The `FingerModel` predicts the readings. The error of the measured load of a touch is common to all elements and is
    integrated out: within this error the readings are linear in the load.

    Parameters
    ----------
    model : FingerModel
        The finger without effects, with the prior of all coordinates of the flat vector (see `FlatLayout`).
    known : KnownTouches
        The t known touches.
    start : (3 m + 2,) array
        Starting vector of fits.
    at_places : TouchesWithPlaces, optional
        Functions of place, as a discrepancy of the readings; by default none.
    """

    def __init__(
        self, model: FingerModel, known: KnownTouches, start: FloatArray, at_places: TouchesWithPlaces | None = None
    ) -> None:
        assert model.flat_prior is not None
        self.prior, self.known, self.start, self.at_places = model.flat_prior, known, start, at_places
        self.missing = known.missing
        pose = np.stack([known.radius_mm, known.angle, known.load])
        self.model = replace(model, observed=UntimedTouches(len(known.load)), pose=pose)
        if model.evaluator is None:
            reach = self._reach(start, self.prior.spread[: self.layout.n_chain], PRIOR_REACH)
            self.model = replace(self.model, evaluator=self._series(reach))

    @property
    def layout(self) -> FlatLayout:
        """Positions of the parameters in the vector."""
        return self.model.layout

    @property
    def sign(self) -> FloatArray:
        """Signs of the responses, (m,), see `FingerModel`."""
        return self.model.sign

    @property
    def series(self) -> TouchSeries:
        """The fast evaluator of the model."""
        assert self.model.evaluator is not None
        return self.model.evaluator

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lowest and highest value of each coordinate of the chain, (3 m + 2,) each."""
        low, high = (ends.copy() for ends in self.prior.bounds)
        log_mu, sigma = self.layout.log_mu, self.layout.sigma
        # Where a function of place makes the surface flatter, a flat has a larger radius than the finger.
        radius = float(self.known.radius_mm.max())
        low[log_mu] = max(low[log_mu], softest(self.model.finger, self.model.largest_load, float(low[sigma]), radius))
        return low, high

    def _reach(self, centre: FloatArray, sd: FloatArray, times: float) -> Reach:
        """Range of `times` standard deviations about a vector, inside the bounds."""
        at, (low, high) = self.layout, self.bounds
        below = np.maximum(centre - times * sd, low[: at.n_chain])
        above = np.minimum(centre + times * sd, high[: at.n_chain])
        if not above[at.log_mu] > below[at.log_mu]:
            raise too_soft(float(np.exp(below[at.log_mu])))
        return Reach(
            sigma=(float(below[at.sigma]), float(above[at.sigma])),
            log_mu=(float(below[at.log_mu]), float(above[at.log_mu])),
            depth=float(above[at.depth].max()),
        )

    def _series(self, reach: Reach) -> TouchSeries:
        model = self.model
        return TouchSeries.of(self.known, model.finger, self.layout, model.sign, reach, model.contact)

    def posterior_series(self, fit: LaplaceFit) -> TouchSeries:
        """The series, limited to the range of the posterior."""
        return self.series.down_to(self._reach(fit.mode, fit.sd, POSTERIOR_REACH).depth)

    def chain(self, vector: FloatArray) -> FingerChain:
        """The finger with these parameters."""
        return self.model.chain(vector)

    def predicted(self, vector: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Predicted readings (t, m), and their derivative over the load (t, m)."""
        return self.model.predict(vector).touches, self.model.by_load(vector)

    def derivatives(self, vector: FloatArray) -> FloatArray:
        """Derivative of the readings over the parameters, (3 m + 2, t, m)."""
        return self.model.derivatives(vector)[0]

    def standard_errors(self, vector: FloatArray) -> StandardErrors:
        """Standard errors of readings and loads for a whole flat vector."""
        return StandardErrors.of(self.known, self.layout, vector)

    def whiten(self, rows: FloatArray, slope: FloatArray, spread: StandardErrors) -> FloatArray:
        """Rows (..., t, m) whitened with the errors of the readings and the shared error of the load.

        With functions of place the result has more rows, see `bayestouch.sampling.low_rank.LowRank.whiten`.
        """
        return self.covariance(slope, spread).whiten(np.where(self.missing, 0.0, rows))

    def covariance(self, slope: FloatArray, spread: StandardErrors) -> DiagonalPlusRankOne | ErrorsWithPlaces:
        """Covariance of the readings: independent errors, the shared error of the load, functions of place."""
        by_load = np.where(self.missing, 0.0, slope) * spread.load_sd[..., None]
        if self.at_places is None:
            return DiagonalPlusRankOne(spread.sd, by_load)
        return self.at_places.errors(spread.sd, by_load)

    def maximum(self, spread: StandardErrors) -> LaplaceFit:
        """Mode and Laplace covariance of the coordinates of the chain, for given errors.

        Contacts are solved again if the posterior extends beyond the range of the series.
        """
        fit = self._maximum(spread)
        reach = self._reach(fit.mode, fit.sd, POSTERIOR_REACH)
        # If the touches contradict a narrow prior, the modes of two ranges may alternate without end.
        for _ in range(MOST_RANGES):
            if self.series.reach.covers(reach):
                break
            self.model, self.start = replace(self.model, evaluator=self._series(reach)), fit.mode
            fit = self._maximum(spread)
            # The posterior may extend beyond the range of the old series.
            reach = self._reach(fit.mode, fit.sd, POSTERIOR_REACH / 2)
        return fit

    def _maximum(self, spread: StandardErrors) -> LaplaceFit:
        at, n = self.layout, self.layout.n_chain
        mean, width = self.prior.mean[:n], self.prior.spread[:n]
        # With functions of place the covariance takes long to compute and hardly changes within a fit.
        held = None if self.at_places is None else self.covariance(self.predicted(self.start)[1], spread)

        def whiten(rows: FloatArray, slope: FloatArray) -> FloatArray:
            if held is None:
                return self.whiten(rows, slope, spread)
            return held.whiten(np.where(self.missing, 0.0, rows))

        def residuals(vector: FloatArray) -> FloatArray:
            predicted, slope = self.predicted(vector)
            data = whiten(self.known.readings - predicted, slope)
            return np.concatenate([data.ravel(), (vector - mean) / width])

        def jacobian(vector: FloatArray) -> FloatArray:
            _, slope = self.predicted(vector)
            rows = -whiten(self.derivatives(vector), slope)
            return np.concatenate([rows.reshape(len(vector), -1).T, np.diag(1 / width)])

        low, high = (ends[:n].copy() for ends in self.bounds)
        for place, ends in ((at.sigma, self.series.reach.sigma), (at.log_mu, self.series.reach.log_mu)):
            low[place], high[place] = max(low[place], ends[0]), min(high[place], ends[1])
        high[at.depth] = np.minimum(high[at.depth], self.series.reach.depth)
        start = np.clip(self.start, low, high)
        if held is None:
            return least_squares_map(residuals, jacobian, start, (low, high))
        # The misfit of the model slows the last steps down. The mode is only the centre of proposals and derivatives.
        enough = NEGLIGIBLE / (0.5 * float((residuals(start) ** 2).sum()))
        return least_squares_map(residuals, jacobian, start, (low, high), enough)

    def with_prior_about(self, vector: FloatArray) -> FingerLikelihood:
        """The likelihood with the normal approximation of Student-t priors about a flat vector."""
        assert self.model.flat_prior is not None
        model = replace(self.model, flat_prior=self.model.flat_prior.about(vector))
        return FingerLikelihood(model, self.known, self.start, self.at_places)

    def with_known(self, known: KnownTouches) -> FingerLikelihood:
        """The likelihood for the same touches with other readings, or other estimates of unmeasured loads."""
        model = replace(self.model, evaluator=replace(self.series, known=known))
        return FingerLikelihood(model, known, self.start, self.at_places)

    def with_places(self, known: KnownTouches, at_places: TouchesWithPlaces) -> FingerLikelihood:
        """The likelihood with functions of place, for the same touches with other radii and readings."""
        return FingerLikelihood(replace(self.model, evaluator=None), known, self.start, at_places)
