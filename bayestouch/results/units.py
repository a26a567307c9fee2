"""Units of the variables of posterior files: those of the parameters, as plots show them, and of derived quantities."""

from __future__ import annotations

from collections.abc import Iterable

from bayestouch.data.sensor import Sensor
from bayestouch.priors.parameters import Parameter

# Units of quantities that are no parameters. {r} is the unit of the readings, {l} that of the load. A finger's gain
# follows from its parameters; strain has no unit, and is named all the same, since a pad's gain is per load.
_DERIVED = {
    "r_c": "mm",
    "R": "mm",
    "theta_c": "degree",
    "x": "mm",
    "y": "mm",
    "load": "{l}",
    "force_sd": "{l}",
    "gain": "{r}/strain",
    "noise_sd": "{r}",
    "discrepancy_sd": "{r}",
    "tactile_sd": "{r}",
    "reading": "{r}",
    "predicted": "{r}",
    "sd": "{r}",
    "rest_reading": "{r}",
    "effect_peak": "{r}",
    "effect_zero": "{r}",
    "location_theta_c": "degree",
    "location_x": "mm",
    "location_y": "mm",
    "radius_mm": "mm",
    "map_origin": "mm",
    "map_step": "mm",
    "map_low": "mm",
    "map_high": "mm",
    "map_offset": "{r}",
    "map_offset_variance": "({r})^2",
    "map_sensitivity": "{r}/{l}",
    "map_variance": "({r}/{l})^2",
    "map_covariance": "({r})^2/{l}",
}


def units_of(parameters: Iterable[Parameter], sensor: Sensor) -> dict[str, str]:
    """Unit by name of a variable; what is not in it has none (a number, a count, a logarithm).

    Parameters
    ----------
    parameters : iterable of Parameter
        Unknowns of the result. Their units are those that plots show.
    sensor : Sensor
        Its readings and loads have these units.
    """
    reading, load = sensor.reading_unit, sensor.body.load_unit
    derived = {name: unit.format(r=reading or "reading", l=load) for name, unit in _DERIVED.items()}
    if not reading:
        derived |= {name: "" for name, unit in _DERIVED.items() if unit == "{r}"}
    return derived | {parameter.name: parameter.unit for parameter in parameters}


def unit_of_gain(sensor: Sensor) -> str:
    """Unit of the gain of a finger's elements, reading per unit of compressive strain: ``counts/strain``."""
    return units_of((), sensor)["gain"]
