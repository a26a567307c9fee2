"""Calibration of a finger from touches with known indenter, location and load."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.averages import TouchMeans
from bayestouch.calibration.finger_priors import FingerPriors
from bayestouch.chain.finger import FingerChain
from bayestouch.contact import composite_radius
from bayestouch.errors import InputError
from bayestouch.fit import LaplaceFit, least_squares_map, whiten_rank_one
from bayestouch.noise import Noise
from bayestouch.sensor import Finger

FloatArray = NDArray[np.float64]

# Contacts are tabulated up to this many times the largest calibration load: touches may be harder.
LOAD_REACH = 3.2
# Steps of the central differences, in the unit of each parameter; their error is far below the noise.
STEP_RADIUS_MM, STEP_ANGLE, STEP_POISSON, STEP_LOG_MODULUS = 1e-3, 1e-4, 1e-4, 1e-3


@dataclass(frozen=True, eq=False)
class KnownTouches:
    """Touches of which indenter and location are known, averaged over samples; t touches, m elements.

    Attributes
    ----------
    radius_mm, angle, load : (t,) arrays
        Composite radius R (mm), contact location (rad), measured load (N/m).
    load_sd : (t,) array
        Standard error of the load, N/m.
    readings : (t, m) array
        Mean readings, NaN missing.
    counts : (t, m) array
        Raw readings behind each.
    """

    radius_mm: FloatArray
    angle: FloatArray
    load: FloatArray
    load_sd: FloatArray
    readings: FloatArray
    counts: NDArray[np.int64]

    @classmethod
    def of(cls, means: TouchMeans, finger: Finger, force_sd: float) -> tuple[KnownTouches, NDArray[np.bool_]]:
        """Known touches among `means`, and which they are.

        A touch whose load was not measured is kept: its load is the mean of the others with a standard
        error of the same size, so that it tells about angles and depths only.
        """
        assert means.angle_deg is not None
        known = ~np.isnan(means.indenter_radius_mm) & ~np.isnan(means.angle_deg)
        if not known.any():
            raise InputError(
                "no touch has a known indenter and location: calibration needs indenter_radius_mm (0 for a knife "
                "edge, inf for a flat) and angle_deg"
            )
        load = means.load[known]
        measured = np.isfinite(load)
        if not measured.any():
            raise InputError("no calibration touch has a measured load: the gains are not identifiable without one")
        typical = float(load[measured].mean())
        reads = np.maximum(means.counts[known].max(axis=1), 1)
        load_sd = np.where(measured, force_sd / np.sqrt(reads), typical)
        return (
            cls(
                radius_mm=composite_radius(means.indenter_radius_mm[known], finger.outer_radius_mm),
                angle=np.radians(means.angle_deg[known]),
                load=np.where(measured, load, typical),
                load_sd=load_sd,
                readings=means.readings[known],
                counts=means.counts[known],
            ),
            known,
        )


@dataclass(frozen=True, eq=False)
class FingerFit:
    """Maximum a posteriori of all calibration parameters at once.

    Attributes
    ----------
    chain : FingerChain
        The finger at the mode.
    laplace : LaplaceFit
        In the order responses, depths (mm), angles (rad), σ, log μ.
    noise : Noise
        Noise of readings and force sensor.
    lack_of_fit : float
        Residual mean square over pure-error mean square: 1 where the model is right; NaN without repeats.
    predicted, sd : (t, m) arrays
        Prediction for the touches, and standard deviation of reading minus prediction.
    likelihood : FingerLikelihood
        Touches and priors that were fitted.
    """

    chain: FingerChain
    laplace: LaplaceFit
    noise: Noise
    lack_of_fit: float
    predicted: FloatArray
    sd: FloatArray
    likelihood: FingerLikelihood


class FingerLikelihood:
    """Whitened residuals of known touches and priors, as functions of the flat parameter vector.

    The vector holds, for m elements, responses (reading per N/m), depths r_s (mm), angles θ_s (rad), then σ and
    log μ. The true load of a touch is not the measured one; its error moves all elements together and is
    integrated out (the chain is all but linear in the load).
    """

    def __init__(
        self, known: KnownTouches, finger: Finger, priors: FingerPriors, start: FloatArray, contact: str
    ) -> None:
        self.known, self.finger, self.priors, self.contact = known, finger, priors, contact
        self.n_elements = finger.n_elements
        self.start = start
        self.missing = ~(known.counts > 0) | np.isnan(known.readings)
        self._last: tuple[bytes, FingerChain, FloatArray] | None = None

    def chain(self, vector: FloatArray) -> FingerChain:
        """The finger with these parameters."""
        m = self.n_elements
        return FingerChain(
            core_radius_mm=self.finger.core_radius_mm,
            outer_radius_mm=self.finger.outer_radius_mm,
            response=vector[:m],
            sensing_radius_mm=vector[m : 2 * m],
            angle=vector[2 * m : 3 * m],
            offset=np.zeros(m),
            poisson_ratio=float(vector[3 * m]),
            shear_modulus_MPa=float(np.exp(vector[3 * m + 1])),
            largest_load=LOAD_REACH * float(self.known.load.max()),
            contact=self.contact,
        )

    def _predict(self, chain: FingerChain) -> FloatArray:
        return chain.predict(self.known.radius_mm, self.known.angle, self.known.load)

    def predicted(self, vector: FloatArray) -> tuple[FingerChain, FloatArray]:
        """Chain and its prediction (t, m), remembered for the last vector asked."""
        key = vector.tobytes()
        if self._last is None or self._last[0] != key:
            chain = self.chain(vector)
            self._last = (key, chain, self._predict(chain))
        return self._last[1], self._last[2]

    def derivatives(self, vector: FloatArray) -> FloatArray:
        """Derivative of the prediction, (d, t, m); an element's own parameters move that element alone."""
        m = self.n_elements
        chain, predicted = self.predicted(vector)
        moved = [
            # not predicted / response: the response of a dead element is zero
            self._predict(chain.with_(response=np.ones(m))),
            self._central(chain, "sensing_radius_mm", STEP_RADIUS_MM),
            self._central(chain, "angle", STEP_ANGLE),
        ]
        out = np.zeros((3 * m + 2, *predicted.shape))
        for block, derivative in enumerate(moved):
            for element in range(m):
                out[block * m + element, :, element] = derivative[:, element]
        for row, step in ((3 * m, STEP_POISSON), (3 * m + 1, STEP_LOG_MODULUS)):
            shift = np.zeros_like(vector)
            shift[row] = step
            up, down = self.chain(vector + shift), self.chain(vector - shift)
            out[row] = (self._predict(up) - self._predict(down)) / (2 * step)
        return out

    def _central(self, chain: FingerChain, name: str, step: float) -> FloatArray:
        value = getattr(chain, name)
        up, down = chain.with_(**{name: value + step}), chain.with_(**{name: value - step})
        return np.asarray((self._predict(up) - self._predict(down)) / (2 * step))

    def whiten(self, rows: FloatArray, predicted: FloatArray, sd: FloatArray) -> FloatArray:
        """Whiten (..., t, m) rows with the readings' standard deviations and the load's shared error."""
        direction = predicted * (self.known.load_sd / self.known.load)[:, None]
        direction = np.where(self.missing, 0.0, direction)
        return whiten_rank_one(np.where(self.missing, 0.0, rows), sd, direction)

    def maximum(self, sd: FloatArray) -> LaplaceFit:
        """Mode and Laplace covariance, for readings with standard deviations `sd` (t, m)."""
        mean, spread = self.priors.flat(self.finger, self.start[: self.n_elements])

        def residuals(vector: FloatArray) -> FloatArray:
            _, predicted = self.predicted(vector)
            data = self.whiten(self.known.readings - predicted, predicted, sd)
            return np.concatenate([data.ravel(), (vector - mean) / spread])

        def jacobian(vector: FloatArray) -> FloatArray:
            _, predicted = self.predicted(vector)
            rows = -self.whiten(self.derivatives(vector), predicted, sd)
            return np.concatenate([rows.reshape(len(vector), -1).T, np.diag(1 / spread)])

        largest = LOAD_REACH * float(self.known.load.max())
        return least_squares_map(residuals, jacobian, self.start, self.priors.bounds(self.finger, largest))


