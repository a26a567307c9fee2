"""Candidate models of a pad: a kernel, a kernel with an empirical map, an empirical map about a constant."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.kernels import Kernel
from bayestouch.chain.noise import Noise
from bayestouch.chain.pad import PadChain
from bayestouch.pad.fit import PadFit, fit_chain
from bayestouch.pad.known_touches import location_spacing
from bayestouch.pad.left_out import blocks_left_out
from bayestouch.pad.misfit_fit import fit_misfit
from bayestouch.pad.noise import LeftOut, left_out_density
from bayestouch.pad.place_error import place_error
from bayestouch.pad.problem import PadProblem
from bayestouch.pad.residual_map import MapDiscrepancy

# Noise and chain are fitted alternately; after three rounds neither changes by a tenth of its sd.
_KERNEL_ROUNDS = 3
_MAP_ROUNDS = 2

# Number of touches used to choose among the starting values of a kernel.
_START_TOUCHES = 200
# A fit from a starting value ends when a step decreases its objective by less than this share of it. Fits that end in
# different minima differ by more, and the best one is fitted again to its end.
_START_ENOUGH = 1e-4

# Step of the derivatives over the place: kernels and maps change over millimetres, so that rounding and curvature are
# both below a millionth.
STEP_MM = 1e-3

# First guess of the model error of a kernel, as a share of the signal.
_FIRST_MISFIT = 0.03


@dataclass(frozen=True, eq=False)
class PadCandidate:
    """A fitted model of a pad.

    Attributes
    ----------
    fit : PadFit
        Fitted chain and covariance.
    shape : PadChain
        Pad whose kernel is used in the prior of the map (`MapDiscrepancy.shape`).
    left_out : LeftOut
        Predictions of each reading from all others.
    noise : Noise
        Noise estimated from these predictions, or from blocks of touches that are left out together.
    load_spread : float
        Standard deviation of unmeasured loads over their mean in the calibration; NaN where loads were measured.
    score : float
        Log predictive density of the left-out readings.
    place_error : float
        Standard deviation of the displacement of touches by errors of the model, mm (`bayestouch.pad.place_error`).
    """

    fit: PadFit
    shape: PadChain
    left_out: LeftOut
    noise: Noise
    load_spread: float
    score: float
    place_error: float = 0.0

    def at(self, flat: FloatArray, covariance: FloatArray) -> PadCandidate:
        """The same model with other parameters (d,) of the pad, and their covariance (d, d)."""
        fit = self.fit
        laplace = replace(fit.laplace, mode=flat, covariance=covariance)
        return replace(self, fit=replace(fit, chain=fit.chain.with_flat(flat), laplace=laplace))

    @property
    def kernel(self) -> Kernel:
        """Kernel of the model."""
        return self.fit.chain.kernel

    @property
    def has_map(self) -> bool:
        """Whether the model has an empirical map."""
        return self.fit.misfit.misfit > 0

    @property
    def load_errors(self) -> FloatArray:
        """Standard deviation of the error that the readings of each touch share, over its load, (n,)."""
        return self.left_out.load_errors(self.noise, self.load_spread)

    def sensitivity(self, points: FloatArray) -> FloatArray:
        """Sensitivity of the elements, with the map, at points (k, D) in mm, (k, m)."""
        fit, out = self.fit, self.fit.chain.sensitivity(points)
        if self.has_map:
            shape = kernel_shape(self.shape, points)
            for e, covariance in enumerate(fit.misfit.covariances):
                functions = fit.misfit.functions_at(e, points, shape[:, e])
                out[:, e] += functions @ covariance.weights(fit.residual[:, e])
        return out

    @property
    def by_place(self) -> FloatArray:
        """Change of the predicted readings of the touches per mm, (n, D, m)."""
        known = self.fit.known
        steps = STEP_MM * np.eye(known.location.shape[1])
        rises = [self.sensitivity(known.location + step) - self.sensitivity(known.location - step) for step in steps]
        return np.asarray(known.load[:, None, None] * np.stack(rises, axis=1) / (2 * STEP_MM))

    @property
    def error_percent(self) -> float:
        """Rms of left-out readings minus prediction, percent of each element's peak, mean over elements."""
        return percent_of_peak(self.left_out.residual, self.fit.known.readings - self.fit.chain.offset)


def percent_of_peak(difference: FloatArray, signal: FloatArray) -> float:
    """Rms over touches of a difference (n, m), percent of each element's largest signal, mean over elements."""
    here = np.isfinite(difference)
    some = here.any(axis=0)
    size = np.abs(np.where(here, signal, 0.0)).max(axis=0)[some]
    square = np.where(here, difference, 0.0)[:, some] ** 2
    rms = np.sqrt(square.sum(axis=0) / here.sum(axis=0)[some])
    return float(100 * np.mean(rms / np.where(size > 0, size, np.nan)))


