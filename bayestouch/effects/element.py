"""Effects of the elements: their width, and coupling between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import ClassVar

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.element_weight import ElementWeight
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.recording import Recording
from bayestouch.data.arrays import turned
from bayestouch.effects.bell import TAILS, bell
from bayestouch.effects.effect import Effect, EffectParameter, Setting, Stage, Values, own_parameters
from bayestouch.priors.parameters import LogNormal, Normal, Uniform

# Parameter of an element whose share differs from that of all, and the standard deviation of its prior: shares of parts
# that are not made by a machine differ by about a half.
EXCESS, SPREAD = "relative excess of the share", 0.5
# Largest relative excess of the leak from one side. The other side then leaks a ninth of it; at one it would leak none.
MOST_LEAN = 0.8
# Neighbours in the plane are nearer than this many times the nearest one: the next ones in a row, not those across a
# diagonal (1.41 on a square grid).
NEAR_PITCHES = 1.2


@dataclass(frozen=True)
class Aperture(Effect):
    """An element averages the strain over a width along the arc.

    The average of cos kθ over a width w is cos kθ sin(u)/u, u = k w/(2 r_s). High orders k are reduced, as they are by
    depth, so that a slightly deeper element reads almost the same. Data rarely distinguish width from depth.

    In the looser form element e is 1 + `own_e` times as wide, as in a row that is made by hand. And a share `tails` of
    the weight is not even over the width but exponential on both sides, with the same variance: a stiff element pulls
    at the rubber beyond its ends.

    Reference: R. N. Bracewell, The Fourier Transform and Its Applications (2000), on running means; H. L. Cox, British
    Journal of Applied Physics 3, 72 (1952), https://doi.org/10.1088/0508-3443/3/3/302, on the strain of stiff fibres.
    """

    parameters: tuple[EffectParameter, ...] = (
        EffectParameter("width", "mm", "width of the elements along the arc", Normal(0.0, 1.5, 0.0), (0.7,), 0.0),
    )

    name: ClassVar[str] = "aperture"
    stage: ClassVar[Stage] = "element"
    summary: ClassVar[str] = "elements of finite width"
    mixes: ClassVar[bool] = False
    changes_strain: ClassVar[bool] = True

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        return cls() if setting.finger else None

    def further_parameters(self, n_elements: int) -> tuple[EffectParameter, ...]:
        tails = EffectParameter("tails", "", "share of the weight with exponential sides", Uniform(0.0, 1.0), (0.5,))
        return (*own_parameters(n_elements, "relative excess of the width", SPREAD), tails)

    def finger(self, chain: FingerChain, values: Values) -> FingerChain:
        width, *looser = values
        if not looser:
            return chain.with_(element_weight=ElementWeight(width))
        return chain.with_(element_weight=ElementWeight(width * of_elements(looser[:-1]), looser[-1]))


@dataclass(frozen=True)
class Crosstalk(Effect):
    """A share of the signals of both neighbours is added to each channel.

    The capacitance between leads is largest for neighbours. On a finger, each element further away adds `reach` times
    what the element before it adds; with a reach of 1 all add the same, as they do through a common return. `lean` is
    the difference between the two sides: (1 + lean) `share` comes from elements at smaller angles, (1 - lean) `share`
    from those at larger angles. In the looser form element e gets 1 + `own_e` times this.

    Reference: H. W. Ott, Electromagnetic Compatibility Engineering (2009), on capacitive coupling.
    """

    parameters: tuple[EffectParameter, ...]
    neighbours: tuple[tuple[int, int], ...]

    name: ClassVar[str] = "crosstalk"
    stage: ClassVar[Stage] = "element"
    summary: ClassVar[str] = "leak from both neighbours"

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        pairs = neighbours(setting)
        if not pairs:
            return None
        share = EffectParameter("share", "", "share of each neighbour's signal", Normal(0.0, 0.1), (0.001,), 0.0)
        if not setting.finger:
            return cls((share,), pairs)
        reach = EffectParameter(
            "reach", "", "share of an element over that of the nearer one", Uniform(0, 1), (0.1, 0.9)
        )
        prior = Normal(0.0, 0.2, -MOST_LEAN, MOST_LEAN)
        lean = EffectParameter("lean", "", "relative excess from smaller angles", prior, (0.0,))
        return cls((share, reach, lean), pairs)

    def further_parameters(self, n_elements: int) -> tuple[EffectParameter, ...]:
        return own_parameters(n_elements, EXCESS, SPREAD) if len(self.parameters) > 1 else ()

    def signal(self, recording: Recording, values: Values) -> FloatArray:
        leaks = values[0] * self._leaks(recording, *values[1:3]) * of_elements(values[3:])[:, None]
        return np.asarray(recording.signal + recording.signal @ leaks.astype(recording.signal.dtype).T)

    def _leaks(self, recording: Recording, reach: float = 0.0, lean: float = 0.0) -> FloatArray:
        """Weight (m, m) with which each element (row) reads each other element (column); 1 for a neighbour."""
        m = recording.signal.shape[1]
        if len(recording.element_place) > 1:
            leaks = np.zeros((m, m))
            leaks[tuple(np.array(self.neighbours).T)] = 1.0
            return leaks
        return _fading(tuple(recording.element_place[0].tolist()), reach, lean)


@lru_cache(maxsize=256)
def _fading(places: tuple[float, ...], reach: float, lean: float) -> FloatArray:
    """`Crosstalk._leaks` of elements on a line; a live reader asks for the same ones with every sample."""
    rank = np.argsort(np.argsort(places))
    steps = rank[:, None] - rank
    away = np.maximum(np.abs(steps) - 1, 0)
    out = np.where(steps == 0, 0.0, reach**away * (1 + lean * np.sign(steps)))
    out.setflags(write=False)
    return np.asarray(out)


@dataclass(frozen=True)
class ChannelLag(Effect):
    """A multiplexed amplifier does not settle fully: each channel holds a share of the channel scanned before it.

    Channels are scanned in the order of the table; the first one follows the last one of the previous scan. All
    earlier channels together have the weight `share`. With each step back the weight is smaller by the factor `carry`:
    `carry` is 0 if each channel starts from zero, equals `share` if one capacitor settles from channel to channel, and
    is negative if the amplifier rings. In the looser form the change of element e is 1 + `own_e` times this.

    Reference: P. Horowitz and W. Hill, The Art of Electronics (2015), on multiplexed converters.
    """

    parameters: tuple[EffectParameter, ...] = (
        EffectParameter("share", "", "share left of the channel before", Normal(0.0, 0.1), (0.001,), 0.0),
        EffectParameter("carry", "", "weight of a channel over that of the next one", Uniform(-0.8, 0.8), (0.1, -0.5)),
    )

    name: ClassVar[str] = "channel_lag"
    stage: ClassVar[Stage] = "element"
    summary: ClassVar[str] = "leak from the channel scanned before"

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        return cls() if setting.n_elements > 2 else None

    def further_parameters(self, n_elements: int) -> tuple[EffectParameter, ...]:
        return own_parameters(n_elements, EXCESS, SPREAD)

    def signal(self, recording: Recording, values: Values) -> FloatArray:
        share, carry, *own = values
        m = recording.signal.shape[1]
        # The weight of the channel k + 1 before is (1 - carry) carry^k, summed over all scans of this channel.
        before = (np.arange(m)[:, None] - np.arange(m) - 1) % m
        weight = (1 - carry) * carry**before / (1 - carry**m) - np.eye(m)
        weight = (share * weight * of_elements(own)[:, None]).astype(recording.signal.dtype)
        return np.asarray(recording.signal + recording.signal @ weight.T)


@dataclass(frozen=True)
class Proximity(Effect):
    """An element also responds to the distance of the probe: a broad bell over angle is added to the reading.

    This occurs in capacitive, thermal and optical elements. `share` is the height of the bell over the peak reading.
    The height grows with a power of the load, `load_power`: with 0 it does not depend on the load, with 1 it is
    proportional to the load.
    `tails` is the shape of the bell: the larger, the more slowly it decreases. In the looser form the response of
    element e is 1 + `own_e` times this, and the height also depends on the tip: it is `blunt` R/r_b more under a tip of
    composite radius R, as blunt tips have more surface near the element than an edge, for which R = 0.

    Reference: L. K. Baxter, Capacitive Sensors: Design and Applications (1997), on proximity and stray fields.
    """

    parameters: tuple[EffectParameter, ...]
    outer_mm: float

    name: ClassVar[str] = "proximity"
    stage: ClassVar[Stage] = "element"
    summary: ClassVar[str] = "broad response to the distance of the probe, added to the strain"
    mixes: ClassVar[bool] = False

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        if not setting.finger:
            return None
        widths = (17.5, 35.0, 70.0)
        return cls(
            (
                EffectParameter("share", "", "size over the peak reading", Normal(0.0, 0.1), (0.001,), 0.0),
                EffectParameter("width", "degree", "half width at half the height", LogNormal(35.0, 0.5), widths),
                EffectParameter("load_power", "", "power of the load", Uniform(0.0, 1.0), (0.0, 1.0)),
                TAILS,
            ),
            setting.radii_mm[1],
        )

    def further_parameters(self, n_elements: int) -> tuple[EffectParameter, ...]:
        what = "size under a flat over the peak reading, beyond that under an edge"
        blunt = EffectParameter("blunt", "", what, Normal(0.0, 0.1), (0.001,), 0.0)
        return (*own_parameters(n_elements, EXCESS, SPREAD), blunt)

    def signal(self, recording: Recording, values: Values) -> FloatArray:
        share, width, power, tails, *looser = values
        height: FloatArray | float = share
        if looser:
            height = share + looser.pop() * bluntness(recording.indenter_radius_mm, self.outer_mm)[:, None]
        turn = turned(recording.element_place[0] - recording.place[0][:, None])
        size = recording.peak * (np.maximum(recording.load, 0.0) / recording.reference_load)[:, None] ** power
        return np.asarray(recording.signal + height * of_elements(looser) * size * bell((turn / width) ** 2, tails))


def bluntness(indenter_radius_mm: FloatArray, outer_mm: float) -> FloatArray:
    """R/r_b = r_c/(r_c + r_b), (n,): 0 of an edge, 1 of a flat, and of a tip whose radius is not known."""
    return 1 - np.nan_to_num(outer_mm / (outer_mm + indenter_radius_mm))


def of_elements(own: Sequence[float]) -> FloatArray:
    """Share of each element over that of all, from the excess of each; one if none is given."""
    return 1 + np.array(own) if len(own) else np.ones(1)


def neighbours(setting: Setting) -> tuple[tuple[int, int], ...]:
    """Ordered pairs of neighbours: adjacent elements on a line, those within `NEAR_PITCHES` in the plane."""
    m = setting.n_elements
    if m < 2:
        return ()
    if len(setting.element_place) == 1:
        order = np.argsort(setting.element_place[0]).tolist()
        pairs = list(pairwise(order))
        return tuple(pairs + [(j, i) for i, j in pairs])
    distance = np.sqrt(sum((axis[:, None] - axis) ** 2 for axis in setting.element_place))
    np.fill_diagonal(distance, np.inf)
    near = distance <= NEAR_PITCHES * distance.min(axis=1, keepdims=True)
    return tuple((int(i), int(j)) for i, j in np.argwhere(near | near.T))
