"""Direct identification of the E map of a finger as Bayesian regression.

Section 3.2 of Nicolson and Fearing (1995) solves ``E P = G D`` by least squares, equation (6). This has no prior on E,
so that touches all around the finger must determine every coefficient. Here the rows of E have a prior that is centred
on the elastic model, and its strength is inferred. Row e, including the gain, is

    E_e = elastic(r_s, θ_s, response) + departure,    departure_k ~ N(0, (λ_e S_k)²),  S_k = max |elastic_l| over l >= k

for the sine and cosine of each Fourier mode k. The departure has the bandwidth of the sensor, since rubber does not
transmit finer detail, and is equally likely at all angles. (At low modes the elastic response is small because the
rubber is nearly incompressible. The departure is not small there: therefore S is a maximum over modes.)

λ → 0 is the model calibration, λ → ∞ equation (6). Coefficients that the touches do not determine keep their prior, and
their uncertainty is in the covariance.

Pressures are from the contact model at σ and μ of the model calibration; the uncertainty of σ and μ is propagated by
fitting E again at other values. The error of a load is in the noise of each element; its correlation between elements
is neglected (the posterior of each element is exact given its own readings).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.body.emap import per_coefficient
from bayestouch.chain.empirical import (
    EmpiricalFingerChain,
    elastic_amplitudes,
    elastic_e_matrix,
    modes_of,
    pressure_matrix,
)
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.noise import Noise
from bayestouch.finger.empirical.map import EmpiricalCalibration
from bayestouch.finger.empirical.regression import DiagonalElement, ElementData, MapPrior
from bayestouch.finger.empirical.strength import StrengthPosterior, infer_strength
from bayestouch.finger.empirical.touches import MapTouches, SharedParameter, contact_parameters
from bayestouch.finger.fit import FingerFit
from bayestouch.finger.layout import FlatPrior

# Steps of central differences; E is smooth on these scales.
STEP_RESPONSE, STEP_RADIUS_MM, STEP_ANGLE = 1e-3, 1e-3, 1e-4


@dataclass(frozen=True, eq=False)
class EmpiricalFit:
    """An identified E map with the results of its fit.

    Attributes
    ----------
    calibration : EmpiricalCalibration
        Posterior of E.
    strength : StrengthPosterior
        Posterior of the strength λ of the prior.
    effective_coefficients : (m,) array
        Number of coefficients of the departure that are determined by the touches rather than the prior.
    lack_of_fit : (m,) array
        Mean square of the residuals over that of repeats, ``φ²``. If it is well above 1, there are errors that are not
        a smooth function of location in proportion to the load: drift, memory, nonlinearity, or errors that change
        faster over location than the map. A map fitted to a drift is wrong: it assigns the drift to locations.
    predicted, sd : (t, m) arrays
        Prediction for the calibration touches, and standard deviation of reading minus prediction.
    """

    calibration: EmpiricalCalibration
    strength: StrengthPosterior
    effective_coefficients: FloatArray
    lack_of_fit: FloatArray
    predicted: FloatArray
    sd: FloatArray

    @property
    def strengths(self) -> FloatArray:
        """Exponential of the posterior mean of log λ of each element, (m,)."""
        with np.errstate(divide="ignore"):
            return np.array([np.exp(w.weight @ np.log(w.strength)) for w in self.strength.weights])


def fit_empirical(
    fit: FingerFit,
    *,
    n_coefficients: int | None = None,
    strength: float | None = None,
    family: bool = True,
    repeated: NDArray[np.bool_] | None = None,
) -> EmpiricalFit:
    """E identified from the touches of a model calibration, with a prior centred on that model.

    Parameters
    ----------
    fit : FingerFit
        Model calibration: elastic finger at the mode, touches, priors, noise.
    n_coefficients : int, optional
        n_c; by default all modes of the elastic model. High modes are safe, because the prior decreases with the
        elastic response; without a prior (infinite `strength`), the touches must determine all modes.
    strength : float, optional
        Fixed λ of all elements: 0 is the model, infinity equation (6). Inferred by default.
    family : bool
        Fit response, r_s and θ_s of the elastic model too, with the priors of the model calibration. Otherwise the
        prior is centred on the mode of the model calibration.
    repeated : (m,) bool array, optional
        Elements whose noise is known from repeats; by default all if the model calibration has a lack of fit.

    Raises
    ------
    InputError
        If `strength` is infinite and the touches do not determine all coefficients.
    """
    touches, m = MapTouches.of_fit(fit, repeated), fit.chain.n_elements
    return identified_map(
        touches,
        contact_parameters(touches),
        fit.laplace.covariance[3 * m :, 3 * m :],
        n_coefficients=n_coefficients,
        strength=strength,
        family=family,
    )


def identified_map(
    touches: MapTouches,
    shared: Sequence[SharedParameter],
    shared_covariance: FloatArray,
    *,
    n_coefficients: int | None = None,
    strength: float | None = None,
    family: bool = True,
) -> EmpiricalFit:
    """E identified from touches with given signals.

    Parameters
    ----------
    touches : MapTouches
        Known touches.
    shared : sequence of SharedParameter
        Parameters shared by all elements: σ and log μ of the contact, then values of effects; empty if only the mean
        of E is needed.
    shared_covariance : (s, s) array
        Covariance of these parameters.
    n_coefficients, strength, family
        As in `fit_empirical`.
    """
    elastic = touches.elastic
    n_c = modes_of(elastic) if n_coefficients is None else n_coefficients
    elements = _diagonal(touches, n_c, family)
    posterior = infer_strength(elements, [bool(each) for each in touches.repeated], strength)
    pairs = [element.posterior(weights) for element, weights in zip(elements, posterior.weights, strict=True)]
    e_matrix = np.stack([mean for mean, _ in pairs])
    by_contact = np.empty((len(shared), *e_matrix.shape))
    for i, parameter in enumerate(shared):
        up, down = (
            [
                element.mean(weights)
                for element, weights in zip(_diagonal(side, n_c, family), posterior.weights, strict=True)
            ]
            for side in parameter.sides
        )
        by_contact[i] = (np.stack(up) - np.stack(down)) / (2 * parameter.near.step)
    factor2 = np.array([w.weight @ w.factor**2 for w in posterior.weights])
    calibration = EmpiricalCalibration(
        chain=EmpiricalFingerChain(elastic, e_matrix),
        covariance=np.stack([covariance for _, covariance in pairs]),
        by_contact=by_contact,
        contact_covariance=shared_covariance,
        noise=_noise(touches, factor2),
        effect_neighbours=tuple(parameter.near for parameter in shared[2:]),
    )
    return EmpiricalFit(
        calibration=calibration,
        strength=posterior,
        effective_coefficients=np.array(
            [element.effective_coefficients(w) for element, w in zip(elements, posterior.weights, strict=True)]
        ),
        lack_of_fit=factor2,
        predicted=calibration.chain.series(touches.radius_mm, touches.angle, touches.load),
        sd=touches.sd * np.sqrt(factor2),
    )


def finger_prior(prior: FlatPrior, elastic: FingerChain, n_coefficients: int, *, family: bool = True) -> list[MapPrior]:
    """Prior of each row of E (one per element), about an elastic finger near the mode of its calibration.

    Parameters
    ----------
    prior : FlatPrior
        Prior of the parameters of the elastic finger.
    elastic : FingerChain
        The elastic finger.
    n_coefficients, family
        As in `fit_empirical`.
    """
    mean = elastic_e_matrix(elastic, n_coefficients)
    amplitudes = np.abs(elastic_amplitudes(elastic, n_coefficients))
    scale = per_coefficient(np.maximum.accumulate(amplitudes[:, ::-1], axis=1)[:, ::-1])
    m, p = mean.shape
    if not family:
        return [MapPrior(mean[e], scale[e], np.zeros((p, 0)), np.zeros(0)) for e in range(m)]
    ones = np.ones(m)
    steps = {
        "response": STEP_RESPONSE * np.abs(elastic.response),
        "sensing_radius_mm": STEP_RADIUS_MM * ones,
        "angle": STEP_ANGLE * ones,
    }
    tangents, start = np.empty((m, p, 3)), np.empty((m, 3))
    for i, (name, step) in enumerate(steps.items()):
        here = np.asarray(getattr(elastic, name))
        up, down = (elastic_e_matrix(elastic.with_(**{name: here + sign * step}), n_coefficients) for sign in (1, -1))
        # The prior of a response is one of its logarithm.
        unit, value = (here, np.log(np.abs(here))) if name == "response" else (ones, here)
        centre, width = (values[i * m : (i + 1) * m] for values in (prior.mean, prior.spread))
        tangents[:, :, i] = (up - down) * (width * unit / (2 * step))[:, None]
        start[:, i] = (centre - value) / width
    return [MapPrior(mean[e], scale[e], tangents[e], start[e]) for e in range(m)]


def _diagonal(touches: MapTouches, n_coefficients: int, family: bool) -> list[DiagonalElement]:
    elastic, out = touches.elastic, []
    pose = (touches.radius_mm, touches.angle, touches.load)
    design = pressure_matrix(elastic, *pose, n_coefficients)
    linear = touches.signal - elastic.beyond_linear(*pose) if elastic.finite_strain else touches.signal
    for e, prior in enumerate(finger_prior(touches.prior, elastic, n_coefficients, family=family)):
        there = touches.there[:, e]
        data = ElementData(design[there], linear[there, e], touches.sd[there, e])
        out.append(DiagonalElement.of(data, prior))
    return out


def _noise(touches: MapTouches, factor2: FloatArray) -> Noise:
    """Noise with the discrepancy that remains with the map; without repeats all errors count as sensor noise."""
    noise, known = touches.noise, touches.repeated
    # φ² is the mean over touches of 1 + discrepancy² / sd², where sd has the error of the load.
    precision = (1 / touches.reading_sd**2).sum(axis=0) / np.maximum(touches.there.sum(axis=0), 1)
    excess = np.divide(np.maximum(factor2 - 1, 0.0), precision, out=np.zeros(len(factor2)), where=precision > 0)
    return replace(
        noise,
        tactile_sd=np.where(known, noise.tactile_sd, noise.tactile_sd * np.sqrt(factor2)),
        discrepancy_sd=np.where(known, np.sqrt(excess), 0.0),
    )
