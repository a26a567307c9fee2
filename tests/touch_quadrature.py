"""Dense quadrature over radius, location and load of one touch: the oracle of its posterior.

It evaluates the chain itself (no table), adds prior and force reading by their definitions, and finds where the
posterior is by zooming into a grid: nothing of how touches are drawn is used.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from bayestouch.chain.finger import FingerChain
from bayestouch.finger.calibration import finger_chain
from bayestouch.priors.parameters import Prior
from bayestouch.results.objects import Calibration

# Nodes of the searching grids and of the last one, along R, θ_c and P.
COARSE, FINE = (20, 20, 20), (96, 56, 80)
# Nodes this far below the peak are left out: e^-25 of it.
DEPTH = 25.0
PROBABILITIES = (0.05, 0.95)


@dataclass(frozen=True, eq=False)
class OneTouch:
    """Mean readings of one touch of a calibrated finger, and what is known of it beforehand.

    `covariance` (m, m) of the mean readings, `load` in N/m (NaN: not measured), supports of θ_c (rad) and P (N/m).
    """

    chain: FingerChain
    readings: np.ndarray
    covariance: np.ndarray
    load: float
    load_sd: float
    location: tuple[float, float]
    largest_load: float

    @classmethod
    def of(
        cls, calibration: Calibration, readings: np.ndarray, samples: int, load: float, extra: np.ndarray | float = 0.0
    ) -> OneTouch:
        """Mean of samples; priors as documented: 20° beyond the elements, three typical or 1.5 largest loads."""
        chain = finger_chain(calibration)
        sd = np.hypot(calibration.noise.tactile_sd / np.sqrt(samples), calibration.noise.discrepancy_sd)
        margin = np.radians(20)
        return cls(
            chain=chain,
            readings=readings,
            covariance=np.diag(sd**2) + extra,
            load=load,
            load_sd=calibration.noise.force_sd / np.sqrt(samples),
            location=(chain.angle.min() - margin, chain.angle.max() + margin),
            largest_load=max(
                3 * float(calibration.settings["typical_load"]), 1.5 * float(np.nanmax(calibration.rows.load))
            ),
        )

    def log_likelihood(self, radius: np.ndarray, angle: np.ndarray, load: np.ndarray) -> np.ndarray:
        """Log likelihood of readings and force reading, up to a constant, over the grid of three axes."""
        grid = np.meshgrid(radius, angle, load, indexing="ij")
        root = np.linalg.inv(np.linalg.cholesky(self.covariance))
        z = (self.chain.predict(*grid) - self.readings) @ root.T
        miss = 0.0 if np.isnan(self.load) else (grid[2] - self.load) / self.load_sd
        return -0.5 * np.einsum("...m,...m->...", z, z) - 0.5 * miss * miss


@dataclass(frozen=True, eq=False)
class Marginals:
    """Statistics by parameter: mean, sd, 5 and 95 % quantile; the log of the integral; and the peak.

    The peak (R in mm, θ_c in rad, P in N/m) is that of the density per unit of log(R/(r_b - R)), as drawn.
    """

    statistics: dict[str, np.ndarray]
    log_evidence: float
    peak: tuple[float, float, float]


def integrate(touch: OneTouch, prior: Prior | None = None, radius_mm: float | None = None) -> Marginals:
    """Posterior under a prior of R (level over (0, r_b) by default), or at one radius."""
    outer = touch.chain.outer_radius_mm
    log_prior = None if prior is None else prior.log_density
    ends = [(0.0, outer) if prior is None else prior.support, touch.location, (0.0, touch.largest_load)]
    if radius_mm is not None:
        ends[0] = (radius_mm, radius_mm)
    if not np.isnan(touch.load):
        ends[2] = (touch.load - 10 * touch.load_sd, touch.load + 10 * touch.load_sd)
    bounds = list(ends)
    for _ in range(20):
        axes = [low + (np.arange(n) + 0.5) / n * (high - low) for (low, high), n in zip(ends, COARSE, strict=True)]
        if radius_mm is not None:
            axes[0] = np.array([radius_mm])
        log = _log_density(touch, axes, log_prior)
        before, ends = ends, _zoomed(axes, log, ends, bounds)
        # Settled: all that matters is inside, and no axis can be cut much shorter.
        if all(c <= a and b <= d and b - a >= 0.7 * (d - c) for (a, b), (c, d) in zip(ends, before, strict=True)):
            break
    else:
        raise AssertionError("the region of the posterior was not found")
    rules = [_gauss(n, *end) for n, end in zip(FINE, ends, strict=True)]
    if radius_mm is not None:
        rules[0] = np.array([radius_mm]), np.ones(1)
    axes, weights = [rule[0] for rule in rules], [rule[1] for rule in rules]
    log = _log_density(touch, axes, log_prior)
    density = np.exp(log - log.max())
    statistics = {}
    for axis, (name, others) in enumerate((("R", "jk"), ("theta_c", "ik"), ("P", "ij"))):
        if len(axes[axis]) > 1:
            kept = [weight for i, weight in enumerate(weights) if i != axis]
            marginal = np.einsum(f"ijk,{others[0]},{others[1]}->{'ijk'[axis]}", density, *kept)
            scale = 180 / np.pi if axis == 1 else 1.0
            statistics[name] = _statistics(scale * axes[axis], weights[axis], marginal, scale * np.array(ends[axis]))
    # r_c has moments only where the posterior of R ends well below the flat.
    if radius_mm is None and ends[0][1] < 0.9 * outer:
        share = np.einsum("ijk,i,j,k->i", density, *weights)
        statistics["r_c"] = _radius_statistics(statistics["R"], axes[0], share, outer)
    jacobian = axes[0] * (outer - axes[0]) if radius_mm is None else np.ones(1)
    at = np.unravel_index(np.argmax(density * jacobian[:, None, None]), density.shape)
    peak = (float(axes[0][at[0]]), float(axes[1][at[1]]), float(axes[2][at[2]]))
    return Marginals(statistics, float(np.log(np.einsum("ijk,i,j,k->", density, *weights)) + log.max()), peak)


def _gauss(n, low, high):
    """Nodes and weights of Gauss-Legendre's rule: it bears a density that is cut off at an end."""
    x, weight = np.polynomial.legendre.leggauss(n)
    return low + (high - low) * (x + 1) / 2, weight * (high - low) / 2


