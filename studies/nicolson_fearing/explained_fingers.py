"""What single fingers would print under an explanation: intervals, what agrees, and numbers that were not fitted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from bayestouch.contact import composite_radius, indenter_radius
from bayestouch.paper import published
from bayestouch.reliability import Beside, shared_by_indenters
from nicolson_fearing import figure_4, figure_13
from nicolson_fearing.explained_fit import FINGERS, KEYS, OF_TIPS, Inferred, finger, numbers_of
from nicolson_fearing.finger_errors import Tables
from nicolson_fearing.flats_and_edges import flat_errors
from nicolson_fearing.linear_touches import R_B
from nicolson_fearing.paper_run import TIPS_MM
from nicolson_fearing.published_fits import TIP_SHARE
from nicolson_fearing.surface_causes import surface_tables
from nicolson_fearing.unknowns import PRIOR, Unknowns

FloatArray = NDArray[np.float64]

PREDICTED = 200
UNBIASED = 0.1  # share of the radius, as in `table_3`
THRESHOLD_KNOTS = 5
THRESHOLDS = ("figure_4.flat_from_edge_noise", "figure_4.r_c_over_r_b")
OUTSIDE = 0.05  # on either side of a 90 % interval
_FIGURE_13 = [TIPS_MM.index(tip) for tip in figure_13.TIPS]


def first_order(seed: int, unknowns: Unknowns, draw: int) -> Tables:
    """A finger whose errors go through its fits to first order."""
    return surface_tables(finger(seed), unknowns, draw)


@dataclass(frozen=True, eq=False)
class ExplainedFingers:
    """Fingers at draws of the posterior, each with its own elements, errors, noise and tips.

    Attributes
    ----------
    unknowns : tuple of Unknowns
        Of each finger.
    tables : tuple of Tables
        What it would print.
    numbers : (n, numbers) array
        The same by key, on the scale of `explained_fit.scaled`.
    """

    unknowns: tuple[Unknowns, ...]
    tables: tuple[Tables, ...]
    numbers: FloatArray

    @classmethod
    def of(
        cls, inferred: Inferred, count: int = PREDICTED, simulate: Callable[[int, Unknowns, int], Tables] = first_order
    ) -> ExplainedFingers:
        """Draw them; what simulates a finger gets the seed of its elements, its unknowns and the number of the draw."""
        rng = np.random.default_rng(2)
        drawn = inferred.draws(count)
        tables = []
        for i, u in enumerate(drawn):
            shared = replace(u, tip_sd_mm=float(np.sqrt(TIP_SHARE)) * u.tip_sd_mm)
            tables.append(simulate(i % FINGERS, shared, i))
        own = np.sqrt(1 - TIP_SHARE) * np.array([[u.tip_sd_mm] for u in drawn]) * OF_TIPS
        numbers = np.array([numbers_of(each) for each in tables])
        return cls(tuple(drawn), tuple(tables), numbers + own * rng.standard_normal(numbers.shape))

    def rows(self) -> list[Beside]:
        """All numbers of Tables 1 to 4 that it has, in the paper's units: median and 90 % interval."""
        return [beside(key, unscaled(key, self.numbers[:, i])) for i, key in enumerate(KEYS)]

    def column(self, key: str) -> FloatArray:
        """One of the numbers by finger, in the paper's unit."""
        return unscaled(key, self.numbers[:, KEYS.index(key)])

    @cached_property
    def thresholds(self) -> list[Beside]:
        """Figure 4's two numbers with the mean square over the touched half, by the fingers' moduli."""
        moduli = np.log([u.modulus_MPa for u in self.unknowns])
        knots, curves = _threshold_curves()
        return [
            beside(key, np.exp(np.interp(moduli, knots, curve))) for key, curve in zip(THRESHOLDS, curves, strict=True)
        ]

    @cached_property
    def shared(self) -> tuple[FloatArray, FloatArray]:
        """Figure 13 by finger and calibration: mean correlation of errors between tips, share of places in order."""
        true = composite_radius(np.array(figure_13.TIPS), R_B)
        alike, order = np.empty((2, len(self.tables), 2))
        for i, each in enumerate(self.tables):
            for c in range(2):
                errors = each.radius_errors[c][_FIGURE_13]
                alike[i, c] = shared_by_indenters(errors)
                order[i, c] = figure_13.monotonic(errors + true[:, None])
        return alike, order

    def text(self) -> list[Beside]:
        """Sentences of sections 3 to 5, for the most part calculated from the tables as the paper calculates them."""
        theta, noise = (self.column(f"table_4.model.{part}.theta_c") for part in ("total", "noise"))
        arc = np.radians(theta) * R_B / published.number("spacing").value
        load = published.number("touches.load").value
        of_radius = self.column("table_4.empirical.noise.R")
        errors = np.array([each.errors_1.mean() for each in self.tables])
        flats = np.array([flat_errors(u, e) for u, e in zip(self.unknowns, errors, strict=True)]).T
        expected = sum(published.number(f"noise.{name}").value for name in ("force_sensor", "averaged_readings"))
        return [
            Beside("noise.expected_fit", expected),
            beside("noise.error_over_noise", errors / expected),
            beside("flat_fit.hertz", flats[0]),
            beside("flat_fit.frictionless", flats[1]),
            self._unbiased_to(),
            beside("location_error.over_spacing", arc),
            beside("location_error.over_spacing_conclusion", arc),
            beside("location_error.noise_part", noise / theta),
            beside("load_error.over_load", 100 * self.column("table_4.model.noise.P") / load),
            beside("radius_error.noise", of_radius),
            beside("radius_error.averaged", self.column("table_4.empirical.location.R")),
            beside("radius_error.distinguishable", 2 * of_radius),
        ]

    def _unbiased_to(self) -> Beside:
        """Bluntest tip whose expected mean is within a tenth of its radius, and the next one, which is not."""
        radii = [row.r_c for row in published.TABLE_3]
        means = [np.median(self.column(f"table_3[{r:.2f}].frictionless_model")) for r in radii]
        last = max((i for i, r in enumerate(radii) if abs(means[i] / r - 1) < UNBIASED), default=0)
        return Beside("table_3.unbiased_to", radii[last], radii[last], radii[min(last + 1, len(radii) - 1)])


@lru_cache(maxsize=1)
def _threshold_curves() -> tuple[FloatArray, FloatArray]:
    """Logarithms of some moduli, and of Figure 4's two numbers there; both are nearly straight lines."""
    moduli = np.geomspace(*PRIOR["modulus_MPa"], THRESHOLD_KNOTS)
    found = [figure_4.thresholds(figure_4.deep_finger(m), figure_4.SPANS_DEG["touched half"]) for m in moduli]
    return np.log(moduli), np.log([[f.noise_percent for f in found], [f.radius_share for f in found]])


def unscaled(key: str, values: FloatArray) -> FloatArray:
    """In the paper's units."""
    if OF_TIPS[KEYS.index(key)]:
        return np.asarray(indenter_radius(np.clip(values, 0.0, 0.999 * R_B), R_B))
    return np.asarray(np.exp(values))


def beside(key: str, values: FloatArray) -> Beside:
    """A number of single fingers: median and 90 % interval."""
    low, middle, high = np.quantile(values, [OUTSIDE, 0.5, 1 - OUTSIDE])
    return Beside(key, float(middle), float(low), float(high))
