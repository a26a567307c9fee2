"""Forms of the body and of the elements in the fourth blind study. None is in an earlier registry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .blind_readout import held
from .blind_waves import felt_by, half_width
from .effects import Effect
from .elements import turn_deg
from .finger import MODES, Recording


def dried_drop(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A drop of solvent dried on the rubber, and carried what it dissolved to its rim, where the rubber is soft now.

    The share is value (g(x - 8) + g(x + 8) + 0.25 exp(-(x/6)²/2)), g(x) = exp(-(x/2.5)²/2), x the angle from the drop,
    degree. Rings of dried drops (Deegan and others, 1997, doi:10.1038/39827).
    """
    x = r.commanded - rng.uniform(-15, 15)
    rim = np.exp(-0.5 * ((x - 8) / 2.5) ** 2) + np.exp(-0.5 * ((x + 8) / 2.5) ** 2)
    more = rim + 0.25 * np.exp(-0.5 * (x / 6) ** 2)
    return replace(r, signal=r.signal * (1 + value * more[r.touch])[:, None])


def spot_under_the_contact(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A small hard spot lies near the surface: narrow contacts feel all of it, wide ones its mean over their width.

    The share is -value (4°/w) exp(-(x/w)²/2), w² = (4°)² + a²/2, a the half-width of the contact in degrees, x the
    angle from the spot: the bell of the spot over that of the pressure.
    """
    x = r.commanded - rng.uniform(-15, 15)
    contact = np.degrees(half_width(r.finger, r.press) / r.finger.body.outer)
    wide = np.sqrt(16 + contact**2 / 2)
    less = 4 / wide * np.exp(-0.5 * (x / wide) ** 2)
    return replace(r, signal=r.signal * (1 - value * less[r.touch])[:, None])


def shear_lag(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements are stiff threads that the soft rubber pulls along: strain goes on in them, exp(-|s|/l) from its place.

    l is from 0.6 to 1.4 times `value` mm; each wave is weighed with 1/(1 + q²), q = k l/r_s. Shear lag (Cox, 1952,
    doi:10.1088/0508-3443/3/3/302).
    """
    length = value * rng.permutation(np.linspace(0.6, 1.4, len(r.peak)))
    q = np.arange(MODES)[:, None] * length / r.finger.depth
    return felt_by(r, 1 / (1 + q**2))


def oval_cords(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements are cords that a clamp squeezed oval, more and more from the first to the last: they feel a mean.

    They are from 0.3 to 1.7 times `value` mm wide, from one end of the row to the other, and a tenth of that thick.
    Sampled at 3 rings of 8 places of equal area in the ellipse; no place lies within 0.02 mm of the core.
    """
    finger, wide = r.finger, value * np.linspace(0.3, 1.7, len(r.peak))[:: rng.choice([-1, 1])]
    ring, turn = np.meshgrid(np.sqrt((np.arange(3) + 0.5) / 3), (np.arange(8) + 0.5) * np.pi / 4)
    signal = np.zeros((len(r.tip), len(r.peak)))
    for x, y in zip((ring * np.cos(turn)).ravel(), (ring * np.sin(turn)).ravel(), strict=True):
        depth = np.maximum(finger.depth + 0.05 * wide * y, finger.body.core + 0.02)
        angle = finger.angle + np.degrees(0.5 * wide * x / finger.depth)
        signal += replace(finger, angle=angle, depth=depth).signal(r.press) / ring.size
    return replace(r, signal=r.signal + (signal - finger.signal(r.press))[r.touch])


def plug_of_two_rows(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The plug has two rows of pins, and channels go to them in turn: pins of the same row lie next to each other.

    Each wire gets `value` of the second neighbours, which are in its row, and 0.4 of that of the first ones in the
    other row; couplings differ with sd 20 %. Capacitance of parallel pins.
    """
    m = len(r.peak)
    apart = np.abs(np.arange(m)[:, None] - np.arange(m))
    uneven = rng.standard_normal((m, m))
    coupling = (1.0 * (apart == 2) + 0.4 * (apart == 1)) * (1 + 0.2 * (uneven + uneven.T) / np.sqrt(2))
    return replace(r, signal=r.signal + value * r.signal @ coupling)


def stray_light(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements are optical and the rubber is clear: light strays into others, exp(-Δ/14°) of it at the angle Δ.

    Sources differ in brightness, log-normal with sd 0.5, so that an element gives more than it takes or less; `value`
    is the share of a source of mean brightness at no distance. Law of Lambert and Beer.
    """
    apart = np.abs(r.finger.angle[:, None] - r.finger.angle)
    bright = np.exp(0.5 * rng.standard_normal(len(r.peak)))
    strays = bright[:, None] * np.exp(-apart / 14) * (1 - np.eye(len(r.peak)))
    return replace(r, signal=r.signal + value * r.signal @ strays)


def there_and_back(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The scan goes there and back: every second sample is read from the last channel to the first.

    What is left of the channel that was read before, the share `value`, so comes from either side in turn. The first
    channel of a scan is the last one of the scan before, and has settled.
    """
    scans = r.signal.copy()
    scans[1::2] = scans[1::2, ::-1]
    scan = scans.ravel()
    read = (scan - value * np.diff(scan, prepend=scan[0])).reshape(scans.shape)
    read[1::2] = read[1::2, ::-1]
    return replace(r, signal=read)


def banks_of_switches(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Switches come in banks of four on one line: from bank to bank the whole line has to be charged anew.

    Of the step from the channel before, `value` is left in the first channel of a bank, a half of what was wrong there
    in the one that follows, and so on. Within a bank a fifth of `value` is left of each step.
    """
    scan = r.signal.ravel()
    first = np.tile(np.arange(len(r.peak)) % 4 == 0, len(r.time))
    wrong = -value * np.where(first, 1.0, 0.2) * np.diff(scan, prepend=scan[0])
    left = sum(0.5**i * np.roll(np.where(first, wrong, 0.0), i) for i in range(1, 4))
    return replace(r, signal=(scan + wrong + left).reshape(r.signal.shape))


def warm_tips(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Tips are warmer than the rubber, and their warmth reaches the elements through the air while a touch is held.

    value (1 - 0.7 exp(-t/0.5 s)) exp(-√(x² + 36)/12 + 1/2) of the peak, x the angle from element to tip in degrees, t
    the time since the touch began. At any load. Elements with a first-order lag.
    """
    near = np.exp(0.5 - np.sqrt(turn_deg(r) ** 2 + 36) / 12)
    warm = 1 - 0.7 * np.exp(-held(r) / 0.5)
    return replace(r, signal=r.signal + value * r.peak * near[r.touch] * warm[:, None])


def bracket_on_one_side(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The tip hangs on a bracket that reaches out to one side, and capacitive elements feel it far on that side.

    (1 + (x/w)²)^-1.5 of the peak, `value` in size, x the angle from element to tip, w = 12° on one side and 32° on the
    other one; which is drawn. At any load. Fields of a body fall off from where it ends.
    """
    turn = turn_deg(r) * rng.choice([-1, 1])
    near = (1 + (turn / np.where(turn < 0, 12.0, 32.0)) ** 2) ** -1.5
    return replace(r, signal=r.signal + value * r.peak * near[r.touch])


EFFECTS = (
    Effect("soft_spot", "dried drop", "after", 0.1, 0.9, dried_drop),
    Effect("soft_spot", "under the contact", "after", 0.1, 0.9, spot_under_the_contact),
    Effect("aperture", "shear lag", "after", 0.7, 3.0, shear_lag),
    Effect("aperture", "oval cords", "after", 2.0, 5.0, oval_cords),
    Effect("crosstalk", "two rows", "after", 0.03, 0.4, plug_of_two_rows),
    Effect("crosstalk", "stray light", "after", 0.03, 0.4, stray_light),
    Effect("channel_lag", "there and back", "after", 0.03, 0.4, there_and_back),
    Effect("channel_lag", "banks", "after", 0.03, 0.5, banks_of_switches),
    Effect("proximity", "warm tips", "after", 0.02, 0.5, warm_tips),
    Effect("proximity", "bracket on one side", "after", 0.02, 0.5, bracket_on_one_side),
)
