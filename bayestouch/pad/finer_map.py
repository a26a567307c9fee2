"""The map of a pad with a correction: finer in the location, and not in proportion to the load.

The sensitivity of an element is its kernel plus two Gaussian processes. The first process is that of the empirical map
(`bayestouch.pad.residual_map`). The second process has a correlation length l₂ in the location and, if loads vary, a
correlation length λ in the logarithm of the load: ``amplitude_e² C² ρ(|x - x'|/l₂) ρ(|ln P/P'|/λ)``. All sizes and
lengths are shared by the elements and maximise the marginal likelihood; the kernel and the offsets are fixed at their
most probable values.

If a diagnosis finds a correction, touches are read with this map. It does not use the weights of the correction: the
functions of a correction are few, so that a search is fast, while a calibration has time for the whole covariance.

Source: C. E. Rasmussen and C. K. I. Williams, Gaussian Processes for Machine Learning (2006), equations 2.23 to 2.26,
2.30 (marginal likelihood), 5.9 (its gradient), 5.12 (leave-one-out).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.chain.noise import Noise
from bayestouch.chain.pad_map import PadMap
from bayestouch.chain.smooth import distances
from bayestouch.data.arrays import read_once
from bayestouch.data.loads import loads_vary
from bayestouch.pad.candidates import PadCandidate, kernel_shape
from bayestouch.pad.inducing import InducedCovariance
from bayestouch.pad.known_touches import location_spacing
from bayestouch.pad.left_out import blocks_left_out, without_block
from bayestouch.pad.noise import FLOOR_SPREAD, LeftOut, left_out_density
from bayestouch.pad.problem import PadProblem
from bayestouch.pad.residual_map import matern_5_2, matern_5_2_by_length
from bayestouch.pad.table import MapGrid

# Touches from which sizes and lengths are estimated: groups of neighbours, which have both short and long distances.
GROUPS, NEIGHBOURS = 12, 25
# Loads at which the map is tabulated: step in the logarithm over λ (an even one leaves linear interpolation off by
# 0.05 % of the part that changes with the load), smallest and largest number of steps, factor beyond known loads, and
# points from which they are chosen. The second step is for maps with too many points: the error is then 1 %.
LOAD_STEP, COARSE_LOAD_STEP, LOADS, BEYOND, FINE = 0.05, 0.2, (8, 60), 1.25, 2001
# Bounds of sizes (over the amplitude), of the length in the logarithm of the load, and of the noise (over the signal).
SIZES, LOAD_LENGTHS, SHARES = (1e-5, 3.0), (0.2, 10.0), (1e-5, 0.1)


@dataclass(frozen=True)
class Sizes:
    """Sizes (over the amplitude of each element) and lengths of both processes.

    Attributes
    ----------
    even, relative, length_mm : float
        A, B and l of `bayestouch.pad.residual_map.MapDiscrepancy`.
    finer, finer_length_mm, load_length : float
        C, l₂ and λ.
    """

    even: float
    relative: float
    length_mm: float
    finer: float
    finer_length_mm: float
    load_length: float


@dataclass(frozen=True, eq=False)
class FinerMap:
    """Kernel with both processes, given the known touches; n touches, m elements.

    Attributes
    ----------
    model : PadCandidate
        Model with the first process, at its most probable parameters. Its noise and its predictions of left-out
        readings are those of this map.
    sizes : Sizes
        Sizes and lengths.
    loads : (L,) array
        Loads at which the map is tabulated; empty if loads do not vary. On a large pad there are fewer tables.
    covariances : tuple of InducedCovariance
        Covariance of the readings of each element.
    """

    model: PadCandidate
    sizes: Sizes
    loads: FloatArray
    covariances: tuple[InducedCovariance, ...]

    @classmethod
    def of(cls, problem: PadProblem, model: PadCandidate) -> FinerMap:
        """The map with the sizes, lengths and noise that maximise the marginal likelihood."""
        sizes, floor, share = _chosen(problem, model)
        return cls.given(problem, model, sizes, replace(model.noise, discrepancy_sd=floor, signal_share=share))

    @classmethod
    def first(cls, problem: PadProblem, model: PadCandidate) -> FinerMap:
        """The map of `model` in this form, without the second process; readings are left out in the same blocks."""
        own = model.fit.misfit
        first = (own.misfit, own.relative, own.length_mm) if model.has_map else (0.0, 0.0, 1.0)
        return cls.given(problem, model, Sizes(*first, 0.0, 1.0, 1.0), model.noise)

    @classmethod
    def given(cls, problem: PadProblem, model: PadCandidate, sizes: Sizes, noise: Noise) -> FinerMap:
        """The map with given sizes, lengths and noise; its model has the noise estimated from left-out blocks."""
        fit, known = model.fit, problem.known
        signal = fit.predicted() - fit.chain.offset
        here = problem.present
        variance = noise.mean_variance(read_once(known.counts), signal)
        residual, open_ = np.full(here.shape, np.nan), np.full(here.shape, np.nan)
        covariances, predicted = [], fit.chain.predict(known.location, known.load)
        shape = kernel_shape(model.shape, known.location)
        location = _Rows(known.location, known.load, shape)
        blocks = blocks_left_out(problem.observed.touch_time_s)
        for e in range(here.shape[1]):
            # The noise of a missing reading is so large that its weight is negligible.
            blank = np.where(here[:, e], variance[:, e], 1e9 * (variance[:, e] + signal[:, e] ** 2))
            between = _covariance(sizes, fit.misfit.amplitude[e], e, location, location)
            covariance = InducedCovariance.of(between, blank)
            pulled = covariance.solve(fit.residual[:, e])
            for block in blocks:
                residual[block, e], open_[block, e] = without_block(
                    covariance.precision(block), pulled[block], blank[block]
                )
            predicted[:, e] += covariance.columns @ covariance.weights(fit.residual[:, e])
            covariances.append(covariance)
        residual, open_ = (np.where(here, each, np.nan) for each in (residual, open_))
        signal = predicted - fit.chain.offset
        left_out = LeftOut(residual, open_, signal, known.counts, known.load, problem.load_share)
        found, spread = problem.noise_of(left_out, scattered=True)
        score = float(left_out_density(left_out, found, spread).sum())
        made = replace(model, left_out=left_out, noise=found, load_spread=spread, score=score, place_error=0.0)
        loads = np.zeros(0)
        if loads_vary(known.load):
            loads = tabulated_loads(known.load, sizes.load_length)
        return cls(made, sizes, loads, tuple(covariances))

    def tabulated(self) -> PadMap:
        """Tables over the calibrated region, and over the loads if these vary."""
        lengths = (self.sizes.length_mm, self.sizes.finer_length_mm)
        grid, known, loads = MapGrid.of(self.model, min(lengths), len(self.loads) + 1), self.model.fit.known, self.loads
        if len(loads) >= grid.most_tables:
            # What changes with the load changes slowly: fewer loads cost less than a coarser grid.
            loads = tabulated_loads(known.load, self.sizes.load_length, grid.most_tables - 2)
        typical = float(np.median(known.load))
        (mean, variance), *by_load = (grid.tables(partial(self.at, load=load)) for load in (typical, *loads.tolist()))
        made = grid.map_of(self.model, mean, variance, np.zeros_like(mean))
        if not by_load:
            return made
        return replace(
            made,
            loads=loads,
            by_load=np.concatenate([each - mean for each, _ in by_load], axis=-1),
            variance_by_load=np.concatenate([each - variance for _, each in by_load], axis=-1),
        )

    def at(self, location: FloatArray, load: float) -> tuple[FloatArray, FloatArray]:
        """Sensitivity and its variance at locations (k, D) in mm under one load, (k, m) each."""
        fit = self.model.fit
        known, amplitude = fit.known, fit.misfit.amplitude
        there = _Rows(location, np.full(len(location), load), kernel_shape(self.model.shape, location))
        rows = _Rows(known.location, known.load, kernel_shape(self.model.shape, known.location))
        mean = fit.chain.sensitivity(location)
        variance = np.empty_like(mean)
        for e in range(mean.shape[1]):
            covariance = self.covariances[e]
            cross = _covariance(self.sizes, amplitude[e], e, there, rows.select(covariance.inducing)) / load
            functions = covariance.functions_at(cross)
            mean[:, e] += functions @ covariance.weights(fit.residual[:, e])
            own = self.sizes.even**2 + (self.sizes.relative * there.shape[:, e]) ** 2 + self.sizes.finer**2
            variance[:, e] = covariance.variance_at(amplitude[e] ** 2 * own, functions)
        return mean, variance


def tabulated_loads(load: FloatArray, length: float, most: int = LOADS[1]) -> FloatArray:
    """Loads at which a map is tabulated, from known loads (n,) and the correlation length in their logarithm.

    There are at most `most` steps between them, unless they would be farther apart than the coarse step.
    Half of them lie evenly in the logarithm, half as the known loads do. Acting loads of a response that flattens lie
    in a narrow range, and there the map must be exact: a small error of a reading is a large one of the load.
    """
    known = np.sort(np.log(load))
    ends = known[0] - np.log(BEYOND), known[-1] + np.log(BEYOND)
    wanted, least = (np.ceil((ends[1] - ends[0]) / (step * length)) for step in (LOAD_STEP, COARSE_LOAD_STEP))
    count = int(np.clip(min(wanted, max(least, most)), *LOADS)) + 1
    fine = np.linspace(*ends, FINE)
    share = 0.5 * np.linspace(0, 1, FINE) + 0.5 * np.interp(fine, known, np.linspace(0, 1, len(known)))
    return np.asarray(np.exp(np.interp(np.linspace(0, 1, count), share, fine)))


@dataclass(frozen=True, eq=False)
class _Rows:
    """Locations (n, D), loads (n,) and kernels (n, m) of touches."""

    location: FloatArray
    load: FloatArray
    shape: FloatArray

    def select(self, index: IntArray) -> _Rows:
        return _Rows(self.location[index], self.load[index], self.shape[index])


def _covariance(sizes: Sizes, amplitude: float, element: int, one: _Rows, two: _Rows) -> FloatArray:
    """Covariance of readings of an element without noise, (n, k)."""
    distance = distances(one.location, two.location)
    in_load = np.abs(np.log(one.load)[:, None] - np.log(two.load))
    own = sizes.even**2 + sizes.relative**2 * np.outer(one.shape[:, element], two.shape[:, element])
    finer = matern_5_2(distance / sizes.finer_length_mm) * matern_5_2(in_load / sizes.load_length)
    rho = own * matern_5_2(distance / sizes.length_mm) + sizes.finer**2 * finer
    return np.asarray(amplitude**2 * np.outer(one.load, two.load) * rho)


def _chosen(problem: PadProblem, model: PadCandidate) -> tuple[Sizes, FloatArray, float]:
    """Sizes and lengths, constant noise of each element (m,), noise over the signal: maximum marginal likelihood."""
    from scipy.optimize import minimize

    fit, known = model.fit, problem.known
    index = _some(known.location, problem.seed)
    here, residual = problem.present[index], fit.residual[index]
    rows = _Rows(known.location, known.load, kernel_shape(model.shape, known.location)).select(index)
    signal = (fit.predicted() - fit.chain.offset)[index]
    averaged = model.noise.averaged_variance(read_once(known.counts[index]), signal)
    unit = fit.misfit.amplitude * float(np.median(known.load))
    spacing, m = location_spacing(known.location), len(unit)
    extent = max(float(np.ptp(known.location, axis=0).max()), spacing)
    varying = loads_vary(known.load)
    lengths = (0.5 * spacing, extent)
    limits = [SIZES, SIZES, lengths, SIZES, lengths, LOAD_LENGTHS, SHARES, (1e-6, 1.0), *[(0.1, 10.0)] * m]
    if not varying:
        limits[5] = (1e6, 1e6)
    distance = distances(rows.location, rows.location)
    in_load = np.abs(np.log(rows.load)[:, None] - np.log(rows.load))
    loads = np.outer(rows.load, rows.load)

    def cost(vector: FloatArray) -> tuple[float, FloatArray]:
        a, b, length, c, finer_length, load_length, share, floor = np.exp(vector[:8])
        rho, of_load = matern_5_2(distance / length), matern_5_2(in_load / load_length)
        finer = matern_5_2(distance / finer_length)
        turned = matern_5_2_by_length(distance / length) * loads
        value, gradient = 0.0, np.zeros(len(vector))
        for e in range(m):
            inside = np.ix_(here[:, e], here[:, e])
            scale, shapes = fit.misfit.amplitude[e] ** 2, np.outer(rows.shape[:, e], rows.shape[:, e])
            own = (floor * np.exp(vector[8 + e]) * unit[e]) ** 2
            lasting = (share * signal[here[:, e], e]) ** 2
            parts = {
                0: 2 * a**2 * scale * rho * loads,
                1: 2 * b**2 * scale * shapes * rho * loads,
                2: (a**2 + b**2 * shapes) * scale * turned,
                3: 2 * c**2 * scale * finer * of_load * loads,
                4: c**2 * scale * matern_5_2_by_length(distance / finer_length) * of_load * loads,
                5: c**2 * scale * finer * matern_5_2_by_length(in_load / load_length) * loads,
            }
            covariance = 0.5 * (parts[0] + parts[1] + parts[3])[inside]
            covariance += np.diag(averaged[here[:, e], e] + own + lasting)
            factor = cho_factor(covariance, lower=True, check_finite=False)
            precision = cho_solve(factor, np.eye(len(covariance)), check_finite=False)
            weights = precision @ residual[here[:, e], e]
            value -= 0.5 * float(residual[here[:, e], e] @ weights) + float(np.log(np.diag(factor[0])).sum())
            slope = 0.5 * (np.outer(weights, weights) - precision)
            for k, part in parts.items():
                gradient[k] += float((slope * part[inside]).sum())
            gradient[6] += 2 * float(np.diag(slope) @ lasting)
            gradient[7] += 2 * float(np.diag(slope).sum() * own)
            gradient[8 + e] += 2 * float(np.diag(slope).sum() * own)
        departure = vector[8:] / FLOOR_SPREAD
        gradient[8:] -= departure / FLOOR_SPREAD
        return 0.5 * float(departure @ departure) - value, -gradient

    base = fit.misfit
    begin = (base.misfit, base.relative, base.length_mm) if model.has_map else (0.01, 0.01, 3 * spacing)
    bounds = [(float(np.log(a)), float(np.log(b))) for a, b in limits]
    low, high = np.array(bounds).T
    starts = [np.array([*begin, 0.01, times * spacing, 1.0, 0.003, 0.003, *[1.0] * m]) for times in (3.0, 10.0)]
    found = [
        minimize(
            cost,
            np.clip(np.log(np.maximum(each, 1e-300)), low, high),
            jac=True,
            method="L-BFGS-B",
            bounds=bounds,
            options={"maxiter": 60, "ftol": 1e-7},
        )
        for each in starts
    ]
    best = np.exp(min(found, key=lambda each: float(each.fun)).x)
    return Sizes(*best[:6].tolist()), best[7] * best[8:] * unit, float(best[6])


def _some(location: FloatArray, seed: int) -> IntArray:
    """Indices of touches in groups of neighbours around random centres; all touches if they are few."""
    n = len(location)
    if n <= GROUPS * NEIGHBOURS:
        return np.arange(n)
    centres = np.random.default_rng(seed).choice(n, GROUPS, replace=False)
    near = np.argsort(distances(location[centres], location), axis=1, kind="stable")[:, :NEIGHBOURS]
    return np.unique(near)
