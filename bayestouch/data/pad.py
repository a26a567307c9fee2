"""Geometry of a pad, and the names of its columns and keys in files.

`bayestouch.data.finger` has the same attributes for a finger.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.checked import checked_numbers, checked_positive
from bayestouch.errors import InputError
from bayestouch.output.summary import Summarised

# When the data set is read, a length of 0 is an error that names key and line, so that no length is forgotten.
_TEMPLATE = """\
[geometry]                  # every 0 must be replaced: lengths in mm
element_x_mm = []           # {elements} places, in the order of the columns {columns}
# element_y_mm = []         # the same across; leave out for elements in a line
# thickness_mm = 0          # of the rubber
# depth_mm = 0              # of the elements under the surface

[force_sensor]              # measures the load of each touch; leave out what you do not know
# noise_sd_N = 0.01         # standard deviation of one reading of the load
"""


@dataclass(frozen=True, repr=False)
class Pad(Summarised):
    """A flat layer of rubber over elements in a line (1-D) or in the plane (2-D).

    Parameters
    ----------
    element_x_mm : tuple of float, shape (n_elements,)
    element_y_mm : tuple of float, shape (n_elements,), or None
        None for elements in a line.
    thickness_mm : float or None
        Thickness of the layer, above zero; None unknown.
    depth_mm : float or None
        Depth of the elements under the surface, above zero and at most the thickness; None unknown.

    Raises
    ------
    InputError
        A value is not a finite number, lengths differ, or the elements lie below the layer.

    Examples
    --------
    >>> import bayestouch
    >>> pad = bayestouch.Pad((0.0, 6.0, 12.0), thickness_mm=6.0)
    >>> pad.n_elements, pad.places_mm["x"]
    (3, (0.0, 6.0, 12.0))
    """

    element_x_mm: tuple[float, ...]
    element_y_mm: tuple[float, ...] | None = None
    thickness_mm: float | None = None
    depth_mm: float | None = None

    internal: ClassVar[frozenset[str]] = frozenset(
        {"all_location_columns", "as_built", "default_contact", "elements_key", "force_noise_key", "geometry_keys"}
        | {"load_column", "location_columns", "reads_radius", "required_keys", "template"}
    )
    kind: ClassVar[str] = "pad"
    geometry_keys: ClassVar[tuple[str, ...]] = ("element_x_mm", "element_y_mm", "thickness_mm", "depth_mm")
    required_keys: ClassVar[tuple[str, ...]] = ("element_x_mm",)
    elements_key: ClassVar[str] = "element_x_mm"
    force_noise_key: ClassVar[str] = "noise_sd_N"
    template: ClassVar[str] = _TEMPLATE
    all_location_columns: ClassVar[tuple[str, ...]] = ("x_mm", "y_mm")
    load_column: ClassVar[str] = "load_N"
    load_unit: ClassVar[str] = "N"
    reads_radius: ClassVar[bool] = False
    default_contact: ClassVar[str] = ""

    def __post_init__(self) -> None:
        x = checked_numbers(self.element_x_mm, "element_x_mm")
        y = None if self.element_y_mm is None else checked_numbers(self.element_y_mm, "element_y_mm")
        if y is not None and len(y) != len(x):
            raise InputError(f"expected {len(x)} values as in element_x_mm, got {len(y)}", column="element_y_mm")
        thickness = None if self.thickness_mm is None else checked_positive(self.thickness_mm, "thickness_mm")
        depth = None if self.depth_mm is None else checked_positive(self.depth_mm, "depth_mm")
        if thickness is not None and depth is not None and depth > thickness:
            raise InputError(
                f"expected elements within the layer of {thickness!r} mm, got {depth!r}", column="depth_mm"
            )
        object.__setattr__(self, "element_x_mm", x)
        object.__setattr__(self, "element_y_mm", y)
        object.__setattr__(self, "thickness_mm", thickness)
        object.__setattr__(self, "depth_mm", depth)

    @property
    def n_elements(self) -> int:
        """Number of elements."""
        return len(self.element_x_mm)

    @property
    def dimensions(self) -> int:
        """1 for elements in a line, 2 in the plane."""
        return 1 if self.element_y_mm is None else 2

    @property
    def location_columns(self) -> tuple[str, ...]:
        """Columns of the touch table that contain the reference location."""
        return self.all_location_columns[: self.dimensions]

    def extent(self, place_mm: FloatArray) -> tuple[float, float]:
        """Lowest and highest of some coordinates, mm; NaN is left out."""
        return float(np.nanmin(place_mm)), float(np.nanmax(place_mm))

    @property
    def places_mm(self) -> dict[str, tuple[float, ...]]:
        """Design positions of the elements by coordinate: ``x``, and ``y`` in the plane."""
        return {"x": self.element_x_mm} | ({} if self.element_y_mm is None else {"y": self.element_y_mm})

    def as_built(self) -> tuple[tuple[str, Any, str], ...]:
        """Return the rows (quantity, value, unit) of a table of the geometry; the value is None if unknown."""
        rows: list[tuple[str, Any, str]] = [
            ("thickness", self.thickness_mm, "mm"),
            ("depth of the elements", self.depth_mm, "mm"),
        ]
        for axis, places in self.places_mm.items():
            rows += [(f"elements from {axis} =", min(places), "mm"), (f"to {axis} =", max(places), "mm")]
        return tuple(rows)
