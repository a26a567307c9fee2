"""What a simplex search that stops early adds to the scatter of θ_c, P and R.

The paper fitted with the simplex of Numerical Recipes, which stops when the criterion at its corners differs by less
than a tolerance, relative to the criterion. Here searches from one first guess stop at several tolerances, and are
compared with the minimum of the same readings.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from bayestouch.contact import composite_radius
from bayestouch.paper.published import TABLE_1
from nicolson_fearing.many_fits import fit_many_touches
from nicolson_fearing.noise_causes import LOAD, PLACES_DEG, R_B, SQUEEZE_AT_MPA, TIPS_MM, Reader, reader_model
from nicolson_fearing.paper_run import paper_run

FloatArray = NDArray[np.float64]

TOLERANCES = (0.1, 0.03, 0.01)
FIRST_RADIUS_MM, FIRST_STEP_DEG = 4.4, 2.0  # the first guess: a blunt tip, 200 N/m, and the nearest even degree
STEPS = np.array([1.0, 10.0, 1.0])  # first simplex: degree, N/m, mm
SQUEEZED = Reader(squeezed=True)  # reads a flat within its limits: their effect is not mixed up with that of stopping


def added_scatter(tolerances: Sequence[float] = TOLERANCES, samples: int = 4, seed: int = 0) -> FloatArray:
    """Scatter about the minimum over the scatter of minima, (tolerances, 3): θ_c, P, R; under Table 1's mean noise."""
    model = reader_model(SQUEEZED, SQUEEZE_AT_MPA)
    finger = paper_run(seed).finger
    reader = finger.reader("model", model or "layer", SQUEEZE_AT_MPA)
    pressed = finger.reader("model", "layer", SQUEEZE_AT_MPA)
    radius, angle = (g.ravel() for g in np.meshgrid(composite_radius(TIPS_MM, R_B), PLACES_DEG, indexing="ij"))
    silent = pressed.predict(radius, np.radians(angle), np.full(len(radius), LOAD)) / pressed.gain
    silent, angle = np.repeat(silent, samples, axis=0), np.repeat(angle, samples)
    noise = TABLE_1[3].average / 100 * LOAD * np.random.default_rng(seed).standard_normal(silent.shape)

    def minima(strain: FloatArray) -> FloatArray:
        found = fit_many_touches(reader, strain * reader.gain)
        return np.stack([found.angle_deg, found.load, found.composite_radius_mm], axis=1)

    def strain(x: FloatArray) -> FloatArray:
        return np.asarray(
            reader.predict(np.clip(x[..., 2], 0, 2 * R_B), np.radians(x[..., 0]), np.maximum(x[..., 1], 1))
            / reader.gain
        )

    noisy = silent + noise
    best = minima(noisy)
    criterion = ((strain(best) - noisy) ** 2).sum(axis=1)
    out = []
    for tolerance in tolerances:
        stopped = np.empty_like(best)
        for i, each in enumerate(noisy):
            first = np.array([FIRST_STEP_DEG * np.round(angle[i] / FIRST_STEP_DEG), LOAD, FIRST_RADIUS_MM])
            stopped[i] = minimize(
                lambda x, data=each: float(((strain(x) - data) ** 2).sum()),
                first,
                method="Nelder-Mead",
                options={
                    "initial_simplex": np.vstack([first, first + np.diag(STEPS)]),
                    "xatol": np.inf,
                    "fatol": tolerance * criterion[i],
                },
            ).x
        out.append(np.sqrt(((stopped - best) ** 2).mean(axis=0)))
    return np.array(out) / np.sqrt(((best - minima(silent)) ** 2).mean(axis=0))
