"""Hierarchical model of one build of fingers, to predict the next finger from earlier ones.

The vector x_k of finger k is normal about ``A M`` with covariance ``Q = Σ_j τ_j² B_j``. M is the mean of the build; the
sds τ are those between fingers, and between elements of a finger. The data of each earlier finger have the likelihood
``exp(-½ x' Λ_k x + η_k' x)``; Λ_k is singular in directions on which the data have no information. M and all x_k are
integrated out in closed form, and emcee draws the few log τ. Each coordinate is its difference from the mean of the
default prior of one finger, in units of the sd of this prior: M is normal with mean 0 and sd 1, and each τ is
half-normal with scale 1.
"""

from __future__ import annotations

from dataclasses import dataclass

import emcee
import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.sampling.sampler import ArraySampler

WALKERS, BURN_IN, STEPS, THIN = 32, 200, 400, 5
# Range of log τ in which walkers start: between a hundredth of the sd of the default prior and this sd.
START = np.log(0.01), 0.0
# Random values of a coordinate for each of the 2,560 draws: if all were independent, their 2.5 % quantile would vary by
# 1 % of an sd.
EACH = 20


@dataclass(frozen=True, eq=False)
class EarlierFingers:
    """Normal likelihoods of K earlier fingers, of d coordinates.

    Attributes
    ----------
    precision : (K, d, d) array
        Λ, positive semidefinite.
    shift : (K, d) array
        η, which is Λ times the estimate.
    """

    precision: FloatArray
    shift: FloatArray


@dataclass(frozen=True, eq=False)
class Population:
    """Distribution of the coordinates of the fingers of a build.

    Attributes
    ----------
    design : (d, q) array
        A, from the q means of the build to the d coordinates of a finger.
    components : (c, d, d) array
        B, the covariances for sds of 1.
    """

    design: FloatArray
    components: FloatArray

    @classmethod
    def of(cls, n_scalars: int, n_elements: int) -> Population:
        """Population of `n_scalars` values of a finger, then of one value of each element.

        The sds are those of each scalar between fingers, of the mean of the elements between fingers, and of elements
        within a finger.
        """
        n, d = n_scalars, n_scalars + n_elements
        design = np.zeros((d, n + 1))
        design[:n, :n] = np.eye(n)
        design[n:, n] = 1.0
        each = [np.outer(column, column) for column in design.T]
        return cls(design, np.stack([*each, np.diag(design[:, n])]))

    def covariance(self, log_sd: FloatArray) -> FloatArray:
        """Covariance (..., d, d) of the coordinates about the mean of the build, for log sds (..., c)."""
        return np.tensordot(np.exp(2 * log_sd), self.components, axes=1)

    def posterior(self, log_sd: FloatArray, evidence: EarlierFingers) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Log posterior density (n,) of log sds (n, c); mean (n, q) and covariance (n, q, q) of M given these sds."""
        cov = self.covariance(log_sd)[:, None]
        precision, shift = evidence.precision, evidence.shift[..., None]
        # Woodbury identity: I + ΛQ has an inverse even if Q or Λ is singular.
        inverse = np.linalg.inv(np.eye(cov.shape[-1]) + precision @ cov)
        of_mean = (self.design.T @ inverse @ precision @ self.design).sum(axis=1) + np.eye(self.design.shape[1])
        of_shift = (self.design.T @ inverse @ shift).sum(axis=1)
        spread = np.linalg.inv(of_mean)
        mean = spread @ of_shift
        log_volume = np.linalg.slogdet(inverse)[1].sum(axis=1) - np.linalg.slogdet(of_mean)[1]
        explained = (shift.swapaxes(-1, -2) @ cov @ inverse @ shift).sum(axis=(1, 2, 3))
        explained = explained + (of_shift * mean).sum(axis=(1, 2))
        half_normal = (log_sd - 0.5 * np.exp(2 * log_sd)).sum(axis=1)
        return 0.5 * (log_volume + explained) + half_normal, mean[..., 0], spread

    def sample(self, evidence: EarlierFingers, seed: int) -> FloatArray:
        """Draws (n, c) of the log sds from their posterior."""
        c = len(self.components)
        rng = np.random.RandomState(seed)
        sampler = ArraySampler(WALKERS, c, lambda points: self.posterior(points, evidence)[0], vectorize=True)
        start = emcee.State(rng.uniform(*START, (WALKERS, c)), random_state=rng.get_state())
        sampler.run_mcmc(start, BURN_IN + STEPS)
        return np.asarray(sampler.get_chain(discard=BURN_IN, thin=THIN, flat=True))


@dataclass(frozen=True, eq=False)
class NextFinger:
    """Predictive distribution of a finger without touches; n draws.

    Attributes
    ----------
    sd : (n, c) array
        Draws of the sds of the population.
    mean : (n, d) array
        Mean of the coordinates, given these sds.
    variance : (n, d) array
        Variance of the coordinates as independent priors, see `predict`.
    """

    sd: FloatArray
    mean: FloatArray
    variance: FloatArray

    def samples(self, coordinate: int, rng: np.random.Generator) -> FloatArray:
        """Random values of one coordinate, `EACH` from each of the n draws, (EACH n,)."""
        noise = rng.standard_normal((EACH, len(self.mean)))
        return np.asarray(self.mean[:, coordinate] + np.sqrt(self.variance[:, coordinate]) * noise).ravel()


def predict(population: Population, evidence: EarlierFingers, seed: int) -> NextFinger:
    """Predictive distribution of the next finger, from earlier fingers.

    The coordinates of the next finger are correlated: all its elements depend on the mean of the finger, and the means
    of the build were learned together. The priors of a calibration are independent. Their variances are the smallest
    with which no combination of coordinates is more certain than in the population. The variance of an element is that
    within the finger plus m times that of the mean of the m elements, so that the mean of the elements has its own
    variance. The variances of the means are multiplied by the largest eigenvalue of their correlation matrix.
    """
    log_sd = population.sample(evidence, seed)
    sd = np.exp(log_sd)
    _, mean, spread = population.posterior(log_sd, evidence)
    q = spread.shape[-1]
    between = spread + sd[:, :q, None] ** 2 * np.eye(q)
    inflation = largest_eigenvalue(between)
    variance = inflation * np.diagonal(between, axis1=1, axis2=2)
    elements: NDArray[np.bool_] = population.design[:, -1] > 0
    by_coordinate = variance @ population.design.T
    by_coordinate[:, elements] = sd[:, -1:] ** 2 + elements.sum() * variance[:, -1:]
    return NextFinger(sd, mean @ population.design.T, by_coordinate)


def largest_eigenvalue(covariances: FloatArray) -> float:
    """Largest eigenvalue of the mean correlation matrix of covariances (n, q, q)."""
    sd = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    correlation = (covariances / (sd[:, :, None] * sd[:, None, :])).mean(axis=0)
    return float(np.linalg.eigvalsh(correlation)[-1])
