"""Drifts of zeros and gains along a stream of touches: a Kalman filter.

`bayestouch.finger.reading.drift` estimates the drift of a touch from all other touches of a table. In a stream only the
earlier ones are known. The process is the same: a Gaussian process with Matérn 3/2 correlation, which is a linear
stochastic differential equation for its value and its slope.

Source: J. Hartikainen and S. Särkkä, IEEE Workshop on Machine Learning for Signal Processing (2010) 379.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.recording import Recording
from bayestouch.effects.effect import Values
from bayestouch.effects.random import RandomEffect


@dataclass(frozen=True, eq=False)
class DriftFilter:
    """Normal distribution of all drifts at one time; s states: value and slope of each function.

    Attributes
    ----------
    drifts : sequence of (RandomEffect, values)
        The drifts with their values.
    n_elements : int
        Number of elements m.
    time_s : float
        Time to which the distribution belongs; NaN before the first touch.
    mean, covariance : (s,), (s, s) arrays
        Mean and covariance of the states.
    """

    drifts: Sequence[tuple[RandomEffect, Values]]
    n_elements: int
    time_s: float
    mean: FloatArray
    covariance: FloatArray

    @classmethod
    def of(cls, drifts: Sequence[tuple[RandomEffect, Values]], n_elements: int) -> DriftFilter:
        """The stationary distribution, before any touch."""
        rest = [np.repeat(_stationary(values)[None], _count(drift, values, n_elements), 0) for drift, values in drifts]
        covariance = _blocks(np.concatenate(rest)) if rest else np.zeros((0, 0))
        return cls(drifts, n_elements, np.nan, np.zeros(len(covariance)), covariance)

    def at(self, time_s: float) -> DriftFilter:
        """The distribution at a later time, s."""
        if np.isnan(self.time_s):
            return DriftFilter(self.drifts, self.n_elements, time_s, self.mean, self.covariance)
        moves, noise = [], []
        for drift, values in self.drifts:
            count, rate = _count(drift, values, self.n_elements), np.sqrt(3.0) / values[1]
            lag = rate * (time_s - self.time_s)
            move = np.exp(-lag) * np.array([[1 + lag, time_s - self.time_s], [-rate * lag, 1 - lag]])
            stationary = _stationary(values)
            moves += [move] * count
            noise += [stationary - move @ stationary @ move.T] * count
        move = _blocks(np.array(moves))
        covariance = move @ self.covariance @ move.T + _blocks(np.array(noise))
        return DriftFilter(self.drifts, self.n_elements, time_s, move @ self.mean, covariance)

    def columns(self, recording: Recording) -> FloatArray:
        """Change of the readings of one touch per unit of each state, (m, s)."""
        out = []
        for drift, values in self.drifts:
            scale = np.asarray(drift.scale(recording))[0]
            own = np.diag(scale) if drift.own(values) else scale[:, None]
            out.append(np.stack([own, np.zeros_like(own)], axis=-1).reshape(self.n_elements, -1))
        return np.concatenate(out, axis=1)

    def after(self, columns: FloatArray, precision: FloatArray, information: FloatArray) -> DriftFilter:
        """The distribution after a touch.

        Parameters
        ----------
        columns : (m, s) array
            From `columns`.
        precision, information : (m, m), (m,) arrays
            Precision, and precision times mean, of the addition to the readings of the touch.
        """
        seen = columns @ self.covariance
        gain = np.linalg.solve((np.eye(self.n_elements) + precision @ columns @ seen.T).T, seen).T
        covariance = self.covariance - gain @ precision @ seen
        covariance = 0.5 * (covariance + covariance.T)
        mean = self.mean + covariance @ columns.T @ (information - precision @ columns @ self.mean)
        return DriftFilter(self.drifts, self.n_elements, self.time_s, mean, covariance)


def _count(drift: RandomEffect, values: Values, n_elements: int) -> int:
    return n_elements if drift.own(values) else 1


def _stationary(values: Values) -> FloatArray:
    """Covariance of value and slope of the process."""
    sd, time = values[:2]
    return np.diag([sd**2, 3 * (sd / time) ** 2])


def _blocks(parts: FloatArray) -> FloatArray:
    """Block-diagonal matrix of blocks (n, 2, 2)."""
    n = len(parts)
    out = np.zeros((n, 2, n, 2))
    out[range(n), :, range(n)] = parts
    return out.reshape(2 * n, 2 * n)
