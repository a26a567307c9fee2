"""Priors of a sensor's parameters as text, for the command line."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from bayestouch.errors import InputError, shown
from bayestouch.priors.parameters import LogNormal, Normal, Prior, Uniform

FORMS = "normal:MEAN,SD, uniform:LOW,HIGH or log-normal:MEDIAN,FACTOR"


def priors_from_text(pairs: Iterable[str]) -> dict[str, Prior]:
    """Return priors by name of the parameter, from texts such as ``sigma=normal:0.47,0.01``.

    Raises
    ------
    InputError
        A text has another form, a name occurs twice, or a prior is impossible.
    """
    priors: dict[str, Prior] = {}
    for pair in pairs:
        name, equals, text = (part.strip() for part in pair.partition("="))
        if not equals or not name:
            raise InputError(f"--prior: expected NAME={FORMS}, got {shown(pair)}")
        if name in priors:
            raise InputError(f"--prior: {name} is given twice")
        try:
            priors[name] = prior_from_text(text)
        except InputError as error:
            raise InputError(f"prior of {name}: {error}") from None
    return priors


def prior_from_text(text: str) -> Prior:
    """Return the prior that a text describes: ``normal:MEAN,SD``, ``uniform:LOW,HIGH`` or ``log-normal:MEDIAN,FACTOR``.

    The factor corresponds to one standard deviation: with ``log-normal:0.15,1.35`` a value is between 0.111 and 0.2025
    with a probability of 68 %.

    Raises
    ------
    InputError
        The text has another form, or the prior is impossible.
    """
    kind, _, rest = text.partition(":")
    try:
        first, second = (float(part) for part in rest.split(","))
    except ValueError:
        raise InputError(f"expected {FORMS}, got {shown(text)}") from None
    if kind == "normal":
        return Normal(first, second)
    if kind == "uniform":
        return Uniform(first, second)
    if kind == "log-normal":
        if not second > 1:
            raise InputError(f"log-normal prior: expected a factor above 1, got {second:g}")
        return LogNormal(first, float(np.log(second)))
    raise InputError(f"expected {FORMS}, got {shown(text)}")
