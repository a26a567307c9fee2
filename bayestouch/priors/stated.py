"""Checks of priors stated by the user."""

from __future__ import annotations

from collections.abc import Mapping

from bayestouch.errors import InputError, shown
from bayestouch.priors.parameters import Normal, Prior

# A prior contradicts the nominal geometry if the nominal value is more than so many standard deviations from its mean.
FARTHEST = 6.0


def require_priors(stated: Mapping[str, Prior] | None) -> None:
    """Raise an error unless `stated` has a prior for each name.

    Raises
    ------
    InputError
        It is no mapping, or holds something else than a prior: without support, density or quantiles.
    """
    if not isinstance(stated, Mapping | None):
        raise InputError(f"priors: expected priors by name of the parameter, got {shown(stated)}")
    for name, prior in (stated or {}).items():
        if isinstance(prior, type) or not all(hasattr(prior, each) for each in ("support", "log_density", "quantile")):
            raise InputError(f"prior of {name}: expected a prior, such as Normal(mean, sd), got {shown(prior)}")


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