def fit_finger(
    means: TouchMeans, finger: Finger, priors: FingerPriors, force_sd: float, *, contact: str = "layer"
) -> tuple[FingerFit, NDArray[np.bool_]]:
    """Fit every calibration parameter to all known touches at once.

    Parameters
    ----------
    means : TouchMeans
        Averaged calibration touches, rest reading subtracted.
    finger : Finger
        Geometry as built.
    priors : FingerPriors
        Priors.
    force_sd : float
        Noise of one reading of the force sensor, N/m.
    contact : str
        Contact model.

    Returns
    -------
    FingerFit, (t,) bool array
        The fit, and which touches it used.

    Raises
    ------
    InputError
        If the touches cannot identify the parameters, saying what would.
    """
    known, used = KnownTouches.of(means, finger, force_sd)
    start = _start(known, finger, priors)
    likelihood = FingerLikelihood(known, finger, priors, start, contact)
    tactile = np.sqrt(means.pure_error_variance)
    repeated = np.isfinite(tactile) & (tactile > 0)
    counts = np.where(likelihood.missing, 0, known.counts)
    # Without repeats the noise starts as a hundredth of the peak and is then taken from the residuals.
    peak = np.abs(start[: finger.n_elements]) * known.load.mean()
    noise = Noise(np.where(repeated, tactile, 0.01 * peak), np.zeros(finger.n_elements), 0.0, force_sd)
    lack_of_fit = np.nan
    for _ in range(3):
        sd = noise.mean_sd(counts, np.zeros(counts.shape))
        laplace = likelihood.maximum(sd)
        likelihood.start = laplace.mode
        _, predicted = likelihood.predicted(laplace.mode)
        bare = replace(noise, discrepancy_sd=np.zeros(finger.n_elements))
        z = likelihood.whiten(known.readings - predicted, predicted, bare.mean_sd(counts, np.zeros(counts.shape)))
        mean_square = _mean_square(z, counts > 0)
        n_rows = int((counts > 0).sum())
        if (repeated | likelihood.missing.all(axis=0)).all():
            lack_of_fit = float((z * z).sum() / max(n_rows - len(laplace.mode), 1))
        updated = _updated_noise(noise, repeated, counts, mean_square)
        if np.allclose(updated.tactile_sd, noise.tactile_sd, rtol=0.01) and np.allclose(
            updated.discrepancy_sd,
            noise.discrepancy_sd,
            rtol=0.02,
            atol=0.01 * float(np.nanmin(updated.tactile_sd)),
        ):
            break
        noise = updated
    chain, predicted = likelihood.predicted(laplace.mode)
    sd = noise.mean_sd(counts, np.zeros(counts.shape))
    return FingerFit(chain, laplace, noise, lack_of_fit, predicted, sd, likelihood), used


