"""Forms of the body and of the elements in the second blind study. None is in `blind_elements` or `elements`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .blind_waves import felt_by
from .effects import Effect
from .elements import turn_deg
from .finger import MODES, Recording


def two_bubbles(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Two bubbles of unequal size, 13° apart, were left in the rubber: readings over them are less, by two bells.

    The share is value (exp(-(x/5)²/2) + 0.6 exp(-((x - 13)/3.5)²/2)), x the angle from the first, degree. Casting in
    air leaves bubbles in groups.
    """
    x = (r.commanded - rng.uniform(-15, 5)) * rng.choice([-1, 1])
    less = np.exp(-0.5 * (x / 5) ** 2) + 0.6 * np.exp(-0.5 * ((x - 13) / 3.5) ** 2)
    return replace(r, signal=r.signal * (1 - value * less[r.touch])[:, None])


def closing_void(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A void under the surface yields to light touches, and is closed by heavy ones: share value g (200/P)².

    P in N/m, g = (1 + (x/7)²)^-1.5, x the angle from the void, degree: the field of a small void falls with the third
    power of the distance (Eshelby, 1957, doi:10.1098/rspa.1957.0133).
    """
    x = (r.commanded - rng.uniform(-15, 15)) / 7
    more = (1 + x**2) ** -1.5 * (200 / r.press.load) ** 2
    return replace(r, signal=r.signal * (1 + value * more[r.touch])[:, None])


def slanted_strips(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements are strips that were cut by hand and lie askew in the rubber: one end is deeper, by 12 % of the length.

    Lengths are from 0.5 to 1.5 times `value` mm. What a strip feels is the mean of the strain at 8 places along it, of
    different angle and depth; which end is the deeper one is drawn for each.
    """
    finger, lean = r.finger, 0.12 * rng.choice([-1, 1], len(r.peak))
    length = value * rng.permutation(np.linspace(0.5, 1.5, len(r.peak)))
    signal = np.zeros((len(r.tip), len(r.peak)))
    for s in (np.arange(8) + 0.5) / 8 - 0.5:
        depth = np.maximum(finger.depth + lean * s * length, finger.body.core + 0.02)
        angle = finger.angle + np.degrees(s * length / finger.depth)
        signal += replace(finger, angle=angle, depth=depth).signal(r.press) / 8
    change = signal - finger.signal(r.press)
    return replace(r, signal=r.signal + change[r.touch])


def hairpin(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements are wires bent to a hairpin: two legs, `value` mm apart, of which one is bonded better.

    The better one has from 50 to 80 % of the response, by element; an element's angle is the middle of its response.
    Loops of wire are the usual form of strain gauges (Hoffmann, An Introduction to Measurements using Strain Gages,
    1989).
    """
    share = rng.permutation(np.linspace(0.5, 0.8, len(r.peak)))
    side = rng.choice([-1, 1], len(r.peak)) * value / r.finger.depth
    k = np.arange(MODES)[:, None]
    near, far = k * side * (1 - share), -k * side * share
    weight = share * np.cos(near) + (1 - share) * np.cos(far)
    return felt_by(r, weight, share * np.sin(near) + (1 - share) * np.sin(far))


def common_return(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """All elements share a thin return wire: its voltage drop takes `value` of the sum of all signals from each.

    Conductive coupling by a common impedance (Ott, Electromagnetic Compatibility Engineering, 2009, chapter 2). Wires
    join the return one after the other: the last element sees all of the drop, the first 40 % of it.
    """
    seen = np.linspace(0.4, 1.0, len(r.peak))
    return replace(r, signal=r.signal - value * np.outer(r.signal.sum(axis=1), seen))


def damp_tracks(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Damp lets current leak between neighbouring tracks: a ladder of conductances, (1 + v L)^-1 times the signals.

    L is the Laplacian of the chain of tracks with conductances from 0.3 to 1.7 between neighbours, as water lies on the
    board; `value` is their mean over that of an element. Kirchhoff's laws.
    """
    m = len(r.peak)
    laplacian = np.zeros((m, m))
    for i, wet in enumerate(rng.permutation(np.linspace(0.3, 1.7, m - 1))):
        laplacian[i : i + 2, i : i + 2] += wet * np.array([[1, -1], [-1, 1]])
    return replace(r, signal=np.linalg.solve(np.eye(m) + value * laplacian, r.signal.T).T)


def unequal_sources(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Elements have unequal resistance, so each input needs its own time to settle: shares from 0 to 2 times `value`.

    What is left of the step from the channel before is exp(-T/(R C)) of it. Channels are read in the order of the
    table; nothing is left from further channels.
    """
    share = value * rng.permutation(np.linspace(0.0, 2.0, len(r.peak)))
    scan = r.signal.ravel()
    step = np.diff(scan, prepend=scan[0]).reshape(r.signal.shape)
    return replace(r, signal=r.signal - share * step)


def ringing_amplifier(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The amplifier rings: it overshoots each step between channels, and swings back over the next ones.

    After n channels the share value (-0.6)^n of a step is left: a second-order filter with little damping (Horowitz and
    Hill, The Art of Electronics, 2015).
    """
    scan = r.signal.ravel()
    step = np.diff(scan, prepend=scan[0])
    left = np.convolve(step, (-0.6) ** np.arange(10))[: len(scan)]
    return replace(r, signal=(scan + value * left).reshape(r.signal.shape))


def magnetic_probe(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The probe is magnetic, and elements feel its dipole: (2 h² - d²)/(h² + d²)^2.5, which changes its sign.

    d is the chord from the element to the probe, h = 7 mm; scaled to `value` of the peak right below (Jackson,
    Classical Electrodynamics, 1999, section 5.6). At any load.
    """
    chord = 2 * r.finger.body.outer * np.sin(np.radians(np.abs(turn_deg(r))) / 2) / 7
    near = (1 - chord**2 / 2) * (1 + chord**2) ** -2.5
    return replace(r, signal=r.signal + value * r.peak * near[r.touch])


def charged_tips(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Tips are charged by rubbing on silicone, each by its own amount: Coulomb's field, 1/(1 + (d/6 mm)²).

    d is the chord from the element to the tip; amounts are log-normal with sd 0.6 over tips, `value` of the peak in the
    middle, all of one sign (Lowell and Rose-Innes, 1980, doi:10.1080/00018738000101466).
    """
    tips, which = np.unique(r.tip, return_inverse=True)
    charge = np.exp(0.6 * rng.standard_normal(len(tips)))[which]
    chord = 2 * r.finger.body.outer * np.sin(np.radians(np.abs(turn_deg(r))) / 2)
    near = charge[:, None] / (1 + (chord / 6) ** 2)
    return replace(r, signal=r.signal + value * r.peak * near[r.touch])


EFFECTS = (
    Effect("soft_spot", "two bubbles", "after", 0.1, 0.6, two_bubbles),
    Effect("soft_spot", "closing void", "after", 0.1, 0.9, closing_void),
    Effect("aperture", "slanted strips", "after", 2.0, 5.0, slanted_strips),
    Effect("aperture", "hairpin", "after", 1.0, 4.0, hairpin),
    Effect("crosstalk", "common return", "after", 0.02, 0.3, common_return),
    Effect("crosstalk", "damp tracks", "after", 0.05, 0.5, damp_tracks),
    Effect("channel_lag", "unequal sources", "after", 0.03, 0.3, unequal_sources),
    Effect("channel_lag", "ringing", "after", 0.03, 0.5, ringing_amplifier),
    Effect("proximity", "magnetic probe", "after", 0.02, 0.5, magnetic_probe),
    Effect("proximity", "charged tips", "after", 0.02, 0.5, charged_tips),
)
