"""Priors over indenters as text, for the command line."""

from __future__ import annotations

from bayestouch.errors import InputError, nearest, shown
from bayestouch.priors.indenters import (
    EdgeOrRound,
    IndenterDistribution,
    IndenterPrior,
    KnownTips,
    UniformCurvature,
    UniformRadius,
)
from bayestouch.priors.prior_text import prior_from_text
from bayestouch.priors.radius import QUANTITIES

FORMS = (
    "uniform, curvature:SHARPEST, tips:R,R,... or tips:R=WEIGHT,..., edge-or-round or edge-or-round:PROBABILITY, "
    "or a prior such as r_c=log-normal:2,1.6"
)

KINDS = ("uniform", "curvature", "tips", "edge-or-round")


def indenter_from_text(text: str) -> IndenterPrior:
    """Return the prior over indenters that a text describes.

    Parameters
    ----------
    text : str
        ``uniform``; ``curvature:0.3`` (radius of the sharpest in mm); ``tips:0,0.5,2,inf`` or with weights
        ``tips:0=0.5,2=0.25,inf=0.25``; ``edge-or-round`` or with the edge's probability ``edge-or-round:0.3``; a prior
        of ``r_c``, ``R`` or ``curvature`` in the form of `bayestouch.priors.prior_text`: ``r_c=log-normal:2,1.6``.

    Raises
    ------
    InputError
        The text has another form, or the prior is impossible.
    """
    quantity, equals, prior = text.strip().partition("=")
    if equals and quantity in QUANTITIES:
        return IndenterDistribution(prior_from_text(prior), quantity)
    kind, colon, rest = text.strip().partition(":")
    if kind == "uniform" and not colon:
        return UniformRadius()
    if kind == "curvature":
        if not rest:
            raise InputError("indenter: curvature needs the radius of the sharpest indenter in mm, as in curvature:0.3")
        return UniformCurvature(_number(rest, text))
    if kind == "tips":
        return _tips(rest, text)
    if kind == "edge-or-round":
        return EdgeOrRound(_number(rest, text)) if colon else EdgeOrRound()
    question = nearest(quantity if equals else kind, QUANTITIES if equals else KINDS)
    raise InputError(f"indenter: expected {FORMS}, got {shown(text)}{question}")


def _tips(rest: str, text: str) -> KnownTips:
    pairs = [part.partition("=") for part in rest.split(",") if part.strip()]
    radii = [_number(radius, text) for radius, _, _ in pairs]
    weighted = [bool(equals) for _, equals, _ in pairs]
    if any(weighted) and not all(weighted):
        raise InputError(f"indenter: expected a weight for every tip or for none, got {shown(text)}")
    return KnownTips(radii, [_number(weight, text) for _, _, weight in pairs] if any(weighted) else ())


def _number(part: str, text: str) -> float:
    try:
        return float(part)
    except ValueError:
        raise InputError(f"indenter: expected a number, got {shown(part.strip())} in {shown(text)}") from None