def _mean_square(z: FloatArray, present: NDArray[np.bool_]) -> FloatArray:
    """Mean square per element of whitened residuals, for the three parameters each element fits."""
    freedom = np.maximum(present.sum(axis=0) - 3, 1)
    return np.asarray((np.where(present, z, 0.0) ** 2).sum(axis=0) / freedom)


def _updated_noise(
    noise: Noise, repeated: NDArray[np.bool_], counts: NDArray[np.int64], mean_square: FloatArray
) -> Noise:
    """Noise from pure error where there are repeats, else from residuals; the excess is discrepancy."""
    typical = np.where(counts > 0, counts, np.nan)
    with np.errstate(invalid="ignore"):
        reads = np.where(np.isnan(typical).all(axis=0), 1.0, np.nansum(typical, 0) / np.maximum((counts > 0).sum(0), 1))
    variance_of_mean = noise.tactile_sd**2 / reads
    excess = np.maximum(mean_square - 1, 0.0) * variance_of_mean
    return Noise(
        tactile_sd=np.where(repeated, noise.tactile_sd, noise.tactile_sd * np.sqrt(np.maximum(mean_square, 1e-12))),
        discrepancy_sd=np.where(repeated, np.sqrt(excess), 0.0),
        signal_share=0.0,
        force_sd=noise.force_sd,
    )


def _start(known: KnownTouches, finger: Finger, priors: FingerPriors) -> FloatArray:
    """Start of the fit: nominal geometry, and each response from the touches nearest to the element."""
    nominal = np.radians(finger.element_angles_deg)
    turn = np.abs(np.angle(np.exp(1j * (known.angle[:, None] - nominal))))
    near = turn < np.radians(15)
    unreached = ~(near & np.isfinite(known.readings)).any(axis=0)
    dead = np.isnan(known.readings).all(axis=0)
    if (unreached & ~dead).any():
        names = ", ".join(f"e{i + 1:02d}" for i in np.flatnonzero(unreached & ~dead))
        raise InputError(
            f"no calibration touch comes within 15 degrees of element {names}: its gain, depth and angle are not "
            "identifiable; touch the finger there, or leave the element out"
        )
    share = np.where(near & np.isfinite(known.readings), known.readings / known.load[:, None], 0.0)
    response = np.take_along_axis(share, np.abs(share).argmax(axis=0)[None], axis=0)[0]
    response = np.where(response == 0, np.median(response[response != 0]) if (response != 0).any() else 1.0, response)
    return np.concatenate(
        [
            response,
            np.full(finger.n_elements, finger.sensing_radius_mm),
            nominal,
            [priors.poisson_ratio.mean, np.log(priors.shear_modulus.median)],
        ]
    )
