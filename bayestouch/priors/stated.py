"""Check of priors stated by the user."""

from __future__ import annotations

from bayestouch.errors import InputError
from bayestouch.priors.parameters import Normal, Prior

# A prior contradicts the nominal geometry if the nominal value is more than so many standard deviations from its mean.
FARTHEST = 6.0


def check_holds(prior: Prior, value: float, what: str) -> Prior:
    """Return the prior if a nominal value is possible with it; `what` describes the value.

    Raises
    ------
    InputError
        The value is outside the support, or too far from the mean of a normal prior.
    """
    low, high = prior.support
    off = isinstance(prior, Normal) and abs(value - prior.mean) > FARTHEST * prior.sd
    if not low <= value <= high or off:
        raise InputError(f"{prior} excludes {what}; correct one of the two")
    return prior
