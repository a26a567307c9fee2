"""Option `like` of `bayestouch.calibrate`: priors that are learned from earlier calibrations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from bayestouch.data.dataset import DataSet
from bayestouch.data.splits import with_calibration
from bayestouch.model.body import Body
from bayestouch.results.keys import LIKE
from bayestouch.results.objects import Calibration
from bayestouch.results.reading import load_calibration

# Above this R-hat the posterior has two separate modes, and no chain moves between them: one agrees with the touches,
# the other with the learned priors.
LARGEST_RHAT = 1.2


@dataclass(frozen=True)
class LikeEarlier:
    """What earlier calibrations change in a calibration.

    Attributes
    ----------
    options : dict
        Options of the body, with the learned priors instead of the earlier calibrations.
    names : tuple of str
        Names of the earlier calibrations: the file name of a path, the name of the sensor of a `Calibration`.
    notes : tuple of str
        One note for each learned prior that is used.
    """

    options: dict[str, Any]
    names: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @classmethod
    def of(cls, body: Body, options: Mapping[str, Any], dataset: DataSet) -> LikeEarlier:
        """Learn priors from the option ``like``, if it is given; stated priors replace those that are learned.

        Raises
        ------
        InputError
            A file cannot be read, or a calibration is of another build.
        """
        others = {name: value for name, value in options.items() if name != LIKE}
        like = options.get(LIKE)
        if not like or body.learned_priors is None:
            return cls(others)
        earlier = [
            (each.sensor.name, each) if isinstance(each, Calibration) else (Path(each).name, load_calibration(each))
            for each in like
        ]
        learned, notes = body.learned_priors(earlier, with_calibration(dataset), others["contact"])
        stated = others["priors"] or {}
        kept = tuple(note for name, note in zip(learned, notes, strict=True) if name not in stated)
        return cls({**others, "priors": {**learned, **stated}}, tuple(name for name, _ in earlier), kept)

    def noted(self, calibration: Calibration) -> Calibration:
        """The calibration with the notes, and with the names of the earlier calibrations in its settings."""
        if not self.names:
            return calibration
        settings = {**calibration.settings, LIKE: ", ".join(self.names)}
        notes = (*calibration.notes, *self.notes)
        if (rhat := calibration.statistics.get("rhat", 1.0)) > LARGEST_RHAT:
            notes += (
                f"R-hat is {rhat:.2f}: touches and learned priors contradict each other, and this finger may be unlike "
                "the earlier ones; calibrate it without like.",
            )
        return replace(calibration, settings=settings, notes=notes)
