"""The catalogue's own formulas, written out from its page (docs/effects.md) for plain arrays.

Rows are samples, columns elements. Angles in degrees, lengths in mm, times in s; loads in N/m on a finger, N on a pad.
`peak` (m,) is the size of each element's reading right under a knife edge (on a pad: the touch) at the reference load.
Nothing of the package is used.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.linalg import sqrtm

Array = np.ndarray


def once_around(angle: Array, sine: float, cosine: float, elements: Array) -> Array:
    """a sin θ + b cos θ less its mean over the elements, in the unit of a and b."""

    def wave(at: Array) -> Array:
        return np.asarray(sine * np.sin(np.pi * at / 180) + cosine * np.cos(np.pi * at / 180))

    return np.asarray(wave(angle) - np.mean(wave(elements)))


def prober_eccentricity(commanded: Array, sine: float, cosine: float, elements: Array) -> Array:
    """Where the touch really is, degree: θ_c = θ + a sin θ + b cos θ + constant."""
    return np.asarray(commanded + once_around(commanded, sine, cosine, elements))


def load_offset(load: Array, offset: float) -> Array:
    """What the force sensor reads of the load P: P + offset."""
    return np.asarray(load + offset)


def load_misalignment_finger(load: Array, angle: Array, sine: float, cosine: float, elements: Array) -> Array:
    """What the force sensor reads of the load P: P (1 + a sin θ + b cos θ + constant)."""
    return np.asarray(load * (1 + once_around(angle, sine, cosine, elements)))


def load_misalignment_pad(load: Array, place: Array, slope: Array) -> Array:
    """What it reads on a tilted table: P (1 + Σ slope u), u from -1 to 1 over the places touched; place (n, D)."""
    low, high = place.min(axis=0), place.max(axis=0)
    return np.asarray(load * (1 + (2 * (place - low) / (high - low) - 1) @ np.asarray(slope)))


def load_nonlinearity(load: Array, reference: float, share: float, threshold: float) -> Array:
    """Load as it acts: p/(1 + share p/P_ref), p = P - threshold."""
    p = load - threshold
    return np.asarray(p / (1 + share * p / reference))


def bell(distance: Array, tails: float) -> Array:
    """A bell over the distance in half widths, 1/2 at 1: Pearson's type VII (tails > 0), II (< 0), the normal one (0).

    (1 + (2^tails - 1) u²)^(-1/tails), zero where the bracket is below zero.
    """
    if tails == 0:
        return np.asarray(0.5 ** (distance**2))
    inside = np.maximum(1 + (2.0**tails - 1) * distance**2, 0.0)
    return np.asarray(inside ** (-1 / tails))


def soft_spot(signal: Array, place: Array, share: float, width: float, tails: float, centre: Array) -> Array:
    """signal (1 + share g), g a bell of the distance to the centre (D,) in half widths; place (n, D)."""
    away = np.linalg.norm(place - np.asarray(centre), axis=1) / width
    return np.asarray(signal * (1 + share * bell(away, tails))[:, None])


def crosstalk_finger(signal: Array, angle: Array, share: float, reach: float, lean: float) -> Array:
    """Each element hears those n steps away with share reach^(n-1), (1 ± lean) of it from smaller/larger angles."""
    order = np.argsort(angle)
    out = signal.copy()
    for here, e in enumerate(order):
        for there, other in enumerate(order):
            if here != there:
                side = 1 + lean if there < here else 1 - lean
                out[:, e] += share * side * reach ** (abs(here - there) - 1) * signal[:, other]
    return out


def crosstalk_pad(signal: Array, position: Array, pitch: float, share: float) -> Array:
    """Each element hears `share` of those that are one pitch away; position (m, D)."""
    out = signal.copy()
    for e, here in enumerate(position):
        for other, there in enumerate(position):
            if other != e and np.linalg.norm(here - there) < 1.2 * pitch:
                out[:, e] += share * signal[:, other]
    return out


def channel_lag(signal: Array, share: float, carry: float) -> Array:
    """Channels in the order of the table, scan after scan of the same signals until nothing of the start is left.

    y_i = (1 - share) x_i + share v_{i-1}, where what is left over v_i = (1 - carry) x_i + carry v_{i-1}.
    """
    out, left = signal.copy(), np.zeros(len(signal))
    for _ in range(60):
        for i in range(signal.shape[1]):
            out[:, i] = (1 - share) * signal[:, i] + share * left
            left = (1 - carry) * signal[:, i] + carry * left
    return out


def proximity(turn: Array, peak: Array, load: Array, reference: float, values: tuple[float, ...]) -> Array:
    """What is added (n, m): share peak (P/P_ref)^load_power g(turn/width); turn (n, m) degree from probe to element.

    Values are share, width (degree), load_power and tails.
    """
    share, width, power, tails = values
    return np.asarray(share * peak * (load[:, None] / reference) ** power * bell(turn / width, tails))


def gain_nonlinearity(signal: Array, peak: Array, share: float, power: float) -> Array:
    """y (1 + share |y/peak|^power)."""
    return np.asarray(signal * (1 + share * np.abs(signal / peak) ** power))


def saturation(signal: Array, peak: Array, level: float, knee: float, shared: float) -> Array:
    """y/(1 + |y/limit|^knee)^(1/knee), limit = level × the geometric path from own peak (0) to the mean peak (1)."""
    limit = level * np.exp((1 - shared) * np.log(peak) + shared * np.log(peak.mean()))
    return np.asarray(signal / (1 + np.abs(signal / limit) ** knee) ** (1 / knee))


def rest_offset(signal: Array, peak: Array, shares: Array) -> Array:
    """y + share of each element (m,) × its peak: a constant that is there without touch."""
    return np.asarray(signal + shares * peak)


def creep(signal: Array, held: Array, share: Array | float, time: float) -> Array:
    """y (1 + share (1 - exp(-t/time))), t since the touch began; `share` of all elements or of each (m,)."""
    return np.asarray(signal * (1 + np.asarray(share) * (1 - np.exp(-held / time))[:, None]))


def memory(signal: Array, touch: Array, time: Array, pause: float, values: tuple[float, float, float]) -> Array:
    """Each touch leaves `share` of its mean reading when the next begins after the usual pause, and that fades.

    Values are share, time (s) and breadth. What is left fades as the mean of exp(-t/τ), log τ normal about log `time`
    with the sd `breadth`, by Gauss-Hermite quadrature with three nodes. Rows in the order of time.
    """
    share, middle, breadth = values
    nodes, weights = np.polynomial.hermite_e.hermegauss(3)
    tau, weights = middle * np.exp(breadth * nodes), weights / weights.sum()
    scale = share / float(weights @ np.exp(-pause / tau))
    out, ends, means = signal.copy(), [], []
    for each in np.unique(touch):
        rows = np.flatnonzero(touch == each)
        for end, mean in zip(ends, means, strict=True):
            fade = np.exp(-(time[rows] - end)[:, None] / tau) @ weights
            out[rows] += scale * fade[:, None] * mean
        ends.append(time[rows[-1]])
        means.append(out[rows].mean(axis=0))
    return out


def wander(time: Array, count: int, length: float, rng: np.random.Generator) -> Array:
    """Random functions of time (n, count) of sd 1, Matérn 3/2: (1 + √3 d/l) exp(-√3 d/l), drawn without knots."""
    lag = np.sqrt(3) * np.abs(time[:, None] - time) / length
    root = np.linalg.cholesky((1 + lag) * np.exp(-lag) + 1e-8 * np.eye(len(time)))
    return np.asarray(root @ rng.standard_normal((len(time), count)))


def baseline_drift(signal: Array, peak: Array, sd: float, course: Array) -> Array:
    """y + sd peak f(t), a course f of its own for each element, (n, m)."""
    return np.asarray(signal + sd * peak * course)


def gain_drift(signal: Array, sd: float, course: Array) -> Array:
    """y (1 + sd f(t)), one course (n, 1) for all elements or one for each (n, m)."""
    return np.asarray(signal * (1 + sd * course))


def common_mode_noise(peak: Array, rows: int, sd: float, shared: float, rng: np.random.Generator) -> Array:
    """An error of each sample, of sd × the geometric path from own peak (0) to mean peak (1) in each element."""
    size = sd * np.exp((1 - shared) * np.log(peak) + shared * np.log(peak.mean()))
    return np.asarray(rng.standard_normal((rows, 1)) * size)


def signal_dependent_noise(signal: Array, peak: Array, share: float, power: float, rng: np.random.Generator) -> Array:
    """An error of sd share |y/peak|^power in units of the peak."""
    return np.asarray(share * peak * np.abs(signal / peak) ** power * rng.standard_normal(signal.shape))


def outliers(signal: Array, peak: Array, probability: float, size: float, rng: np.random.Generator) -> Array:
    """A share of the readings has errors of sd size × peak."""
    return np.asarray((rng.random(signal.shape) < probability) * size * peak * rng.standard_normal(signal.shape))


def surface_profile(angle: np.ndarray, values: Mapping[str, float], end: float = 90.0) -> np.ndarray:
    """Departure of the curvature (1/mm) at angles (degree) between `-end` and `end`: a spline of B-splines.

    Through 21 knots between these, and through zeros two steps beyond, where it is level. The knots' values are the
    square root of their correlation, a Matérn 5/2 process over 10° without its first two waves, times the weights.
    """
    knots = np.linspace(-end, end, 21)
    lag = np.radians(knots[:, None] - knots)
    waves = [(k, (1 + np.radians(10 * k) ** 2 / 5) ** -3) for k in range(2, 121)]
    correlation = np.sum([p * np.cos(k * lag) for k, p in waves], axis=0) / sum(p for _, p in waves)
    through = sqrtm(correlation).real @ [values.get(f"weight_{i:02d}", 0.0) for i in range(1, 22)]
    level = [(1, 0.0)]
    spline = make_interp_spline([-1.2 * end, *knots, 1.2 * end], [0, *through, 0], k=3, bc_type=(level, level))
    return np.asarray(spline(angle))
