"""Mixtures of causes of scatter, inferred from the six numbers of Table 4's noise rows: posterior and evidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import emcee
import numpy as np
from scipy.special import expit
from scipy.stats import multivariate_t

from bayestouch.paper.published import TABLE_1, number
from nicolson_fearing.noise_causes import MODULI_MPA, NAMES, Cause, Propagated
from nicolson_fearing.paper_finger import CALIBRATIONS

#: Upper ends of uniform priors: share of the variance, % of the peak, %, %, and (last two) in units of the
#: scatter by independent noise.
#: Noise common to strains is part of every element's level, so that it is at most the smallest of Table 1.
ENDS = {"share": 1.0, "strain": TABLE_1[3].minimum, "load": 10.0, "gain": 10.0, "search": 5.0, "ridge": 5.0}
#: Posterior of μ from Table 3 (`table_3_residual.py`, base): mean and 90 % interval of its logarithm.
MODULUS_MPA, MODULUS_INTERVAL = 0.057, (0.045, 0.072)
TITLES = {
    "share": "common to readings",
    "strain": "common to strains",
    "load": "load jitter",
    "gain": "gain jitter",
    "search": "stopped simplex",
    "ridge": "scatter along the ridge",
}
WALKERS, STEPS, BURN, PROPOSALS = 16, 200, 60, 800
KEPT = 400  # draws, of which hits are counted


def printed() -> tuple[np.ndarray, np.ndarray]:
    """Noise rows of Table 4 and the roundings, (2, 3): calibration; θ_c (degree), P (N/m), R (mm)."""
    numbers = [[number(f"table_4.{c}.noise.{name}") for name in NAMES] for c in CALIBRATIONS]
    values, rounding = np.array([[(n.value, n.rounding) for n in row] for row in numbers]).transpose(2, 0, 1)
    return values, rounding


@dataclass(frozen=True, eq=False)
class Mixture:
    """Causes, and a way of fitting: likelihood of the six printed numbers.

    Attributes
    ----------
    causes : tuple of str
        Beside independent noise.
    propagated : Propagated
        What they do in these fits.
    free_modulus : bool
        Whether any modulus of the grid is as probable as any other; else Table 3's posterior is the prior.
    """

    causes: tuple[str, ...]
    propagated: Propagated
    free_modulus: bool = False

    def values(self, x: np.ndarray) -> dict[str, float]:
        """Parameters at unconstrained coordinates, and "modulus" in MPa."""
        amounts = {name: ENDS[name] * float(expit(each)) for name, each in zip(self.causes, x, strict=False)}
        if self.free_modulus:
            low, high = np.log(MODULI_MPA[[0, -1]])
            return {**amounts, "modulus": float(np.exp(low + (high - low) * expit(x[-1])))}
        return {**amounts, "modulus": float(MODULUS_MPA * np.exp(modulus_sd() * x[-1]))}

    def rows(self, values: dict[str, float]) -> np.ndarray | None:
        """The six numbers by draw of finger and levels, (draws, 2, 3); None where more than all noise is common."""
        share, strain = values.get("share", 0.0), values.get("strain", 0.0)
        if strain**2 > TABLE_1[3].minimum ** 2 * (1 - share):
            return None
        weight: dict[Cause, float] = {
            "independent": 1 - share + values.get("search", 0.0) ** 2,
            "even": -(strain**2),
            "common_readings": share,
            "common_strain": strain**2,
            "load": values.get("load", 0.0) ** 2,
            "gain": values.get("gain", 0.0) ** 2,
            "ridge": values.get("ridge", 0.0) ** 2,
        }
        used: dict[Cause, float] = {cause: size for cause, size in weight.items() if size or cause == "independent"}
        return self.propagated.rows(float(np.clip(values["modulus"], *MODULI_MPA[[0, -1]])), used)

    def log_likelihood(self, x: np.ndarray) -> float:
        """Log density of the six numbers' logarithms: normal, of fingers, sampling and rounding."""
        rows = self.rows(self.values(x))
        if rows is None:
            return -np.inf
        mean, covariance = self._normal(rows)
        off = np.log(printed()[0]).ravel() - mean
        factor = np.linalg.cholesky(covariance)
        white = np.linalg.solve(factor, off)
        return float(-0.5 * white @ white - np.log(factor.diagonal()).sum() - 0.5 * len(off) * np.log(2 * np.pi))

    def misfit(self, values: dict[str, float], *, averaged: bool = False) -> float:
        """χ² of the six numbers, or of the three means over both calibrations."""
        rows = self.rows(values)
        assert rows is not None
        mean, covariance = self._normal(rows)
        off = np.log(printed()[0]).ravel() - mean
        if averaged:
            over = np.kron([[0.5, 0.5]], np.eye(3))
            off, covariance = over @ off, over @ covariance @ over.T
        return float(off @ np.linalg.solve(covariance, off))

    def _normal(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        logs = np.log(rows).reshape(len(rows), -1)
        return logs.mean(axis=0), np.cov(logs.T) + self._errors

    @cached_property
    def _errors(self) -> np.ndarray:
        """Covariance of sampling, which both calibrations have in common, and of rounding."""
        values, rounding = printed()
        sampling = np.kron(np.ones((2, 2)), np.diag(self.propagated.sampling_sd**2))
        return np.asarray(sampling + np.diag((rounding / values).ravel() ** 2 / 3))

    def log_prior(self, x: np.ndarray) -> float:
        """Log density of the coordinates: logistic where the parameter is uniform, normal for Table 3's modulus."""
        bounded = x if self.free_modulus else x[:-1]
        logistic = float((-np.logaddexp(0, bounded) - np.logaddexp(0, -bounded)).sum())
        return logistic + (0.0 if self.free_modulus else -0.5 * float(x[-1] ** 2 + np.log(2 * np.pi)))

    def log_posterior(self, x: np.ndarray) -> float:
        """Unnormalised."""
        prior = self.log_prior(x)
        return prior + self.log_likelihood(x) if np.isfinite(prior) else -np.inf

    def inferred(self, seed: int = 0, steps: int = STEPS) -> Inferred:
        """Posterior by emcee, evidence by importance sampling from a t distribution about its draws."""
        size = len(self.causes) + 1
        rng = np.random.default_rng(seed)
        # Scatter wide, but start where the walkers' density is finite.
        start = rng.standard_normal((10 * WALKERS, size))
        level = np.array([self.log_posterior(x) for x in start])
        start = start[np.argsort(-level)[:WALKERS]]
        sampler = emcee.EnsembleSampler(WALKERS, size, self.log_posterior)
        state = emcee.State(start, random_state=np.random.RandomState(seed).get_state())
        sampler.run_mcmc(state, steps)
        x = sampler.get_chain(discard=int(steps * BURN / STEPS), flat=True)
        proposal = multivariate_t(x.mean(axis=0), 1.5 * np.atleast_2d(np.cov(x.T)) + 1e-9 * np.eye(size), df=4)
        tried = proposal.rvs(PROPOSALS, random_state=rng).reshape(PROPOSALS, size)
        log_weight = np.array([self.log_posterior(each) for each in tried]) - proposal.logpdf(tried)
        weight = np.exp(log_weight - log_weight.max())
        return Inferred(
            self,
            [self.values(each) for each in x[:: max(1, len(x) // KEPT)]],
            float(log_weight.max() + np.log(weight.mean())),
            float(weight.sum() ** 2 / (weight**2).sum()),
        )


def modulus_sd() -> float:
    """Standard deviation of log μ, of Table 3's posterior."""
    return float(np.log(MODULUS_INTERVAL[1] / MODULUS_INTERVAL[0]) / (2 * 1.645))


@dataclass(frozen=True, eq=False)
class Inferred:
    """Posterior of a mixture.

    Attributes
    ----------
    mixture : Mixture
        What was inferred.
    draws : list of dict
        Parameters.
    log_evidence : float
        Of the six numbers.
    effective : float
        Effective number of the proposals that it comes from.
    """

    mixture: Mixture
    draws: list[dict[str, float]]
    log_evidence: float
    effective: float

    def of(self, name: str) -> np.ndarray:
        """Draws of a parameter."""
        return np.array([each[name] for each in self.draws])

    @cached_property
    def best(self) -> dict[str, float]:
        """The draw with the smallest misfit."""
        return min(self.draws, key=self.mixture.misfit)

    @cached_property
    def hits(self) -> float:
        """Share of draws of parameters, finger and levels with all six numbers within rounding and two sampling sds."""
        values, rounding = printed()
        allowed = rounding + 2 * self.mixture.propagated.sampling_sd * values
        rows = [self.mixture.rows(each) for each in self.draws]
        return float(np.mean([np.all(np.abs(r - values) <= allowed, axis=(1, 2)) for r in rows if r is not None]))


def name_of(causes: Sequence[str]) -> str:
    """In words."""
    return "independent" + "".join(f" + {TITLES[cause]}" for cause in causes)
