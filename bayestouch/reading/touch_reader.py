"""Protocols of the inference of touches, which each body (finger, pad) implements."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, Self, TypeVar

from bayestouch.array_types import FloatArray, IndexArray, IntArray
from bayestouch.data.survey import Survey
from bayestouch.data.touches import Touches
from bayestouch.priors.parameters import Parameter
from bayestouch.reading.faults import FittedTouches, SensorCheck
from bayestouch.results.data import TouchRows
from bayestouch.results.tips import TipProbabilities
from bayestouch.sampling import BlockProposal
from bayestouch.sampling.normals import Normals

#: Arrays by name; the last axis is the touch.
Drawn = dict[str, FloatArray]


class Block(Protocol):
    """Touches that are processed together; t touches, m elements."""

    @property
    def n_touches(self) -> int:
        """Number of touches."""
        ...

    def select(self, index: IntArray) -> Self:
        """Block with some of the touches."""
        ...

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Block with all touches of several blocks."""
        ...


AnyBlock = TypeVar("AnyBlock", bound=Block)
AnyTouches = TypeVar("AnyTouches", contravariant=True)


class TouchGroup(Protocol):
    """Unknown touches that are drawn together."""

    @property
    def rows(self) -> IndexArray:
        """Rows of the touches in the block, ascending."""
        ...

    @property
    def proposal(self) -> BlockProposal:
        """Proposal of the sampler for each touch."""
        ...

    def log_density(self, x: FloatArray, touch: IndexArray) -> FloatArray:
        """Log posterior density (B, n) at points x (B, n, d) of touches; `touch` (B,) numbers them in the group."""
        ...

    def results(self, draws: FloatArray) -> Drawn:
        """Arrays that are kept of draws (chain, draw, t, d): those of `TouchSampler.shapes`."""
        ...


class TouchSampler(Protocol[AnyTouches]):
    """Sampler of touches on a calibrated sensor."""

    @property
    def redraws_together(self) -> bool:
        """True if all touches with poor draws are drawn again together; False if each is drawn again in its group."""
        ...

    def pieces(self, rows: IndexArray, again: bool) -> list[IndexArray]:
        """Rows divided into pieces, one for each task of a process. They do not depend on the number of processes."""
        ...

    def shapes(self, chains: int, draws: int) -> Mapping[str, tuple[int, ...]]:
        """Names of the arrays that are kept, with the shape of each without its last axis (the touch)."""
        ...

    def groups(self, touches: AnyTouches, rows: IndexArray) -> Iterator[TouchGroup]:
        """Groups of touches from these rows; a group is drawn together."""
        ...


class TouchModel(Protocol):
    """How the readings and loads of t touches are distributed, given the parameters of the touches; m elements."""

    @property
    def observed(self) -> FloatArray:
        """Mean readings as they were used, (t, m); NaN missing or left out."""
        ...

    @property
    def load(self) -> FloatArray:
        """Measured loads as they were used, (t,); NaN not measured or not used."""
        ...

    @property
    def load_sd(self) -> FloatArray:
        """Standard error of each measured load, (t,)."""
        ...

    @property
    def load_shown(self) -> FloatArray:
        """Measured loads as `observed_data` has them, (t,): before they are corrected for effects."""
        ...

    def readings(self, draws: Drawn, touches: slice) -> Normals:
        """Distribution of the mean readings of some touches at draws by public name, (n, some)."""
        ...

    def measured_load(self, draws: Drawn) -> FloatArray:
        """Load that a correct force sensor would read at draws (n, some)."""
        ...

    def log_prior(self, draws: Drawn, touches: slice) -> Drawn:
        """Log prior density of each parameter of some touches at draws (n, some), in public units."""
        ...

    def prior(self, uniform: FloatArray) -> Drawn:
        """Draws of the prior by public name, (n, some), from uniform random numbers (parameters, n, some)."""
        ...

    @property
    def n_parameters(self) -> int:
        """Number of parameters of a touch."""
        ...


@dataclass(frozen=True, eq=False)
class Estimates:
    """Estimates of t touches, in public names and units.

    Attributes
    ----------
    posterior, sample_stats, reference
        As in `bayestouch.results.objects.TouchPosteriors`.
    rows : TouchRows
        The touches with the predicted readings.
    tips : TipProbabilities or None
        Probabilities of the tips, if the prior of the indenter has tips.
    model : TouchModel or None
        Distribution of readings and loads, for groups that are written on request; None if there are none of them.
    """

    posterior: Mapping[str, FloatArray]
    sample_stats: Mapping[str, FloatArray]
    reference: Mapping[str, FloatArray]
    rows: TouchRows
    tips: TipProbabilities | None = None
    model: TouchModel | None = None


class TouchReader(Protocol):
    """Functions of a calibrated sensor that infer touches: a finger or a pad, with or without effects.

    Rows of the touch table become touches in two steps, `average` and `ready`. Only the second step depends on the
    result of the sensor check.
    """

    @property
    def needs_whole_table(self) -> bool:
        """True if a touch depends on other touches of the table: on those before it, or on a drift."""
        ...

    @property
    def sampler(self) -> TouchSampler[Any]:
        """Sampler of touches."""
        ...

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Unknown parameters of a touch, with their priors."""
        ...

    @property
    def settings(self) -> Mapping[str, str | float]:
        """Settings of the result that only this body has."""
        ...

    @property
    def least_share(self) -> float:
        """Effective draws as a share of all draws; with fewer, a touch is drawn again."""
        ...

    @property
    def load_unit(self) -> str:
        """Unit of a load."""
        ...

    @property
    def unchecked(self) -> str:
        """Reason why the sensor cannot be checked; empty if it can."""
        ...

    @property
    def drifts_are_estimated(self) -> bool:
        """True if drifts are estimated from the touches to be inferred; then a faulty element looks like a drift."""
        ...

    def average(self, piece: Touches) -> Any:
        """Averaged touches of a part of the table, rest reading already subtracted; no touch is split between parts."""
        ...

    def ready(self, touches: Any) -> Any:
        """Block of touches without the columns that the check left out, with effects at the time of each touch."""
        ...

    def fitted(
        self, touches: Any, block: Any, some: IntArray, rest_variance: FloatArray | None = None
    ) -> FittedTouches:
        """Some touches, by their positions, in the form that the check needs; from `average`, and from `ready`.

        `rest_variance` (m,) is that of the error that they share by the rest reading.
        """
        ...

    def without(self, check: SensorCheck) -> Self:
        """Reader without faulty columns, with wires in the right order, and with noise widened to cover misfits."""
        ...

    def unknown(self, block: Any) -> Any:
        """Touches in the form that the sampler needs."""
        ...

    def estimates(self, block: Any, drawn: Drawn, first: int) -> Estimates:
        """Estimates from the draws and their grades; `first` touches of the table are before the block."""
        ...

    def notes(self, found: Survey, whole: Any | None) -> tuple[str, ...]:
        """Notes on the touches; `whole` is the averaged table if the whole table is needed."""
        ...
