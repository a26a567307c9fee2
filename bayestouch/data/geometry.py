"""`Geometry`: what the package reads from the geometry of a sensor, and the list of bodies."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

if TYPE_CHECKING:
    from bayestouch.array_types import FloatArray

#: Folder of each kind of body, by its name in `sensor.toml`. A new body needs a folder and a line here. The names are
#: strings, because the folders are in a higher layer; their modules are imported when they are needed.
BODIES = {"finger": "bayestouch.finger", "pad": "bayestouch.pad"}


class Geometry(Protocol):
    """Geometry of a sensor of any kind, and the names of its columns and keys in files.

    Attributes
    ----------
    kind : str
        Name in ``sensor.toml``.
    geometry_keys, required_keys : tuple of str
        Keys under ``[geometry]``, which are the arguments of the class, and those that must be given.
    elements_key : str
        Key with one value for each element.
    force_noise_key : str
        Key of the force sensor's standard deviation.
    template : str
        Text of ``[geometry]`` and ``[force_sensor]`` in a new ``sensor.toml``.
    all_location_columns, location_columns : tuple of str
        Columns of reference locations: of all sensors of the kind, and of this one.
    load_column, load_unit : str
        Column and unit of the load.
    reads_radius : bool
        Whether a touch gives the radius of its indenter.
    default_contact : str
        Name of the contact model; empty if the body needs none.
    """

    kind: ClassVar[str]
    geometry_keys: ClassVar[tuple[str, ...]]
    required_keys: ClassVar[tuple[str, ...]]
    elements_key: ClassVar[str]
    force_noise_key: ClassVar[str]
    template: ClassVar[str]
    all_location_columns: ClassVar[tuple[str, ...]]
    load_column: ClassVar[str]
    load_unit: ClassVar[str]
    reads_radius: ClassVar[bool]
    default_contact: ClassVar[str]

    @property
    def n_elements(self) -> int:
        """Number of elements."""
        ...

    @property
    def location_columns(self) -> tuple[str, ...]:
        """Columns of the touch table that contain the reference location."""
        ...

    def extent(self, place: FloatArray) -> tuple[float, float]:
        """Lowest and highest of some locations along one column, in its unit; NaN is left out."""
        ...

    def as_built(self) -> tuple[tuple[str, Any, str], ...]:
        """Return the rows (quantity, value, unit) of a table of the geometry; the value is None if unknown."""
        ...


@cache
def geometries() -> Mapping[str, type[Geometry]]:
    """Classes of the geometries by the names of the bodies; each is `GEOMETRY` in the body's `geometry.py`."""
    return {kind: import_module(f"{folder}.geometry").GEOMETRY for kind, folder in BODIES.items()}
