"""Priors of a sensor's parameters as text, for the command line."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from bayestouch.errors import InputError, nearest, shown
from bayestouch.priors.parameters import LogNormal, LogStudentT, Normal, Prior, StudentT, Uniform

FORMS = (
    "normal:MEAN,SD, uniform:LOW,HIGH, log-normal:MEDIAN,FACTOR, student-t:CENTRE,SCALE,DOF or "
    "log-student-t:MEDIAN,FACTOR,DOF"
)
# How many numbers each kind has.
NUMBERS = {"normal": 2, "uniform": 2, "log-normal": 2, "student-t": 3, "log-student-t": 3}


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
    """Return the prior that a text describes, such as ``normal:MEAN,SD`` or ``log-normal:MEDIAN,FACTOR``; see `FORMS`.

    The factor corresponds to one standard deviation: with ``log-normal:0.15,1.35`` a value is between 0.111 and 0.2025
    with a probability of 68 %. For a Student-t prior, scale and factor are those of the normal prior that it becomes
    with many degrees of freedom.

    Raises
    ------
    InputError
        The text has another form, or the prior is impossible.
    """
    kind, _, rest = text.partition(":")
    try:
        numbers = [float(part) for part in rest.split(",")]
    except ValueError:
        raise InputError(f"expected {FORMS}, got {shown(text)}") from None
    if len(numbers) != NUMBERS.get(kind):
        question = "" if kind in NUMBERS else nearest(kind, NUMBERS)
        raise InputError(f"expected {FORMS}, got {shown(text)}{question}")
    first, second = numbers[:2]
    if kind == "normal":
        return Normal(first, second)
    if kind == "uniform":
        return Uniform(first, second)
    if kind == "student-t":
        return StudentT(first, second, numbers[2])
    if not second > 1:
        raise InputError(f"{kind} prior: expected a factor above 1, got {second:g}")
    spread = float(np.log(second))
    return LogNormal(first, spread) if kind == "log-normal" else LogStudentT(first, spread, numbers[2])
