"""What goes wrong on the paper's finger, drawn: errors of edges and of touches; and what it would print.

The same draws go through all fits to first order (`linear_finger`), or into readings whose fits are searched for
(`whole_finger`). Strains are in % of each element's peak under an edge.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from bayestouch.contact import composite_radius
from bayestouch.paper.published import number
from nicolson_fearing.error_curves import smooth_curves, tail_curves
from nicolson_fearing.linear_touches import R_B
from nicolson_fearing.paper_finger import DESIGN, LOCATIONS_DEG
from nicolson_fearing.paper_run import TABLE_4_TIPS, TIPS_MM
from nicolson_fearing.unknowns import Unknowns

FloatArray = NDArray[np.float64]
Curves = list[FloatArray]  # cosine and sine coefficients (m, modes) of the angle from an element

SAMPLES = int(number("touches.n_samples").value)
FORCE_NOISE = number("noise.force_sensor").value
EDGES_DEG = np.arange(-DESIGN.calibration_span_deg, DESIGN.calibration_span_deg + 1)
AT = np.searchsorted(EDGES_DEG, LOCATIONS_DEG)
OF_TABLE_4 = np.isin(TIPS_MM, TABLE_4_TIPS)
OF_TABLE_3 = np.array([0 < tip < np.inf for tip in TIPS_MM])
SHARPEST_MM = 0.02
"""No round tip is sharper, whatever its error."""


@dataclass(frozen=True, eq=False)
class Tables:
    """What the paper would print of one finger.

    Attributes
    ----------
    errors_1, errors_2 : (m,) arrays
        Errors of the elements in Tables 1 and 2, % of the peak.
    table_3 : (2, 2, 9) array
        Mean r_c as composite radius (mm): contact (Hertz, frictionless), calibration, tip.
    table_4 : (2, 3, 3) array
        Calibration; total, location, noise; θ_c (degree), P (N/m), R (mm).
    radius_errors : (2, tips, places) array
        Errors of R of averages by the squeezed contact, mm.
    """

    errors_1: FloatArray
    errors_2: FloatArray
    table_3: FloatArray
    table_4: FloatArray
    radius_errors: FloatArray


@dataclass(frozen=True, eq=False)
class EdgeErrors:
    """Errors of a finger and of the edges that calibrate it.

    Attributes
    ----------
    curves : Curves
        Errors of the E maps.
    place : (edges, m) array
        Errors of the places.
    prober : (edges,) array
        Errors of location, degree.
    noise : (edges, m) array
        Of the means over the samples.
    drift, force : (edges,) arrays
        Factor of the readings, and error of the force sensor; %.
    """

    curves: Curves
    place: FloatArray
    prober: FloatArray
    noise: FloatArray
    drift: FloatArray
    force: FloatArray

    @classmethod
    def of(cls, u: Unknowns, levels: FloatArray, rng: np.random.Generator) -> EdgeErrors:
        """Draw them; levels (m,) is the noise of a sample."""
        m, n_edges = len(levels), len(EDGES_DEG)
        scale = u.element_scales(rng.standard_normal(m))
        curves = [u.map_error * scale[:, None] * c for c in smooth_curves(rng, m)]
        return cls(
            curves=[a + u.tail * b for a, b in zip(curves, tail_curves(rng, m), strict=True)],
            place=u.place_error * scale * rng.standard_normal((n_edges, m)),
            prober=u.prober_deg * rng.standard_normal(n_edges),
            noise=levels * rng.standard_normal((n_edges, m)) / np.sqrt(SAMPLES),
            drift=u.drift * rng.standard_normal(n_edges),
            force=FORCE_NOISE * rng.standard_normal(n_edges),
        )


@dataclass(frozen=True, eq=False)
class Added:
    """What a cause adds to errors by chance.

    Attributes
    ----------
    edges : (edges, m) array
        Strains under the edges of the calibration, % of the peak.
    tips : (tips, places, m) array
        Strains under the tips.
    location_deg : (edges,) array
        True location less that of the prober.
    curvature_per_mm : (places,) array
        What the surface adds to 1/R of every tip.
    """

    edges: FloatArray
    tips: FloatArray
    location_deg: FloatArray
    curvature_per_mm: FloatArray

    @classmethod
    def none(cls, m: int) -> Added:
        """Nothing, for m elements."""
        n, places = len(EDGES_DEG), len(LOCATIONS_DEG)
        return cls(np.zeros((n, m)), np.zeros((len(TIPS_MM), places, m)), np.zeros(n), np.zeros(places))

    def __add__(self, other: Added) -> Added:
        """Of both causes."""
        return Added(*(getattr(self, each.name) + getattr(other, each.name) for each in fields(self)))


@dataclass(frozen=True, eq=False)
class TouchErrors:
    """Noise of the touches; single samples only of the tips of Table 4.

    Attributes
    ----------
    noise : (tips of Table 4, places, samples, m) array
        Of samples.
    jitter : (tips of Table 4, places, samples) array
        Factor of the readings less one.
    mean_noise : (tips, places, m) array
        Of the means over the samples.
    mean_jitter, drift : (tips, places) arrays
        Factor of the means less one; and of the touch.
    """

    noise: FloatArray
    jitter: FloatArray
    mean_noise: FloatArray
    mean_jitter: FloatArray
    drift: FloatArray

    @classmethod
    def of(cls, u: Unknowns, levels: FloatArray, rng: np.random.Generator) -> TouchErrors:
        """Draw them; levels (m,) is the noise of a sample."""
        touches = (len(TIPS_MM), len(LOCATIONS_DEG))
        samples = (int(OF_TABLE_4.sum()), len(LOCATIONS_DEG), SAMPLES)
        noise = levels * rng.standard_normal((*samples, len(levels)))
        jitter = u.jitter / 100 * rng.standard_normal(samples)
        # of the other tips only averages are needed
        mean_noise = levels * rng.standard_normal((*touches, len(levels))) / np.sqrt(SAMPLES)
        mean_jitter = u.jitter / 100 * rng.standard_normal(touches) / np.sqrt(SAMPLES)
        mean_noise[OF_TABLE_4], mean_jitter[OF_TABLE_4] = noise.mean(axis=2), jitter.mean(axis=2)
        return cls(noise, jitter, mean_noise, mean_jitter, u.drift / 100 * rng.standard_normal(touches))


def true_radii(u: Unknowns, rng: np.random.Generator) -> FloatArray:
    """Composite radii of the tips as they are, (tips,), mm: the odd one, and errors of the others."""
    true = composite_radius(np.array(TIPS_MM), R_B)
    wrong = u.tip_sd_mm * rng.standard_normal(len(TIPS_MM)) * OF_TABLE_3
    true = np.where(np.array(TIPS_MM) == u.ODD_TIP_MM, u.odd_tip_R_mm, true)
    return np.asarray(np.maximum(true + wrong, SHARPEST_MM * OF_TABLE_3))


def table_4_rows(means: list[FloatArray], samples: list[FloatArray]) -> FloatArray:
    """Table 4 about the mean error of each tip, (2, 3, 3), from errors of θ_c, P and R of averages and of samples.

    Averages are (2, tips, places), samples (2, tips, places, samples).
    """
    table = np.empty((2, 3, 3))
    for i, (a, s) in enumerate(zip(means, samples, strict=True)):
        middle = a.mean(axis=-1, keepdims=True)
        table[:, 0, i] = np.sqrt(((s - middle[..., None]) ** 2).mean(axis=(1, 2, 3)))
        table[:, 1, i] = np.sqrt(((a - middle) ** 2).mean(axis=(1, 2)))
        table[:, 2, i] = np.sqrt(((s - a[..., None]) ** 2).mean(axis=(1, 2, 3)))
    return table
