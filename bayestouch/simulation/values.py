"""Values of the parameters of simulated effects: meaning of a single number, and default shape of an effect."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bayestouch.effects import Effect, EffectParameter, Setting, Values, effect_classes
from bayestouch.errors import InputError, unknown_name
from bayestouch.simulation.plan import EffectValues

#: Default values of shape parameters, by effect: the simplest form of each; times in s. A parameter that is neither
#: listed here nor an amplitude has the middle one of the values for which the catalogue computes signatures.
SHAPES: Mapping[str, Mapping[str, float]] = {
    "crosstalk": {"reach": 0.0},  # neighbours only
    "channel_lag": {"carry": 0.0},  # previous channel only
    "proximity": {"load_power": 0.0},  # the same at any load
    "gain_nonlinearity": {"power": 1.0},  # the gain is linear in the reading
    "saturation": {"knee": 40.0, "shared": 0.0},  # the hardest limit of the catalogue, for each element
    "baseline_drift": {"time": 600.0},
    "gain_drift": {"time": 600.0, "own": 0.0},  # the same drift for all elements
    "creep": {"time": 1.0},
    "memory": {"time": 10.0, "breadth": 0.0},  # one exponential
    "common_mode_noise": {"shared": 0.0},  # in proportion to each element's peak
    "signal_dependent_noise": {"power": 1.0},  # in proportion to the signal
    "outliers": {"size": 0.58},  # sd of values that are uniform within one peak
}
#: Largest size of a value, in units of the largest plausible one: readings then stay numbers that a table may hold.
_FAR = 1e5


def effect_values(stated: Mapping[str, float], setting: Setting) -> EffectValues:
    """Effects with the values of all their parameters, in the order in which they act.

    Parameters
    ----------
    stated : mapping of str to float
        ``NAME`` is the first parameter of that effect, ``NAME.PARAMETER`` any of them. At least one amplitude of each
        effect is stated; the others have the value at which they do nothing, and other parameters those of `SHAPES`.
    setting : Setting
        The sensor, and how it is touched.

    Raises
    ------
    InputError
        If an effect or parameter is unknown or stated twice, an effect is impossible here, no amplitude of it is
        stated, or a value is outside the bounds of its prior.
    """
    known, by_effect = effect_classes(), dict[str, list[tuple[str | None, float]]]()
    for key, value in stated.items():
        name, dot, parameter = key.partition(".")
        if name not in known:
            raise unknown_name("effect", name, known)
        by_effect.setdefault(name, []).append((parameter if dot else None, value))
    out = []
    for name, given in by_effect.items():
        effect = known[name].suited(setting)
        if effect is None:
            raise InputError(f"effect {name} cannot occur, or not be seen, in this design")
        effect = effect.in_form_with((parameter for parameter, _ in given if parameter), setting.n_elements)
        out.append((effect, _values(effect, given)))
    return tuple(sorted(out, key=lambda pair: (pair[0].order, list(known).index(pair[0].name))))


def stated_again(effects: EffectValues) -> dict[str, float]:
    """All values, by names of the form ``NAME.PARAMETER``."""
    return {
        f"{effect.name}.{parameter.name}": value
        for effect, values in effects
        for parameter, value in zip(effect.parameters, values, strict=True)
    }


def _values(effect: Effect, stated: list[tuple[str | None, float]]) -> Values:
    """Values of all parameters from those that are stated; a value without a name is that of the first parameter."""
    names, given = [each.name for each in effect.parameters], dict[str, float]()
    for name, value in stated:
        name = names[0] if name is None else name
        if name not in names:
            raise unknown_name(f"parameter of effect {effect.name}:", name, names)
        if name in given:
            raise InputError(f"effect {effect.name}: {name} is given twice")
        given[name] = value
    amplitudes = [names[i] for i in effect.amplitudes]
    if not set(amplitudes) & set(given):
        raise InputError(f"effect {effect.name}: expected a value of {' or '.join(amplitudes)} too")
    return tuple(
        _checked(effect, each, given[each.name]) if each.name in given else _unstated(effect, each)
        for each in effect.parameters
    )


def _unstated(effect: Effect, parameter: EffectParameter) -> float:
    if parameter.null is not None:
        return parameter.null
    return SHAPES.get(effect.name, {}).get(parameter.name, parameter.probes[len(parameter.probes) // 2])


def _checked(effect: Effect, parameter: EffectParameter, value: float) -> float:
    least, most = parameter.prior.quantile(np.array([0.001, 0.999]))
    far = _FAR * max(abs(least), abs(most))
    if value == parameter.null or (abs(value) <= far and parameter.prior.log_density(value) > -np.inf):
        return float(value)
    low, high = parameter.prior.support
    if np.isfinite([low, high]).all():
        expected = f"{parameter.name} from {low:g} to {high:g}"
    else:
        bound = "" if np.isinf(low) else " above 0" if parameter.logarithmic else f" from {low:g} up"
        expected = f"finite {parameter.name}{bound} (plausible: {least:.2g} to {most:.2g})"
    raise InputError(f"effect {effect.name}: expected a {expected}, got {value:g}")
