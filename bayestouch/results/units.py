"""Units of the variables of posterior files: those of the parameters, as plots show them, and of derived quantities."""

from __future__ import annotations

from bayestouch.results.data import CalibrationData, PosteriorsData

# Units of quantities that are no parameters. {r} is the unit of the readings, {l} that of the load. A finger's gain
# follows from its parameters; strain has no unit, and is named all the same, since a pad's gain is per load. The noise
# of the force sensor is in the unit of the force sensor, {f}.
_DERIVED = {
    "r_c": "mm",
    "R": "mm",
    "theta_c": "degree",
    "x": "mm",
    "y": "mm",
    "load": "{l}",
    "force_sd": "{f}",
    "load_scatter": "{l}",
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
    "map_shared": "{r}/{l}",
    "map_by_effect": "{r}/{l}",
    "map_offset_by_effect": "{r}",
    "map_loads": "{l}",
    "map_by_load": "{r}/{l}",
    "map_variance_by_load": "({r}/{l})^2",
}


def units_of(result: CalibrationData | PosteriorsData) -> dict[str, str]:
    """Unit by name of a variable; what is not in it has none (a number, a count, a logarithm).

    Parameters
    ----------
    result : Calibration or TouchPosteriors
        Its unknowns have the units that plots show; readings and loads have those of its sensor, see `load_unit`.
    """
    reading, load, force = result.sensor.reading_unit, load_unit(result), result.sensor.body.load_unit
    # A load without a unit leaves no quotient.
    derived = {name: unit if load else unit.replace("/{l}", "") for name, unit in _DERIVED.items()}
    units = {name: unit.format(r=reading or "reading", l=load, f=force) for name, unit in derived.items()}
    if not reading:
        units |= {name: "" for name, unit in derived.items() if unit == "{r}"}
    return units | {parameter.name: parameter.unit for parameter in result.parameters}


def load_unit(result: CalibrationData | PosteriorsData) -> str:
    """Unit of loads; none where a calibration had no measured loads: they are shares of its usual load."""
    for parameter in result.parameters:
        if parameter.name == "P":
            return parameter.unit
    return result.sensor.body.load_unit if result.settings.get("load_measured", 1) else ""
