"""Pads that are drawn at random, and touches of them; written without the code of the package.

signal_e = P gain_e (1 + ρ²/z²)^(-5/2), ρ the distance (mm) from the touch to element e: the normal stress at the depth
z in a half-space under a point load. Loads in N, readings in kPa.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parents[1] / "tests"))

from independent import catalogue_forms as forms

Array = np.ndarray

PITCH = 6.0
NOMINAL = np.stack(np.meshgrid(*[PITCH * np.arange(3)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)
# Of the places that are touched, beyond the outermost elements, mm.
MARGIN = 2.0
LOW, HIGH = NOMINAL.min(axis=0) - MARGIN, NOMINAL.max(axis=0) + MARGIN
# Loads are normal, N; below the least load they are drawn again.
LOAD, LOAD_SD, LEAST_LOAD = 1.0, 0.25, 0.2
NOISE, FORCE_NOISE = 0.05, 0.01
# Samples of a touch, and s between them.
SAMPLES, SAMPLE_S = 4, 0.25


@dataclass(frozen=True, eq=False)
class Errors:
    """What a pad has that a linear pad with one kernel and independent noise has not; by default nothing.

    Attributes
    ----------
    map_share, map_mm : float
        Standard deviation (share of the peak) and length of a smooth error of each element's map.
    crosstalk : (float, float)
        Least and largest share of each neighbour's signal; the share of a pad is uniform between them.
    drift_share, drift_s : float
        Standard deviation (share of the peak) and correlation time of a drift of each zero.
    """

    map_share: float = 0.0
    map_mm: float = 5.0
    crosstalk: tuple[float, float] = (0.0, 0.0)
    drift_share: float = 0.0
    drift_s: float = 600.0


@dataclass(frozen=True, eq=False)
class Table:
    """Samples of touches, a row each: touch, time (s), load as read (N), readings (kPa); and the touches.

    Attributes
    ----------
    touch, time_s, read_load : (n,) arrays
    readings : (n, m) array
    place : (t, 2) array
        Where the pad was touched, mm.
    load : (t,) array
        The load that was pressed, N.
    """

    touch: Array
    time_s: Array
    read_load: Array
    readings: Array
    place: Array
    load: Array


@dataclass(frozen=True, eq=False)
class DrawnPad:
    """A pad: depth z (mm), gains (kPa/N), offsets (kPa) and places (mm) of the elements."""

    depth: float
    gain: Array
    offset: Array
    position: Array

    @classmethod
    def of(cls, rng: np.random.Generator) -> DrawnPad:
        """Draw a pad."""
        m = len(NOMINAL)
        return cls(
            float(5.0 * np.exp(0.1 * rng.standard_normal())),
            10 * np.exp(0.15 * rng.standard_normal(m)),
            0.2 * rng.standard_normal(m),
            NOMINAL + 0.3 * rng.standard_normal((m, 2)),
        )

    def sensitivity(self, place: Array) -> Array:
        """Signal per N of touches at places (t, 2), (t, m)."""
        away = np.linalg.norm(place[:, None] - self.position, axis=2)
        return np.asarray(self.gain * (1 + (away / self.depth) ** 2) ** -2.5)

    def touched(
        self,
        counts: tuple[int, ...],
        cycles_s: tuple[float, ...],
        pause_s: float,
        errors: Errors,
        rng: np.random.Generator,
    ) -> tuple[Table, ...]:
        """Tables of so many touches at random places and loads, and s from touch to touch; pauses between tables.

        The corners are touched first: the prior of a place is uniform over the places that a calibration has.
        """
        total = sum(counts)
        place = rng.uniform(LOW, HIGH, (total, 2))
        place[:2] = LOW, HIGH
        load = _loads(total, rng)
        table = np.repeat(np.arange(len(counts)), counts)
        cycle_s = np.repeat(cycles_s, counts)
        start_s = np.cumsum(cycle_s) - cycle_s + pause_s * table
        touch, sample = np.divmod(np.arange(total * SAMPLES), SAMPLES)
        time_s = start_s[touch] + SAMPLE_S * sample
        per_load = self.sensitivity(place)
        if errors.map_share:
            per_load = per_load + errors.map_share * self.gain * smooth(place, errors.map_mm, len(self.gain), rng)
        signal = (load[:, None] * per_load)[touch]
        signal = forms.crosstalk_pad(signal, NOMINAL, PITCH, rng.uniform(*errors.crosstalk))
        if errors.drift_share:
            course = forms.wander(start_s, len(self.gain), errors.drift_s, rng)[touch]
            signal = forms.baseline_drift(signal, self.gain * LOAD, errors.drift_share, course)
        readings = self.offset + signal + NOISE * rng.standard_normal(signal.shape)
        read_load = load[touch] + FORCE_NOISE * rng.standard_normal(len(touch))
        of = table[touch]
        return tuple(
            Table(
                touch[of == k],
                time_s[of == k],
                read_load[of == k],
                readings[of == k],
                place[table == k],
                load[table == k],
            )
            for k in range(len(counts))
        )


def smooth(place: Array, length: float, count: int, rng: np.random.Generator) -> Array:
    """Random functions of the place (t, count) of sd 1, squared-exponential: exp(-d²/2l²), drawn exactly."""
    square = ((place[:, None] - place) ** 2).sum(axis=2)
    values, vectors = np.linalg.eigh(np.exp(-0.5 * square / length**2))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    return np.asarray(root @ rng.standard_normal((len(place), count)))


def _loads(count: int, rng: np.random.Generator) -> Array:
    drawn = LOAD + LOAD_SD * rng.standard_normal(2 * count + 100)
    return np.asarray(drawn[drawn > LEAST_LOAD][:count])
