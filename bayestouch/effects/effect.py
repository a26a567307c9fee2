"""Base class of effects, their parameters, and the setting in which an effect may occur."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, pairwise, product
from typing import Any, ClassVar, Literal, Self, cast

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.missing import MissingTouches
from bayestouch.chain.recording import Recording
from bayestouch.priors.parameters import LogNormal, Normal, Parameter, Prior

Values = tuple[float, ...]
Stage = Literal["rig", "contact", "body", "element", "readout", "noise"]

STAGES: tuple[Stage, ...] = ("rig", "contact", "body", "element", "readout", "noise")


@dataclass(frozen=True)
class Setting:
    """Properties of the sensor and of its touches, from which effects choose their priors and probes before any fit.

    Attributes
    ----------
    finger : bool
        True for a finger, False for a pad.
    n_elements : int
        Number of elements m.
    element_place : tuple of (m,) arrays
        Nominal locations of the elements, one array per coordinate: degree on a finger, mm on a pad.
    place_range : tuple of (float, float)
        Lowest and highest location of the touches, for each coordinate; degree or mm.
    reference_load : float
        Typical load, in `load_unit`.
    load_unit : str
        ``"N/m"`` or ``"N"``.
    contact : str
        Contact model of a finger; ``""`` on a pad.
    has_edges : bool
        Whether some touches were made with a knife edge.
    hold_s, gap_s, span_s : float
        Longest hold of a touch, median time from the last sample of a touch to the first of the next, and
        duration of the whole recording; 0 where it is not defined.
    time_unit : str
        ``"s"``, or ``"touch"`` where times are not known and the order of the rows is used instead.
    loads_vary : bool
        Whether loads were measured and differ. Where they are equal, an error of the load cannot be distinguished
        from one of the gain.
    radii_mm : tuple of (float, float)
        ``r_a`` and ``r_b`` of a finger, mm; zeros on a pad.
    own_rest : bool
        Whether every touch has a rest reading of its own, which is subtracted from it. What changes readings with or
        without a touch, and slowly, is then subtracted, too.
    any_rest : bool
        Whether some rows are without contact, so that a rest reading is subtracted.
    """

    finger: bool
    n_elements: int
    element_place: tuple[FloatArray, ...]
    place_range: tuple[tuple[float, float], ...]
    reference_load: float
    load_unit: str
    contact: str
    has_edges: bool
    hold_s: float
    gap_s: float
    span_s: float
    time_unit: str = "s"
    loads_vary: bool = True
    radii_mm: tuple[float, float] = (0.0, 0.0)
    own_rest: bool = False
    any_rest: bool = True


@dataclass(frozen=True)
class EffectParameter:
    """A parameter of an effect.

    Attributes
    ----------
    name, unit, description : str
        Name (without that of the effect), unit and description, as in files.
    prior : Prior
        Prior of the value.
    probes : tuple of float
        Values at which the signature of the effect is computed in the search for effects.
    null : float or None
        Value of an amplitude at which the effect changes nothing. None for a shape parameter (a width, a time).
    of_element : bool
        Whether it is of one element. Each element then has such a parameter, in their order.
    """

    name: str
    unit: str
    description: str
    prior: Prior
    probes: tuple[float, ...]
    null: float | None = None
    of_element: bool = False

    @property
    def logarithmic(self) -> bool:
        """Whether fits use the logarithm of the value: True if the prior is log-normal."""
        return isinstance(self.prior, LogNormal)

    def to_unconstrained(self, value: float) -> float:
        """Coordinate of a value in fits: the value itself, or its logarithm if `logarithmic`."""
        return float(np.log(value)) if self.logarithmic else value

    def from_unconstrained(self, coordinate: float) -> float:
        """Value that belongs to a coordinate in fits; inverse of `to_unconstrained`."""
        return float(np.exp(coordinate)) if self.logarithmic else coordinate

    @property
    def normal_prior(self) -> tuple[float, float, float, float]:
        """Mean, sd, lower and upper bound of the coordinate in fits.

        For a prior that is neither normal nor log-normal: median, and half the central 68 % range.
        """
        prior = self.prior
        if isinstance(prior, LogNormal):
            return float(np.log(prior.median)), prior.spread, -np.inf, np.inf
        low, high = prior.support
        if isinstance(prior, Normal):
            return prior.mean, prior.sd, low, high
        tails = prior.quantile(np.array([0.159, 0.5, 0.841]))
        return float(tails[1]), float(0.5 * (tails[2] - tails[0])), low, high


class Effect:
    """One addition to one stage of the chain. Subclasses are frozen dataclasses that override one or more methods.

    An effect changes the pose and load of touches (`pose`: stages rig and contact), the finger (`finger`: terms of the
    series over modes) or the readings (`signal`: stages body, element and readout). An unknown function of time is a
    `bayestouch.effects.random.RandomEffect`; an effect that changes the noise is a `NoiseEffect`.

    Attributes
    ----------
    name : str
        Name in files.
    stage : str
        Stage of the chain, one of `STAGES`.
    summary : str
        What the effect does, in half a sentence.
    needs_samples : bool
        Whether it differs between the samples of one touch, so that means of touches show only a part of it.
    random : bool
        Whether it is a random function of time, which can also fit a part of the errors that other effects cause.
    remembers : bool
        Whether it depends on earlier touches, which in a scan are touches of the places beside.
    mixes : bool
        Whether the reading of an element depends on the signals of other elements.
    changes_strain : bool
        Whether it changes the finger only in the strain of its elements under each Fourier mode of the pressure.
    adds_strain : bool
        Whether it changes the finger only by a strain that is added to that of the linear body.
    contained_in : str
        Name of an effect that can do the same and more: beside it this one is not looked for. Empty if there is none.
    parameters : tuple of EffectParameter
        Amplitudes and shape parameters, in the order of the argument `values` of the methods.
    """

    name: ClassVar[str]
    stage: ClassVar[Stage]
    summary: ClassVar[str]
    needs_samples: ClassVar[bool] = False
    random: ClassVar[bool] = False
    remembers: ClassVar[bool] = False
    mixes: ClassVar[bool] = True
    changes_strain: ClassVar[bool] = False
    adds_strain: ClassVar[bool] = False
    contained_in: ClassVar[str] = ""
    parameters: tuple[EffectParameter, ...]

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        """The effect with priors and probes for this setting; None if it cannot occur or cannot be observed."""
        raise NotImplementedError

    def as_stated(self, start: Mapping[str, float]) -> Self:
        """The effect for a model that states values by name, from which a fit starts."""
        return self

    def pose(self, recording: Recording, values: Values) -> Recording:
        """Actual locations, radii and loads of the touches, from the commanded ones and the loads as read."""
        return recording

    def finger(self, chain: FingerChain, values: Values) -> FingerChain:
        """The finger with the effect."""
        return chain

    def signal(self, recording: Recording, values: Values) -> FloatArray:
        """Readings (n, m) with the effect, from `recording.signal`, the readings before it."""
        return recording.signal

    def left_by_missing(
        self, values: Values, read: FloatArray, when_s: FloatArray, missing: MissingTouches, peak: FloatArray
    ) -> FloatArray:
        """Mean square (t, m, m) of what touches that may be missing in a table leave in the readings of others.

        Parameters
        ----------
        values : tuple of float
            Values of the effect.
        read : (t, m) array
            Mean readings of the touches of the table; NaN missing.
        when_s : (t,) array
            Their times.
        missing : MissingTouches
            The touches that may be missing.
        peak : (m,) array
            As in `Recording`.
        """
        return np.zeros((*read.shape, read.shape[1]))

    def by_place(self, recording: Recording) -> FloatArray | None:
        """Basis (n, q) if row i depends on the q values only through ``basis[i] @ values``; None for other effects.

        The product is, for example, a smooth function of the location. With `shifted` the derivatives over all values
        follow from one derivative. `recording` has the touches before the effect.
        """
        return None

    def shifted(self, recording: Recording, by: FloatArray) -> Recording:
        """Touches after an effect with a basis, with the product of basis and values higher by `by` (n,).

        `recording` has the touches after the effect.
        """
        raise NotImplementedError

    def simulate(self, recording: Recording, values: Values, rng: np.random.Generator) -> FloatArray:
        """Simulated readings (n, m) with the effect: as `signal`; random parts are drawn with `rng`."""
        return self.signal(recording, values)

    @property
    def order(self) -> tuple[int, bool, bool]:
        """Sort key of the order in which effects act.

        Effects act by stage. In one stage, those that differ between the samples of a touch follow the others, and
        functions of time are last: they are drifts of the amplifier, which neither creep nor memory of the rubber
        changes.
        """
        return STAGES.index(self.stage), self.random, self.needs_samples

    @property
    def follows_time(self) -> bool:
        """Whether it can follow any slow course of time, and with it a part of what drifts change."""
        return self.random

    @property
    def changes_pose(self) -> bool:
        """Whether the effect changes the location, radius or load of touches."""
        return type(self).pose is not Effect.pose

    @property
    def changes_finger(self) -> bool:
        """Whether the effect changes the finger."""
        return type(self).finger is not Effect.finger

    @property
    def amplitudes(self) -> tuple[int, ...]:
        """Indices of the parameters that are amplitudes."""
        return tuple(i for i, each in enumerate(self.parameters) if each.null is not None)

    @property
    def probes(self) -> tuple[Values, ...]:
        """All combinations of the probes of the parameters."""
        return tuple(product(*(each.probes for each in self.parameters)))

    def further_parameters(self, n_elements: int) -> tuple[EffectParameter, ...]:
        """Parameters that the `looser` form has after the others; empty if there is no such form.

        At zero of these parameters the looser form is the effect as it is. Often they are one for each element, which
        then need not have the effect in equal measure.
        """
        return ()

    def looser(self, n_elements: int) -> Effect | None:
        """The effect with its `further_parameters`; None if it has none. The looser form of this form is itself."""
        further = self.further_parameters(n_elements)
        if not further:
            return None
        names = {each.name for each in further}
        own = tuple(each for each in self.parameters if each.name not in names)
        form: Effect = replace(cast(Any, self), parameters=(*own, *further))
        return form

    def in_form_with(self, names: Iterable[str], n_elements: int) -> Effect:
        """The effect, in its looser form if only this has a parameter of one of the names."""
        looser = self.looser(n_elements)
        if looser is None or not set(names) & (looser.names - self.names):
            return self
        return looser

    @property
    def names(self) -> set[str]:
        """Names of the parameters."""
        return {each.name for each in self.parameters}

    def without(self, values: Values) -> Values:
        """The values with every amplitude at its null, where the effect changes nothing."""
        return tuple(
            value if each.null is None else each.null for each, value in zip(self.parameters, values, strict=True)
        )

    def drawn(self, which: int, value: float, sd: float, normal: FloatArray) -> FloatArray:
        """Draws of the value with index `which` (most probable `value`, `sd`), from standard normal numbers.

        For effects whose values are not parameters of the chain. The draws have the shape of `normal` and are inside
        the support of the prior.
        """
        return np.clip(value + sd * normal, *self.parameters[which].prior.support)

    def public_parameters(self) -> tuple[Parameter, ...]:
        """The parameters under their names in a calibration, e.g. ``crosstalk_share``."""
        return tuple(
            Parameter(
                f"{self.name}_{each.name}",
                f"{each.name} ({self.name})",
                rf"\mathrm{{{each.name.replace('_', ' ')}}}",
                each.unit,
                each.prior,
                f"{self.name}: {each.description}",
            )
            for each in self.parameters
        )


@dataclass(frozen=True, eq=False)
class Shift(Effect):
    """A given shift of the product of basis and values of another effect, at each touch.

    Attributes
    ----------
    of : Effect
        The effect, which has `Effect.by_place` and `Effect.shifted`. The shift acts directly after it.
    by : (t,) array
        The shift.
    """

    of: Effect
    by: FloatArray
    parameters: tuple[EffectParameter, ...] = ()

    name: ClassVar[str] = "shift"
    summary: ClassVar[str] = "a given shift of what another effect changes"
    mixes: ClassVar[bool] = False

    @property
    def stage(self) -> Stage:  # type: ignore[override]  # that of the other effect, not one of the class
        """The stage of the effect."""
        return self.of.stage

    @property
    def changes_finger(self) -> bool:
        return self.of.changes_finger

    def pose(self, recording: Recording, values: Values) -> Recording:
        return self.of.shifted(recording, self.by)


def places_of_values(effects: Sequence[Effect], first: int = 0) -> tuple[slice, ...]:
    """Where the values of each effect are in a vector that holds them one effect after the other, from `first` on."""
    ends = list(accumulate((len(effect.parameters) for effect in effects), initial=first))
    return tuple(slice(start, stop) for start, stop in pairwise(ends))


#: How the names of the parameters of elements begin.
OWN = "own_"


def own_parameters(n_elements: int, what: str, sd: float) -> tuple[EffectParameter, ...]:
    """One parameter for each element, ``own_01`` and on, for the `looser` form of an effect.

    Parameters
    ----------
    n_elements : int
        Number of elements.
    what : str
        What the parameter is; " of element 1" follows it in descriptions.
    sd : float
        Standard deviation of the prior, which is normal with mean zero. The parameters have no unit.
    """
    prior = Normal(0.0, sd)
    return tuple(
        EffectParameter(f"{OWN}{e:02d}", "", f"{what} of element {e}", prior, (0.0,), of_element=True)
        for e in range(1, n_elements + 1)
    )
