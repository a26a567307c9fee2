"""The paper's experiment to first order: one finger, its calibrations and all its touches in a hundredth of a second.

`paper_run` simulates every reading and searches for every fit, which takes a minute a finger. Here small errors of the
strains go through all fits by their derivatives at the truth: fits of elements (Table 1), the identified E map
(Table 2), and fits of touches (Tables 3 and 4). Radii are not linear: the contact's width is turned into R, and R into
r_c, exactly, and no contact is narrower than an edge. Strains are in % of each element's peak under an edge.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from bayestouch.contact import composite_radius, indenter_radius
from bayestouch.paper.simplex.elements import WINDOW_DEG
from bayestouch.paper.simplex.empirical import SMALLEST_SINGULAR_VALUE, coefficients_needed
from bayestouch.simulation.finger import BuiltFinger
from nicolson_fearing.finger_errors import (
    AT,
    EDGES_DEG,
    OF_TABLE_3,
    OF_TABLE_4,
    Added,
    Curves,
    EdgeErrors,
    Tables,
    TouchErrors,
    table_4_rows,
    true_radii,
)
from nicolson_fearing.linear_touches import (
    LOAD,
    MODES,
    R_B,
    TouchFits,
    best_ellipse,
    element_weights,
    felt,
    read_by_curvature,
)
from nicolson_fearing.noise_causes import noise_levels
from nicolson_fearing.paper_finger import DESIGN, POISSON_RATIO
from nicolson_fearing.paper_run import DEPTH_SPREAD_MM, TIPS_MM
from nicolson_fearing.unknowns import Unknowns

FloatArray = NDArray[np.float64]

FINGERS = 24
"""Fingers over which unknowns are inferred; what does not depend on the unknowns is remembered of each."""
BLUNTEST = 0.97
"""Largest R, as a share of that of a flat, whose r_c counts in a mean: the r_c of a flat is infinite."""


@dataclass(frozen=True, eq=False)
class Calibrated:
    """Errors of a finger, and what both calibrations made of them.

    Attributes
    ----------
    errors : pair of (m,) arrays
        Of the elements in Tables 1 and 2, % of the peak.
    curves : Curves
        Errors of the E maps.
    absorbed : pair of Curves
        What the fitted model and the identified map took up of the edges' errors.
    residual : (edges, m) array
        What the identified map left over.
    place : (places, m) array
        Errors of the places touched, % of the peak.
    prober : (places,) array
        Errors of location there, degree.
    """

    errors: tuple[FloatArray, FloatArray]
    curves: Curves
    absorbed: tuple[Curves, Curves]
    residual: FloatArray
    place: FloatArray
    prober: FloatArray


@dataclass(frozen=True, eq=False)
class LinearFinger:
    """Elements as they came out; the same at all values of the unknowns.

    Attributes
    ----------
    seed : int
        Of the elements.
    sensing_radius_mm, angle_deg, levels : (m,) arrays
        r_s, θ_s, and noise of a sample in % of the peak.
    """

    seed: int
    sensing_radius_mm: FloatArray
    angle_deg: FloatArray
    levels: FloatArray

    @classmethod
    def of(cls, seed: int) -> LinearFinger:
        """Draw the elements: depths and angles as `paper_run`, noise levels as Table 1."""
        rng = np.random.default_rng([seed, 11])
        m = DESIGN.n_elements
        depth = DEPTH_SPREAD_MM * rng.standard_normal(m).clip(-2, 2)
        angle = DESIGN.element_angles_deg + DESIGN.angle_error_deg * rng.standard_normal(m)
        return cls(seed, DESIGN.sensing_radius_mm + depth, angle, noise_levels(rng))

    @cached_property
    def weights(self) -> FloatArray:
        """Response to each mode of the pressure, one right under an edge; (m, modes)."""
        return element_weights(self.sensing_radius_mm, POISSON_RATIO)

    @cached_property
    def turns(self) -> tuple[FloatArray, FloatArray]:
        """cos and sin of each mode at each edge, (2, edges, m, modes)."""
        turn = np.radians(EDGES_DEG[:, None] - self.angle_deg)[..., None] * MODES
        return np.cos(turn), np.sin(turn)

    @cached_property
    def by_degree(self) -> FloatArray:
        """Change of the edges' strains by a degree of location, % of the peak; (edges, m)."""
        return np.asarray(-100 * np.pi / 180 * (self.turns[1] * self.weights * MODES).sum(axis=-1))

    @cached_property
    def by_load(self) -> FloatArray:
        """Strains of the edges, % of the peak, which is how they change by the load; (edges, m)."""
        return np.asarray(100 * (self.turns[0] * self.weights).sum(axis=-1))

    @cached_property
    def _fits(self) -> tuple[list[tuple[NDArray[np.bool_], FloatArray]], FloatArray]:
        """By element: the edges of Table 1's fit, and its four derivatives there; and the projection of Table 2."""
        slopes = self._slopes
        by_element = []
        for i, design in enumerate(DESIGN.element_angles_deg):
            near = np.abs(EDGES_DEG - design) <= WINDOW_DEG / 2
            columns = np.stack([(self.turns[odd][near, i] * c[i]).sum(axis=-1) for odd, c in slopes], axis=1)
            by_element.append((near, columns))
        n_c = _coefficients()
        p = np.radians(EDGES_DEG)[:, None] * np.arange(n_c + 1)
        basis = np.concatenate([np.cos(p), np.sin(p[:, 1:])], axis=1)
        left, values, _ = np.linalg.svd(basis.T, full_matrices=False)
        kept = left[:, values > SMALLEST_SINGULAR_VALUE * values[0]]
        reduced = basis @ kept
        return by_element, kept @ np.linalg.pinv(reduced)

    @cached_property
    def _slopes(self) -> list[tuple[int, FloatArray]]:
        """Derivatives of an edge's readings by σ, r_s, θ_s and gain, as (0 cosine or 1 sine, (m, modes))."""
        w, step = self.weights, 1e-4
        sigma = (element_weights(self.sensing_radius_mm, POISSON_RATIO + step) - w) / step
        depth = (element_weights(self.sensing_radius_mm + step, POISSON_RATIO) - w) / step
        return [(0, sigma), (0, depth), (1, w * MODES), (0, w)]

    def tables(self, u: Unknowns, draw: int = 0, added: Added | None = None) -> Tables:
        """Calibrate, touch and read under these unknowns; each draw has its own errors and noise, and what is added."""
        edges, radii, touches = self.drawn(u, draw)
        more = added or Added.none(len(self.levels))
        found, reach = self.calibrated(edges, more), self.reach(u, radii)
        by_curvature = read_by_curvature(u, radii, more.curvature_per_mm)
        return self._read(u, reach, found, self.missed(found, reach) + more.tips, touches, by_curvature)

    def drawn(self, u: Unknowns, draw: int = 0) -> tuple[EdgeErrors, FloatArray, TouchErrors]:
        """Errors of the edges, composite radii of the tips (mm), and errors of the touches."""
        rng = np.random.default_rng([self.seed, 12, draw])
        edges = EdgeErrors.of(u, self.levels, rng)
        radii = true_radii(u, rng)
        return edges, radii, TouchErrors.of(u, self.levels, rng)

    def calibrated(self, wrong: EdgeErrors, added: Added) -> Calibrated:
        """Fit the edges, with what other causes add."""
        cos, sin = self.turns
        seen = (cos * wrong.curves[0]).sum(axis=-1) + (sin * wrong.curves[1]).sum(axis=-1) + wrong.place
        factor = (wrong.drift - wrong.force)[:, None] / 100
        measured = seen + wrong.noise + factor * self.by_load + wrong.prober[:, None] * self.by_degree + added.edges
        errors_1, absorbed_1 = self._table_1(measured)
        residual, absorbed_2 = self._table_2(measured)
        errors_2 = np.sqrt((residual**2).mean(axis=0))
        absorbed, prober = (absorbed_1, absorbed_2), wrong.prober + added.location_deg
        return Calibrated((errors_1, errors_2), wrong.curves, absorbed, residual, wrong.place[AT], prober[AT])

    def missed(self, found: Calibrated, reach: TouchFits) -> FloatArray:
        """Errors of the strains that readers with both calibrations do not expect, (2, tips, places, m)."""
        left = [[a - b for a, b in zip(found.curves, absorbed, strict=True)] for absorbed in found.absorbed]
        return np.array([self.felt(each, reach) + found.place for each in left])

    def felt(self, curves: Curves, reach: TouchFits) -> FloatArray:
        """Errors of E maps under the pressures of the tips, (tips, places, m)."""
        cos, sin = self.turns
        return felt(cos[AT] * curves[0] + sin[AT] * curves[1], reach.spectrum)

    def reach(self, u: Unknowns, radii_mm: FloatArray) -> TouchFits:
        """Fits of tips of these composite radii."""
        width, factor = best_ellipse(LOAD / 1000 * radii_mm / u.modulus_MPa, u.poisson_ratio, u.length_mm)
        return TouchFits.of(self.weights, [t[AT] for t in self.turns], width, factor)

    def _table_1(self, measured: FloatArray) -> tuple[FloatArray, Curves]:
        """Errors of the fits (m,), and what they took up, as curves."""
        by_element, _ = self._fits
        errors, absorbed = np.empty(len(by_element)), [np.zeros_like(self.weights) for _ in range(2)]
        for i, (near, columns) in enumerate(by_element):
            found, *_ = np.linalg.lstsq(columns, measured[near, i], rcond=None)
            errors[i] = np.sqrt(np.mean((measured[near, i] - columns @ found) ** 2))
            for value, (odd, curve) in zip(found, self._slopes, strict=True):
                absorbed[odd][i] += value * curve[i]
        return errors, absorbed

    def _table_2(self, measured: FloatArray) -> tuple[FloatArray, Curves]:
        """Residuals (edges, m), and what the map took up."""
        _, solve = self._fits
        found = solve @ measured  # (2 n_c + 1, m), about 0°
        n_c = len(found) // 2
        k = np.arange(n_c + 1)
        p = np.radians(EDGES_DEG)[:, None] * k
        fitted = np.cos(p) @ found[: n_c + 1] + np.sin(p[:, 1:]) @ found[n_c + 1 :]
        even, odd = (np.zeros((n_c + 1, DESIGN.n_elements)) for _ in range(2))
        even[:], odd[1:] = found[: n_c + 1], found[n_c + 1 :]
        turn = k[:, None] * np.radians(self.angle_deg)
        absorbed = [np.zeros_like(self.weights) for _ in range(2)]
        absorbed[0][:, : n_c + 1] = (even * np.cos(turn) + odd * np.sin(turn)).T
        absorbed[1][:, : n_c + 1] = (odd * np.cos(turn) - even * np.sin(turn)).T
        return measured - fitted, absorbed

    def _read(
        self,
        u: Unknowns,
        reach: TouchFits,
        found: Calibrated,
        missed: FloatArray,
        wrong: TouchErrors,
        by_curvature: FloatArray,
    ) -> Tables:
        averaged = reach.fit(missed + wrong.mean_noise, wrong.mean_jitter + wrong.drift)
        table_3 = []
        for squeeze, more in zip((0.0, u.squeeze_mm), by_curvature, strict=True):
            radius = np.clip(averaged.radius_mm(u.modulus_MPa, squeeze) + more, 0.0, BLUNTEST * R_B)[:, OF_TABLE_3]
            table_3.append(composite_radius(indenter_radius(radius, R_B).mean(axis=-1), R_B))
        some = reach.only(OF_TABLE_4)
        drift = wrong.drift[OF_TABLE_4, :, None]
        single = some.fit(missed[:, OF_TABLE_4, :, None] + wrong.noise, wrong.jitter + drift)
        true = composite_radius(np.array(TIPS_MM), R_B)
        errors = averaged.radius_mm(u.modulus_MPa, u.squeeze_mm) - true[:, None] + by_curvature[1]
        angle = averaged.angle_error_deg + found.prober
        mean = [each[:, OF_TABLE_4] for each in (angle, averaged.load_error, errors)]
        one = [
            single.angle_error_deg + found.prober[:, None],
            single.load_error,
            single.radius_mm(u.modulus_MPa, u.squeeze_mm) - (true[:, None] - by_curvature[1])[OF_TABLE_4, :, None],
        ]
        return Tables(*found.errors, np.array(table_3), table_4_rows(mean, one), errors)


@lru_cache(maxsize=1)
def _coefficients() -> int:
    built = BuiltFinger(DESIGN, *(np.ones(DESIGN.n_elements),) * 3)
    return coefficients_needed(built.sensor({}).body)  # type: ignore[arg-type]  # it is a finger
