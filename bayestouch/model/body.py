"""What the verbs ask of a body: all that differs between a finger and a pad, and where it stands."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from itertools import groupby
from typing import TYPE_CHECKING, Any

from bayestouch.errors import InputError

if TYPE_CHECKING:
    from bayestouch.data.averages import TouchMeans
    from bayestouch.data.dataset import DataSet
    from bayestouch.data.sensor import Sensor
    from bayestouch.model.beginning import Beginning
    from bayestouch.results.objects import Calibration

#: Module that holds the `BODY` of each kind of sensor. A further body is a folder, and a line here. Modules are named,
#: not imported: bodies stand above this package, and one that is not used is never loaded.
BODIES = {"finger": "bayestouch.finger.body", "pad": "bayestouch.pad.body"}


@dataclass(frozen=True)
class Option:
    """An option of the verbs that not all bodies have.

    Attributes
    ----------
    default : object
        What it is where it is not given.
    words : tuple of str
        All that it may be; empty where it is checked where it is used.
    """

    default: Any = None
    words: tuple[str, ...] = ()


@dataclass(frozen=True)
class Body:
    """A kind of sensor, as the verbs use it.

    Attributes
    ----------
    kind : str
        As in ``sensor.toml``.
    options : mapping of str to Option
        Options of `bayestouch.calibrate`, `bayestouch.infer` and `bayestouch.diagnose` that this body has and others
        lack.
    main_option : str
        What is said of them where an option of another body is given.
    instead : mapping of str to str
        What is said in place of that, by the option of another body that is given.
    references : tuple of str
        Columns of a touch table that a fit needs; one that the table does not have is not asked for.
    scanned : bool
        Whether touches that follow each other in time are neighbours in place. They are then held out in blocks.
    most_touches : int or None
        Training touches that a search for effects has time for.
    setting : callable
        ``(body, contact, loads)`` to those entries of `bayestouch.effects.Setting` that depend on the kind of body.
    calibrate : callable
        ``(dataset, *, draws, seed, progress, **options)`` to a `Calibration` without effects.
    begin : callable
        ``(data, *, draws, seed, **options)`` to the `Beginning` of a fit with effects.
    reader : callable
        ``(calibration, options)`` to a `bayestouch.reading.touch_reader.TouchReader`.
    lacking : callable
        ``(dataset, known)`` to a line for each kind of touch that a calibration needs or would gain by; `known` has the
        means of the touches with references.
    """

    kind: str
    options: Mapping[str, Option]
    main_option: str
    references: tuple[str, ...]
    scanned: bool
    setting: Callable[..., dict[str, Any]]
    calibrate: Callable[..., Calibration]
    begin: Callable[..., Beginning]
    reader: Callable[..., Any]  # a package beside this one has its type
    lacking: Callable[[DataSet, TouchMeans], Iterator[str]]
    most_touches: int | None = None
    instead: Mapping[str, str] = field(default_factory=dict)

    def own(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Those of the options of a verb that this body has, with its default where one is None.

        Parameters
        ----------
        given : mapping
            All options of the verb that not all bodies have; None for those that were not given.

        Raises
        ------
        InputError
            An option of another body is given, or a word that an option does not know.
        """
        for owner, why, names in self._foreign(given):
            if any(given[name] is not None for name in names):
                are = "is an option" if len(names) == 1 else "are options"
                raise InputError(f"{_listed(names)} {are} of {owner}s; {why}")
        for name in given.keys() & self.options.keys():
            words = self.options[name].words
            if given[name] is not None and words and given[name] not in words:
                raise InputError(f"{name}: expected {' or '.join(words)}, got {given[name]!r}")
        return {name: given[name] or self.options[name].default for name in given if name in self.options}

    def _foreign(self, given: Mapping[str, Any]) -> list[tuple[str, str, list[str]]]:
        """Options that this body lacks: whose they are, what is said of them, and their names."""
        here = f"this sensor is a {self.kind} (its option is the {self.main_option})"
        lacking = [(_owner(name), self.instead.get(name, here), name) for name in given if name not in self.options]
        return [(*key, [name for _, _, name in group]) for key, group in groupby(lacking, lambda each: each[:2])]


@cache
def body_of_kind(kind: str) -> Body:
    """The body of a kind of sensor, as `bayestouch.data.sensor` names it."""
    body: Body = import_module(BODIES[kind]).BODY
    return body


def body_of(sensor: Sensor) -> Body:
    """The body of a sensor."""
    return body_of_kind(sensor.body.kind)


def _owner(option: str) -> str:
    return next(kind for kind in BODIES if option in body_of_kind(kind).options)


def _listed(names: list[str]) -> str:
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last
