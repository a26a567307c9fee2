"""The sensor as built: body, rubber, force sensor, unit of the readings, source of the data.

Reading and writing `sensor.toml` is in `bayestouch.data.sensor_toml`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from bayestouch.data.checked import checked_number, checked_positive, checked_text
from bayestouch.data.finger import Finger
from bayestouch.data.geometry import Geometry
from bayestouch.data.pad import Pad
from bayestouch.errors import InputError, shown
from bayestouch.output.summary import Summarised, fields_in_short
from bayestouch.output.text import number, plural

__all__ = ["Finger", "Pad", "Rubber", "Sensor", "finger_of", "pad_of"]


@dataclass(frozen=True, repr=False)
class Rubber(Summarised):
    """Nominal elastic constants; None if unknown (the prior is then wide).

    Parameters
    ----------
    shear_modulus_MPa : float or None
        μ, above zero.
    poisson_ratio : float or None
        σ of the paper, 0 to 0.5.

    Examples
    --------
    >>> import bayestouch
    >>> bayestouch.Rubber(shear_modulus_MPa=0.15, poisson_ratio=0.46)
    Rubber(shear_modulus_MPa=0.15, poisson_ratio=0.46)
    """

    shear_modulus_MPa: float | None = None
    poisson_ratio: float | None = None

    def __post_init__(self) -> None:
        if self.shear_modulus_MPa is not None:
            object.__setattr__(self, "shear_modulus_MPa", checked_positive(self.shear_modulus_MPa, "shear_modulus_MPa"))
        if self.poisson_ratio is not None:
            ratio = checked_number(self.poisson_ratio, "poisson_ratio")
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
        The geometry, or that of another body, see `bayestouch.data.geometry.Geometry`.
    rubber : Rubber
    force_noise_sd : float or None
        Standard deviation of the force sensor, N/m on a finger and N on a pad; None unknown.
    reading_unit, reading_quantity : str
        Unit and quantity of the readings, empty if not stated.
    source : mapping of str to str
        Origin of the data; free text that every report repeats.
    extra : mapping
        Keys and tables of `sensor.toml` that this package does not use; they are kept and written again.
    notes : tuple of str
        Irregularities that were corrected while reading, for the report. Not used in comparisons.

    Raises
    ------
    InputError
        A value has the wrong type, or the noise is not above zero.

    Examples
    --------
    >>> import bayestouch
    >>> finger = bayestouch.Finger(9.4, 12.7, 9.9, element_angles_deg=(-8.8, 0.0, 8.8))
    >>> sensor = bayestouch.Sensor("my finger", finger, bayestouch.Rubber(0.15, 0.46), force_noise_sd=1.0)
    >>> sensor.n_elements, sensor.force_noise_sd
    (3, 1.0)
    """

    name: str
    body: Geometry
    rubber: Rubber = field(default_factory=Rubber)
    force_noise_sd: float | None = None
    reading_unit: str = ""
    reading_quantity: str = ""
    source: Mapping[str, str] = field(default_factory=dict)
    extra: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = field(default=(), compare=False)

    def __post_init__(self) -> None:
        checked_text(self.name, "name")
        checked_text(self.reading_unit, "unit")
        checked_text(self.reading_quantity, "quantity")
        # The class of a geometry names its kind; bodies of other packages have classes of their own.
        if not isinstance(getattr(type(self.body), "kind", None), str):
            raise InputError(f"expected a Finger or a Pad, got {shown(self.body)}", column="body")
        if not isinstance(self.rubber, Rubber):
            raise InputError(f"expected a Rubber, got {shown(self.rubber)}", column="rubber")
        for name, given in (("source", self.source), ("extra", self.extra)):
            if not isinstance(given, Mapping):
                raise InputError(f"expected a dict, got {shown(given)}", column=name)
        for key, value in self.source.items():
            checked_text(value, f"source.{key}")
        if not isinstance(self.notes, tuple):
            raise InputError(f"expected a tuple of text, got {shown(self.notes)}", column="notes")
        if self.force_noise_sd is not None:
            noise = checked_positive(self.force_noise_sd, self.body.force_noise_key)
            object.__setattr__(self, "force_noise_sd", noise)

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


def finger_of(sensor: Sensor, what: str = "this") -> Finger:
    """Return the geometry of a finger; raises an error for a pad.

    Parameters
    ----------
    sensor : Sensor
    what : str
        Name of the function that is for fingers only, for the message.

    Raises
    ------
    InputError
        The sensor is not a finger.
    """
    if not isinstance(sensor.body, Finger):
        raise InputError(f"{what} is offered for fingers; this sensor is a {sensor.body.kind}")
    return sensor.body


def pad_of(sensor: Sensor, what: str = "this") -> Pad:
    """Return the geometry of a pad; raises an error for a finger (see `finger_of`)."""
    if not isinstance(sensor.body, Pad):
        raise InputError(f"{what} is offered for pads; this sensor is a {sensor.body.kind}")
    return sensor.body
