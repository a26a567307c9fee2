"""Parts of a report that depend on the body; all other parts are the same for every body."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from bayestouch.array_types import FloatArray
from bayestouch.data.sensor import Sensor
from bayestouch.output.pictures import Picture
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.headline import HeadlineError
from bayestouch.reporting.sketch import Sketch

#: Content of ``report.json``, or part of it.
Numbers = dict[str, Any]


@dataclass(frozen=True, eq=False)
class BodyNumbers:
    """Parts of ``report.json`` that depend on the body.

    Attributes
    ----------
    peak : dict
        ``calibration.peak``: error of the fit and noise in % of each element's peak.
    estimates : dict
        ``estimates``: results for the touches, compared with their references.
    places : dict
        ``places``: expected error at each place.
    prediction : dict or None
        ``residuals.prediction``: errors of the readings that are predicted for the reference values.
    paper : dict or None
        ``paper``: tables that the paper printed.
    """

    peak: Numbers
    estimates: Numbers
    places: Numbers
    prediction: Numbers | None = None
    paper: Numbers | None = None


@dataclass(frozen=True, eq=False)
class BodyPages:
    """Numbers, text and figures of one kind of body. Its templates are in ``templates/<kind>/``.

    Attributes
    ----------
    numbers : callable
        Function that returns the `BodyNumbers`.
    headline : callable
        Function of the evidence: the quantities whose errors the first screen shows.
    sketch : callable
        Function of the numbers of a report: the drawing of the sensor on the first screen.
    errors_and_limits : callable
        Function of the numbers of a report: sentences on errors and limits, and key numbers.
    own_answers : callable
        Function of the numbers of a report: rows of question, short answer and reason.
    plug_in_compared : tuple of str
        Parameters that are inferred both with and without the uncertainty of the calibration, for comparison. If empty,
        touches are inferred in one way only.
    read : str
        Name of the quantity in the texts of `bayestouch.reporting.next_steps`.
    reads_held_out : bool
        Whether the diagnosis of a report reads the held-out touches as unknown, before and after: seconds on a pad,
        minutes on a finger.
    next_after_diagnosis : str
        Advice on what to do with the effects that a diagnosis found.
    design : callable
        Designed places of the elements, (m,) arrays by the name of the calibration parameter.
    origin_known : bool
        True if places of elements and touches have a common origin; otherwise all elements may be shifted together.
    examples : callable
        Numbers of the touches that are shown as examples: ``typical``, and ``hardest`` if there is one.
    pictures : callable
        Function that yields the figures of the estimates.
    sensor_picture : callable
        Function that returns the figure of the sensor with the expected error at each place.
    live_sensor, live_estimates : callable
        Functions that return the interactive versions, from the numbers of a report and the data source of the touches;
        that of the estimates is None if the touches have no reference values.
    """

    numbers: Callable[[Evidence], BodyNumbers]
    headline: Callable[[Evidence], list[HeadlineError]]
    sketch: Callable[[Numbers], Sketch]
    errors_and_limits: Callable[[Numbers], tuple[list[str], list[Numbers]]]
    own_answers: Callable[[Numbers], list[dict[str, str]]]
    plug_in_compared: tuple[str, ...]
    read: str
    reads_held_out: bool
    next_after_diagnosis: str
    design: Callable[[Sensor], Mapping[str, FloatArray]]
    origin_known: bool
    examples: Callable[[Evidence], Mapping[str, int]]
    pictures: Callable[[Evidence, Numbers], Iterator[Picture]]
    sensor_picture: Callable[[Evidence, Numbers], Picture]
    live_sensor: Callable[[Mapping[str, Any], Any], Any]
    live_estimates: Callable[[Mapping[str, Any], Any], Any]
