"""Effects that no catalogue lists."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .effects import Effect
from .elements import turn_deg
from .finger import Recording


def far_lobe(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The core flexes: a weak answer to touches 45° away on one side."""
    side = rng.choice([-1, 1])
    lobe = np.exp(-0.5 * ((turn_deg(r) - side * 45) / 9) ** 2) * (r.press.load / 200)[:, None]
    return replace(r, signal=r.signal + value * r.peak * lobe[r.touch])


def ripple(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements are layered: the answer ripples with the place of the touch on the element, three waves within 20°."""
    turn = turn_deg(r)
    wave = np.sin(2 * np.pi * turn / 6.7) * np.exp(-0.5 * (turn / 8) ** 2) * (r.press.load / 200)[:, None]
    return replace(r, signal=r.signal + value * r.peak * wave[r.touch])


def distant_pair(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A wire crosses another: two pairs of elements far apart hear each other."""
    signal = r.signal.copy()
    m = signal.shape[1]
    for one, other in ((m // 4, m - 3), (m // 4 + 2, m - 2)):
        signal[:, one] += value * r.signal[:, other]
        signal[:, other] += value * r.signal[:, one]
    return replace(r, signal=signal)


def load_history(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Hysteresis: a touch heavier than the one before reads more, a lighter one less."""
    change = np.diff(r.press.load, prepend=r.press.load[0])
    return replace(r, signal=r.signal * (1 + value * np.tanh(change / 20))[r.touch][:, None])


def loose_patch(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A patch under four elements has come off the core and is pressed back on by heavier touches."""
    middle = r.signal.shape[1] // 2
    signal = r.signal.copy()
    load = (r.press.load[r.touch] - 200) / 40
    signal[:, middle - 2 : middle + 2] *= (1 + value * load * np.abs(load))[:, None]
    return replace(r, signal=signal)


def gear(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The prober's wheel of 20 teeth is cut unevenly: an angle error, in degrees, that comes back with every tooth."""
    error = value * np.sin(np.radians(20 * r.commanded) - rng.uniform(0, 2 * np.pi))
    return replace(r, press=replace(r.press, angle=r.press.angle + error))


#: Fixed functions of element, relative location and load, which a correction by these can take away ...
PLACED = (
    Effect("far_lobe", "", "after", 0.02, 0.9, far_lobe, listed=False),
    Effect("ripple", "", "after", 0.05, 0.9, ripple, listed=False),
    Effect("distant_pair", "", "after", 0.1, 0.9, distant_pair, listed=False),
    Effect("gear", "", "before", 0.3, 3.0, gear, listed=False),
    Effect("loose_patch", "", "after", 0.1, 0.9, loose_patch, listed=False),
)
#: ... and what it cannot but by chance.
ELSEWHERE = (Effect("load_history", "", "after", 0.05, 0.9, load_history, listed=False),)
EFFECTS = PLACED + ELSEWHERE
