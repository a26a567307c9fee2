"""Calibration of a finger from touches with known indenter, location and load."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.noise import Noise
from bayestouch.data.averages import TouchMeans
from bayestouch.data.sensor import Finger
from bayestouch.errors import InputError
from bayestouch.finger.known_touches import KnownTouches
from bayestouch.finger.likelihood import LOAD_REACH, FingerLikelihood
from bayestouch.finger.model import FingerModel
from bayestouch.finger.noise import NoiseShape, Residuals, first_guess, noise_of, noise_shape
from bayestouch.finger.place.touches import ErrorsWithPlaces, TouchesWithPlaces
from bayestouch.finger.priors import FingerPriors
from bayestouch.model.observations import UntimedTouches
from bayestouch.model.shared_rest import RestOffsets
from bayestouch.sampling.laplace import LaplaceFit
from bayestouch.sampling.rank_one import DiagonalPlusRankOne

# Largest number of fits of the chain, each with the noise of the one before; two are enough if loads are known.
MOST_FITS = 6


@dataclass(frozen=True, eq=False)
class FingerFit:
    """Normal approximation of the joint posterior of all calibration parameters.

    Attributes
    ----------
    chain : FingerChain
        The finger at the mode.
    laplace : LaplaceFit
        Mode and covariance of the coordinates of the chain, at the fitted noise (see `FlatLayout`).
    vector : (d,) array
        Centre of the whole flat vector: the mode of `laplace`, then the mean noise at this mode.
    noise_shape : NoiseShape
        Approximate density of the coordinates of the noise.
    noise : Noise
        Noise of readings and force sensor, at the centre.
    lack_of_fit : float
        Residual mean square over pure-error mean square: 1 if the model is right; NaN without repeats.
    predicted, sd : (t, m) arrays
        Prediction for the touches, and standard deviation of reading minus prediction, with the error of the load.
    likelihood : FingerLikelihood
        Touches and priors that were fitted.
    errors_with_places : ErrorsWithPlaces or None
        Errors of the readings at the centre, including functions of place; None without these functions.
    """

    chain: FingerChain
    laplace: LaplaceFit
    vector: FloatArray
    noise_shape: NoiseShape
    noise: Noise
    lack_of_fit: float
    predicted: FloatArray
    sd: FloatArray
    likelihood: FingerLikelihood
    errors_with_places: ErrorsWithPlaces | None = None

    @property
    def covariance(self) -> FloatArray:
        """Covariance of responses, depths (mm), angles (rad), σ and log μ, (3 m + 2, 3 m + 2)."""
        scale = np.ones(len(self.laplace.mode))
        scale[: self.chain.n_elements] = self.chain.response
        return self.laplace.covariance * np.outer(scale, scale)


def fit_finger(
    means: TouchMeans, finger: Finger, priors: FingerPriors, *, contact: str = "layer"
) -> tuple[FingerFit, NDArray[np.bool_]]:
    """Fit of all calibration parameters to all known touches.

    Parameters
    ----------
    means : TouchMeans
        Mean readings of the calibration touches, minus the rest reading.
    finger : Finger
        Nominal geometry.
    priors : FingerPriors
        Priors.
    contact : str
        Contact model.

    Returns
    -------
    FingerFit, (t,) bool array
        The fit, and which touches it used.

    Raises
    ------
    InputError
        If the touches cannot identify the parameters; the message says which touches are missing.
    """
    known, used = identifying_touches(means, finger)
    apparent = priors.apparent_response(finger, known)
    prior = priors.flat(finger, known, apparent)
    start = prior.mean[: prior.layout.n_chain].copy()
    start[prior.layout.response] = np.log(np.abs(apparent))
    model = FingerModel(
        observed=UntimedTouches(len(known.load)),
        peak=np.abs(apparent) * known.typical_load,
        reference_load=known.typical_load,
        finger=finger,
        layout=prior.layout,
        flat_prior=prior,
        sign=np.sign(apparent),
        contact=contact,
        largest_load=LOAD_REACH * float(known.load.max()),
    )
    likelihood = FingerLikelihood(model, known, start)
    return settled_fit(likelihood, np.concatenate([start, first_guess(known, prior)])), used


def with_offsets(fit: FingerFit, offsets: RestOffsets) -> FingerFit:
    """The fit with the errors of the rest readings that its t touches share integrated out, like functions of place.

    The estimates of these errors are taken out of the readings of `fit`.
    """
    reads, removed = offsets.reads, offsets.removed
    likelihood, noise = fit.likelihood, fit.noise.tactile_sd
    sd = np.divide(noise, np.sqrt(reads), out=np.zeros_like(reads), where=reads > 0)
    at_places = TouchesWithPlaces.of_offsets(sd, removed)
    known = replace(likelihood.known, readings=likelihood.known.readings + removed)
    return settled_fit(likelihood.with_places(known, at_places), fit.vector)


def without_offsets(fit: FingerFit) -> FingerFit:
    """The fit of the same touches with the estimates of offsets that they share taken out; itself if it has none."""
    likelihood, at_places = fit.likelihood, fit.likelihood.at_places
    if at_places is None:
        return fit
    known = replace(likelihood.known, readings=likelihood.known.readings - at_places.shift)
    model = replace(likelihood.model, evaluator=None)
    return settled_fit(FingerLikelihood(model, known, likelihood.start), fit.vector)


def settled_fit(likelihood: FingerLikelihood, vector: FloatArray) -> FingerFit:
    """Fit chain and noise in turn, starting from a flat vector, until the standard errors are constant.

    They count as constant if they change by less than 2 %. At most `MOST_FITS` fits of the chain are made.
    """
    prior = likelihood.prior
    unmeasured = likelihood.known.load_reads == 0
    spread = likelihood.standard_errors(vector)
    for _ in range(MOST_FITS):
        laplace = likelihood.maximum(spread)
        likelihood.start = laplace.mode
        vector = np.concatenate([laplace.mode, vector[prior.layout.n_chain :]])
        shape = noise_shape(
            likelihood.known, likelihood.prior.for_proposals(), vector, _residuals(likelihood, laplace, vector)
        )
        vector[prior.layout.n_chain :] = shape.mean
        used_prior, likelihood = likelihood.prior, likelihood.with_prior_about(vector)
        before, spread = spread, likelihood.standard_errors(vector)
        # A change of the errors by 2 % is negligible for a proposal, in whatever unit: readings may be farads.
        settled = all(np.allclose(getattr(spread, n), getattr(before, n), rtol=0.02, atol=0) for n in ("sd", "load_sd"))
        settled &= np.allclose(likelihood.prior.spread, used_prior.spread, rtol=0.02)
        if unmeasured.any():
            moved = _estimated_loads(likelihood, vector)
            settled &= np.allclose(moved, likelihood.known.load, rtol=1e-3, atol=0)
            likelihood = likelihood.with_known(replace(likelihood.known, load=moved))
        if settled:
            break
    predicted, slope = likelihood.predicted(laplace.mode)
    errors = _errors_with_places(likelihood, vector)
    if errors is not None and likelihood.at_places is not None:
        at_places = likelihood.at_places
        predicted = predicted - at_places.shift + at_places.added(errors.weights(_left(likelihood, vector)))
    chain = likelihood.chain(laplace.mode)
    spread = likelihood.standard_errors(vector)
    # A load that was not measured is estimated from the readings.
    by_load = slope * np.where(unmeasured, 0.0, spread.load_sd)[:, None]
    sd = np.hypot(spread.sd, by_load)
    noise = noise_of(likelihood.known, prior.layout, vector)
    lack_of_fit = _lack_of_fit(likelihood, vector)
    return FingerFit(chain, laplace, vector, shape, noise, lack_of_fit, predicted, sd, likelihood, errors)


def identifying_touches(means: TouchMeans, finger: Finger) -> tuple[KnownTouches, NDArray[np.bool_]]:
    """Known touches that identify the parameters of a finger, and the mask of their rows, as `KnownTouches.of`.

    Raises
    ------
    InputError
        If the touches cannot identify the parameters; the message says which touches are missing.
    """
    known, used = KnownTouches.of(means, finger)
    known.check_near(finger)
    check_enough(known)
    return known, used


def check_enough(known: KnownTouches) -> None:
    """Raise an error if there are fewer readings than parameters.

    Raises
    ------
    InputError
        The message names the elements or the number of readings, and the touches to add.
    """
    read = (~known.missing).sum(axis=0)
    few = np.flatnonzero((read > 0) & (read < 3))
    if len(few):
        names = ", ".join(f"e{i + 1:02d}" for i in few)
        raise InputError(
            f"fewer than 3 calibration touches were read by element {names}: its response, depth and angle are not "
            "identifiable; touch the finger at 3 places within its reach at least"
        )
    numbers, alive = int(read.sum()), int((read > 0).sum())
    parameters = 3 * alive + 2
    if numbers < parameters:
        raise InputError(
            f"{numbers} mean readings for {parameters} parameters (3 for each of {alive} elements, Poisson's ratio and "
            "shear modulus): not identifiable; add touches at other places or with other indenters"
        )


def _residuals(likelihood: FingerLikelihood, laplace: LaplaceFit, vector: FloatArray) -> Residuals:
    """Residuals of the fit, with the number of parameters that the readings of each element determine."""
    predicted, slope = likelihood.predicted(laplace.mode)
    rows = likelihood.whiten(likelihood.derivatives(laplace.mode), slope, likelihood.standard_errors(vector))
    spent = np.einsum("itm,ij,jtm->m", rows, laplace.covariance, rows, optimize=True)
    left = np.where(likelihood.missing, 0.0, likelihood.known.readings - predicted)
    errors = _errors_with_places(likelihood, vector)
    if errors is not None and likelihood.at_places is not None:
        # The residuals are scaled so that their squares have the sum of the whitened readings, which includes that of
        # the weights of functions of place: the noise scales these too.
        distance = (errors.whiten(left) ** 2).sum(axis=0)
        left = left - likelihood.at_places.added(errors.weights(left))
        left = left * np.sqrt(distance / np.maximum(((left * errors.weight) ** 2).sum(axis=0), 1e-300))
    return Residuals(left, np.where(likelihood.missing, 0.0, slope), spent)


def _left(likelihood: FingerLikelihood, vector: FloatArray) -> FloatArray:
    """Reading minus prediction of the chain, (t, m); zero where missing."""
    predicted, _ = likelihood.predicted(vector[: likelihood.layout.n_chain])
    return np.where(likelihood.missing, 0.0, likelihood.known.readings - predicted)


def _errors_with_places(likelihood: FingerLikelihood, vector: FloatArray) -> ErrorsWithPlaces | None:
    """Errors of the readings at a flat vector; None without functions of place."""
    _, slope = likelihood.predicted(vector[: likelihood.layout.n_chain])
    errors = likelihood.covariance(slope, likelihood.standard_errors(vector))
    return errors if isinstance(errors, ErrorsWithPlaces) else None


def _estimated_loads(likelihood: FingerLikelihood, vector: FloatArray) -> FloatArray:
    """Loads (t,) in N/m: as measured, else estimated from the readings."""
    known, spread = likelihood.known, likelihood.standard_errors(vector)
    predicted, slope = likelihood.predicted(vector[: likelihood.layout.n_chain])
    weight = np.where(known.missing, 0.0, 1 / spread.sd**2)
    left = np.where(known.missing, 0.0, known.readings - predicted)
    step = (slope * left * weight).sum(axis=1) / ((slope**2 * weight).sum(axis=1) + spread.load_sd**-2.0)
    bounded = np.clip(known.load + step, *known.searched_loads)
    return np.where(known.load_reads == 0, bounded, known.load)


def _lack_of_fit(likelihood: FingerLikelihood, vector: FloatArray) -> float:
    """Mean square of the residuals over that expected from repeats; NaN without repeats."""
    layout, known = likelihood.layout, likelihood.known
    if not known.repeated:
        return np.nan
    bare = vector.copy()
    some = known.scatter_dof > 0
    bare[layout.noise] = np.where(
        some, 0.5 * np.log(np.where(some, known.scatter, 1.0) / np.maximum(known.scatter_dof, 1.0)), bare[layout.noise]
    )
    bare[layout.log_discrepancy] = -np.inf
    _, slope = likelihood.predicted(vector[: layout.n_chain])
    spread, left = likelihood.standard_errors(bare), _left(likelihood, vector)
    spent = float(layout.n_determined(~known.missing))
    errors = _errors_with_places(likelihood, bare)
    if errors is None or likelihood.at_places is None:
        z = likelihood.whiten(left, slope, spread)
    else:
        spent += errors.spent.sum()
        left = np.where(known.missing, 0.0, left - likelihood.at_places.added(errors.weights(left)))
        by_load = np.where(known.missing, 0.0, slope) * spread.load_sd[:, None]
        z = DiagonalPlusRankOne(spread.sd, by_load).whiten(left)
    return float((z * z).sum() / max(int((~known.missing).sum()) - spent, 1))
