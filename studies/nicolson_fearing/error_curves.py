"""Random errors of elements' E maps as curves of the angle from the element: everywhere, and in the tails alone."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from nicolson_fearing.linear_touches import MODES
from nicolson_fearing.paper_finger import MISFIT_LENGTH_DEG
from nicolson_fearing.unknowns import tail_window

FloatArray = NDArray[np.float64]


def smooth_curves(rng: np.random.Generator, m: int) -> list[FloatArray]:
    """Smooth random curves of the angle, sd 1, as cosine and sine coefficients (m, modes): `with_map_errors`."""
    length = np.radians(MISFIT_LENGTH_DEG)
    power = np.exp(-0.5 * (MODES * length) ** 2) * np.where(MODES == 0, 0.5, 1.0) * (int(4 / length) >= MODES)
    return [np.sqrt(power / power.sum()) * rng.standard_normal((m, len(MODES))) for _ in range(2)]


def tail_curves(rng: np.random.Generator, m: int) -> list[FloatArray]:
    """Such curves outside of Table 1's window alone."""
    cosine, sine = smooth_curves(rng, m)
    cos, sin, window, share = _circle()
    curve = (cosine @ cos.T + sine @ sin.T) * window
    return [share * (curve @ cos), share * (curve @ sin)]


@lru_cache(maxsize=1)
def _circle() -> tuple[FloatArray, ...]:
    """Modes at each degree, the tails' window there, and what turns sums over the circle into coefficients."""
    angle = np.arange(-180.0, 180.0)
    turn = np.radians(angle)[:, None] * MODES
    return np.cos(turn), np.sin(turn), tail_window(angle), np.where(MODES == 0, 1.0, 2.0) / len(angle)
