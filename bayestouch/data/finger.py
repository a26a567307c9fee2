"""Geometry of a finger, and the names of its columns and keys in files.

`bayestouch.data.pad` has the same attributes for a pad.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.arrays import nearest_turn
from bayestouch.data.checked import checked_numbers, checked_positive
from bayestouch.errors import InputError
from bayestouch.output.summary import Summarised

# Rounding of a gap between elements, degree: elements at even angles all around have no largest gap.
ROUNDING = 1e-6

# When the data set is read, a length of 0 is an error that names key and line, so that no length is forgotten.
_TEMPLATE = """\
[geometry]                  # every 0 must be replaced: lengths in mm, angles in degree
core_radius_mm = 0          # r_a: the rigid core under the rubber
outer_radius_mm = 0         # r_b: the surface that is touched
sensing_radius_mm = 0       # r_s: where the elements lie, between the two (as designed; it is calibrated)
element_angles_deg = []     # theta_s: {elements} angles, in the order of the columns {columns}

[force_sensor]              # measures the load of each touch; leave out what you do not know
# noise_sd_N_per_m = 1.0    # standard deviation of one reading of the load
"""


@dataclass(frozen=True, repr=False)
class Finger(Summarised):
    """A rigid cylindrical core with a bonded layer of rubber; elements at one depth measure radial strain.

    Parameters
    ----------
    core_radius_mm, outer_radius_mm : float
        r_a and r_b, 0 < r_a < r_b.
    sensing_radius_mm : float
        Design radius r_s of the elements, r_a < r_s < r_b.
    element_angles_deg : tuple of float, shape (n_elements,)
        Design angles θ_s, positive in the sense of `angle_deg` of the touch table.

    Raises
    ------
    InputError
        A value is not a finite number, or the radii are not in order.

    Examples
    --------
    >>> import bayestouch
    >>> finger = bayestouch.Finger(9.4, 12.7, 9.9, element_angles_deg=(-8.8, 0.0, 8.8))
    >>> finger.n_elements, finger.pitch_deg
    (3, 8.8)
    """

    core_radius_mm: float
    outer_radius_mm: float
    sensing_radius_mm: float
    element_angles_deg: tuple[float, ...]

    internal: ClassVar[frozenset[str]] = frozenset(
        {"all_location_columns", "as_built", "default_contact", "elements_key", "force_noise_key", "geometry_keys"}
        | {"load_column", "location_columns", "reads_radius", "required_keys", "template"}
    )
    kind: ClassVar[str] = "finger"
    geometry_keys: ClassVar[tuple[str, ...]] = (
        "core_radius_mm",
        "outer_radius_mm",
        "sensing_radius_mm",
        "element_angles_deg",
    )
    required_keys: ClassVar[tuple[str, ...]] = geometry_keys
    elements_key: ClassVar[str] = "element_angles_deg"
    force_noise_key: ClassVar[str] = "noise_sd_N_per_m"
    template: ClassVar[str] = _TEMPLATE
    all_location_columns: ClassVar[tuple[str, ...]] = ("angle_deg",)
    load_column: ClassVar[str] = "load_N_per_m"
    load_unit: ClassVar[str] = "N/m"
    reads_radius: ClassVar[bool] = True
    default_contact: ClassVar[str] = "layer"

    def __post_init__(self) -> None:
        core = checked_positive(self.core_radius_mm, "core_radius_mm")
        outer = checked_positive(self.outer_radius_mm, "outer_radius_mm")
        sensing = checked_positive(self.sensing_radius_mm, "sensing_radius_mm")
        if core >= outer:
            raise InputError(
                f"expected a core smaller than the outer radius {outer!r} mm, got {core!r}",
                column="core_radius_mm",
            )
        if not core < sensing < outer:
            raise InputError(
                f"expected a radius between core and outer, {core!r} and {outer!r} mm, got {sensing!r}",
                column="sensing_radius_mm",
            )
        angles = _in_a_row(checked_numbers(self.element_angles_deg, "element_angles_deg"))
        object.__setattr__(self, "core_radius_mm", core)
        object.__setattr__(self, "outer_radius_mm", outer)
        object.__setattr__(self, "sensing_radius_mm", sensing)
        object.__setattr__(self, "element_angles_deg", angles)

    @property
    def n_elements(self) -> int:
        """Number of elements."""
        return len(self.element_angles_deg)

    @property
    def location_columns(self) -> tuple[str, ...]:
        """Columns of the touch table that contain the reference location."""
        return self.all_location_columns

    @property
    def pitch_deg(self) -> float | None:
        """Median angle between neighbouring elements, degree; None for one element.

        The largest gap around the circle does not count: there the row of elements ends.
        """
        return float(np.median(np.diff(np.sort(self.element_angles_deg)))) if self.n_elements > 1 else None

    def near(self, angle_deg: FloatArray) -> FloatArray:
        """Angles in degree, with as many whole turns added as bring them nearest to the middle of the elements."""
        return nearest_turn(angle_deg, 0.5 * (min(self.element_angles_deg) + max(self.element_angles_deg)))

    def extent(self, angle_deg: FloatArray) -> tuple[float, float]:
        """Lowest and highest of some angles, degree, with the circle cut at the largest gap between them.

        -30 to 30 and 330 to 30 are the same range. NaN is left out.
        """
        row = _in_a_row(tuple(angle_deg[np.isfinite(angle_deg)].tolist()))
        low, high = min(row), max(row)
        middle = np.array([0.5 * (low + high)])
        turns = float((self.near(middle) - middle)[0])
        return low + turns, high + turns

    def as_built(self) -> tuple[tuple[str, Any, str], ...]:
        """Return the rows (quantity, value, unit) of a table of the geometry; the value is None if unknown."""
        pitch = self.pitch_deg
        arc = None if pitch is None else round(float(np.radians(pitch)) * self.outer_radius_mm, 3)
        return (
            ("core radius r_a", self.core_radius_mm, "mm"),
            ("sensing radius r_s, design", self.sensing_radius_mm, "mm"),
            ("outer radius r_b", self.outer_radius_mm, "mm"),
            ("angle between neighbouring elements", pitch, "degree"),
            ("the same along the surface", arc, "mm"),
        )


def _in_a_row(angles: tuple[float, ...]) -> tuple[float, ...]:
    """Angles in degree with whole turns added, so that the row of elements ends at the largest gap around the circle.

    Elements at 170 and -170 are 20 degrees apart, whatever turn their angles are stated in: -170 becomes 190. Angles
    whose largest gap is at their ends already are unchanged.
    """
    ordered = np.sort(angles)
    if len(angles) < 2:
        return angles
    # Halves, as the difference of the largest numbers there are is infinite.
    if 0.5 * ordered[-1] - 0.5 * ordered[0] >= 180:
        # Twice, as 360 is what rounding makes of an angle just below zero.
        angles = tuple(float(each % 360 % 360) for each in angles)
        ordered = np.sort(angles)
    gaps = np.diff(ordered)
    if gaps.max() <= 360 - (ordered[-1] - ordered[0]) + ROUNDING:
        return angles
    last = ordered[int(np.argmax(gaps))]
    row = [each + 360 * (each <= last) for each in angles]
    turn = 360 if 0.5 * (min(row) + max(row)) > 180 else 0
    return tuple(float(each - turn) for each in row)
