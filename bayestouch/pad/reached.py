"""Which elements of a pad the calibration touches come near to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.chain.pad import element_pitch
from bayestouch.output.text import listed

# A touch presses an element if it is within this share of the pitch: then no other element of a line is nearer.
_PRESSED = 0.5


@dataclass(frozen=True, eq=False)
class Reached:
    """Distances of the elements of a pad from the touches.

    Attributes
    ----------
    nearest : (m,) array
        Distance of each element from the nearest touch, mm.
    pitch_mm : float
        Distance between neighbouring elements.
    """

    nearest: FloatArray
    pitch_mm: float

    @classmethod
    def of(cls, place: FloatArray, location: FloatArray) -> Reached:
        """Of elements at places (m, D) and touches at locations (t, D), mm."""
        distance = np.sqrt(((place[:, None] - location) ** 2).sum(axis=2))
        return cls(distance.min(axis=1), element_pitch(place, float(np.ptp(location, axis=0).max())))

    @property
    def pressed(self) -> BoolArray:
        """Whether a touch is within half a pitch, (m,)."""
        return np.asarray(self.nearest <= _PRESSED * self.pitch_mm)

    def sizes(self, signal: FloatArray, usable: BoolArray) -> FloatArray:
        """Signals (m,) that elements would have if all were pressed.

        Noise, and tails of kernels, say nothing of the gain: an element that is not pressed has at least the median of
        those that are. One that is pressed and reads little has the little that it reads.
        """
        near = self.pressed & usable
        if not near.any():
            return signal
        return np.where(self.pressed, signal, np.maximum(signal, np.median(signal[near])))

    def note(self, usable: BoolArray) -> str:
        """One sentence on the elements that are a pitch or more from all touches; empty if there are none.

        Such a touch is beyond the neighbours, and its reading is the tail of a kernel, if it is more than noise. A
        single element has no pitch.
        """
        missed = usable & (self.nearest > self.pitch_mm)
        names = [f"e{e + 1:02d}" for e in np.flatnonzero(missed)]
        if not names or len(missed) == 1:
            return ""
        of = "its gain and place follow" if len(names) == 1 else "their gains and places follow"
        return (
            f"no calibration touch comes within {self.pitch_mm:.3g} mm, the distance between elements, of "
            f"{listed(names)}: {of} from farther touches, or from the priors alone; touch the pad there, too"
        )
