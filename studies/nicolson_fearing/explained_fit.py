"""Shared unknowns inferred from the paper's tables: posterior, evidence, and what single fingers would then print.

Linear fingers (`linear_finger`) are simulated at draws of the unknowns; a quadratic regression of what they would print
is the emulator, its residuals are what chance does from finger to finger. The likelihood is normal, with the rounding
of the prints. Errors of the tips' radii are added to the covariance of Table 3 exactly. Draws come from the
prior, then from the posterior so far, widened, until it settles.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import emcee
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import expit
from scipy.stats import multivariate_t

from bayestouch.contact import composite_radius
from bayestouch.paper.published import TABLE_3, number
from nicolson_fearing.finger_errors import Tables
from nicolson_fearing.linear_finger import FINGERS, LinearFinger
from nicolson_fearing.linear_touches import R_B, read_slopes
from nicolson_fearing.paper_finger import CALIBRATIONS
from nicolson_fearing.published_fits import FLOOR_MM, SHRINKAGE, TIP_SHARE
from nicolson_fearing.surface_causes import surface_tables
from nicolson_fearing.unknowns import PRIOR, Unknowns

FloatArray = NDArray[np.float64]

_CONTACTS = ("hertz", "frictionless")
_PARTS, _COLUMNS = ("total", "location", "noise"), ("theta_c", "P", "R")
ELEMENT_KEYS = tuple(f"table_{t}.error.{end}" for t in (1, 2) for end in ("min", "avg", "max"))
TIP_KEYS = tuple(f"table_3[{row.r_c:.2f}].{c}_{k}" for c in _CONTACTS for k in CALIBRATIONS for row in TABLE_3)
ERROR_KEYS = tuple(f"table_4.{k}.{part}.{name}" for k in CALIBRATIONS for part in _PARTS for name in _COLUMNS)
KEYS = (*ELEMENT_KEYS, *TIP_KEYS, *ERROR_KEYS)
OF_TIPS = np.array([key in TIP_KEYS for key in KEYS])
DRAWS, ROUNDS, WIDEN, LEAST_WIDTH, REACH = 250, 4, 1.5, 0.08, 3.0
MOST_ROUNDS, ENOUGH = 7, 50
"""Rounds go on until this many proposals of the evidence are worth one."""
WALKERS_PER, STEPS, BURN, PROPOSALS = 4, 600, 200, 4000


def scaled(key: str, value: float) -> float:
    """A printed number on the scale of the likelihood: composite radius (mm) in Table 3, logarithms elsewhere."""
    return float(composite_radius(value, R_B)) if key in TIP_KEYS else float(np.log(value))


@lru_cache(maxsize=1)
def printed() -> tuple[FloatArray, FloatArray]:
    """All numbers on that scale, and the standard deviations of their rounding."""
    numbers = [number(key) for key in KEYS]
    value, above = (np.array([scaled(n.key, n.value + share * n.rounding) for n in numbers]) for share in (0.0, 1.0))
    return value, (above - value) / np.sqrt(3)


def numbers_of(tables: Tables) -> FloatArray:
    """What a finger would print, on the same scale."""
    of_elements = [end(e) for e in (tables.errors_1, tables.errors_2) for end in (np.min, np.mean, np.max)]
    return np.concatenate([np.log(of_elements), tables.table_3.ravel(), np.log(tables.table_4).ravel()])


@lru_cache(maxsize=FINGERS)
def finger(seed: int) -> LinearFinger:
    """One of the fingers, remembered."""
    return LinearFinger.of(seed)


@dataclass(frozen=True)
class Explanation:
    """What may be true: unknowns that are free, and the values of the others.

    Attributes
    ----------
    name : str
        In words.
    free : tuple of str
        Names of the free unknowns.
    fixed : Unknowns
        The others.
    tables : tuple of str
        Beginnings of the keys that the unknowns are inferred from. Totals of Table 4 are never among these: they are
        the root of the sum of squares of the other two rows, and say nothing more.
    """

    name: str
    free: tuple[str, ...]
    fixed: Unknowns
    tables: tuple[str, ...] = ("table_",)

    @property
    def used(self) -> NDArray[np.bool_]:
        """Which numbers the unknowns are inferred from."""
        return np.array([key.startswith(self.tables) and ".total." not in key for key in KEYS])

    def unknowns(self, share: FloatArray) -> Unknowns:
        """At shares of the priors' ranges."""
        ends = [PRIOR[name] for name in self.free]
        return replace(
            self.fixed, **{n: lo + (hi - lo) * float(s) for n, (lo, hi), s in zip(self.free, ends, share, strict=True)}
        )

    def simulated(self, shares: FloatArray, first: int = 0) -> FloatArray:
        """What one finger at each of these would print, tips without errors; (n, numbers)."""
        out = []
        for i, share in enumerate(shares, start=first):
            unknowns = replace(self.unknowns(share), tip_sd_mm=0.0)
            out.append(numbers_of(surface_tables(finger(i % FINGERS), unknowns, draw=i)))
        return np.array(out)

    def inferred(self, *, near: Inferred | None = None, draws: int = DRAWS, steps: int = STEPS) -> Inferred:
        """Posterior and evidence; `near` is a posterior with at least these free unknowns, to begin at."""
        rng = np.random.default_rng(0)
        if near is None:
            shares = rng.uniform(size=(draws, len(self.free)))
        else:
            kept = [near.explanation.free.index(name) for name in self.free]
            shares = _widened(near.shares[:, kept], draws, rng)
        least = ROUNDS if near is None else ROUNDS - 2
        known, numbers = np.empty((0, len(self.free))), np.empty((0, len(KEYS)))
        for done in range(1, MOST_ROUNDS + 1):
            known = np.concatenate([known, shares])
            numbers = np.concatenate([numbers, self.simulated(shares, first=len(numbers))])
            # of the earlier draws only those count that are as near as these
            near_by = np.all(np.abs(known - shares.mean(axis=0)) <= REACH * shares.std(axis=0), axis=1)
            found = Inferred.of(self, Emulator.of(self, known[near_by], numbers[near_by]), rng, steps)
            if done >= least and found.effective > ENOUGH:
                break
            shares = _widened(found.shares, draws, rng)
        return found


