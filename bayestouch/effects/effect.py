"""What an effect is: one more piece for one stage of the chain."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import ClassVar, Literal

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.recording import Recording
from bayestouch.priors.parameters import LogNormal, Normal, Parameter, Prior

Values = tuple[float, ...]
Stage = Literal["rig", "contact", "body", "element", "readout", "noise"]

STAGES: tuple[Stage, ...] = ("rig", "contact", "body", "element", "readout", "noise")


@dataclass(frozen=True)
class Setting:
    """What an effect may suit itself to before any fit: the sensor, and how it was touched.

    Attributes
    ----------
    finger : bool
        A finger, else a pad.
    n_elements : int
        Elements m.
    element_place : tuple of (m,) arrays
        Nominal places, degree or mm.
    place_range : tuple of (float, float)
        Lowest and highest location touched, for each coordinate.
    reference_load : float
        Typical load.
    load_unit : str
        ``"N/m"`` or ``"N"``.
    contact : str
        Contact model of a finger; ``""`` on a pad.
    has_edges : bool
        Whether knife edges touched.
    hold_s, gap_s, span_s : float
        Longest hold of a touch, median time from the last sample of a touch to the first of the next, and
        duration of the whole recording; 0 where there is no such thing.
    time_unit : str
        ``"s"``, or ``"touch"`` where times are not known and the order of rows stands for them.
    loads_vary : bool
        Whether loads were measured and differ; where they do not, an error of the load is one of the gain.
    radii_mm : tuple of (float, float)
        ``r_a`` and ``r_b`` of a finger; zeros on a pad.
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


@dataclass(frozen=True)
class EffectParameter:
    """A parameter of an effect.

    Attributes
    ----------
    name, unit, description : str
        As in files.
    prior : Prior
        Its prior.
    probes : tuple of float
        Values at which the signature of the effect is taken.
    null : float or None
        Value that leaves the chain unchanged: an amplitude has one. None for what gives the effect its shape
        (a width, a time), which means nothing where the amplitude is null.
    """

    name: str
    unit: str
    description: str
    prior: Prior
    probes: tuple[float, ...]
    null: float | None = None

    @property
    def logarithmic(self) -> bool:
        """Whether fits move its logarithm: they do where the prior is log-normal, and so normal in it."""
        return isinstance(self.prior, LogNormal)

    def to_unconstrained(self, value: float) -> float:
        """Coordinate that fits move, of a value."""
        return float(np.log(value)) if self.logarithmic else value

    def from_unconstrained(self, coordinate: float) -> float:
        """Value at a coordinate that fits move."""
        return float(np.exp(coordinate)) if self.logarithmic else coordinate

    @property
    def normal_prior(self) -> tuple[float, float, float, float]:
        """Mean, sd, lower and upper end of the coordinate; what is not normal is taken by its middle 68 %."""
        prior = self.prior
        if isinstance(prior, LogNormal):
            return float(np.log(prior.median)), prior.spread, -np.inf, np.inf
        low, high = prior.support
        if isinstance(prior, Normal):
            return prior.mean, prior.sd, low, high
        tails = prior.quantile(np.array([0.159, 0.5, 0.841]))
        return float(tails[1]), float(0.5 * (tails[2] - tails[0])), low, high


class Effect:
    """One piece of one stage. Subclasses are frozen dataclasses and override what they change.

    An effect changes the pose and load of touches (`pose`: stages rig and contact), the finger (`finger`: what is
    summed over modes) or the readings (`signal`: body, element and readout). What wanders with time on a course that is
    not known in advance is a `bayestouch.effects.random.RandomEffect`, what changes the noise a `NoiseEffect`.

    Attributes
    ----------
    name : str
        Name in files.
    stage : str
        Stage of the chain.
    summary : str
        What it does, in half a sentence.
    needs_samples : bool
        Whether it acts within a touch, so that the mean of a touch does not show it all.
    random : bool
        Whether it is a random function of time, which can follow what other effects do.
    mixes : bool
        Whether an element's reading depends on the signals of others.
    parameters : tuple of EffectParameter
        Amplitudes and shapes, in the order of the values that the methods are given.
    """

    name: ClassVar[str]
    stage: ClassVar[Stage]
    summary: ClassVar[str]
    needs_samples: ClassVar[bool] = False
    random: ClassVar[bool] = False
    mixes: ClassVar[bool] = True
    parameters: tuple[EffectParameter, ...]

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        """The effect with priors and probes for this setting; None where it cannot occur or cannot be seen."""
        raise NotImplementedError

    def pose(self, recording: Recording, values: Values) -> Recording:
        """Touches as they really were, from touches as commanded and loads as read."""
        return recording

    def finger(self, chain: FingerChain, values: Values) -> FingerChain:
        """The finger with the effect."""
        return chain

    def signal(self, recording: Recording, values: Values) -> FloatArray:
        """Readings (n, m) with the effect, from those so far (`recording.signal`)."""
        return recording.signal

    def simulate(self, recording: Recording, values: Values, rng: np.random.Generator) -> FloatArray:
        """Readings (n, m) of a simulated sensor with the effect: as `signal`, with what is random in it drawn."""
        return self.signal(recording, values)

    @property
    def changes_pose(self) -> bool:
        """Whether touches are not where, or under what load, they are said to be."""
        return type(self).pose is not Effect.pose

    @property
    def changes_finger(self) -> bool:
        """Whether the finger itself is another one."""
        return type(self).finger is not Effect.finger

    @property
    def amplitudes(self) -> tuple[int, ...]:
        """Which of the parameters are amplitudes."""
        return tuple(i for i, each in enumerate(self.parameters) if each.null is not None)

    @property
    def probes(self) -> tuple[Values, ...]:
        """Every combination of the parameters' probes."""
        return tuple(product(*(each.probes for each in self.parameters)))

    def without(self, values: Values) -> Values:
        """The same shape with null amplitudes: an effect that does nothing."""
        return tuple(
            value if each.null is None else each.null for each, value in zip(self.parameters, values, strict=True)
        )

    def drawn(self, which: int, value: float, sd: float, normal: FloatArray) -> FloatArray:
        """Draws of one of its values about the most probable one, from standard normal numbers of any shape.

        For effects whose values are no parameters of the chain.
        """
        return np.clip(value + sd * normal, *self.parameters[which].prior.support)

    def public_parameters(self) -> tuple[Parameter, ...]:
        """The unknowns under the names they have in a calibration: ``crosstalk_share`` …"""
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