def kernel_shape(chain: PadChain, location: FloatArray) -> FloatArray:
    """Kernel of each element at locations (n, D) in mm, shape (n, m)."""
    return replace(chain, gain=np.ones(chain.n_elements)).sensitivity(location)


def fit_kernel(problem: PadProblem, kernel: Kernel) -> PadCandidate:
    """Fit of a kernel without a map; the best of the fits from its starting values."""
    known, priors = problem.known, problem.priors
    first = (_FIRST_MISFIT * priors.amplitude * known.load[:, None]) ** 2
    variance = np.where(problem.present, first, np.inf)
    misfit = MapDiscrepancy(
        location=known.location,
        load=known.load,
        variance=variance,
        amplitude=priors.amplitude,
        shape=np.ones(variance.shape),
    )
    flat = priors.of(kernel)
    # A part of the touches is enough to choose the best start.
    order = np.random.default_rng(problem.seed).permutation(known.n_touches)[:_START_TOUCHES]
    part, rough = known.select(order), misfit.select(order)
    starts = [fit_chain(priors.start(kernel, values), flat, part, rough, _START_ENOUGH) for values in kernel.starts]
    fit = fit_chain(min(starts, key=lambda each: each.laplace.cost).chain, flat, known, misfit)
    # The guess is scaled to the observed residuals: if it were too large, the uncertainty of the fit would hide noise.
    residual, learned = fit.left_out
    size = float(np.nanmean(residual**2 / (learned + fit.misfit.variance)))
    misfit = replace(misfit, variance=misfit.variance * max(size, 1e-12))
    fit = fit_chain(fit.chain, flat, known, misfit)
    model = _judged(problem, fit, fit.chain)
    for _ in range(_KERNEL_ROUNDS - 1):
        sd2 = model.noise.mean_sd(known.counts, model.left_out.signal) ** 2
        # Here the error of the load counts as independent between elements, because it only determines fit weights.
        variance = np.where(problem.present, sd2 + (model.load_errors[:, None] * model.left_out.signal) ** 2, np.inf)
        fit = fit_chain(fit.chain, flat, known, replace(misfit, variance=variance))
        model = _judged(problem, fit, fit.chain)
    return model


def add_map(problem: PadProblem, model: PadCandidate) -> PadCandidate:
    """Add an empirical map to a kernel that was fitted without one."""
    known = problem.known
    fit = model.fit
    for again in range(_MAP_ROUNDS):
        chain = fit.chain
        base = replace(fit.misfit, shape=kernel_shape(chain, known.location))
        # In the second round the signal, of which the noise is a share, is that of kernel and map together.
        misfit = fit_misfit(
            base,
            fit.residual,
            fit.predicted() - chain.offset,
            known.counts,
            model.noise,
            spacing_mm=location_spacing(known.location),
            seed=problem.seed,
            warm=again > 0,
        )
        fit = fit_chain(chain, problem.priors.of(chain.kernel), known, misfit)
    return _judged(problem, fit, chain)


def with_noise_between_blocks(problem: PadProblem, model: PadCandidate) -> PadCandidate:
    """The model with the noise of later touches: that of predictions from other blocks of touches.

    The model itself is chosen by single touches that are left out. If it is wrong, for example in the load, blocks are
    predicted so much worse that a search for what is missing would see noise.
    """
    residual, variance = model.fit.without_blocks(blocks_left_out(problem.observed.touch_time_s))
    left_out = replace(model.left_out, residual=residual, variance=variance)
    noise, spread = problem.noise_of(left_out, scattered=True)
    # Touches that are a whole spacing off would be read as their neighbours.
    largest = location_spacing(problem.known.location)
    error = place_error(left_out, model.by_place, noise, spread, largest)
    return replace(model, noise=noise, load_spread=spread, place_error=error)


def _judged(problem: PadProblem, fit: PadFit, shape: PadChain) -> PadCandidate:
    residual, variance = fit.left_out
    left_out = LeftOut(
        residual=residual,
        variance=variance,
        signal=fit.predicted() - fit.chain.offset,
        counts=problem.known.counts,
        load=problem.known.load,
        load_share=problem.load_share,
    )
    noise, spread = problem.noise_of(left_out)
    score = float(left_out_density(left_out, noise, spread).sum())
    return PadCandidate(fit, shape, left_out, noise, spread, score)
