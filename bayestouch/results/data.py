"""Data of calibrations and of posteriors of touches; `bayestouch.results.objects` adds plots and files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.chain.noise import Noise
from bayestouch.data.arrays import quantiles, responding
from bayestouch.data.sensor import Sensor
from bayestouch.errors import InputError, few, nearest, not_a, number_array
from bayestouch.output.summary import Summarised
from bayestouch.priors.parameters import Parameter
from bayestouch.results.keys import E_MAP, EFFECTS, IDENTIFIED_MAP, REST_READING, REST_READS
from bayestouch.results.tips import TipProbabilities

#: Statistic of a touch: 1 if it is beyond the loads or places that the calibration allows, else 0.
BEYOND = "beyond_prior"
#: Statistic of a touch: 1 if it has no reading that was used, else 0.
UNREAD = "without_reading"


@dataclass(frozen=True, eq=False, repr=False)
class TouchRows(Summarised):
    """Touches with their readings and the model's predictions, one row a touch; t touches, m elements.

    Attributes
    ----------
    touch : (t,) int array
        Number of the touch.
    location : mapping of (t,) arrays
        Reference location by name: ``theta_c`` (degree), or ``x`` and ``y`` (mm); NaN unknown.
    radius_mm : (t,) array
        Reference indenter radius r_c in mm: 0 knife edge, inf flat, NaN unknown.
    load : (t,) array
        Measured load, N/m (finger) or N (pad); NaN where not measured or not used.
    observed, predicted, sd : (t, m) arrays
        Mean reading, predicted reading and standard deviation of their difference, in the sensor's unit. The noise of
        effects is included, and the error of a measured load where readings are predicted with it.
    counts : (t, m) array
        Number of raw reads with the noise of each mean; less than `samples` where a touch has a rest reading of its
        own, whose noise is in the mean. 0 where there is no reading.
    samples, load_reads : (t,) arrays
        Number of raw reads of the elements in each touch, and of the force sensor in its mean load, at least 1.
    sample : (t,) int array, or None
        Number of the sample within its touch, if each sample was read by itself; None if whole touches were.
    """

    touch: NDArray[np.int64]
    location: Mapping[str, FloatArray]
    radius_mm: FloatArray
    load: FloatArray
    observed: FloatArray
    predicted: FloatArray
    sd: FloatArray
    counts: FloatArray
    samples: FloatArray
    load_reads: FloatArray
    sample: NDArray[np.int64] | None = None

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Every array of the touches by name, but for those of `location`."""
        values = {each.name: getattr(self, each.name) for each in fields(self)}
        return {name: value for name, value in values.items() if isinstance(value, np.ndarray)}

    @property
    def responds(self) -> BoolArray:
        """Whether each element has readings that differ from touch to touch, (m,), see `responding`."""
        return responding(self.observed)

    @property
    def usual_load_reads(self) -> float | None:
        """Median number of reads of the force sensor in a touch; None if most touches have one with each sample."""
        known = np.isfinite(self.load)
        fewer = known & (self.load_reads < self.samples)
        return float(np.median(self.load_reads[fewer])) if fewer.sum() > known.sum() / 2 else None


@dataclass(frozen=True, eq=False, repr=False)
class CalibrationData(Summarised):
    """Data of a calibration; `bayestouch.results.objects.Calibration` describes each field."""

    sensor: Sensor
    parameters: tuple[Parameter, ...]
    mode: Mapping[str, FloatArray]
    posterior: Mapping[str, FloatArray]
    covariance: FloatArray
    layout: tuple[str, ...]
    noise: Noise
    rows: TouchRows
    settings: Mapping[str, str | float]
    statistics: Mapping[str, float]
    extra: Mapping[str, FloatArray] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    groups: Mapping[str, Mapping[str, FloatArray]] = field(default_factory=dict)

    @property
    def rest_reading(self) -> FloatArray | None:
        """Reading at rest that was subtracted from the calibration touches, (m,); None if there was no such reading."""
        return self.extra.get(REST_READING)

    @property
    def rest_reads(self) -> FloatArray | None:
        """Number of raw reads behind `rest_reading` whose error is in the offsets of the calibration, (m,), or None."""
        return self.extra.get(REST_READS)

    def with_rest_reading(self, rest: FloatArray | None, reads: FloatArray | None = None) -> Self:
        """Copy of the calibration with another reading at rest (m,) and its `rest_reads`, or without one."""
        given = {REST_READING: rest, REST_READS: reads}
        kept = {name: values for name, values in self.extra.items() if name not in given}
        return replace(self, extra={**kept, **{name: values for name, values in given.items() if values is not None}})

    def of_elements_read(self, values: FloatArray) -> FloatArray:
        """Values or draws (..., m) of the elements that respond in the calibration touches; all if none does.

        Of the other elements nothing but the prior is known, which would be most of a mean or a range. Values of a
        parameter that all elements share are returned as they are.
        """
        read = self.rows.responds
        by_element = values.shape[-1:] == read.shape and bool(read.any())
        return values[..., read] if by_element else values

    @property
    def has_identified_map(self) -> bool:
        """True if the E map of a finger was identified by regression, not taken from the elastic model."""
        return self.settings.get(E_MAP) == IDENTIFIED_MAP

    @property
    def has_effects(self) -> bool:
        """True if the model of the calibration has effects."""
        return EFFECTS in self.settings


