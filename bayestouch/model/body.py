"""`Body`: everything that `calibrate`, `infer` and `diagnose` need to know about a kind of sensor."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from itertools import groupby
from typing import TYPE_CHECKING, Any

from bayestouch.data.geometry import BODIES
from bayestouch.errors import InputError, nearest

if TYPE_CHECKING:
    from bayestouch.array_types import FloatArray
    from bayestouch.data.averages import TouchMeans
    from bayestouch.data.dataset import DataSet
    from bayestouch.data.sensor import Sensor
    from bayestouch.data.touches import Touches
    from bayestouch.effects.stated import StatedModel
    from bayestouch.model.beginning import Beginning
    from bayestouch.model.planned import PlannedTouches
    from bayestouch.priors.parameters import Prior
    from bayestouch.results.objects import Calibration


@dataclass(frozen=True)
class Option:
    """An option of `calibrate`, `infer` or `diagnose` that only some bodies have.

    Attributes
    ----------
    default : object
        Value if the option is not given.
    words : tuple of str
        Allowed values; empty if the value is checked where it is used.
    """

    default: Any = None
    words: tuple[str, ...] = ()


@dataclass(frozen=True)
class Body:
    """A kind of sensor, as `calibrate`, `infer` and `diagnose` use it.

    Attributes
    ----------
    kind : str
        Name of the kind in ``sensor.toml``.
    options : mapping of str to Option
        Options of `bayestouch.calibrate`, `bayestouch.infer` and `bayestouch.diagnose` that this body has and others
        do not have.
    main_option : str
        Option of this body that the message names if an option of another body is given.
    instead : mapping of str to str
        Other text of that message, by the option of the other body.
    references : tuple of str
        Columns of a touch table whose values a fit needs; columns that the table does not have are not required.
    scanned : bool
        Whether consecutive touches are neighbours in location. They are then held out in blocks.
    needs_load : bool
        Whether fits leave out touches without a measured load, where others have one.
    most_touches : int or None
        Largest number of training touches in a search for effects; None for no limit.
    setting : callable
        ``(body, contact)`` to the fields of `bayestouch.effects.Setting` that depend on the kind of body.
    calibrate : callable
        ``(dataset, *, draws, seed, progress, **options)`` to a `Calibration` without effects.
    begin : callable
        ``(data, *, draws, seed, **options)`` to the `Beginning` of a fit with effects.
    reader : callable
        ``(calibration, options)`` to a `bayestouch.reading.touch_reader.TouchReader`.
    live : callable
        ``(calibration, options, arrays)`` to a `bayestouch.reading.live.LiveBody`; `arrays` from its file, or None.
    stated : callable
        From a calibration to the effects with their values and the options of the fit, with which the fit is repeated.
    lacking : callable
        ``(dataset, known)`` to a line of text for each kind of touch that is missing and that would improve or permit
        a calibration; `known` has the means of the touches with references.
    planned : callable
        ``(calibration, table)`` to `bayestouch.model.planned.PlannedTouches`: the touches of a table that are planned.
    loads_as_read : callable
        From a calibration to the loads of its touches as the force sensor reads them, NaN where none was measured.
    learned_priors : callable or None
        ``(earlier, dataset, contact)`` to the priors that earlier calibrations give, and notes; None for a body without
        the option ``like``.
    """

    kind: str
    options: Mapping[str, Option]
    main_option: str
    references: tuple[str, ...]
    scanned: bool
    setting: Callable[..., dict[str, Any]]
    calibrate: Callable[..., Calibration]
    begin: Callable[..., Beginning]
    reader: Callable[..., Any]  # the type is in `bayestouch.reading`, which this package does not import
    live: Callable[..., Any]
    stated: Callable[[Calibration], tuple[StatedModel, dict[str, Any]]]
    lacking: Callable[[DataSet, TouchMeans], Iterator[str]]
    planned: Callable[[Calibration, Touches], PlannedTouches]
    loads_as_read: Callable[[Calibration], FloatArray]
    learned_priors: Callable[..., tuple[dict[str, Prior], tuple[str, ...]]] | None = None
    needs_load: bool = False
    most_touches: int | None = None
    instead: Mapping[str, str] = field(default_factory=dict)

    def own(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """The options in `given` that this body has; the default replaces None or an empty one.

        Parameters
        ----------
        given : mapping
            All options that only some bodies have; None for those that were not given.

        Raises
        ------
        InputError
            An option of another body is given, or an option has a value that is not allowed.
        """
        for owner, why, names in self._foreign(given):
            are = "is an option" if len(names) == 1 else "are options"
            raise InputError(f"{_listed(names)} {are} of {owner}s; {why}")
        for name in given.keys() & self.options.keys():
            words = self.options[name].words
            if given[name] is not None and words and given[name] not in words:
                raise InputError(
                    f"{name}: expected {' or '.join(words)}, got {given[name]!r}{nearest(str(given[name]), words)}"
                )
        return {name: given[name] or self.options[name].default for name in given if name in self.options}

    def _foreign(self, given: Mapping[str, Any]) -> list[tuple[str, str, list[str]]]:
        """Given options that this body does not have: (kind of the other body, message, names of the options)."""
        here = f"this sensor is a {self.kind} (its option is the {self.main_option})"
        foreign = [name for name, value in given.items() if value is not None and name not in self.options]
        lacking = [(_owner(name), self.instead.get(name, here), name) for name in foreign]
        return [(*key, [name for _, _, name in group]) for key, group in groupby(lacking, lambda each: each[:2])]


@cache
def body_of_kind(kind: str) -> Body:
    """The `Body` of a kind of sensor: ``"finger"`` or ``"pad"``; KeyError for another kind."""
    body: Body = import_module(f"{BODIES[kind]}.body").BODY
    return body


def body_of(sensor: Sensor) -> Body:
    """The `Body` of a sensor."""
    return body_of_kind(sensor.body.kind)


def _owner(option: str) -> str:
    return next(kind for kind in BODIES if option in body_of_kind(kind).options)


def _listed(names: list[str]) -> str:
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last
