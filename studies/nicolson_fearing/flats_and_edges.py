"""Section 3.1's fit of edges and flats together, to first order: what a wrong width of flats leaves over."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from bayestouch.contact.hertz import elliptic_spectrum
from bayestouch.paper.simplex.elements import WINDOW_DEG
from nicolson_fearing.linear_touches import LOAD, MODES, PER_KAPPA, R_B, best_ellipse, element_weights
from nicolson_fearing.paper_finger import DESIGN, POISSON_RATIO
from nicolson_fearing.unknowns import Unknowns

FloatArray = NDArray[np.float64]

_HALF = WINDOW_DEG / 2


def flat_errors(unknowns: Unknowns, error_percent: float) -> tuple[float, float]:
    """Errors (% of the peak) with Hertz flats and with frictionless ones on the layer in plane strain.

    Parameters
    ----------
    unknowns : Unknowns
        What is true.
    error_percent : float
        Error of the edges alone, to which that of the flats is added in quadrature.
    """
    kappa = np.array([LOAD / 1000 * R_B / unknowns.modulus_MPa])
    width, load = best_ellipse(kappa, unknowns.poisson_ratio, unknowns.length_mm)
    true = load[0] * elliptic_spectrum(width / R_B, MODES)[0]
    on_layer, layer_load = best_ellipse(kappa, POISSON_RATIO, np.inf)
    assumed = (
        elliptic_spectrum(np.sqrt(PER_KAPPA * kappa) / R_B, MODES)[0],
        layer_load[0] * elliptic_spectrum(on_layer / R_B, MODES)[0],
    )
    first, second = (float(np.hypot(_left_over(true - each, each), error_percent)) for each in assumed)
    return first, second


def _left_over(missed: FloatArray, spectrum: FloatArray) -> float:
    """Root mean square of what σ, r_s, θ_s and the gain of an element cannot take up, % of the peak."""
    edges = np.arange(-_HALF, _HALF + 1)
    flats = np.arange(-_HALF, _HALF + 1, DESIGN.flat_step_deg)
    weights, slopes = _element()
    columns = []
    for odd, slope in slopes:
        turned = np.sin if odd else np.cos
        by_edge = turned(np.radians(edges)[:, None] * MODES) @ slope
        by_flat = turned(np.radians(flats)[:, None] * MODES) @ (slope * spectrum)
        columns.append(np.concatenate([by_edge, by_flat]))
    off = 100 * np.cos(np.radians(flats)[:, None] * MODES) @ (weights * missed)
    data = np.concatenate([np.zeros(len(edges)), off])
    found, *_ = np.linalg.lstsq(np.stack(columns, axis=1), data, rcond=None)
    return float(np.sqrt(np.mean((data - np.stack(columns, axis=1) @ found) ** 2)))


@lru_cache(maxsize=1)
def _element() -> tuple[FloatArray, list[tuple[int, FloatArray]]]:
    """Response of an element as designed by mode, and its derivatives by σ, r_s, θ_s (odd) and gain."""
    at, step = np.array([DESIGN.sensing_radius_mm]), 1e-4
    w = element_weights(at, POISSON_RATIO)[0]
    sigma = (element_weights(at, POISSON_RATIO + step)[0] - w) / step
    depth = (element_weights(at + step, POISSON_RATIO)[0] - w) / step
    return w, [(0, sigma), (0, depth), (1, w * MODES), (0, w)]
