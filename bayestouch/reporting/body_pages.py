"""What the pages of one kind of body have of their own; the rest of a report is the same for every body."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from bayestouch.array_types import FloatArray
from bayestouch.data.sensor import Sensor
from bayestouch.output.pictures import Picture
from bayestouch.reporting.evidence import Evidence

#: What ``report.json`` holds, or will hold.
Numbers = dict[str, Any]


@dataclass(frozen=True, eq=False)
class BodyNumbers:
    """Parts of ``report.json`` that each kind of body fills in its own way.

    Attributes
    ----------
    peak : dict
        ``calibration.peak``: error of the fit and noise in % of each element's peak.
    estimates : dict
        ``estimates``: what is read of the touches, against their references.
    places : dict
        ``places``: the error to expect at each place.
    prediction : dict or None
        ``residuals.prediction``: errors of the readings predicted at the references.
    paper : dict or None
        ``paper``: the paper's printed tables.
    """

    peak: Numbers
    estimates: Numbers
    places: Numbers
    prediction: Numbers | None = None
    paper: Numbers | None = None


@dataclass(frozen=True, eq=False)
class BodyPages:
    """Numbers, words and pictures of one kind of body. Its templates are in ``templates/<kind>/``.

    Attributes
    ----------
    numbers : callable
        Its parts of ``report.json``.
    errors_and_limits : callable
        Sentences on errors and limits, and key numbers, from the numbers of a report.
    own_answers : callable
        Rows of question, short answer and reason, from the numbers of a report.
    plug_in_compared : tuple of str
        Parameters that are read with the calibration's uncertainty and without it, for comparison; none: touches are
        read in one way.
    read : str
        The quantity that `bayestouch.reporting.next_steps` speaks of.
    next_after_diagnosis : str
        What to do with the effects that a diagnosis found.
    design : callable
        Places of the elements as designed, (m,) each, by the name of the calibration parameter.
    origin_known : bool
        Whether places of the elements and of the touches have one origin; if not, elements may all be shifted.
    examples : callable
        Numbers of touches that are shown one by one: ``typical``, and ``hardest`` where there is one.
    pictures : callable
        Figures of the estimates.
    sensor_picture : callable
        The sensor with the error to expect at each place.
    live_sensor, live_estimates : callable
        The interactive figures of both, from the numbers of a report and the touches' data source.
    """

    numbers: Callable[[Evidence], BodyNumbers]
    errors_and_limits: Callable[[Numbers], tuple[list[str], list[Numbers]]]
    own_answers: Callable[[Numbers], list[dict[str, str]]]
    plug_in_compared: tuple[str, ...]
    read: str
    next_after_diagnosis: str
    design: Callable[[Sensor], Mapping[str, FloatArray]]
    origin_known: bool
    examples: Callable[[Evidence], Mapping[str, int]]
    pictures: Callable[[Evidence, Numbers], Iterator[Picture]]
    sensor_picture: Callable[[Evidence, Numbers], Picture]
    live_sensor: Callable[[Mapping[str, Any], Any], Any]
    live_estimates: Callable[[Mapping[str, Any], Any], Any]
