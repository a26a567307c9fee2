"""Which of two indenters made a touch: the share of touches that are named rightly, by quadrature over the location.

The scale u(R) of `bayestouch.reliability.information` takes readings to be linear in the location. Then the readings of
one indenter are as far from those of another, at any location, as the two are apart on the scale. Where one shallow
element reads a touch almost alone they are not: an edge on either side of it reads nearly like a blunt tip above it.
There the evidence of both indenters is integrated over the location, for touches with many values of the noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np
from scipy.special import ndtr, ndtri

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.contact import composite_radius, indenter_radius
from bayestouch.reliability.information import RadiusScale
from bayestouch.reliability.known_finger import KnownFinger, TouchPlaces

# Difference of a probability by the scale from that by the shortest distance of the readings from which it is computed
# by quadrature: the statistical error of 2000 simulated touches.
ACCEPTED = 0.005
# Locations that are compared with that of a touch: further away other elements read. They are closer together near the
# touch, where readings are mostly nearest.
SPAN, NODES = np.radians(12.0), 61
OFFSETS = SPAN * np.linspace(-1.0, 1.0, NODES) * np.abs(np.linspace(-1.0, 1.0, NODES))
# A finer grid is about nodes whose readings are at most so many standard deviations further from the touch than the
# nearest: noise of one in 10^9 makes up for six, and three sd are a factor of 90 in the posterior. Number of such
# grids; nodes of each, which are then at most about one sd apart, where a sum over a normal density is exact to 1e-8.
REACH, FINER, FINE_NODES = 9.0, 2, 121
# Steps of the load at each location, of which readings are nearly linear, and the change for their slope.
LOAD_STEPS, STEP_LOAD = 2, 1e-3
# Touches of each indenter, and directions of the noise: touches that differ in radius, location and load lie in three
# directions to first order, and their bends in three more.
TOUCHES, DIRECTIONS = 1024, 6
# Steps from the threshold by the scale to a flat, in which a blunter one is searched: a flat may read more like an edge
# than a sharper tip does. Halvings of a step, which leave a thousandth of the outer radius or, from the start, a 250th.
BLUNTER, HALVINGS = 4, 8
TINY = 1e-300


def right_shares(
    known: KnownFinger, radius_mm: FloatArray, angle: FloatArray, expected: FloatArray, samples: int, use_load: bool
) -> FloatArray:
    """Share of touches for which the right one of each pair of indenters is named, (n, k, k).

    Parameters
    ----------
    known : KnownFinger
        The calibrated finger.
    radius_mm : (k,) array
        Composite radii R.
    angle : (n,) array
        Locations, rad.
    expected : (n, k, k) array
        The shares by the scale, which are kept where the readings agree with it.
    samples, use_load
        As in `touch_information`.
    """
    k, out = len(radius_mm), expected.copy()
    touches = [
        NoiselessTouches.of(known, np.full(len(angle), radius), angle, samples, use_load) for radius in radius_mm
    ]
    for i in range(k):
        for j in range(i):
            for place in np.flatnonzero(disagrees(touches[i], touches[j], expected[:, i, j])).tolist():
                both = touches[i].select(place), touches[j].select(place)
                out[place, i, j] = out[place, j, i] = right_share(*both)
    return out


def thresholds(
    known: KnownFinger, scale: RadiusScale, from_r_c: float, probability: float, samples: int, use_load: bool
) -> FloatArray:
    """r_c (mm) that is distinguished from `from_r_c` with a probability at each location, (n,); NaN if none is.

    Parameters
    ----------
    known, samples, use_load
        As in `right_shares`.
    scale : RadiusScale
        The scale at the locations; its thresholds are kept where the readings agree with it. Where it distinguishes
        nothing, a flat is compared.
    from_r_c : float
        Indenter to start from, mm.
    probability : float
        Share of touches for which the right one is named.
    """
    outer, angle, out = known.outer_radius_mm, scale.angle, scale.threshold(from_r_c, probability)
    nothing = np.isnan(out)
    start, radius = (composite_radius(r_c, outer) for r_c in (from_r_c, np.where(nothing, np.inf, out)))
    expected = np.where(nothing, scale.distinguished(from_r_c, np.inf)[:, 0], probability)
    first = NoiselessTouches.of(known, np.full(len(angle), start), angle, samples, use_load)
    second = NoiselessTouches.of(known, radius, angle, samples, use_load)
    for place in np.flatnonzero(disagrees(first, second, expected)).tolist():
        one, found = first.select(place), float(radius[place])

        def enough(radius: float, one: NoiselessTouches = one) -> bool:
            other = NoiselessTouches.of(known, np.array([radius]), one.angle, samples, use_load)
            return right_share(one, other) >= probability

        low, high = float(start), found
        if not enough(found):
            ends = np.linspace(found, outer, BLUNTER + 1).tolist() if found < outer else []
            low, high = next(((a, b) for a, b in pairwise(ends) if enough(b)), (np.nan, np.nan))
        if np.isnan(high):
            out[place] = np.nan
            continue
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if enough(middle) else (middle, high)
        out[place] = indenter_radius(high, outer)
    return out


@dataclass(frozen=True, eq=False)
class NoiselessTouches:
    """Touches without noise, and what is needed to compare others with them; t touches.

    Attributes
    ----------
    known : KnownFinger
        The calibrated finger.
    radius_mm, angle : (t,) arrays
        Composite radius R (mm) and location (rad); loads are the typical one.
    readings : (t, m) array
        Their readings.
    whitener : (t, m, m) array
        Transforms errors of readings to independent ones with standard deviation one.
    load_sd : float
        Standard error of the measured load, N/m; inf if it is not measured.
    """

    known: KnownFinger
    radius_mm: FloatArray
    angle: FloatArray
    readings: FloatArray
    whitener: FloatArray
    load_sd: float

    @classmethod
    def of(
        cls, known: KnownFinger, radius_mm: FloatArray, angle: FloatArray, samples: int, use_load: bool
    ) -> NoiselessTouches:
        """Touches of composite radii R (t,), mm, at locations (t,), rad."""
        places = TouchPlaces(radius_mm, angle, np.full(len(angle), known.typical_load))
        whitener = np.linalg.inv(np.linalg.cholesky(known.covariance(places, samples)))
        return cls(known, radius_mm, angle, known.predict(places), whitener, known.load_sd(samples, use_load))

    def select(self, touch: int) -> NoiselessTouches:
        """One of the touches."""
        one = slice(touch, touch + 1)
        return NoiselessTouches(
            self.known, self.radius_mm[one], self.angle[one], self.readings[one], self.whitener[one], self.load_sd
        )

    def like(self, radius_mm: FloatArray, angle: FloatArray, steps: int = LOAD_STEPS) -> NearestTouches:
        """Touches of other composite radii (t,), mm, at locations (t, g), rad, that read most like these."""
        known, radius = self.known, np.repeat(radius_mm, angle.shape[1])
        load = np.full(angle.shape, known.typical_load)

        def rest(load: FloatArray) -> FloatArray:
            readings = known.predict(TouchPlaces(radius, angle.ravel(), load.ravel())).reshape(*load.shape, -1)
            white = (readings - self.readings[:, None]) @ self.whitener.swapaxes(1, 2)
            return np.concatenate([white, ((load - known.typical_load) / self.load_sd)[..., None]], axis=-1)

        here = rest(load)
        slope = (rest(load * (1 + STEP_LOAD)) - here) / (STEP_LOAD * load)[..., None]
        information = np.maximum((slope**2).sum(axis=-1), TINY)
        for _ in range(steps):
            load = np.clip(load - (slope * here).sum(axis=-1) / information, 0.1 * load, known.largest_load)
            here = rest(load)
        return NearestTouches(angle, here, slope)

    def fine(self, radius_mm: FloatArray) -> NearestTouches:
        """Touches of composite radius R (1,), mm, on even locations about those that read like this one touch."""
        angle = self.angle[:, None] + OFFSETS
        for _ in range(FINER):
            distance = np.sqrt(self.like(radius_mm, angle).square[0])
            near = np.flatnonzero(distance < distance.min() + REACH)
            low, high = angle[0, max(near[0] - 1, 0)], angle[0, min(near[-1] + 1, angle.shape[1] - 1)]
            angle = np.linspace(low, high, FINE_NODES)[None]
        return self.like(radius_mm, angle)


@dataclass(frozen=True, eq=False)
class NearestTouches:
    """Touches that read most like t given ones, at g locations for each.

    Attributes
    ----------
    angle : (t, g) array
        Locations, rad.
    rest : (t, g, q) array
        Their readings (and load, if it is measured) less those of the given touch, for the load that fits best, in
        standard deviations.
    slope : (t, g, q) array
        Change of the rest per N/m of the load.
    """

    angle: FloatArray
    rest: FloatArray
    slope: FloatArray

    @property
    def square(self) -> FloatArray:
        """Square of the length of the rest, (t, g)."""
        return np.asarray((self.rest**2).sum(axis=-1))

    def log_evidence(self, noise: FloatArray) -> FloatArray:
        """Log of the integral of the likelihood over location and load, (n,), for noise (n, q) of the first touch."""
        rest, slope = self.rest[0], self.slope[0]
        precision = np.maximum((slope**2).sum(axis=1), TINY)
        along = slope / np.sqrt(precision)[:, None]
        # Half the square of rest less noise, without that of the noise, for the load that fits best with this noise.
        log = noise @ rest.T - 0.5 * self.square[0] - 0.5 * np.log(precision)
        log += 0.5 * ((rest * along).sum(axis=1) - noise @ along.T) ** 2
        top = log.max(axis=1)
        step = self.angle[0, 1] - self.angle[0, 0]
        return np.asarray(np.log(np.exp(log - top[:, None]).sum(axis=1)) + top + np.log(step))


def disagrees(first: NoiselessTouches, second: NoiselessTouches, expected: FloatArray) -> BoolArray:
    """Whether shares by the scale (t,) differ from those by the shortest distance of the readings, (t,)."""
    by_distance = 0.5 * (_by_distance(first, second.radius_mm) + _by_distance(second, first.radius_mm))
    return np.asarray(np.abs(by_distance - expected) > ACCEPTED)


def _by_distance(touches: NoiselessTouches, radius_mm: FloatArray) -> FloatArray:
    """Share of touches that are named rightly if readings of the other radii (t,) are linear where they are nearest."""
    square = touches.like(radius_mm, touches.angle[:, None] + OFFSETS, steps=1).square
    k = np.clip(square.argmin(axis=1), 1, NODES - 2)
    rows = np.arange(len(k))
    before, here, after = (square[rows, k + step] for step in (-1, 0, 1))
    left, right = OFFSETS[k] - OFFSETS[k - 1], OFFSETS[k + 1] - OFFSETS[k]
    # The parabola through three nodes: slope and half the bend at the middle one.
    bend = ((after - here) / right - (here - before) / left) / (left + right)
    slope = (here - before) / left + bend * left
    least = np.minimum(here, here - slope**2 / (4 * np.maximum(bend, TINY)))
    return np.asarray(ndtr(0.5 * np.sqrt(np.maximum(least, 0.0))))


def right_share(first: NoiselessTouches, second: NoiselessTouches) -> float:
    """Share of touches for which the right one of two is named, with even prior odds; one touch each."""
    total = 0.0
    for true, other in ((first, second), (second, first)):
        own, wrong = true.fine(true.radius_mm), true.fine(other.radius_mm)
        noise = _noise(own, wrong)
        total += float((own.log_evidence(noise) > wrong.log_evidence(noise)).mean())
    return 0.5 * total


def _noise(*found: NearestTouches) -> FloatArray:
    """Noise of many touches, (n, q): evenly spread, in the directions in which readings differ most."""
    rows = []
    for each in found:
        length = np.sqrt(np.maximum((each.slope[0] ** 2).sum(axis=1), TINY))
        rows += [each.rest[0], each.slope[0] / length[:, None]]
    directions = np.linalg.svd(np.concatenate(rows), full_matrices=False)[2][:DIRECTIONS]
    return np.asarray(_even_normals(len(directions)) @ directions)


@cache
def _even_normals(d: int) -> FloatArray:
    """Normal numbers (n, d) from a lattice, as in `bayestouch.finger.reading.even_points`."""
    root = 2.0  # of x^(d + 1) = x + 1, by iteration
    for _ in range(60):
        root = (1 + root) ** (1 / (d + 1))
    points = (0.5 + np.arange(1, TOUCHES + 1)[:, None] * root ** -np.arange(1.0, d + 1)) % 1.0
    return np.asarray(ndtri(points))