def _widened(shares: FloatArray, draws: int, rng: np.random.Generator) -> FloatArray:
    """Draws that reach further, within the priors, so that a regression on them does not follow chance."""
    middle = shares.mean(axis=0)
    some = middle + WIDEN * (shares[rng.integers(len(shares), size=draws)] - middle)
    return np.asarray(np.clip(some + LEAST_WIDTH * rng.standard_normal(some.shape), 0.0, 1.0))


@dataclass(frozen=True, eq=False)
class Emulator:
    """Quadratic regression of the numbers on the unknowns' shares.

    Attributes
    ----------
    explanation : Explanation
        Of what.
    middle, width : (k,) arrays
        Of the shares, that make them of order one.
    weights : (terms, numbers) array
        Of the regression.
    covariance : (numbers, numbers) array
        Of one finger about it, and of rounding.
    """

    explanation: Explanation
    middle: FloatArray
    width: FloatArray
    weights: FloatArray
    covariance: FloatArray

    @classmethod
    def of(cls, explanation: Explanation, shares: FloatArray, found: FloatArray) -> Emulator:
        """Of what was simulated there."""
        middle, width = shares.mean(axis=0), shares.std(axis=0) + 1e-9
        terms = _terms((shares - middle) / width)
        weights, *_ = np.linalg.lstsq(terms, found, rcond=None)
        left = found - terms @ weights
        covariance = left.T @ left / (len(found) - terms.shape[1])
        covariance *= np.where(np.eye(len(KEYS)) > 0, 1.0, 1 - SHRINKAGE)
        return cls(explanation, middle, width, weights, covariance + np.diag(printed()[1] ** 2 + FLOOR_MM**2 * OF_TIPS))

    def mean(self, share: FloatArray) -> FloatArray:
        """Expected numbers at (..., k) shares."""
        return np.asarray(_terms((np.atleast_2d(share) - self.middle) / self.width) @ self.weights)

    def log_posterior(self, coordinates: FloatArray) -> FloatArray:
        """Of logits of the shares, (n, k) to (n,); prior and likelihood are normalised."""
        share = expit(coordinates)
        off = (printed()[0] - self.mean(share))[:, self.explanation.used]
        half, rotated, size, log_determinant = self._rotated
        white = off @ half.T @ rotated
        extra = 1 + self._tip_sd(share)[:, None] ** 2 * size
        likelihood = -0.5 * (white**2 / extra + np.log(extra)).sum(axis=1) - log_determinant
        prior = -(np.logaddexp(0, coordinates) + np.logaddexp(0, -coordinates)).sum(axis=1)
        return np.asarray(likelihood - 0.5 * off.shape[1] * np.log(2 * np.pi) + prior)

    def _tip_sd(self, share: FloatArray) -> FloatArray:
        if "tip_sd_mm" not in self.explanation.free:
            return np.full(len(share), self.explanation.fixed.tip_sd_mm)
        low, high = PRIOR["tip_sd_mm"]
        return np.asarray(low + (high - low) * share[:, self.explanation.free.index("tip_sd_mm")])

    @cached_property
    def _rotated(self) -> tuple[FloatArray, FloatArray, FloatArray, float]:
        """What makes chance white, and then the directions and variances of errors of the tips (sd 1 mm)."""
        slope = np.zeros((len(KEYS), len(TABLE_3)))
        slope[OF_TIPS] = tip_slopes(self.explanation.unknowns(self.middle)).repeat(2, axis=0).reshape(-1, len(TABLE_3))
        used = np.ix_(self.explanation.used, self.explanation.used)
        factor = np.linalg.cholesky(self.covariance[used])
        half = np.linalg.inv(factor)
        # Of the variance of a tip's error its columns share a part; the rest is what else a column may have.
        spread = TIP_SHARE * slope @ slope.T + (1 - TIP_SHARE) * np.diag(OF_TIPS.astype(float))
        both = half @ spread[used] @ half.T
        size, rotated = np.linalg.eigh(both)
        return half, rotated, np.maximum(size, 0.0), float(np.log(factor.diagonal()).sum())


