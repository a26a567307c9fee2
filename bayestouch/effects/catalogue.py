"""All known effects: those of this package, and those that other packages add by an entry point."""

from __future__ import annotations

from importlib.metadata import entry_points

from bayestouch.effects.body import FiniteStrain, SoftSpot
from bayestouch.effects.contact import BluntEdge, RigidCore, TangentialLoad
from bayestouch.effects.effect import STAGES, Effect, Setting
from bayestouch.effects.element import Aperture, ChannelLag, Crosstalk, Proximity
from bayestouch.effects.noise import CommonModeNoise, Outliers, SignalDependentNoise
from bayestouch.effects.pad import CreepByElement, LoadNonlinearity
from bayestouch.effects.random import BaselineDrift, GainDrift
from bayestouch.effects.readout import Creep, GainNonlinearity, Memory, RestOffset, Saturation
from bayestouch.effects.rig import LoadMisalignment, LoadOffset, ProberEccentricity
from bayestouch.effects.surface import SurfaceProfile
from bayestouch.errors import InputError

GROUP = "bayestouch.effects"

_BUILT_IN: tuple[type[Effect], ...] = (
    ProberEccentricity,
    LoadOffset,
    LoadMisalignment,
    RigidCore,
    BluntEdge,
    TangentialLoad,
    SurfaceProfile,
    LoadNonlinearity,
    SoftSpot,
    FiniteStrain,
    Aperture,
    Crosstalk,
    ChannelLag,
    Proximity,
    GainNonlinearity,
    Saturation,
    RestOffset,
    BaselineDrift,
    GainDrift,
    Creep,
    CreepByElement,
    Memory,
    CommonModeNoise,
    SignalDependentNoise,
    Outliers,
)


def effect_classes() -> dict[str, type[Effect]]:
    """Effect classes by name, in the order of the stages; in each stage this package's own come first.

    Raises
    ------
    InputError
        An entry point cannot be loaded, is not an `Effect`, or uses the name of another effect.
    """
    classes = {effect.name: effect for effect in _BUILT_IN}
    for point in sorted(entry_points(group=GROUP), key=lambda each: each.name):
        try:
            loaded = point.load()
        except Exception as error:
            raise InputError(f"effect {point.name} ({point.value}) cannot be loaded: {error}") from error
        if not (isinstance(loaded, type) and issubclass(loaded, Effect)):
            raise InputError(f"effect {point.name} ({point.value}): expected a subclass of bayestouch.effects.Effect")
        if classes.get(loaded.name, loaded) is not loaded:
            raise InputError(f"effect {point.name} ({point.value}): the name {loaded.name!r} is taken")
        classes[loaded.name] = loaded
    return dict(sorted(classes.items(), key=lambda item: STAGES.index(item[1].stage)))


def catalogue(setting: Setting) -> tuple[Effect, ...]:
    """Every effect that can occur and can be observed in this setting, in the order of the stages."""
    suited = (each.suited(setting) for each in effect_classes().values())
    return tuple(effect for effect in suited if effect is not None)
