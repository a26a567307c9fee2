"""A simulated finger and the touches made on it: from pose and load to signals, before any noise.

Angles in degrees and loads in N/m, as in the files; strain is compression positive.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from .body import Annulus, Response, solve
from .contact import contact_table

# (10.3/12.7)^100 is 1e-9: deeper modes reach no element
MODES = 100
REFERENCE_LOAD = 200.0


@dataclass(frozen=True)
class Design:
    """What is built and touched; by default as the practice fingers."""

    body: Annulus = field(default_factory=Annulus)
    modulus: float = 0.15
    depth: float = 9.9
    n_elements: int = 16
    pitch: float = 8.8
    depth_sd: float = 0.1
    angle_sd: float = 0.5
    gain_sd: float = 0.15
    peak: float = 1000.0
    noise_sd: float = 17.2
    force_sd: float = 1.0
    samples: int = 5
    edge_step: float = 1.0
    flat_step: float = 3.0
    tips: tuple[float, ...] = (0.0, 0.5, 1.59, 3.9, 6.01, 7.55, 9.3, 12.3, 18.71, 25.25, np.inf)
    tip_step: float = 1.0
    tip_span: float = 20.0
    exam_tips: tuple[float, ...] = (1.0, 2.7, 5.0, 8.4, 10.8, 15.0)
    exam_step: float = 1.0
    loads: tuple[float, float] = (160.0, 240.0)
    sample_interval: float = 0.25
    touch_interval: float = 5.25

    @property
    def angles(self) -> np.ndarray:
        """Design angles of the elements, degree."""
        return np.asarray((np.arange(self.n_elements) - (self.n_elements - 1) / 2) * self.pitch)


#: A quarter of the touches and 8 elements, for tests that must be quick.
SMALL = Design(n_elements=8, edge_step=2.0, flat_step=6.0, tips=(0.0, 1.59, 6.01, 12.3, np.inf), tip_step=2.0)


@dataclass(frozen=True, eq=False)
class Finger:
    """A finger as it came out of the mould: true depths (mm), angles (degree), counts per strain."""

    body: Annulus
    modulus: float
    depth: np.ndarray
    angle: np.ndarray
    gain: np.ndarray

    @property
    def peak(self) -> np.ndarray:
        """Counts of each element right under a knife edge of 200 N/m."""
        m = len(self.angle)
        press = Press(np.zeros(m), self.angle, np.full(m, REFERENCE_LOAD))
        return np.asarray(np.diagonal(self.signal(press)))

    def signal(self, press: Press) -> np.ndarray:
        """Counts, shape (touch, element)."""
        k = np.arange(MODES)
        outer = self.body.outer
        curvature = np.maximum(1 / outer + press.hump, 0) + 1 / np.maximum(press.tip, 1e-9)
        kappa = press.load / 1000 / self.modulus / curvature
        spectrum = contact_table(self.body, MODES).spectrum(np.where(press.tip == 0, 0.0, kappa))
        if press.half_space:
            spectrum = spectrum + press.half_space * (
                _hertz(self.body, np.where(press.tip == 0, 0.0, kappa)) - spectrum
            )
        if press.land:
            spectrum = np.where((press.tip == 0)[:, None], _flat_punch(k * press.land / outer), spectrum)
        weight = np.where(k == 0, 1.0, 2.0)[:, None] * _window(k[:, None] * press.aperture / self.depth)
        # the mean of cos kφ over an arc of length `width` at the element's depth
        weight = weight * np.sinc(k[:, None] * press.width / self.depth / (2 * np.pi))
        touch, element = np.radians(press.angle)[:, None] * k, np.radians(self.angle) * k[:, None]
        cosine, sine = spectrum * np.cos(touch), spectrum * np.sin(touch)
        normal = weight * _response(self.body, "normal").strain_at(self.depth)
        strain = cosine @ (normal * np.cos(element)) + sine @ (normal * np.sin(element))
        if np.any(press.tangential):
            # shear cos kφ is sin kφ turned by a quarter wave
            shear = weight * _response(self.body, "shear").strain_at(self.depth)
            shear = cosine @ (shear * np.sin(element)) - sine @ (shear * np.cos(element))
            strain = strain + press.tangential[:, None] * shear
        scale = press.load / 1000 / self.modulus / (2 * np.pi * outer)
        return np.asarray(self.gain * scale[:, None] * strain)


@dataclass(frozen=True, eq=False)
class Press:
    """True pose and load of touches, (t,) arrays, and how they are felt.

    `land` is the half-width (mm) of a worn edge, `aperture` the half-width (mm) at the foot of a triangular element,
    `tangential` (t,) the shear load as a share of the load, towards larger angles. `width` (mm) is that of an element
    which weighs all of it alike, `half_space` the share of Hertz's pressure in that of the bonded layer. `hump` (t,) is
    the curvature of the surface where it is touched, less that of a round one, 1/mm.
    """

    tip: np.ndarray
    angle: np.ndarray
    load: np.ndarray
    land: float = 0.0
    aperture: float = 0.0
    tangential: np.ndarray | float = 0.0
    width: float = 0.0
    half_space: float = 0.0
    hump: np.ndarray | float = 0.0


@dataclass(frozen=True, eq=False)
class Recording:
    """All samples of a data set in order of time, one row each, as the stages fill it in.

    Attributes
    ----------
    finger : Finger
    press : Press
        One row a touch.
    touch, sample : (n,) int arrays
    time, read_load : (n,) arrays
        s; N/m, without noise of the force sensor.
    tip, commanded : (t,) arrays
        What the tables will say: r_c in mm (0 edge, inf flat), degree.
    peak : (m,) array
    signal, error : (n, m) arrays
        Counts, and what only disturbs them; noise of the design is added when the tables are written.
    noise_sd : float
    parts : (3,) tuple of int
        Number of calibration touches, of touches to be read, of exam touches.
    """

    finger: Finger
    press: Press
    touch: np.ndarray
    sample: np.ndarray
    time: np.ndarray
    read_load: np.ndarray
    tip: np.ndarray
    commanded: np.ndarray
    peak: np.ndarray
    signal: np.ndarray
    error: np.ndarray
    noise_sd: float
    parts: tuple[int, int, int]

    @property
    def n_samples(self) -> int:
        """Samples a touch."""
        return len(self.touch) // len(self.tip)

    def by_touch(self, rows: np.ndarray) -> np.ndarray:
        """Means over the samples of each touch, (t, ...)."""
        return np.asarray(rows.reshape(len(self.tip), self.n_samples, *rows.shape[1:]).mean(axis=1))

    def pressed(self) -> Recording:
        """With the finger's signals."""
        return replace(self, signal=np.repeat(self.finger.signal(self.press), self.n_samples, axis=0))


