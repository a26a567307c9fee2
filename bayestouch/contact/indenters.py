"""Rigid indenters: what each imposes on the finger's surface.

All slopes are ``du_r/ds`` in mm per mm at arc length s from the contact's centre, positive to the right: how
fast the gap between the undeformed finger (radius r_b) and the indenter opens. The contact stages solve for
the pressure that gives this slope to the surface.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.contact.circle import circle_slope
from bayestouch.contact.hertz import composite_radius
from bayestouch.errors import InputError

Profile = Literal["parabola", "circle"]


@dataclass(frozen=True)
class Round:
    """A cylinder of radius ``radius_mm``, above zero."""

    radius_mm: float

    def __post_init__(self) -> None:
        if not 0 < self.radius_mm < np.inf:
            raise InputError(f"radius of a round indenter must be above zero and finite, got {self.radius_mm:g} mm")

    def composite_radius(self, outer_radius_mm: float) -> float:
        """R in mm, ``1/R = 1/r_b + 1/r_c``."""
        return float(composite_radius(self.radius_mm, outer_radius_mm))

    def profile_slope(self, s_mm: ArrayLike, outer_radius_mm: float, profile: Profile = "parabola") -> FloatArray:
        """Slope at arc length `s_mm`: ``s/R``, or that of the true circles; shape of `s_mm`."""
        return _round_slope(s_mm, self.composite_radius(outer_radius_mm), outer_radius_mm, profile)


@dataclass(frozen=True)
class Flat:
    """A flat plate: a round indenter of infinite radius."""

    radius_mm: float = np.inf

    def composite_radius(self, outer_radius_mm: float) -> float:
        """R in mm, which is ``r_b``."""
        return outer_radius_mm

    def profile_slope(self, s_mm: ArrayLike, outer_radius_mm: float, profile: Profile = "parabola") -> FloatArray:
        """Slope at arc length `s_mm`: ``s/r_b``, or that of the true finger circle; shape of `s_mm`."""
        return _round_slope(s_mm, outer_radius_mm, outer_radius_mm, profile)


@dataclass(frozen=True)
class Corner:
    """A corner pressed tip first, its bisector along the finger's normal; contact in
    `bayestouch.contact.corner`.

    Attributes
    ----------
    angle_deg : float
        Angle of the solid corner, 90 for the paper's.
    """

    angle_deg: float = 90.0
    radius_mm: float = 0.0

    def __post_init__(self) -> None:
        if not 0 < self.angle_deg < 180:
            raise InputError(f"angle of a corner must lie between 0 and 180 degrees, got {self.angle_deg:g}")

    @property
    def face_slope(self) -> float:
        """Rise over run m of the faces: 1 for 90°."""
        return float(1 / np.tan(np.radians(self.angle_deg / 2)))

    def composite_radius(self, outer_radius_mm: float) -> float:
        """R of the tip, 0 mm."""
        return 0.0

    def profile_slope(self, s_mm: ArrayLike, outer_radius_mm: float, profile: Profile = "parabola") -> FloatArray:
        """Slope ``m sign(s) + s/r_b``, or that of straight faces over the true circle; shape of `s_mm`."""
        s = np.asarray(s_mm, dtype=float)
        m = self.face_slope * np.sign(s)
        if profile == "parabola":
            return np.asarray(m + s / outer_radius_mm)
        sine, cosine = np.sin(s / outer_radius_mm), np.cos(s / outer_radius_mm)
        return np.asarray((sine + m * cosine) / (cosine - m * sine) ** 2)


@dataclass(frozen=True)
class KnifeEdge:
    """A line load: touches at one point, so its slope is infinite on either side and its spectrum 1."""

    radius_mm: float = 0.0

    def composite_radius(self, outer_radius_mm: float) -> float:
        """R, 0 mm."""
        return 0.0

    def profile_slope(self, s_mm: ArrayLike, outer_radius_mm: float, profile: Profile = "parabola") -> FloatArray:
        """Infinite, with the sign of `s_mm`; zero in the middle."""
        s = np.asarray(s_mm, dtype=float)
        return np.asarray(np.where(s == 0, 0.0, np.copysign(np.inf, s)))


Indenter = KnifeEdge | Corner | Round | Flat


def indenter_from_radius(indenter_radius_mm: float) -> Indenter:
    """Indenter of a touch table's radius: 0 mm is a knife edge, inf a flat; negative or NaN raises."""
    if indenter_radius_mm == 0:
        return KnifeEdge()
    return Flat() if indenter_radius_mm == np.inf else Round(indenter_radius_mm)


def _round_slope(s_mm: ArrayLike, composite_mm: float, outer_radius_mm: float, profile: Profile) -> FloatArray:
    s = np.asarray(s_mm, dtype=float)
    if profile == "parabola":
        return np.asarray(s / composite_mm)
    return circle_slope(s / outer_radius_mm, outer_radius_mm / composite_mm)
