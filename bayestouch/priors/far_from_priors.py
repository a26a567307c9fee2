"""Notes on parameters that the touches put far from their priors, as a stated value in a wrong unit does."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.priors.parameters import LogNormal, Normal, Parameter, Prior

# By chance a parameter is so many standard deviations of its prior from the centre once in 16,000 fingers.
FAR_SD = 4.0


def far_from_priors(
    parameters: Sequence[Parameter], posterior: Mapping[str, FloatArray], nominal: Mapping[str, ArrayLike]
) -> Iterator[str]:
    """Yield a line for each parameter with a posterior mean more than `FAR_SD` from its prior: the farthest element.

    Parameters
    ----------
    parameters : sequence of Parameter
        Parameters with priors. Those whose priors are in units of the data have no stated value, and are left out; so
        are those without a normal or log-normal prior.
    posterior : mapping of str to array
        Draws (chains, draws) or (chains, draws, m) in the units of the parameters.
    nominal : mapping of str to (m,) array_like
        Nominal values of the parameters whose priors are of the difference from them: angles or places of the elements.
    """
    for parameter in parameters:
        if parameter.name not in posterior or (parameter.relative and parameter.name not in nominal):
            continue
        found = np.atleast_1d(np.asarray(posterior[parameter.name]).mean(axis=(0, 1)))
        place = np.broadcast_to(np.asarray(nominal.get(parameter.name, 0.0), dtype=float), found.shape)
        centre, away = _away(parameter.prior, found - place)
        far = int(away.argmax())
        if not away[far] > FAR_SD:
            continue
        of = f" of e{far + 1:02d}" if len(found) > 1 else ""
        unit = f" {parameter.unit}" if parameter.unit else ""
        many = int((away > FAR_SD).sum())
        more = f" ({many} elements are more than {FAR_SD:g} away)" if many > 1 else ""
        yield (
            f"{parameter.name}{of}: {found[far]:.3g}{unit} was found, {away[far]:.0f} standard deviations of its prior "
            f"from {centre + place[far]:.3g}{unit}, the centre of the prior{more}: is a value or a unit wrong in "
            "sensor.toml, or a column of the tables?"
        )


def _away(prior: Prior, values: FloatArray) -> tuple[float, FloatArray]:
    """Centre of a prior, and the distance of each value from it in its standard deviations, 0 for other priors."""
    if isinstance(prior, Normal):
        return prior.mean, np.abs(values - prior.mean) / prior.sd
    if isinstance(prior, LogNormal):
        return prior.median, np.abs(np.log(values / prior.median)) / prior.spread
    return 0.0, np.zeros(len(values))
