"""Contact stage: load, indenter and pose to surface pressure (the C and S maps).

Round indenters, from knife edge to flat, are one family: everything is a function of ``κ = P R/μ`` in mm²,
with P the load in N/mm, R the composite radius in mm and μ the shear modulus in MPa. A `ContactModel` turns κ
into a half-width and a normalised pressure spectrum. Corners are in `bayestouch.contact.corner`, any other
shape goes through `bayestouch.contact.slope_map`.
"""

from __future__ import annotations

from functools import lru_cache

from bayestouch.contact.approximate import ApproximateFrictionless
from bayestouch.contact.circle import CircleContact
from bayestouch.contact.corner import CornerContact
from bayestouch.contact.hertz import HertzContact, composite_radius, indenter_radius
from bayestouch.contact.layer import LayerContact
from bayestouch.contact.model import ContactModel
from bayestouch.errors import InputError

CONTACT_MODELS = ("hertz", "approximate frictionless", "layer")

__all__ = [
    "CONTACT_MODELS",
    "ApproximateFrictionless",
    "CircleContact",
    "ContactModel",
    "CornerContact",
    "HertzContact",
    "LayerContact",
    "composite_radius",
    "contact_model",
    "indenter_radius",
]


def contact_model(name: str, finger_radii: tuple[float, float], poisson_ratio: float) -> ContactModel:
    """Contact model by name.

    Parameters
    ----------
    name : {"hertz", "approximate frictionless", "layer"}
        Half-plane; ellipse on the layer's contact width (the paper's Table 3); exact frictionless contact on
        the layer.
    finger_radii : (float, float)
        Core radius ``r_a`` and outer radius ``r_b``, mm.
    poisson_ratio : float
        σ.

    Raises
    ------
    InputError
        If the name is unknown or the body impossible.
    """
    core_radius, outer_radius = finger_radii
    if name == "hertz":
        return HertzContact(outer_radius, poisson_ratio)
    if name not in CONTACT_MODELS:
        raise InputError(f"unknown contact model {name!r}; expected one of {', '.join(CONTACT_MODELS)}")
    layer = _solved_layer(core_radius, outer_radius, poisson_ratio)
    return layer if name == "layer" else ApproximateFrictionless(layer)


@lru_cache(maxsize=16)
def _solved_layer(core_radius: float, outer_radius: float, poisson_ratio: float) -> LayerContact:
    """Fits ask for the same bodies again and again: of all their parameters only σ changes the contact."""
    return LayerContact.for_body(core_radius, outer_radius, poisson_ratio)
