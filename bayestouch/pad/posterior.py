"""The posterior of the calibration of a pad, by the names of the parameters, as in files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.model.added import AddedEffect
from bayestouch.model.requested import groups_of_draws
from bayestouch.output.progress import Progress
from bayestouch.pad.density import PadDensity
from bayestouch.pad.requested import PadGroups, by_name
from bayestouch.pad.sampling import sample_density
from bayestouch.results.schema import LOG_DENSITY


@dataclass(frozen=True, eq=False)
class PadPosterior:
    """Mode and draws of the parameters of a pad, in public units.

    Attributes
    ----------
    mode : dict of () or (m,) arrays
        Most probable values.
    draws : dict of (chain, draw) or (chain, draw, m) arrays
        Posterior draws, made with emcee.
    covariance : (d, d) array
        Covariance of the normal approximation at the mode.
    layout : tuple of str
        Name of each row of the covariance.
    grades : dict of str to float
        ``ess_bulk`` and ``rhat`` of the worst parameter, and the ``acceptance`` of the proposals.
    groups : dict of dict of arrays
        As in `bayestouch.Calibration`.
    """

    mode: dict[str, FloatArray]
    draws: dict[str, FloatArray]
    covariance: FloatArray
    layout: tuple[str, ...]
    grades: dict[str, float]
    groups: dict[str, dict[str, FloatArray]]

    @classmethod
    def of(
        cls,
        density: PadDensity,
        draws: int,
        seed: int,
        *,
        added: Sequence[AddedEffect] = (),
        groups: Sequence[str] = (),
        progress: Progress | None = None,
    ) -> PadPosterior:
        """Draw from a density.

        Parameters
        ----------
        density : PadDensity
            Posterior density of pad and effects.
        draws, seed : int
            Number of draws over all chains, and seed of the random numbers.
        added : sequence of AddedEffect
            Effects with their posterior. Only the values of noise effects are not entries of the density: they are
            drawn from this posterior, independent of the other parameters, and the density has their most probable
            values. Their likelihood (of the scatter of samples) depends on the other parameters to second order only.
            A value that selects the kind of a drift is constant.
        groups : sequence of str
            Groups of the ArviZ schema, see `bayestouch.results.schema.GROUPS`.
        progress : callable, optional
            Called with the share done, 0 to 1.
        """
        drawn = sample_density(density, draws, seed, progress)
        values, mode = density.values(drawn.draws[:, :, 0]), density.values(density.mode)
        scale = np.where(density.logarithmic, mode, 1.0)
        named = by_name(density, values)
        at_mode = {name: value[0, 0] for name, value in by_name(density, mode[None, None]).items()}
        rng = np.random.default_rng([seed, 3])
        for each in added:
            for i, parameter in enumerate(each.effect.public_parameters()):
                if parameter.name not in named:
                    at_mode[parameter.name] = np.asarray(each.values[i])
                    named[parameter.name] = each.draws(i, rng.standard_normal(values.shape[:2]))
        return cls(
            mode=at_mode,
            draws=named,
            covariance=density.covariance * np.outer(scale, scale),
            layout=density.names,
            grades={
                "ess_bulk": float(drawn.ess_bulk.min()),
                "rhat": float(drawn.rhat.max()),
                "acceptance": float(drawn.acceptance.min()),
            },
            groups={
                "sample_stats": {LOG_DENSITY: drawn.log_density[:, :, 0]},
                **groups_of_draws(PadGroups(density), drawn.draws[:, :, 0], groups, seed),
            },
        )
