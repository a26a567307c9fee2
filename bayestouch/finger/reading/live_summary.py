"""Moments, quantiles and flags of one touch on a finger, from the integrals of `live_nodes`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from bayestouch.array_types import FloatArray
from bayestouch.finger.reading.live_density import Expansion, OneTouch
from bayestouch.finger.reading.live_elsewhere import ELSEWHERE, Branch, left_out
from bayestouch.finger.reading.live_nodes import Nodes, nodes_of
from bayestouch.finger.reading.modulus import SHARES, RadiusOverModulus
from bayestouch.priors.parameters import Prior
from bayestouch.priors.radius import RadiusOfTips
from bayestouch.reading.live import AT_AN_END, CLOSE, IMPROBABLE, LEVELS, MISFIT, LiveTouch
from bayestouch.reading.mixtures import finer, mixture_quantiles
from bayestouch.results.tips import ROUND

# Number of knots; their range in Laplace sd from the mode, and largest |w|, as in `profile`.
KNOTS, REACH, FURTHEST = 21, 6.5, 9.0
# Towards an edge (w below zero) or a flat the likelihood is constant in the end, and the density of w falls by one nat
# per unit. Where the Laplace sd is larger than the first number, the knots reach that far at least on this side.
LONG_TAIL, TAIL_REACH = 0.4, 6.5
ROUNDED = 1e-9
# A grid is replaced if an end has more than the first share of the total mass, or one knot more than the second; range
# of the new grid, in sd from the mean.
LEFT_OUT, CROWDED, AGAIN = 2e-3, 0.6, 6.5
# Flag: logarithm of an integral over that of its normal approximation, mean over the indenters.
BENT = 0.3
CUT = "part of the posterior of R is outside the grid"
NOT_NORMAL = "location and load are not nearly normal for a given indenter"
TOO_FEW = "readings and load are fewer than the unknowns"
NAMES, UNITS = ("R", "theta_c", "P"), ("mm", "degree", "N/m")
_DEGREE = 180 / np.pi


@dataclass(frozen=True)
class Grid:
    """Even knots in w: first one and spacing."""

    low: float
    step: float

    @property
    def w(self) -> FloatArray:
        """Knots, (g,)."""
        return np.asarray(self.low + self.step * np.arange(KNOTS))

    @classmethod
    def between(cls, low: float, high: float) -> Grid:
        """Grid from `low` to `high`, within the range where R differs from edge and flat."""
        low = min(max(low, -FURTHEST), FURTHEST - 1.0)
        high = max(min(high, FURTHEST + 1.0), low + 1e-6)
        return cls(low, (high - low) / (KNOTS - 1))

    def moved(self, log_mass: FloatArray) -> Grid | None:
        """A better grid after the log masses (g,) at the knots are known; None if this one is good."""
        mass = np.exp(log_mass - log_mass.max())
        mass /= mass.sum()
        w = self.w
        # The last knot is rounded: a grid that ends at the limit must not seem to end before it.
        low, high = w[0] > -FURTHEST + ROUNDED, w[-1] < FURTHEST + 1.0 - ROUNDED
        cut = (mass[0] > LEFT_OUT and low) or (mass[-1] > LEFT_OUT and high)
        if not cut and mass.max() < CROWDED:
            return None
        mean = float(w @ mass)
        sd = max(float(np.sqrt((w - mean) ** 2 @ mass)), 0.5 * self.step)
        wider = 1.5 if cut else 1.0
        return Grid.between(mean - wider * AGAIN * sd, mean + wider * AGAIN * sd)


def knots(found: Expansion | Branch) -> Grid:
    """Knots about a mode, from its Laplace approximation."""
    w, spread = float(found.x[0]), float(np.sqrt(found.covariance[0, 0]))
    near = REACH * spread
    far = max(near, TAIL_REACH) if spread > LONG_TAIL else near
    return Grid.between(w - far, w + near) if w < 0 else Grid.between(w - near, w + far)


@dataclass(frozen=True, eq=False)
class Alternatives:
    """Indenters of a prior: known tips and a density.

    Attributes
    ----------
    names : tuple of str
        Names of the tips, and ``round`` for a density beside tips; empty without tips.
    radius_mm, log_weight : (k,) arrays
        Composite radius R and log prior probability of each tip.
    log_share : float or None
        Log prior probability of the density; None if there is none.
    modulus : RadiusOverModulus or None
        Prior of R', if the radius of the touch is R' and not R.
    """

    names: tuple[str, ...]
    radius_mm: FloatArray
    log_weight: FloatArray
    log_share: float | None
    modulus: RadiusOverModulus | None = None

    @classmethod
    def of(cls, prior: Prior) -> Alternatives:
        """The alternatives of a prior of R."""
        if not isinstance(prior, RadiusOfTips):
            return cls((), np.zeros(0), np.zeros(0), 0.0)
        has_density = prior.density is not None
        names = tuple(f"{radius:g}" for radius in prior.indenter_radius_mm) + ((ROUND,) if has_density else ())
        share = float(np.log(prior.share)) if has_density else None
        return cls(names, prior.radius_mm, np.log(prior.weights), share)

    def posterior(
        self,
        one: OneTouch,
        found: Expansion,
        samples: int,
        degrees: int,
        flags: list[str],
        branch: Branch | None = None,
    ) -> LiveTouch:
        """Posterior of a touch from the expansion at its mode.

        Parameters
        ----------
        one : OneTouch
            Density of the touch.
        found : Expansion
            Expansion at its mode.
        samples, flags
            As in `LiveTouch`.
        degrees : int
            Number of readings (with the load) minus number of parameters.
        branch : Branch, optional
            Another place where the touch may be.
        """
        grid = knots(found) if self.log_share is not None else None
        nodes = self._nodes(one, found, grid)
        k = len(self.radius_mm)
        # Beside a tip that is certain, the shape of an improbable density does not matter.
        matters = grid is not None and (not k or _share(nodes.log_mass, k) > LEFT_OUT)
        if grid is not None and matters and (moved := grid.moved(nodes.log_mass[k:])) is not None:
            grid, nodes = moved, self._nodes(one, found, moved)
            if grid.moved(nodes.log_mass[k:]) is not None:
                flags = [*flags, CUT]
        if branch is not None and left_out(nodes, self._at_branch(one, branch, grid), k):
            flags = [*flags, ELSEWHERE]
        mass = np.exp(nodes.log_mass - nodes.log_mass.max())
        mass /= mass.sum()
        radius, radius_variance = self._moments(nodes.radius)
        parts = np.array([radius, nodes.mean[0] * _DEGREE, nodes.mean[1]])
        mean = parts @ mass
        off = parts - mean[:, None]
        covariance = (off * mass) @ off.T
        angle, both, load = (nodes.covariance @ mass).tolist()
        covariance[1:, 1:] += ((angle * _DEGREE**2, both * _DEGREE), (both * _DEGREE, load))
        covariance[0, 0] += radius_variance @ mass
        sd = np.sqrt(covariance.diagonal())
        quantiles = np.empty((3, 3))
        quantiles[0] = self._radius_quantiles(one, grid, nodes.log_mass)
        quantiles[1:] = mixture_quantiles(mass, parts[1:], np.sqrt(nodes.covariance[::2]) * _UNIT, LEVELS)
        chi_square = -2 * found.log_likelihood
        if grid is None:
            # The mode may be at a radius that no tip has.
            chi_square, degrees = _of_best_tip(one, nodes), degrees + 1
        if degrees < 0:
            flags = [*flags, TOO_FEW]
        misfit = float(chdtrc(degrees, chi_square)) if degrees > 0 else np.nan
        if misfit < IMPROBABLE:
            flags = [*flags, MISFIT]
        if abs(float(nodes.log_rise @ mass)) > BENT:
            flags = [*flags, NOT_NORMAL]
        low, high, least, most = one.ends
        angle_sd, load_sd = float(sd[1]) / _DEGREE, float(sd[2])
        at, pressed = float(mean[1]) / _DEGREE, float(mean[2])
        beside = one.middle is None and min(at - low, high - at) < CLOSE * angle_sd
        if beside or min(pressed - least, most - pressed) < CLOSE * load_sd:
            flags = [*flags, AT_AN_END]
        if one.middle is not None:
            turn = float(one.in_row(mean[1] / _DEGREE)) * _DEGREE - mean[1]
            mean[1], quantiles[1] = mean[1] + turn, quantiles[1] + turn
        tips = {}
        if self.names:
            shares = [*mass[:k].tolist(), *([float(mass[k:].sum())] if grid is not None else [])]
            tips = dict(zip(self.names, shares, strict=True))
        return LiveTouch(NAMES, UNITS, mean, sd, quantiles, covariance, misfit, samples, tips, tuple(flags))

    def _moments(self, radius: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean (mm) and variance of R at each radius of the nodes, (g,) each."""
        if self.modulus is None:
            return radius, np.zeros(len(radius))
        radii = self.modulus.radii(radius)
        mean = radii @ SHARES
        return mean, (radii - mean[:, None]) ** 2 @ SHARES

    def _at_branch(self, one: OneTouch, branch: Branch, grid: Grid | None) -> Nodes:
        """Integrals at another place: about its own mode, or at the knots of the `grid` about the mode of the touch."""
        own = grid is not None and branch.alone
        return self._nodes(one, branch, knots(branch) if own else grid, tails=False)

    def _nodes(self, one: OneTouch, found: Expansion | Branch, grid: Grid | None, *, tails: bool = True) -> Nodes:
        """Integrals at the tips, then at the knots."""
        w = self._tip_w(one)
        log_prior = self.log_weight
        radius = self.radius_mm
        if grid is not None:
            assert self.log_share is not None
            more = grid.w
            ends = np.log(grid.step) + self.log_share
            log_prior = np.concatenate([log_prior, np.interp(more, one.w_grid, one.w_log_prior) + ends])
            radius = np.concatenate([radius, one.radii(more)])
            w = np.concatenate([w, more])
        inverse = found.covariance
        spread = float(np.sqrt(inverse[0, 0]))
        x, lean = found.x, inverse[1:, 0] / inverse[0, 0]
        off = np.minimum(np.maximum(w - x[0], -3 * spread), 3 * spread)
        low, high, least, most = one.ends
        angle = np.minimum(np.maximum(x[1] + lean[0] * off, low + 1e-9), high - 1e-9)
        load = np.minimum(np.maximum(x[2] + lean[1] * off, least + 1e-9), most - 1e-9)
        return nodes_of(one, radius, log_prior, angle, load, tails=tails)

    def _tip_w(self, one: OneTouch) -> FloatArray:
        """Coordinates of the tips, as those of a density, (k,)."""
        if not len(self.radius_mm):
            return self.radius_mm
        low, high = one.radius_ends
        share = np.clip((self.radius_mm - low) / (high - low), 1e-4, 1 - 1e-4)
        return np.asarray(np.log(share / (1 - share)))

    def _radius_quantiles(self, one: OneTouch, grid: Grid | None, log_mass: FloatArray) -> FloatArray:
        """Quantiles of R, mm. The distribution function has steps at the tips and a density tabulated in w."""
        k = len(self.radius_mm)
        tips = np.exp(log_mass[:k] - log_mass.max())
        if grid is None:
            order = np.argsort(self.radius_mm)
            sums = np.cumsum(tips[order])
            return np.asarray(self.radius_mm[order][np.searchsorted(sums / sums[-1], LEVELS)])
        density = np.exp(np.maximum(finer(np.maximum(log_mass[k:] - log_mass.max(), -60.0)), -60.0))
        within = 0.5 * (density[1:] + density[:-1])
        w = grid.low + grid.step * (KNOTS - 1) / len(within) * np.arange(len(density))
        if self.modulus is not None:
            radii = self.modulus.radii(one.radii(w)).ravel()
            order = np.argsort(radii)
            sums = np.cumsum((density[:, None] * SHARES).ravel()[order])
            return np.asarray(np.interp(LEVELS * sums[-1], sums, radii[order]))
        below = np.empty(len(density))
        below[0] = 0.0
        np.cumsum(within, out=below[1:])
        if not k:
            return one.radii(np.interp(LEVELS * below[-1], below, w))
        # A step at each tip: two points of the distribution function at the same radius.
        radius = one.radii(w)
        tips = tips * (len(within) / (KNOTS - 1))
        at = np.repeat(self.radius_mm, 2)
        rise = np.stack([np.zeros(k), tips], axis=1).ravel()
        places = np.concatenate([radius, at])
        order = np.argsort(places, kind="stable")
        own = np.interp(places, radius, below)
        sums = own[order] + np.cumsum(np.concatenate([np.zeros(len(radius)), rise])[order])
        return np.asarray(np.interp(LEVELS * sums[-1], sums, places[order]))


def _of_best_tip(one: OneTouch, nodes: Nodes) -> float:
    """Sum of squared residuals of readings and load at the most probable tip."""
    best = slice(k := int(nodes.log_mass.argmax()), k + 1)
    rest = one.residual(nodes.radius[best], nodes.mean[0, best], nodes.mean[1, best]).astype(np.float64)
    miss = (float(nodes.mean[1, k]) - one.load) / one.load_sd if one.load == one.load else 0.0
    return float((rest**2).sum()) + miss**2


def _share(log_mass: FloatArray, first: int) -> float:
    """Share of the masses from index `first` on."""
    mass = np.exp(log_mass - log_mass.max())
    return float(mass[first:].sum() / mass.sum())


_UNIT = np.array([[_DEGREE], [1.0]])
