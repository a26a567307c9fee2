"""Options of an inference."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.touch_source import TouchSource
from bayestouch.errors import InputError, nearest, require_whole, shown
from bayestouch.priors.indenters import IndenterPrior, is_indenter_prior
from bayestouch.results.objects import Calibration
from bayestouch.results.schema import chosen_groups

#: Ways to draw posteriors of touches.
METHODS = ("emcee", "importance")


def _require_flags(options: Kept | Options, *names: str) -> None:
    """Raise an error if one of these options is neither True nor False: any text, "no" too, would count as True."""
    for name in names:
        if not isinstance(value := getattr(options, name), bool | np.bool_):
            raise InputError(f"{name}: expected True or False, got {shown(value)}")


@dataclass(frozen=True)
class Kept:
    """Options about the draws that are kept in a result.

    Attributes
    ----------
    draws : int
        Number of draws of a touch.
    thin : int
        Every `thin`-th draw of each chain is kept.
    summary_only : bool
        True if no draws are kept.
    summarised : bool
        True if summaries of all draws are stored, even if every draw is kept.
    """

    draws: int = 1024
    thin: int = 1
    summary_only: bool = False
    summarised: bool = True

    def __post_init__(self) -> None:
        _require_flags(self, "summary_only")

    @property
    def everything(self) -> bool:
        """True if all draws are kept and no summary is stored."""
        return self.thin == 1 and not (self.summary_only or self.summarised)


@dataclass(frozen=True)
class Options:
    """All options that influence a result; `bayestouch.infer` describes them.

    It has no `recorded_s`: times (n,) of all rows of the table on the clock of the calibration, in the unit of its
    effects, for touches that were recorded with those of the calibration. Effects of a finger that change with time
    then act as at these times. None for touches after the calibration.
    """

    indenter: IndenterPrior | None = None
    plug_in: bool = False
    use_load: bool = True
    check_sensor: bool = True
    each_sample: bool = False
    method: str = "emcee"
    kept: Kept = field(default_factory=Kept)
    seed: int = 0
    groups: tuple[str, ...] = ()
    recorded_s: FloatArray | None = None

    def __post_init__(self) -> None:
        _require_flags(self, "plug_in", "use_load", "check_sensor", "each_sample")

    def check(self, source: TouchSource, calibration: Calibration) -> None:
        """Refuse options that are impossible.

        Raises
        ------
        InputError
            If an option is out of range, or the table does not fit the calibrated sensor.
        """
        draws, thin = self.kept.draws, self.kept.thin
        if self.method not in METHODS:
            question = nearest(str(self.method), METHODS)
            raise InputError(f"method: expected {' or '.join(METHODS)}, got {self.method!r}{question}")
        require_whole("draws", draws, 64)
        require_whole("seed", self.seed, 0)
        require_whole("thin", thin, 1)
        if thin > draws // 16:
            raise InputError(f"thin: expected 1 to {draws // 16}, a sixteenth of the draws, got {thin}")
        chosen_groups(self.groups)
        if self.groups and self.kept.summary_only:
            raise InputError("groups: these groups hold a number for each draw, and with summary_only no draw is kept")
        if self.indenter is not None and not is_indenter_prior(self.indenter):
            got = shown(self.indenter)
            raise InputError(f"indenter: expected a prior over indenters such as KnownTips((0, 2)), got {got}")
        m = calibration.sensor.n_elements
        if source.n_elements != m:
            raise InputError(f"the table has {source.n_elements} elements, the calibrated sensor {m}")

    @property
    def of_some_bodies(self) -> dict[str, Any]:
        """Options that only some bodies have; None for those with their default values."""
        return {
            "each_sample": self.each_sample or None,
            "method": None if self.method == "emcee" else self.method,
            "indenter": self.indenter,
        }
