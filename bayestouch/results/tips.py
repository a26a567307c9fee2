"""Probability of each known tip for each touch, if the prior over indenters has known tips."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.errors import InputError
from bayestouch.output.summary import Summarised
from bayestouch.priors.radius import RadiusOfTips
from bayestouch.results.arrays import array_of, dataset, group_of

if TYPE_CHECKING:
    import xarray as xr


ROUND = "round"


@dataclass(frozen=True, eq=False, repr=False)
class TipProbabilities(Summarised):
    """Posterior probabilities of the alternatives of each touch; t touches, k alternatives.

    Attributes
    ----------
    radius_mm : (k,) array
        ``r_c`` of the tips: 0 knife edge, inf flat; NaN for a round indenter that is not one of the tips.
    prior : (k,) array
        Prior probabilities.
    log_probability : (t, k) array
        Logarithm of the posterior probabilities; the probabilities of a touch add up to 1.
    """

    radius_mm: FloatArray
    prior: FloatArray
    log_probability: FloatArray

    @classmethod
    def of(cls, prior: RadiusOfTips, log_probability: FloatArray) -> TipProbabilities:
        """Probabilities from the prior of R and the log probabilities (k, t) of its alternatives."""
        has_round = prior.density is not None
        return cls(
            radius_mm=np.array([*prior.indenter_radius_mm, *([np.nan] if has_round else [])]),
            prior=np.array([*prior.weights, *([prior.share] if has_round else [])]),
            log_probability=np.ascontiguousarray(log_probability.T),
        )

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each alternative: radius of the tip in mm as text, or ``round``."""
        return tuple(ROUND if np.isnan(radius) else f"{radius:g}" for radius in self.radius_mm)

    @property
    def probability(self) -> FloatArray:
        """Posterior probabilities, (t, k)."""
        return np.exp(self.log_probability)

    @property
    def log_odds(self) -> FloatArray:
        """Natural logarithm of the posterior odds of each alternative against all the others, (t, k)."""
        others = [
            np.logaddexp.reduce(np.delete(self.log_probability, k, axis=1), axis=1, initial=-np.inf)
            for k in range(len(self.prior))
        ]
        return np.asarray(self.log_probability - np.stack(others, axis=1))

    def to_group(self, touch: NDArray[np.int64]) -> xr.Dataset:
        """Group of a posterior file with ``tip_probability`` and ``tip_log_odds`` by (touch, tip)."""
        by_touch = {"tip_probability": self.probability, "tip_log_odds": self.log_odds}
        group = dataset(
            {name: (("touch", "tip"), values) for name, values in by_touch.items()}
            | {"tip_log_probability": (("touch", "tip"), self.log_probability), "tip_prior": (("tip",), self.prior)},
            {},
        )
        group["tip_probability"].attrs["long_name"] = "posterior probability of the tip"
        group["tip_log_odds"].attrs["long_name"] = "log posterior odds of the tip against all others"
        coordinates = {"touch": touch, "tip": np.array(self.names, dtype=object), "r_c": ("tip", self.radius_mm)}
        group = group.assign_coords(coordinates)
        group["r_c"].attrs["units"] = "mm"
        return group

    @classmethod
    def from_groups(cls, groups: Mapping[str, xr.Dataset], n_touches: int) -> TipProbabilities | None:
        """Probabilities from the groups of a posterior file; None if it has no tips.

        Raises
        ------
        InputError
            If something is missing or inconsistent.
        """
        if "tips" not in groups:
            return None
        group = group_of(groups, "tips")
        radius = array_of(group, "r_c", (-1,))
        shape = (n_touches, len(radius))
        log_probability = array_of(group, "tip_log_probability", shape)
        if not np.allclose(np.exp(log_probability).sum(axis=1), 1.0):
            raise InputError("expected probabilities that add up to 1", column="tip_log_probability")
        return cls(radius, array_of(group, "tip_prior", shape[1:]), log_probability)
