"""Posterior of one touch as a live reader returns it, and the protocol that each body implements."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.errors import InputError, unknown_name
from bayestouch.output.summary import Summarised
from bayestouch.output.text import plural, plus_minus

#: Probabilities of the quantiles of a `LiveTouch`.
LEVELS = np.array([0.05, 0.5, 0.95])
#: Flag of a touch whose mean is nearer to an end of a prior than so many sd.
CLOSE, AT_AN_END = 3.0, "the location or the load is at an end of its prior"
#: Flag of a touch whose readings have a larger misfit with less than this probability.
IMPROBABLE, MISFIT = 1e-4, "the readings fit no touch of this sensor"


@dataclass(frozen=True, eq=False, repr=False)
class LiveTouch(Summarised):
    """Posterior of one touch, as `bayestouch.Reader` returns it; d parameters.

    Attributes
    ----------
    names : tuple of str
        Parameters: ``R``, ``theta_c``, ``P`` on a finger; ``x``, ``y`` (in two dimensions), ``P`` on a pad.
    units : tuple of str
        Their units: mm, degree and N/m on a finger; mm and N on a pad (empty if loads were not measured).
    mean, sd : (d,) arrays
        Posterior mean and standard deviation.
    quantiles : (d, 3) array
        5, 50 and 95 % quantiles.
    covariance : (d, d) array
        Posterior covariance.
    tips : mapping of str to float
        Posterior probability of each known tip, by its radius in mm as text, and of ``round``; empty without tips.
    misfit : float
        Probability of a misfit of the readings at least this large if calibration and noise are right; NaN if there
        are no more readings than parameters.
    samples : int
        Number of samples that the touch has so far, also of those that a pad does not use (`Reader.update`).
    flags : tuple of str
        Reasons not to rely on the result; empty if there are none.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> dataset = bayestouch.simulate(design, seed=3).dataset
    >>> calibration = bayestouch.calibrate(dataset, draws=200)
    >>> readings = dataset.touches.readings[:20].mean(axis=0)  # the 20 samples of the first touch
    >>> touch = bayestouch.Reader(calibration).read(readings, reads=20)
    >>> touch.names, touch.units
    (('R', 'theta_c', 'P'), ('mm', 'degree', 'N/m'))
    >>> float(touch.mean[1].round()), touch.flags  # touched at -20 degrees; no reason to doubt it
    (-20.0, ())
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    mean: FloatArray
    sd: FloatArray
    quantiles: FloatArray
    covariance: FloatArray
    misfit: float
    samples: int = 1
    tips: Mapping[str, float] = field(default_factory=dict)
    flags: tuple[str, ...] = ()

    @property
    def grade(self) -> int:
        """1 if there is no flag, else 0; as ``sample_stats["grade"]`` of `bayestouch.infer`."""
        return int(not self.flags)

    def __getitem__(self, name: str) -> tuple[float, float]:
        """Mean and standard deviation of a parameter.

        Raises
        ------
        InputError
            If there is no such parameter.
        """
        if name not in self.names:
            raise unknown_name("parameter", name, self.names)
        k = self.names.index(name)
        return float(self.mean[k]), float(self.sd[k])

    def summary_lines(self) -> list[str]:
        """Lines that ``repr`` shows."""
        rows = zip(self.names, self.units, self.mean, self.sd, strict=True)
        lines = [f"{name} = {plus_minus(mean, sd)} {unit}".rstrip() for name, unit, mean, sd in rows]
        lines += [f"tip {name}: {probability:.3f}" for name, probability in self.tips.items()]
        return [f"LiveTouch of {plural(self.samples, 'sample')}, grade {self.grade}", *lines, *self.flags]