def require_calibration(value: object) -> None:
    """Raise an error with the way to a calibration if `value` is none.

    Raises
    ------
    InputError
        It is a path, a diagnosis or something else.
    """
    if isinstance(value, CalibrationData):
        return
    after = hasattr(value, "calibration_after")
    how = "use its attribute calibration_after" if after else "make one: bayestouch.calibrate(dataset)"
    if isinstance(value, str | Path):
        how = f"read it: bayestouch.load({str(value)!r})"
    raise not_a("a calibration", value, how)


def poor_touches(statistics: Mapping[str, FloatArray]) -> tuple[int, int, int]:
    """Numbers of touches with grade 0: without a reading, beyond the priors, and the others, which missed the targets.

    Parameters
    ----------
    statistics : mapping of (t,) arrays
        ``sample_stats`` of posteriors. Files of earlier versions have no `BEYOND` or `UNREAD`.
    """
    poor = np.asarray(statistics["grade"]) == 0
    unread, beyond = (np.asarray(statistics.get(name, np.zeros(poor.shape))) > 0 for name in (UNREAD, BEYOND))
    return int(unread.sum()), int(beyond.sum()), int((poor & ~beyond & ~unread).sum())


@dataclass(frozen=True, eq=False, repr=False)
class PosteriorsData(Summarised):
    """Data of posteriors of touches; `bayestouch.results.objects.TouchPosteriors` describes each field."""

    sensor: Sensor
    parameters: tuple[Parameter, ...]
    posterior: Mapping[str, FloatArray]
    sample_stats: Mapping[str, FloatArray]
    reference: Mapping[str, FloatArray]
    rows: TouchRows
    settings: Mapping[str, str | float]
    notes: tuple[str, ...] = ()
    tips: TipProbabilities | None = None
    estimates: Mapping[str, FloatArray] = field(default_factory=dict)
    groups: Mapping[str, Mapping[str, FloatArray]] = field(default_factory=dict)

    def _check(self, name: str) -> None:
        known = [*self.posterior, *self.estimates]
        if name not in known:
            raise InputError(f"{name}: no such parameter; expected one of {few(known, 20)}{nearest(str(name), known)}")

    def mean(self, name: str) -> FloatArray:
        """Posterior mean of a parameter, shape (t,)."""
        self._check(name)
        if name in self.estimates:
            return np.asarray(self.estimates[name][0])
        return np.asarray(self.posterior[name].mean(axis=(0, 1)))

    def sd(self, name: str) -> FloatArray:
        """Posterior standard deviation of a parameter, shape (t,); NaN where a draw is infinite (r_c of a flat tip)."""
        self._check(name)
        if name in self.estimates:
            return np.asarray(self.estimates[name][1])
        with np.errstate(invalid="ignore"):
            return np.asarray(self.posterior[name].std(axis=(0, 1)))

    def interval(self, name: str, probability: float = 0.9) -> tuple[FloatArray, FloatArray]:
        """Lower and upper limit of the central interval of a parameter: two (t,) arrays.

        Raises
        ------
        InputError
            If there is no such parameter, the probability is not between 0 and 1, or only summaries were kept and it
            is not 0.9.
        """
        self._check(name)
        number_array("probability", probability, 0)
        if not 0 < probability < 1:
            raise InputError(f"probability: expected a number between 0 and 1, got {probability:g}")
        if name in self.estimates and probability == 0.9:
            return self.estimates[name][2], self.estimates[name][4]
        if name not in self.posterior:
            raise InputError(f"probability: only summaries were kept, expected 0.9, got {probability:g}")
        tail = (1 - probability) / 2
        low, high = quantiles(self.posterior[name], [tail, 1 - tail], axis=(0, 1))
        return low, high

    @property
    def unread(self) -> int:
        """Number of touches without a reading: nothing is learnt from them but the load."""
        return poor_touches(self.sample_stats)[0]

    @property
    def beyond(self) -> int:
        """Number of touches beyond the loads or places that the calibration allows."""
        return poor_touches(self.sample_stats)[1]

    @property
    def missed(self) -> int:
        """Number of other touches that missed the targets of effective sample size, R-hat and Pareto shape."""
        return poor_touches(self.sample_stats)[2]
