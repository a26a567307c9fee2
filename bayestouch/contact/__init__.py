"""Contact stage: surface pressure from load, indenter and pose (the C and S maps).

Round indenters, from knife edge to flat, are one family: the contact is a function of ``κ = P R/μ`` in mm²
alone, with P the load in N/mm, R the composite radius in mm and μ the shear modulus in MPa. A `ContactModel`
computes a half-width and a normalised pressure spectrum from κ. See `bayestouch.contact.corner` for corners and
`bayestouch.contact.slope_map` for any other shape.
"""

from __future__ import annotations

from functools import lru_cache

from bayestouch.contact.approximate import ApproximateFrictionless
from bayestouch.contact.circle import CircleContact
from bayestouch.contact.corner import CornerContact
from bayestouch.contact.hertz import HertzContact, composite_radius, indenter_radius
from bayestouch.contact.layer import LayerContact
from bayestouch.contact.model import ContactModel
from bayestouch.errors import unknown_name

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
    """Return the contact model with the given name.

    Parameters
    ----------
    name : {"hertz", "approximate frictionless", "layer"}
        Half-plane; elliptic pressure on the contact width of the layer (used for Table 3 of the paper); exact
        frictionless contact on the layer.
    finger_radii : (float, float)
        Core radius ``r_a`` and outer radius ``r_b``, mm.
    poisson_ratio : float
        σ.

    Raises
    ------
    InputError
        If the name is unknown or the dimensions of the body are impossible.
    """
    core_radius, outer_radius = finger_radii
    if name == "hertz":
        return HertzContact(outer_radius, poisson_ratio)
    if name not in CONTACT_MODELS:
        raise unknown_name("contact model", name, CONTACT_MODELS)
    layer = _solved_layer(core_radius, outer_radius, poisson_ratio)
    return layer if name == "layer" else ApproximateFrictionless(layer)


@lru_cache(maxsize=16)
def _solved_layer(core_radius: float, outer_radius: float, poisson_ratio: float) -> LayerContact:
    """Cached layer contact: during a fit the same bodies repeat, because only σ changes the contact."""
    return LayerContact.for_body(core_radius, outer_radius, poisson_ratio)
