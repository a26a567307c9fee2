"""Fast evaluation of the readings of calibration touches of a finger, by sums over Fourier modes.

The locations of the touches are known, so the factors of the series ``Σ_k w_k q_k cos k(θ_s - θ_c)`` that depend on
them are computed once, and each evaluation is two matrix products. Pressure spectra q depend smoothly on σ and
``κ = P R/μ``: they are solved once at Chebyshev nodes of σ and knots of κ, and interpolated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.body.finger import FingerBody, solve_body
from bayestouch.chain.element_weight import ElementWeight
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.response import ContactSpectra, mode_strain, modes_needed
from bayestouch.data.sensor import Finger
from bayestouch.finger.interpolation import lagrange
from bayestouch.finger.known_touches import KnownTouches
from bayestouch.finger.layout import FlatLayout

# Nine nodes over a quarter of the range of σ, and cubics over steps of 0.1 in log(1 + κ/κ_s): the error of spectra is
# below 1e-5 up to κ = 60 mm² (a flat with 700 N/m at 0.15 MPa).
SIGMA_NODES = 9
KAPPA_STEP, LEAST_KNOTS = 0.1, 6
# Relative step of the derivative with respect to the load.
SPECTRUM_STEP = 0.02
# Steps of the central differences: depth (mm), angle, σ, log μ. Their error is far below the noise.
STEPS = 1e-3, 1e-4, 1e-4, 1e-3


@dataclass(frozen=True)
class Reach:
    """Range of a series: of σ, of log μ (MPa), and the largest r_s (`depth`, mm)."""

    sigma: tuple[float, float]
    log_mu: tuple[float, float]
    depth: float

    def covers(self, other: Reach) -> bool:
        """Whether the other range is inside this one."""
        ranges = ((self.sigma, other.sigma), (self.log_mu, other.log_mu))
        inside = all(mine[0] <= yours[0] and yours[1] <= mine[1] for mine, yours in ranges)
        return inside and other.depth <= self.depth


@dataclass(frozen=True, eq=False)
class TouchSeries:
    """Readings of known touches, and their derivative over the load, from flat vectors.

    Attributes
    ----------
    known : KnownTouches
        The t touches; only radii, angles and loads are used.
    finger : Finger
        Nominal geometry.
    layout : FlatLayout
        Positions of the parameters in a vector.
    sign : (m,) array
        1, or -1 for an element whose reading decreases under compression.
    reach : Reach
        Range of the parameters in which the series is valid.
    sigma_nodes : (s,) array
        Values of σ at which `spectra` were solved.
    spectra : (s, n, n_modes) array
        Pressure spectra over the κ of the touches that are not knife edges.
    template : ContactSpectra
        Knots in κ.
    modes : (n_modes,) array
        Fourier modes that are summed.
    cosine, sine : (t, n_modes) arrays
        Cosine and sine of k θ_c.
    element_weight, friction
        As of `FingerChain`, or those of a finger for each vector, the friction as an array (n, 1, 1).
    strained : tuple of FingerChain
        A finger for all vectors, or one for each, whose strain is finite; empty if the strain is linear.
    """

    known: KnownTouches
    finger: Finger
    layout: FlatLayout
    sign: FloatArray
    reach: Reach
    sigma_nodes: FloatArray
    spectra: FloatArray
    template: ContactSpectra
    modes: FloatArray
    cosine: FloatArray
    sine: FloatArray
    element_weight: ElementWeight | None = None
    friction: float | FloatArray = 0.0
    strained: tuple[FingerChain, ...] = ()

    @classmethod
    def of(
        cls, known: KnownTouches, finger: Finger, layout: FlatLayout, sign: FloatArray, reach: Reach, contact: str
    ) -> TouchSeries:
        """Series for these touches, with the contacts solved."""
        places = np.cos(np.pi * (np.arange(SIGMA_NODES) + 0.5) / SIGMA_NODES)
        nodes = 0.5 * (reach.sigma[0] + reach.sigma[1]) + 0.5 * (reach.sigma[1] - reach.sigma[0]) * places
        blunt = known.radius_mm > 0
        low, high = known.load_range()
        ends = np.array([low[blunt].min(), high[blunt].max()]) if blunt.any() else np.array([0.0, 1.0])
        radius = known.radius_mm[blunt] if blunt.any() else np.ones(1)
        kappa = ends / 1000 * radius.max() / np.exp(reach.log_mu[::-1])
        kappa[0] *= radius.min() / radius.max()
        scale = 0.1 * (finger.outer_radius_mm - finger.core_radius_mm) ** 2
        knots = int(np.ceil(np.diff(np.log1p(kappa / scale))[0] / KAPPA_STEP)) + 1
        solved = [
            ContactSpectra.of(
                (finger.core_radius_mm, finger.outer_radius_mm),
                float(node),
                smallest_kappa=float(kappa[0]),
                largest_kappa=float(kappa[1]),
                largest_sensing_radius_mm=reach.depth,
                contact=contact,
                knots=max(knots, LEAST_KNOTS),
            )
            for node in (nodes if blunt.any() else nodes[:1])
        ]
        # If all touches are knife edges, no contact is needed.
        spectra = np.stack([one.spectra for one in solved]) if blunt.any() else np.ones((SIGMA_NODES, 4, 1))
        modes = solved[0].body.modes
        phase = np.outer(known.angle, modes)
        return cls(known, finger, layout, sign, reach, nodes, spectra, solved[0], modes, np.cos(phase), np.sin(phase))

    def down_to(self, depth: float) -> TouchSeries:
        """The series for elements with r_s up to `depth` (mm), with fewer modes."""
        n = modes_needed(depth, self.finger.outer_radius_mm) + 1
        return replace(
            self,
            reach=replace(self.reach, depth=min(depth, self.reach.depth)),
            spectra=self.spectra[:, :, :n],
            modes=self.modes[:n],
            cosine=self.cosine[:, :n],
            sine=self.sine[:, :n],
        )

    def covers(self, vectors: FloatArray) -> NDArray[np.bool_]:
        """Whether each of the vectors (n, d) is in the range of the series, (n,)."""
        at, reach = self.layout, self.reach
        inside: NDArray[np.bool_] = vectors[:, at.depth].max(axis=1) <= reach.depth
        for values, (low, high) in ((vectors[:, at.sigma], reach.sigma), (vectors[:, at.log_mu], reach.log_mu)):
            inside &= (low <= values) & (values <= high)
        return inside

    def __call__(self, vectors: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Expected readings (n, t, m) at the measured loads, and their derivative over the load (n, t, m)."""
        return self._summed(vectors, by_load=True)

    def _summed(self, vectors: FloatArray, *, by_load: bool) -> tuple[FloatArray, FloatArray]:
        """As `__call__`; the derivative is computed only if `by_load`."""
        known, at = self.known, self.layout
        sigma, mu = vectors[:, at.sigma], np.exp(vectors[:, at.log_mu])
        modes = self.modes
        body = solve_body(
            modes,
            core_radius_mm=self.finger.core_radius_mm,
            outer_radius_mm=self.finger.outer_radius_mm,
            poisson_ratio=sigma[:, None],
        )
        weight = np.where(modes == 0, 1.0, 2.0) * self._strain(body, vectors[:, at.depth])
        # The response is that to a knife edge directly above the element.
        response = self.sign * np.exp(vectors[:, at.response])
        weight *= (response / weight.sum(axis=2).real)[:, :, None]
        phase = vectors[:, at.angle, None] * modes
        if np.iscomplexobj(weight):
            turned = (weight * np.exp(1j * phase)).swapaxes(1, 2)
            even, odd = turned.real, turned.imag
        else:
            even, odd = ((weight * of).swapaxes(1, 2) for of in (np.cos(phase), np.sin(phase)))
        shape = self.cosine @ even + self.sine @ odd
        slope = shape.copy()
        blunt = known.radius_mm > 0
        if blunt.any():
            spectra = np.tensordot(lagrange(self.sigma_nodes, sigma), self.spectra, axes=1)
            kappa = self._kappa(mu)
            cosine, sine = self.cosine[blunt], self.sine[blunt]

            def pressed(share: float) -> FloatArray:
                pressure = self._pressure(spectra, share * kappa)
                return np.asarray((pressure * cosine) @ even + (pressure * sine) @ odd)

            shape[:, blunt] = pressed(1.0)
        up, down = 1 + SPECTRUM_STEP, 1 - SPECTRUM_STEP
        if blunt.any() and by_load:
            slope[:, blunt] = (up * pressed(up) - down * pressed(down)) / (2 * SPECTRUM_STEP)
        signal = known.load[:, None] * shape
        if self.strained:
            signal += self._beyond_linear(vectors, known.load)
        if self.strained and by_load:
            more, less = (self._beyond_linear(vectors, share * known.load) for share in (up, down))
            slope += (more - less) / ((up - down) * known.load[:, None])
        return signal, slope

    def _beyond_linear(self, vectors: FloatArray, load: FloatArray) -> FloatArray:
        """Part of the readings (n, t, m) that is due to finite strain, at loads (t,)."""
        at, known = self.layout, self.known
        fingers = self.strained * len(vectors) if len(self.strained) == 1 else self.strained
        here = (
            finger.with_(
                response=self.sign * np.exp(vector[at.response]),
                sensing_radius_mm=vector[at.depth],
                angle=vector[at.angle],
                shear_modulus_MPa=float(np.exp(vector[at.log_mu])),
            )
            for finger, vector in zip(fingers, vectors, strict=True)
        )
        return np.stack([finger.beyond_linear(known.radius_mm, known.angle, load) for finger in here])

    def _strain(self, body: FingerBody, depth: FloatArray) -> NDArray[np.inexact]:
        """Strain (n, m, n_modes) of each element per unit of each mode; complex only with friction."""
        sheared = np.any(self.friction)
        if self.element_weight is None and not sheared:
            return body.radial_strain(depth)
        strain = mode_strain(body, depth, element_weight=self.element_weight, friction=self.friction)
        return strain if sheared else strain.real

    def derivatives(self, vector: FloatArray, readings: FloatArray) -> FloatArray:
        """Derivative of the readings at a vector (d,), (5, t, m), in the order of `bayestouch.chain.neighbours`.

        It is over log response, depth (mm) and angle (rad) of the element, then σ and log μ. The first one is the
        `readings` (t, m) at the vector themselves, which are in proportion to the response.
        """
        at = self.layout
        places: tuple[slice | int, ...] = (at.depth, at.angle, at.sigma, at.log_mu)
        moved = np.repeat(vector[None], 2 * len(places), axis=0)
        for up, down, place, step in zip(moved[::2], moved[1::2], places, STEPS, strict=True):
            up[place] += step
            down[place] -= step
        there, _ = self._summed(moved, by_load=False)
        return np.concatenate([readings[None], (there[::2] - there[1::2]) / (2 * np.array(STEPS)[:, None, None])])

    def signals(self, vector: FloatArray) -> FloatArray:
        """Expected readings (t, m) of one vector (d,)."""
        return np.asarray(self._summed(vector[None], by_load=False)[0][0])

    def moved(self, angle: FloatArray, load: FloatArray, mu: float) -> TouchSeries | None:
        """The series for other locations (rad) and loads (N/m) of the same touches, (t,) each.

        `mu` is the shear modulus in MPa. None if κ of a touch is beyond the knots.
        """
        phase = np.outer(angle, self.modes)
        known = replace(self.known, angle=angle, load=load)
        there = replace(self, known=known, cosine=np.cos(phase), sine=np.sin(phase))
        place, knots = np.log1p(there._kappa(np.array([mu])) / self.template.kappa_scale), self.template.coordinates
        return there if ((knots[0] <= place) & (place <= knots[-1])).all() else None

    def with_strain_of(self, chains: Sequence[FingerChain]) -> TouchSeries:
        """The series with the weights of the elements, friction and finite strain of fingers, one for each vector."""
        weights = [each.element_weight for each in chains]
        friction = np.array([each.friction for each in chains])[:, None, None]
        strained = tuple(chains) if any(each.finite_strain for each in chains) else ()
        return replace(self, element_weight=ElementWeight.stacked(weights), friction=friction, strained=strained)

    def at_loads(self, load: FloatArray) -> TouchSeries:
        """The series for other loads (t,) of the same touches, N/m."""
        return replace(self, known=replace(self.known, load=load))

    def _kappa(self, mu: FloatArray) -> FloatArray:
        """κ (n, b) in mm² of the b touches that are not knife edges, for shear moduli (n,) in MPa."""
        blunt = self.known.radius_mm > 0
        return np.asarray(self.known.load[blunt] / 1000 * self.known.radius_mm[blunt] / mu[:, None])

    def _pressure(self, spectra: FloatArray, kappa: FloatArray) -> FloatArray:
        """Spectra (n, t, n_modes) at κ (n, t), by cubics through four of the knots of `spectra` (n, knots, n_modes)."""
        coordinates = self.template.coordinates
        step = coordinates[1] - coordinates[0]
        place = (np.log1p(kappa / self.template.kappa_scale) - coordinates[0]) / step
        first = np.clip(np.floor(place).astype(np.int64) - 1, 0, len(coordinates) - 4)
        # Beyond the knots the value at the last knot is used.
        t = np.clip(place - first, 0.0, 3.0)
        weights = (
            -(t - 1) * (t - 2) * (t - 3) / 6,
            t * (t - 2) * (t - 3) / 2,
            -t * (t - 1) * (t - 3) / 2,
            t * (t - 1) * (t - 2) / 6,
        )
        row = np.arange(len(spectra))[:, None]
        return np.asarray(sum(w[..., None] * spectra[row, first + i] for i, w in enumerate(weights)))
