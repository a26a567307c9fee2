"""What a calibration and posteriors of touches hold; `bayestouch.results.objects` adds what a user does with them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.chain.noise import Noise
from bayestouch.data.arrays import quantiles
from bayestouch.data.sensor import Sensor
from bayestouch.output.summary import Summarised
from bayestouch.priors.parameters import Parameter
from bayestouch.results.tips import TipProbabilities


@dataclass(frozen=True, eq=False, repr=False)
class TouchRows(Summarised):
    """Touches with what was read and what the model says, one row a touch; t touches, m elements.

    Attributes
    ----------
    touch : (t,) int array
        Identifier.
    location : mapping of (t,) arrays
        Reference location by name: ``theta_c`` (degree), or ``x`` and ``y`` (mm); NaN unknown.
    radius_mm : (t,) array
        Reference indenter radius r_c in mm: 0 knife edge, inf flat, NaN unknown.
    load : (t,) array
        Measured load, N/m (finger) or N (pad); NaN where not measured.
    observed, predicted, sd : (t, m) arrays
        Mean reading, prediction and standard deviation of their difference, in the sensor's unit.
    counts : (t, m) int array
        Raw readings behind each mean.
    """

    touch: NDArray[np.int64]
    location: Mapping[str, FloatArray]
    radius_mm: FloatArray
    load: FloatArray
    observed: FloatArray
    predicted: FloatArray
    sd: FloatArray
    counts: NDArray[np.int64]


@dataclass(frozen=True, eq=False, repr=False)
class CalibrationData(Summarised):
    """A calibrated sensor: every calibration parameter as a random variable.

    Attributes
    ----------
    sensor : Sensor
        The sensor as built.
    parameters : tuple of Parameter
        The unknowns with their priors. By element where `mode` holds an array.
    mode : mapping
        Maximum a posteriori, scalar () or by element (m,) arrays, in public units
        (``r_s`` mm, ``theta_s`` degree, ``mu`` MPa, ``gain`` reading per strain, ``response`` reading per N/m …).
    posterior : mapping
        Draws, (chain, draw) or (chain, draw, m) arrays, by the same names.
    covariance : (d, d) array
        Laplace covariance of the parameters in the order and units of `layout`.
    layout : tuple of str
        Name of each row of `covariance`: ``"sigma"``, ``"r_s[3]"`` …
    noise : Noise
        Noise of readings and force sensor.
    rows : TouchRows
        The calibration touches with their fit.
    settings : mapping
        Whatever repeats the run: contact model or kernel, seed, version, options; text or numbers.
    statistics : mapping of str to float
        ``lack_of_fit``, ``error_percent_peak`` and the like.
    extra : mapping of arrays
        Arrays a body needs beside these (a pad's empirical map).
    notes : tuple of str
        What was handled or assumed, one sentence each, for the report.
    """

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


@dataclass(frozen=True, eq=False, repr=False)
class PosteriorsData(Summarised):
    """Posteriors of touches.

    Attributes
    ----------
    sensor : Sensor
        The sensor that was touched.
    parameters : tuple of Parameter
        Touch parameters with their priors: ``R``, ``theta_c``, ``P`` on a finger (``r_c`` is derived from R);
        ``x``, ``y``, ``P`` on a pad.
    posterior : mapping of (chain, draw, t) arrays
        Draws, in public units (mm, degree, N/m or N); of a large file they are read when asked for. Empty where only
        summaries were kept.
    sample_stats : mapping of (t,) arrays
        ``ess_bulk`` and ``rhat`` (worst parameter of the touch), ``acceptance``, ``pareto_k``, and ``grade``: 1 where
        the targets are met. They are those of all draws, however few were kept.
    reference : mapping of (t,) arrays
        Reference values by the same names as `posterior`, NaN unknown.
    rows : TouchRows
        The touches with the prediction at the posterior mean.
    settings, notes
        As in `Calibration`.
    tips : TipProbabilities or None
        How probable each tip is for each touch, where the prior over indenters has known tips.
    summary : mapping of (5, t) arrays
        Mean, sd and 5, 50 and 95 % quantiles of all draws, however few were kept; empty where all are.
    """

    sensor: Sensor
    parameters: tuple[Parameter, ...]
    posterior: Mapping[str, FloatArray]
    sample_stats: Mapping[str, FloatArray]
    reference: Mapping[str, FloatArray]
    rows: TouchRows
    settings: Mapping[str, str | float]
    notes: tuple[str, ...] = ()
    tips: TipProbabilities | None = None
    summary: Mapping[str, FloatArray] = field(default_factory=dict)

    def mean(self, name: str) -> FloatArray:
        """Posterior mean of a parameter, shape (t,)."""
        if name in self.summary:
            return np.asarray(self.summary[name][0])
        return np.asarray(self.posterior[name].mean(axis=(0, 1)))

    def sd(self, name: str) -> FloatArray:
        """Posterior standard deviation of a parameter, shape (t,); NaN where a draw is infinite (a flat tip's r_c)."""
        if name in self.summary:
            return np.asarray(self.summary[name][1])
        with np.errstate(invalid="ignore"):
            return np.asarray(self.posterior[name].std(axis=(0, 1)))

    def interval(self, name: str, probability: float = 0.9) -> tuple[FloatArray, FloatArray]:
        """Central interval of a parameter: two (t,) arrays.

        Raises
        ------
        InputError
            Only summaries were kept, and the probability is not 0.9.
        """
        if name in self.summary and probability == 0.9:
            return self.summary[name][2], self.summary[name][4]
        tail = (1 - probability) / 2
        low, high = quantiles(self.posterior[name], [tail, 1 - tail], axis=(0, 1))
        return low, high

    @property
    def missed(self) -> int:
        """How many touches missed the targets of effective sample size, R-hat and Pareto shape."""
        return int((self.sample_stats["grade"] == 0).sum())
