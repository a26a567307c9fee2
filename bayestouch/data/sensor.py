"""The sensor as built: body, rubber, force sensor, unit of the readings, source of the data.

Reading and writing `sensor.toml` is in `bayestouch.data.sensor_toml`.
"""

from __future__ import annotations

import math
import numbers
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

from bayestouch.errors import InputError, shown
from bayestouch.output.summary import Summarised, fields_in_short
from bayestouch.output.text import number, plural


def _number(value: object, column: str) -> float:
    # bool is a number to Python, and `true` in a radius is a mistake.
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise InputError(f"expected a number, got {shown(value)}", column=column)
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise InputError(f"expected a finite number, got {shown(value)}", column=column)
    return number


def _positive(value: object, column: str) -> float:
    number = _number(value, column)
    if number <= 0:
        raise InputError(f"expected a number above zero, got {number!r}", column=column)
    return number


def _numbers(values: object, column: str) -> tuple[float, ...]:
    if isinstance(values, str | bytes | Mapping) or not isinstance(values, Iterable):
        raise InputError(f"expected an array of numbers, got {shown(values)}", column=column)
    numbers_ = tuple(_number(value, f"{column}[{i}]") for i, value in enumerate(values))
    if not numbers_:
        raise InputError("expected one number for each element, got none", column=column)
    return numbers_


def _text(value: object, column: str) -> str:
    if not isinstance(value, str):
        raise InputError(f"expected text, got {shown(value)}", column=column)
    return value


@dataclass(frozen=True, repr=False)
class Finger(Summarised):
    """A rigid cylindrical core with a bonded layer of rubber; elements at one depth, read as radial strain.

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
    """

    core_radius_mm: float
    outer_radius_mm: float
    sensing_radius_mm: float
    element_angles_deg: tuple[float, ...]

    kind: ClassVar[str] = "finger"
    elements_key: ClassVar[str] = "element_angles_deg"
    location_columns: ClassVar[tuple[str, ...]] = ("angle_deg",)
    load_column: ClassVar[str] = "load_N_per_m"
    load_unit: ClassVar[str] = "N/m"

    def __post_init__(self) -> None:
        core = _positive(self.core_radius_mm, "core_radius_mm")
        outer = _positive(self.outer_radius_mm, "outer_radius_mm")
        sensing = _positive(self.sensing_radius_mm, "sensing_radius_mm")
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
        object.__setattr__(self, "core_radius_mm", core)
        object.__setattr__(self, "outer_radius_mm", outer)
        object.__setattr__(self, "sensing_radius_mm", sensing)
        object.__setattr__(self, "element_angles_deg", _numbers(self.element_angles_deg, "element_angles_deg"))

    @property
    def n_elements(self) -> int:
        """Number of elements."""
        return len(self.element_angles_deg)


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
    """

    element_x_mm: tuple[float, ...]
    element_y_mm: tuple[float, ...] | None = None
    thickness_mm: float | None = None
    depth_mm: float | None = None

    kind: ClassVar[str] = "pad"
    elements_key: ClassVar[str] = "element_x_mm"
    load_column: ClassVar[str] = "load_N"
    load_unit: ClassVar[str] = "N"

    def __post_init__(self) -> None:
        x = _numbers(self.element_x_mm, "element_x_mm")
        y = None if self.element_y_mm is None else _numbers(self.element_y_mm, "element_y_mm")
        if y is not None and len(y) != len(x):
            raise InputError(f"expected {len(x)} values as in element_x_mm, got {len(y)}", column="element_y_mm")
        thickness = None if self.thickness_mm is None else _positive(self.thickness_mm, "thickness_mm")
        depth = None if self.depth_mm is None else _positive(self.depth_mm, "depth_mm")
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
        """Columns of the touch table that hold the reference location."""
        return ("x_mm",) if self.element_y_mm is None else ("x_mm", "y_mm")


@dataclass(frozen=True, repr=False)
class Rubber(Summarised):
    """Nominal elastic constants; None where they are not known (the prior is then wide).

    Parameters
    ----------
    shear_modulus_MPa : float or None
        μ, above zero.
    poisson_ratio : float or None
        σ of the paper, 0 to 0.5.
    """

    shear_modulus_MPa: float | None = None
    poisson_ratio: float | None = None

    def __post_init__(self) -> None:
        if self.shear_modulus_MPa is not None:
            object.__setattr__(self, "shear_modulus_MPa", _positive(self.shear_modulus_MPa, "shear_modulus_MPa"))
        if self.poisson_ratio is not None:
            ratio = _number(self.poisson_ratio, "poisson_ratio")
            if not 0 <= ratio <= 0.5:
                raise InputError(f"expected a ratio from 0 to 0.5, got {ratio!r}", column="poisson_ratio")
            object.__setattr__(self, "poisson_ratio", ratio)


@dataclass(frozen=True, repr=False)
class Sensor(Summarised):
    """A sensor as built.

    Parameters
    ----------
    name : str
    body : Finger or Pad
    rubber : Rubber
    force_noise_sd : float or None
        Standard deviation of the force sensor, N/m on a finger and N on a pad; None unknown.
    reading_unit, reading_quantity : str
        Unit and quantity of the readings, empty where not stated.
    source : mapping of str to str
        Where the data come from; free text, carried into every report.
    extra : mapping
        Keys and tables of `sensor.toml` that are not used here; kept and written back.
    notes : tuple of str
        What the reader of the file handled; for the report. Not compared.

    Raises
    ------
    InputError
        A value has the wrong type, or the noise is not above zero.
    """

    name: str
    body: Finger | Pad
    rubber: Rubber = field(default_factory=Rubber)
    force_noise_sd: float | None = None
    reading_unit: str = ""
    reading_quantity: str = ""
    source: Mapping[str, str] = field(default_factory=dict)
    extra: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = field(default=(), compare=False)

    def __post_init__(self) -> None:
        _text(self.name, "name")
        _text(self.reading_unit, "unit")
        _text(self.reading_quantity, "quantity")
        if self.force_noise_sd is not None:
            column = "noise_sd_N_per_m" if isinstance(self.body, Finger) else "noise_sd_N"
            object.__setattr__(self, "force_noise_sd", _positive(self.force_noise_sd, column))

    @property
    def finger(self) -> Finger:
        """The body, where it is a finger."""
        assert isinstance(self.body, Finger)
        return self.body

    @property
    def n_elements(self) -> int:
        """Number of elements."""
        return self.body.n_elements

    @property
    def in_short(self) -> str:
        """Name, body and number of elements."""
        return f"{self.name[:60]!r}: a {self.body.kind} of {plural(self.n_elements, 'element')}"

    def summary_lines(self) -> list[str]:
        """Lines of the ``repr``."""
        noise = "" if self.force_noise_sd is None else f"± {number(self.force_noise_sd)} {self.body.load_unit}"
        quantity = " ".join(filter(None, [self.reading_quantity, self.reading_unit])) or "no unit stated"
        lines = [f"Sensor {self.in_short}", fields_in_short(self.body), fields_in_short(self.rubber)]
        return [*lines, f"force sensor {noise or 'not stated'}; readings: {quantity[:60]}"]
