"""A finger fitted with functions of place, and their posterior."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.errors import InputError
from bayestouch.finger.fit import FingerFit, settled_fit, without_offsets
from bayestouch.finger.place.choice import choose_functions
from bayestouch.finger.place.functions import PlaceFunctions
from bayestouch.finger.place.posterior import PlacePosterior, joint_covariance
from bayestouch.finger.place.touches import TouchesWithPlaces

#: Choices of the discrepancy: the one that predicts held-out places best; none; independent from touch to touch; and
#: functions of place in addition to that.
AUTO, NO_DISCREPANCY, OF_TOUCH, OF_PLACE = "auto", "none", "touch", "place"
#: Name of the setting of a calibration without discrepancy.
DISCREPANCY_SETTING = "discrepancy"
# Number of fits. Each starts from the finger and the curvatures of the previous one. Own functions are linear: the
# second fit refers them to fitted angles. With curvatures the third fit changes the result negligibly.
FITS, FITS_OF_SURFACE = 2, 3

NO_CONTACT = (
    "Discrepancy as a function of place: not taken, because these touches would make the surface so flat that no "
    "contact has a solution. Loads, radii or the shear modulus may be in a wrong unit."
)


def fit_of_places(fit: FingerFit, *, wanted: bool) -> tuple[FingerFit, PlacePosterior | None, tuple[str, ...]]:
    """Fit a finger with functions of place, if these predict held-out places better or are `wanted`.

    Returns
    -------
    FingerFit, PlacePosterior or None, tuple of str
        The fit, its functions of place, and a note on the choice. `fit` itself, None and no note if no functions are
        chosen.
    """
    plain = without_offsets(fit)
    choice = choose_functions(plain, wanted=wanted)
    if choice is None:
        return fit, None, ()
    try:
        return (*fit_with_places(plain, choice.functions), (choice.note,))
    except InputError:
        if wanted:
            raise
        # What the functions made of the surface has no contact; the data are not wrong because of a trial.
        return fit, None, (NO_CONTACT,)


def fit_with_places(fit: FingerFit, functions: PlaceFunctions) -> tuple[FingerFit, PlacePosterior]:
    """Fit a finger with functions of place, whose weights are integrated out.

    Readings are linear in the weights of own functions, but not in the curvature of the surface. Therefore the radii
    of the touches include its mean, and the readings are linearised about it.
    """
    fit = without_offsets(fit)
    known = fit.likelihood.known
    posterior: PlacePosterior | None = None
    fitted = fit
    for _ in range(FITS if functions.surface is None else FITS_OF_SURFACE):
        chain, vector = fitted.chain, fitted.vector
        effective, bent = known.radius_mm, np.zeros(len(known.load))
        if posterior is not None:
            effective = posterior.effective_radius(known.radius_mm, known.angle, chain.outer_radius_mm)
            bent = posterior.log_curvature(known.angle)
        touch = (effective, known.angle, known.load)
        own, surface = functions.own_columns(chain, *touch), functions.surface_columns(chain, *touch, bent)
        sd = fitted.likelihood.standard_errors(vector).sd
        mean = np.zeros(surface.shape[2]) if posterior is None else posterior.surface
        at_places = TouchesWithPlaces.of(own, surface, sd, mean)
        moved = replace(known, radius_mm=effective, readings=known.readings + at_places.shift)
        likelihood = fit.likelihood.with_places(moved, at_places)
        likelihood.start = vector[: likelihood.layout.n_chain]
        fitted = settled_fit(likelihood, vector)
        posterior = _posterior(fitted, functions, chain.angle, chain.response)
    assert posterior is not None
    return fitted, posterior


def _posterior(fit: FingerFit, functions: PlaceFunctions, angle: FloatArray, response: FloatArray) -> PlacePosterior:
    """Posterior of the weights at the mode of a fit."""
    likelihood, errors = fit.likelihood, fit.errors_with_places
    at_places, at = likelihood.at_places, likelihood.layout
    assert errors is not None
    assert at_places is not None
    m, k, r = at_places.basis.shape
    q, n = at_places.surface.shape[2], m * r
    predicted, _ = likelihood.predicted(fit.laplace.mode)
    left = np.where(likelihood.missing, 0.0, likelihood.known.readings - predicted)
    weights = errors.weights(left)
    derivatives = likelihood.derivatives(fit.laplace.mode)
    derivatives[at.response] /= fit.chain.response[:, None, None]
    # (m r + q, 3 m + 2): derivative of the mean weights over the parameters of the finger.
    moved = -errors.weights(np.where(likelihood.missing, 0.0, derivatives)).T
    given = errors.low_rank.covariance
    of_model = moved @ fit.covariance
    joint = joint_covariance(fit.covariance, moved[n:], given[n:, n:])
    with_parents = np.concatenate([of_model, of_model @ moved[n:].T + given[:, n:]], axis=1)
    gains, own_covariance = np.empty((m, k, 5 + q)), np.empty((m, k, k))
    for e, basis in enumerate(at_places.basis):
        own = slice(e * r, (e + 1) * r)
        parents = [e, m + e, 2 * m + e, at.sigma, at.log_mu, *range(3 * m + 2, 3 * m + 2 + q)]
        crossed = with_parents[own][:, parents]
        gain = np.linalg.solve(joint[np.ix_(parents, parents)], crossed.T).T
        rest = given[own, own] + of_model[own] @ moved[own].T - gain @ crossed.T
        gains[e] = basis @ gain
        # Combinations on which the touches have no information keep their prior.
        own_covariance[e] = basis @ rest @ basis.T + np.eye(k) - basis @ basis.T
    return PlacePosterior(
        functions=functions,
        angle=angle,
        response=response,
        own=np.einsum("mkr,mr->mk", at_places.basis, weights[:n].reshape(m, r)),
        surface=weights[n:],
        gains=gains,
        own_covariance=own_covariance,
        covariance=joint,
    )
