"""Least-squares fits of many touches at once: the minimum that the paper's simplex finds one touch at a time.

The criterion is that of `bayestouch.paper.simplex.fit_touch`, ``Σ (D_i/gain_i - ε̂_i)²`` over R, θ_c and P. At a fixed
contact width (a fixed ``κ = P R/μ``) the strain is linear in P, so that P is solved for and two unknowns are left:
damped Gauss-Newton on the projected residual, all touches in step. A contact sharper than an edge or blunter
than a flat is held there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.contact import indenter_radius
from bayestouch.paper.simplex import TouchPredictor

FloatArray = NDArray[np.float64]

START_SHARES = (0.02, 0.15, 0.35, 0.65, 0.95)  # of r_b
START_STEP_DEG, START_MARGIN_DEG = 2.0, 20.0
ROUNDS = 60
# Steps in mm and rad: of the differences, the longest taken, and those that end the search; and a damping that does.
DIFFERENCES = (0.02, 1e-3)
LONGEST = (2.0, 0.05)
SETTLED = (1e-5, 1e-7)
GIVE_UP = 1e6
TINY = 1e-12


@dataclass(frozen=True, eq=False)
class ContactEstimates:
    """Fitted contacts of t touches.

    Attributes
    ----------
    composite_radius_mm, angle_deg, load : (t,) arrays
        R (0 an edge, r_b a flat), θ_c, P in N/m.
    outer_radius_mm : float
        ``r_b``.
    """

    composite_radius_mm: FloatArray
    angle_deg: FloatArray
    load: FloatArray
    outer_radius_mm: float

    @property
    def indenter_radius_mm(self) -> FloatArray:
        """r_c, (t,); inf where R is that of a flat."""
        return indenter_radius(self.composite_radius_mm, self.outer_radius_mm)


def fit_many_touches(finger: TouchPredictor, readings: ArrayLike) -> ContactEstimates:
    """Fit R, θ_c and P of every touch.

    Parameters
    ----------
    finger : FingerModel
        Calibrated finger whose contact is a function of ``P R/μ`` (every named contact model), without offsets.
    readings : (t, m) array_like
        Readings, rest reading subtracted, none missing.
    """
    data = np.asarray(readings, dtype=float) / finger.gain
    width, angle = _start(finger, data)
    load = np.empty(len(data))
    active, damping = np.arange(len(data)), np.full(len(data), 1e-3)
    for _ in range(ROUNDS):
        if not active.size:
            break
        step = _Step.of(finger, data[active], width[active], angle[active], damping[active])
        width[active], angle[active], load[active] = step.width, step.angle, step.load
        damping[active] *= np.where(step.better, 0.2, 5.0)
        active = active[~(step.settled | (damping[active] > GIVE_UP))]
    radius = np.minimum(width * (finger.largest_load / 2) / load, finger.outer_radius_mm)
    return ContactEstimates(radius, np.degrees(angle), load, finger.outer_radius_mm)


@dataclass(frozen=True, eq=False)
class _Step:
    """One damped Gauss-Newton step of every touch; R under half the largest load stands for κ."""

    width: FloatArray
    angle: FloatArray
    load: FloatArray
    better: NDArray[np.bool_]
    settled: NDArray[np.bool_]

    @classmethod
    def of(
        cls, finger: TouchPredictor, data: FloatArray, width: FloatArray, angle: FloatArray, damping: FloatArray
    ) -> _Step:
        end = 2 * finger.outer_radius_mm  # of the finger's table
        load, residual = _projected(finger, data, width, angle)
        aside = np.where(width + DIFFERENCES[0] < end, DIFFERENCES[0], -DIFFERENCES[0])
        by_width = (residual - _projected(finger, data, width + aside, angle)[1]) / aside[:, None]
        by_angle = (residual - _projected(finger, data, width, angle + DIFFERENCES[1])[1]) / DIFFERENCES[1]
        a, b, c = (by_width**2).sum(axis=1), (by_width * by_angle).sum(axis=1), (by_angle**2).sum(axis=1)
        g, h = (by_width * residual).sum(axis=1), (by_angle * residual).sum(axis=1)
        # where readings do not depend on the width at all it stays
        a, c = a * (1 + damping) + TINY * (data**2).sum(axis=1), c * (1 + damping)
        move = (c * g - b * h) / (a * c - b * b)
        held = ((width <= 0) & (move < 0)) | ((width >= end) & (move > 0))
        turn = np.where(held, h / c, (a * h - b * g) / (a * c - b * b))
        new_width = np.where(held, width, np.clip(width + np.clip(move, -LONGEST[0], LONGEST[0]), 0.0, end))
        new_angle = angle + np.clip(turn, -LONGEST[1], LONGEST[1])
        new_load, new_residual = _projected(finger, data, new_width, new_angle)
        better = (new_residual**2).sum(axis=1) <= (residual**2).sum(axis=1)
        return cls(
            width=np.where(better, new_width, width),
            angle=np.where(better, new_angle, angle),
            load=np.where(better, new_load, load),
            better=better,
            settled=(np.abs(new_width - width) < SETTLED[0]) & (np.abs(new_angle - angle) < SETTLED[1]),
        )


def _projected(
    finger: TouchPredictor, data: FloatArray, width: FloatArray, angle: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Best load of each touch, and what it leaves over."""
    half = finger.largest_load / 2
    unit = finger.predict(width, angle, np.full(len(width), half)) / finger.gain / half
    best = (unit * data).sum(axis=1) / (unit**2).sum(axis=1)
    # where R would exceed that of a flat: the load that just keeps it there
    load = np.maximum(np.maximum(best, 1e-9 * half), half * width / finger.outer_radius_mm)
    return load, data - load[:, None] * unit


def _start(finger: TouchPredictor, data: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Nearest touch of a grid: R under half the largest load (mm), and θ_c in rad."""
    margin = np.radians(START_MARGIN_DEG)
    line = np.arange(finger.angle.min() - margin, finger.angle.max() + margin, np.radians(START_STEP_DEG))
    shares = np.array(START_SHARES) * finger.outer_radius_mm
    width, angle = (grid.ravel() for grid in np.meshgrid(shares, line, indexing="ij"))
    unit = finger.predict(width, angle, np.full(len(width), finger.largest_load / 2)) / finger.gain
    best = np.argmax((data @ unit.T) / np.sqrt((unit**2).sum(axis=1)), axis=1)
    return width[best], angle[best]