def build(design: Design, rng: np.random.Generator) -> Finger:
    """Draw a finger; gains are such that an element of nominal build peaks at `design.peak`."""
    m = design.n_elements
    room = 0.06 * (design.body.outer - design.body.core)
    depth = np.maximum(design.depth + design.depth_sd * rng.standard_normal(m), design.body.core + room)
    angle = design.angles + design.angle_sd * rng.standard_normal(m)
    nominal = Finger(design.body, design.modulus, np.array([design.depth]), np.zeros(1), np.ones(1))
    gain = design.peak / nominal.peak * np.exp(design.gain_sd * rng.standard_normal(m))
    return Finger(design.body, design.modulus, depth, angle, gain)


def record(design: Design, finger: Finger, rng: np.random.Generator) -> Recording:
    """Plan the touches: edges and flats from -90° to 90°, then every tip, then the exam's tips."""
    calibration = [(0.0, 90, design.edge_step), (np.inf, 90, design.flat_step)]
    touches = [(tip, design.tip_span, design.tip_step) for tip in design.tips]
    exam = [(tip, design.tip_span - design.exam_step / 2, design.exam_step) for tip in design.exam_tips]
    plans = [[(tip, _ladder(span, step)) for tip, span, step in part] for part in (calibration, touches, exam)]
    tip = np.concatenate([np.full(len(angles), tip) for part in plans for tip, angles in part])
    angle = np.concatenate([angles for part in plans for _, angles in part])
    parts = tuple(sum(len(angles) for _, angles in part) for part in plans)
    load = rng.uniform(*design.loads, len(tip))
    touch, sample = np.repeat(np.arange(len(tip)), design.samples), np.tile(np.arange(design.samples), len(tip))
    empty = np.zeros((len(touch), design.n_elements))
    return Recording(
        finger=finger,
        press=Press(tip, angle, load),
        touch=touch,
        sample=sample,
        time=touch * design.touch_interval + sample * design.sample_interval,
        read_load=load[touch],
        tip=tip,
        commanded=angle,
        peak=finger.peak,
        signal=empty,
        error=empty,
        noise_sd=design.noise_sd,
        parts=(parts[0], parts[1], parts[2]),
    )


def _ladder(span: float, step: float) -> np.ndarray:
    return np.linspace(-span, span, round(2 * span / step) + 1)


def _window(x: np.ndarray) -> np.ndarray:
    """Fourier transform of a triangle that reaches from -1 to 1, at x."""
    return np.asarray(np.sinc(x / (2 * np.pi)) ** 2)


def _hertz(body: Annulus, kappa: np.ndarray) -> np.ndarray:
    """Fourier transform of Hertz's pressure √(1-s²/a²), 2 J_1(ka)/(ka), with a² = 4 P R (1-σ²)/(π E), by its integral.

    E = 2 μ (1 + σ), so that a² = 2 κ (1-σ)/π.
    """
    half_angle = np.sqrt(2 * kappa * (1 - body.poisson) / np.pi) / body.outer
    turn = (np.arange(64) + 0.5) * np.pi / 64
    waves = np.cos(half_angle[:, None, None] * np.arange(MODES)[:, None] * np.cos(turn))
    return np.asarray((waves * np.sin(turn) ** 2).mean(axis=2) * 2)


def _flat_punch(x: np.ndarray) -> np.ndarray:
    """Fourier transform of the pressure 1/(π √(1-t²)) under a flat punch, a Bessel function, by its integral."""
    turn = (np.arange(64) + 0.5) * np.pi / 64
    return np.asarray(np.cos(np.outer(x, np.cos(turn))).mean(axis=1))


@lru_cache(maxsize=8)
def _response(body: Annulus, traction: str) -> Response:
    return solve(body, np.arange(MODES), traction)