@dataclass(frozen=True, eq=False)
class HeldTouch:
    """Sums over the samples of one touch so far, which are all that its posterior depends on; m elements.

    Attributes
    ----------
    total : (m,) array
        Sum of the readings minus the rest reading, weighted by raw reads; missing readings are left out.
    raw_counts : (m,) array
        Number of raw reads of each element.
    load_total, load_count : float
        Weighted sum of the measured loads (N/m or N), and its weight; 0 if no load was measured.
    first_load, first_reads : float
        First measured load (NaN without one) and its number of raw reads.
    loads_differ : bool
        Whether another measured load differs from the first one.
    samples : int
        Number of samples.
    rest_reads : (m,) array or None
        Number of raw reads behind the rest reading of the touch; None if its noise is not the touch's own.
    """

    total: FloatArray
    raw_counts: FloatArray
    load_total: float = 0.0
    load_count: float = 0.0
    first_load: float = np.nan
    first_reads: float = 0.0
    loads_differ: bool = False
    samples: int = 0
    rest_reads: FloatArray | None = None

    @classmethod
    def none(cls, n_elements: int, rest_reads: FloatArray | None = None) -> HeldTouch:
        """A touch without samples."""
        return cls(np.zeros(n_elements), np.zeros(n_elements), rest_reads=rest_reads)

    @property
    def counts(self) -> FloatArray:
        """Number of raw reads with the noise of the mean readings, (m,), as `TouchMeans.counts`."""
        n = self.raw_counts
        return n if self.rest_reads is None else np.asarray(n / (1 + n / self.rest_reads))

    def after(self, values: FloatArray, load: float, reads: float = 1.0) -> HeldTouch:
        """The touch with one more sample: readings (m,), NaN missing, and a load, NaN not measured."""
        here = values == values
        total = self.total + reads * (values if here.all() else np.where(here, values, 0.0))
        measured = load == load
        first = measured and not self.load_count
        return HeldTouch(
            total,
            self.raw_counts + reads * here,
            self.load_total + (reads * load if measured else 0.0),
            self.load_count + (reads if measured else 0.0),
            load if first else self.first_load,
            reads if first else self.first_reads,
            self.loads_differ or (measured and not first and load != self.first_load),
            self.samples + 1,
            self.rest_reads,
        )

    @property
    def readings(self) -> FloatArray:
        """Mean readings (m,); 0 where missing."""
        return np.asarray(self.total / np.maximum(self.raw_counts, 1e-300))

    @property
    def reads_of_load(self) -> float:
        """Number of raw reads of the mean load, at least 1; equal loads are one, as in `TouchMeans.load_reads`."""
        return max(self.load_count if self.loads_differ else self.first_reads, 1.0)

    @property
    def load(self) -> float:
        """Mean measured load, N/m or N; NaN if not measured."""
        return self.load_total / self.load_count if self.load_count else np.nan


class LiveStream(Protocol):
    """Effects that depend on time and on earlier touches, followed along a stream. It changes with every sample."""

    @property
    def needs_time(self) -> bool:
        """Whether the times of the samples matter."""
        ...

    def begin(self, time_s: float) -> None:
        """A touch begins at this time."""
        ...

    def add(self, held: HeldTouch, values: FloatArray, load: float, time_s: float, reads: float) -> HeldTouch:
        """The touch with one more sample: readings (m,), load, time, and number of raw reads."""
        ...

    def end(self) -> None:
        """The touch has ended."""
        ...


def require_seconds(unit: str) -> None:
    """Refuse a calibration whose effects of time count in touches: their times have no meaning in s.

    Raises
    ------
    InputError
        If the unit of the effects' times is not the second.
    """
    if unit != "s":
        raise InputError(
            "calibration: its effects depend on time, but its touches had no times, so that a live reader cannot "
            "follow them: calibrate with the column time_s"
        )


class LiveBody(Protocol):
    """A calibrated sensor that reads one touch at a time."""

    @property
    def n_elements(self) -> int:
        """Number of elements m."""
        ...

    def arrays(self) -> dict[str, FloatArray]:
        """What took time to compute, for a file."""
        ...

    def stream(self) -> LiveStream | None:
        """A new stream of samples; None if no effect depends on samples."""
        ...

    def read(self, touch: HeldTouch, near: Any | None, stream: Any | None) -> tuple[LiveTouch, Any]:
        """Posterior of a touch, and where it was found; `near` is where an earlier result was found, or None."""
        ...