def _log_density(touch, axes, log_prior):
    log = touch.log_likelihood(*axes)
    if log_prior is not None:
        log += log_prior(axes[0])[:, None, None]
    return log


def _zoomed(axes, log, ends, bounds):
    """Ends of the region whose nodes matter: half as wide again where it goes on, one node wider where it ends."""
    new = []
    for axis, (nodes, (low, high), (least, most)) in enumerate(zip(axes, ends, bounds, strict=True)):
        profile = log.max(axis=tuple(i for i in range(3) if i != axis))
        kept = np.flatnonzero(profile > log.max() - DEPTH)
        step = (high - low) / max(len(nodes), 2)
        further = 0.5 * (high - low)
        low = nodes[kept[0]] - (1.5 * step if kept[0] else further)
        high = nodes[kept[-1]] + (1.5 * step if kept[-1] < len(nodes) - 1 else further)
        new.append((max(low, least), min(high, most)))
    return new


def _statistics(values: np.ndarray, weights: np.ndarray, marginal: np.ndarray, ends: np.ndarray) -> np.ndarray:
    share = weights * marginal / (weights @ marginal)
    mean = share @ values
    # Quantiles from the integral of a spline through the density, inverted on a fine grid.
    fine = np.linspace(*ends, 4001)
    below = CubicSpline(values, marginal).antiderivative()(fine)
    below -= below[0]
    quantiles = np.interp(np.array(PROBABILITIES) * below[-1], below, fine)
    return np.array([mean, np.sqrt(share @ (values - mean) ** 2), *quantiles])


def _radius_statistics(of_r: np.ndarray, radius: np.ndarray, share: np.ndarray, outer: float) -> np.ndarray:
    """Of r_c, from the share of each node of R: its quantiles are those of R, carried over."""
    share, r_c = share / share.sum(), radius * outer / (outer - radius)
    mean, quantiles = share @ r_c, of_r[2:]
    return np.array([mean, np.sqrt(share @ (r_c - mean) ** 2), *(quantiles * outer / (outer - quantiles))])
