"""Rigid tips: wedges of a half-angle with a round nose, blades (half-angle zero) and flats."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Tip:
    """Rigid tip: signed distance from its surface.

    Attributes
    ----------
    radius : float
        Of the nose, mm; inf for a flat.
    half_angle_deg : float
        Between the flanks and the direction of the load: 0 for a blade as thick as its nose, 45 for a right angle.
    """

    radius: float
    half_angle_deg: float = 0.0

    def _places(self, x: np.ndarray, nose: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """From the nose's centre (2, n), along the flank and off it (n,)."""
        away = np.stack([x[0] - nose - self.radius, x[1]])
        flank = np.radians(self.half_angle_deg)
        along = np.cos(flank) * away[0] + np.sin(flank) * away[1]
        return away, along, np.cos(flank) * away[1] - np.sin(flank) * away[0]

    def gap(self, x: np.ndarray, nose: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Distance (n,), its gradient (2, n) and the curvature of its level lines (n,) at points x (2, n), y >= 0.

        The lowest point of the tip is at (nose, 0).
        """
        if np.isinf(self.radius):
            normal = np.zeros_like(x)
            normal[0] = -1.0
            return nose - x[0], normal, np.zeros(x.shape[1:])
        away, along, beside = self._places(x, nose)
        flank = np.radians(self.half_angle_deg)
        off = away - np.maximum(along, 0) * np.array([np.cos(flank), np.sin(flank)])[:, None]
        distance = np.maximum(np.hypot(*off), 1e-12)
        sign = np.where((along > 0) & (beside < 0), -1.0, 1.0)  # the middle plane of a blade: never reached
        return sign * distance - self.radius, sign * off / distance, np.where(along > 0, 0.0, 1 / distance)

    def arc(self, x: np.ndarray, nose: float) -> np.ndarray:
        """Place along the tip's surface (n,), mm from its lowest point, of the nearest point of the tip."""
        if np.isinf(self.radius):
            return x[1]
        away, along, _ = self._places(x, nose)
        quarter = self.radius * (np.pi / 2 - np.radians(self.half_angle_deg))
        return np.where(along > 0, quarter + along, self.radius * np.arctan2(away[1], -away[0]))
