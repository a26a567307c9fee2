"""What a body gives so that touches on it can be read: the protocols that finger and pad fulfil."""

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

#: Arrays by name; the last axis is the touch.
Drawn = dict[str, FloatArray]


class Block(Protocol):
    """Touches that are read together; t touches, m elements."""

    @property
    def n_touches(self) -> int:
        """How many."""
        ...

    def select(self, index: IntArray) -> Self:
        """Some of them."""
        ...

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """All touches of several blocks."""
        ...


AnyBlock = TypeVar("AnyBlock", bound=Block)
AnyTouches = TypeVar("AnyTouches", contravariant=True)


class TouchGroup(Protocol):
    """Unknown touches that are drawn together."""

    @property
    def rows(self) -> IndexArray:
        """Their places among the touches of the block, ascending."""
        ...

    @property
    def proposal(self) -> BlockProposal:
        """Proposal of the sampler for each of them."""
        ...

    def log_density(self, x: FloatArray, touch: IndexArray) -> FloatArray:
        """Log posterior density (B, n) of points x (B, n, d) of the touches at the places `touch` (B,) of the group."""
        ...

    def results(self, draws: FloatArray) -> Drawn:
        """What is kept of draws (chain, draw, t, d): the arrays of `TouchSampler.shapes`."""
        ...


class TouchSampler(Protocol[AnyTouches]):
    """A calibrated sensor that touches are drawn with."""

    @property
    def redraws_together(self) -> bool:
        """Whether touches with poor draws are drawn again together, wherever they are, or each in its own group."""
        ...

    def pieces(self, rows: IndexArray, again: bool) -> list[IndexArray]:
        """Rows in the pieces that one process takes at a time. They do not depend on the number of processes."""
        ...

    def shapes(self, chains: int, draws: int) -> Mapping[str, tuple[int, ...]]:
        """Names of what is kept, and the shape of each without its last axis, which is the touch."""
        ...

    def groups(self, touches: AnyTouches, rows: IndexArray) -> Iterator[TouchGroup]:
        """Some of the touches, in groups that are drawn together."""
        ...


@dataclass(frozen=True, eq=False)
class Estimates:
    """What was read of t touches, in public names and units.

    Attributes
    ----------
    posterior, sample_stats, reference
        As in `bayestouch.results.objects.TouchPosteriors`.
    rows : TouchRows
        The touches, with the readings that are predicted.
    tips : TipProbabilities or None
        Where the prior of the indenter has tips.
    """

    posterior: Mapping[str, FloatArray]
    sample_stats: Mapping[str, FloatArray]
    reference: Mapping[str, FloatArray]
    rows: TouchRows
    tips: TipProbabilities | None = None


class TouchReader(Protocol):
    """A calibrated sensor that reads touches: a finger or a pad, with or without effects.

    Rows of the touch table become touches in two steps, `average` and `ready`. Only the second one depends on what the
    check of the sensor found.
    """

    @property
    def needs_whole_table(self) -> bool:
        """Whether what is read of a touch depends on other touches of the table: on those before it, or on a drift."""
        ...

    @property
    def sampler(self) -> TouchSampler[Any]:
        """Draws touches."""
        ...

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Unknowns of a touch, with their priors."""
        ...

    @property
    def settings(self) -> Mapping[str, str | float]:
        """What a result says of this body's own options."""
        ...

    @property
    def least_share(self) -> float:
        """Effective draws, as a share of all draws, below which a touch is drawn again."""
        ...

    @property
    def load_unit(self) -> str:
        """Unit of a load."""
        ...

    @property
    def unchecked(self) -> str:
        """Why the sensor cannot be checked; empty where it can."""
        ...

    @property
    def drifts_are_estimated(self) -> bool:
        """Whether drifts are estimated from the touches that are read: a faulty element then looks like a drift."""
        ...

    def average(self, piece: Touches) -> Any:
        """Touches of a piece of the table, the rest reading subtracted; the piece holds its touches whole."""
        ...

    def ready(self, touches: Any) -> Any:
        """A block of touches, without what the check left out, and with the effects of each touch's own time."""
        ...

    def fitted(self, block: Any) -> FittedTouches:
        """The touches as the check of the sensor wants them."""
        ...

    def without(self, check: SensorCheck) -> Self:
        """The reader that goes on without faulty columns, with wires in order, and with noise that covers misfits."""
        ...

    def unknown(self, block: Any) -> Any:
        """The touches as the sampler wants them."""
        ...

    def estimates(self, block: Any, drawn: Drawn) -> Estimates:
        """What was read, from what was drawn and its grades."""
        ...

    def notes(self, found: Survey, whole: Any | None) -> tuple[str, ...]:
        """What is to be said of the touches; `whole` is the averaged table where it is needed whole."""
        ...