@dataclass(frozen=True, eq=False)
class Inferred:
    """Posterior of an explanation.

    Attributes
    ----------
    explanation : Explanation
        Of what.
    emulator : Emulator
        Its last one.
    shares : (n, k) array
        Draws.
    log_evidence, effective : float
        Of the numbers, by importance sampling, and the effective number of its proposals.
    """

    explanation: Explanation
    emulator: Emulator
    shares: FloatArray
    log_evidence: float
    effective: float

    @classmethod
    def of(cls, explanation: Explanation, emulator: Emulator, rng: np.random.Generator, steps: int) -> Inferred:
        """By emcee, then importance sampling."""
        size = len(explanation.free)
        walkers = max(WALKERS_PER * size, 16)
        tried = rng.logistic(size=(400 * walkers, size))
        best = tried[emulator.log_posterior(tried).argmax()]
        best = minimize(lambda x: -float(emulator.log_posterior(x[None])[0]), best, method="Powell").x.clip(-4, 4)
        start = best + 0.1 * rng.standard_normal((walkers, size))
        sampler = emcee.EnsembleSampler(walkers, size, emulator.log_posterior, vectorize=True)
        state = emcee.State(start, random_state=np.random.RandomState(rng.integers(2**31)).get_state())
        sampler.run_mcmc(state, steps)
        x = sampler.get_chain(discard=steps * BURN // STEPS, thin=10, flat=True)
        proposal = multivariate_t(x.mean(axis=0), 1.3 * np.atleast_2d(np.cov(x.T)), df=5)
        count = PROPOSALS * steps // STEPS
        tried = proposal.rvs(count, random_state=rng).reshape(count, size)
        log_weight = emulator.log_posterior(tried) - proposal.logpdf(tried)
        weight = np.exp(log_weight - log_weight.max())
        return cls(
            explanation,
            emulator,
            np.asarray(expit(x)),
            float(log_weight.max() + np.log(weight.mean())),
            float(weight.sum() ** 2 / (weight**2).sum()),
        )

    def of_name(self, name: str) -> FloatArray:
        """Draws of an unknown."""
        low, high = PRIOR[name]
        return np.asarray(low + (high - low) * self.shares[:, self.explanation.free.index(name)])

    def draws(self, count: int, seed: int = 1) -> list[Unknowns]:
        """Some draws."""
        rows = np.random.default_rng(seed).choice(len(self.shares), count, replace=count > len(self.shares))
        return [self.explanation.unknowns(self.shares[row]) for row in rows]


def tip_slopes(unknowns: Unknowns) -> FloatArray:
    """Change of the read composite radius by the tip's own, (contact, tips, tips): diagonal in the tips."""
    true = np.array([float(composite_radius(row.r_c, R_B)) for row in TABLE_3])
    return np.asarray(read_slopes(unknowns, true)[:, :, None] * np.eye(len(true)))


def _terms(z: FloatArray) -> FloatArray:
    """Constant, linear, square and product terms of (n, k)."""
    k = z.shape[1]
    upper = np.triu_indices(k)
    return np.concatenate([np.ones((len(z), 1)), z, z[:, upper[0]] * z[:, upper[1]]], axis=1)
