"""Correction of the readings and loads of a pad for effects; the corrected signal is linear in the acting load.

A reading is a known function of the signal, of time and of earlier touches, and does not depend on the location. The
function is solved for the signal by Newton steps. Effects that depend on the location are part of the empirical map.

The *acting load* is the load after all effects on it; the *true load* is the one that presses on the pad.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.noise import Noise
from bayestouch.chain.recording import History, Recording
from bayestouch.data.sensor import pad_of
from bayestouch.data.touches import Touches
from bayestouch.effects import Effect, Values, places_of_values
from bayestouch.model.effect_list import EffectList
from bayestouch.model.missing import holds, left_by_missing, missing_in
from bayestouch.model.observations import history_of
from bayestouch.model.outliers import RightReadings, without_wrong
from bayestouch.model.timing import Timing
from bayestouch.pad.added_noise import NoiseByEffects
from bayestouch.results.keys import EFFECT_NOISE_SD, EFFECT_PEAK, EFFECT_ROOT, EFFECT_VALUES, EFFECT_ZERO
from bayestouch.results.objects import Calibration

# Number of Newton steps for the signal; each step at least halves the error. With the second number, a start from a
# nearly right signal gives the change of the signal to a thousandth.
STEPS, STEPS_NEAR = 25, 10
# Step of the central difference of a reading over its signal, over the peak; smallest slope in a Newton step.
SLOPE_STEP, LEAST_SLOPE = 1e-4, 0.1
# Smallest noise of an acting load over that at the reference load, and smallest change of an acting load over that of
# the true load: a load that does not act is known, but a standard deviation of zero has no density.
LEAST_RELATIVE_SLOPE = 1e-3
# Number of loads at which effects of the load are tabulated.
GRID = 2001
# Largest load of these tables over the reference load: far beyond the loads of a calibration.
LARGEST_LOAD = 20.0


@dataclass(frozen=True, eq=False)
class PadEffects:
    """Effects of a calibrated pad with their values, in the order in which they act; m elements.

    Attributes
    ----------
    listed : EffectList
        All effects of the calibration, and their setting.
    values : mapping of str to tuple of float
        Values of each effect, by its name.
    peak : (m,) array
        Absolute peak reading of each element.
    zero : (m,) array
        Readings without touch, minus the rest reading.
    element_place : tuple of (m,) arrays
        Nominal locations of the elements, mm.
    root : (q, q) array
        Lower Cholesky factor of the covariance of the values of the effects `corrected_for`, in this order, in the
        coordinates of fits (`EffectParameter.to_unconstrained`); (0, 0) if the values count as exact. Each column is an
        independent cause of errors of the values.
    sd : (m,) array, optional
        Noise of one reading without what effects of the noise add; with it, readings that are wrong by an effect of the
        noise are left out.
    by_effects : NoiseByEffects, optional
        What effects of the noise add to the noise of the calibration; None if they add nothing, or if it has them.
    calibrated : (n, m) array, optional
        Mean readings of the touches of the calibration, with which touches are read; zero where missing.
    """

    listed: EffectList
    values: Mapping[str, Values]
    peak: FloatArray
    zero: FloatArray
    element_place: tuple[FloatArray, ...]
    root: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    sd: FloatArray | None = None
    by_effects: NoiseByEffects | None = None
    calibrated: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))

    def noise(self, noise: Noise) -> Noise:
        """The noise of readings, from that of the calibration."""
        return noise if self.by_effects is None else self.by_effects.to(noise)

    @property
    def right(self) -> RightReadings | None:
        """Noise of a corrected reading that is not wrong; None if that is not known."""
        return None if self.sd is None else RightReadings(self.sd, self.peak, self.listed.noise)

    @property
    def reference_load(self) -> float:
        """Load at which `peak` is given, N."""
        return self.listed.setting.reference_load

    @cached_property
    def _corrected(self) -> tuple[tuple[Effect, Values], ...]:
        """Effects that do not depend on the location, with their values, in the order in which they act."""
        nowhere = self._recording(np.ones(1), self.peak[None], tuple(np.full(1, np.nan) for _ in self.element_place))
        out = []
        for effect in sorted(self.listed.plain, key=lambda each: each.order):
            values = self.values[effect.name]
            if not goes_with_place(effect, values, nowhere):
                out.append((effect, values))
        return tuple(out)

    @property
    def corrected_for(self) -> tuple[Effect, ...]:
        """Effects that readings and loads are corrected for, in the order of `listed`."""
        left = self.left_to_map
        return tuple(effect for effect in self.listed.plain if effect.name not in left)

    def moved(self, cause: int, share: float) -> PadEffects:
        """The effects, their values moved by `share` standard deviations of the cause in column `cause` of `root`."""
        values = dict(self.values)
        for effect, there in zip(self.corrected_for, places_of_values(self.corrected_for), strict=True):
            moved = zip(effect.parameters, values[effect.name], share * self.root[there, cause], strict=True)
            values[effect.name] = tuple(p.from_unconstrained(p.to_unconstrained(v) + step) for p, v, step in moved)
        return replace(self, values=values)

    @property
    def left_to_map(self) -> tuple[str, ...]:
        """Names of the effects that depend on the location; the empirical map includes them."""
        corrected = {effect.name for effect, _ in self._corrected}
        return tuple(effect.name for effect in self.listed.plain if effect.name not in corrected)

    def _recording(self, load: FloatArray, signal: FloatArray, place: tuple[FloatArray, ...]) -> Recording:
        n = len(load)
        return Recording(
            indenter_radius_mm=np.full(n, np.nan),
            place=place,
            load=load,
            time_s=np.zeros(n),
            held_s=np.zeros(n),
            element_place=self.element_place,
            peak=self.peak,
            reference_load=self.reference_load,
            signal=signal,
        )

    def clock(self, touches: Touches) -> Timing:
        """Times of the rows of a table, in the unit of the times of these effects."""
        return Timing.in_unit(touches, self.listed.setting.time_unit)

    def corrected(self, touches: Touches, clock: Timing | None = None, *, near: Touches | None = None) -> Touches:
        """The table with signals (plus the zeros of the elements) instead of readings, and with acting loads.

        Parameters
        ----------
        touches : Touches
            Table with the rest reading subtracted.
        clock : Timing, optional
            Times of the rows; by default from the table.
        near : Touches, optional
            The same table, corrected with nearly the same values: the start of the Newton steps.
        """
        rows = np.flatnonzero(touches.in_contact)
        clock = clock or self.clock(touches)
        place = tuple(np.full(len(rows), np.nan) for _ in self.element_place)
        recording = replace(
            self._recording(np.ones(len(rows)), np.zeros((len(rows), len(self.peak))), place),
            time_s=clock.time_s[rows],
            held_s=clock.held_s[rows],
            history=history_of(touches, clock.time_s).above(self.zero) if len(rows) else None,
        )
        readings = touches.readings.copy()
        missing = np.isnan(readings[rows])
        read = np.where(missing, 0.0, readings[rows] - self.zero)
        start = read
        if near is not None:
            start = np.where(np.isnan(near.readings[rows]), read, near.readings[rows] - self.zero)
        signal = self._signal_behind(recording, read, start, STEPS if near is None else STEPS_NEAR)
        readings[rows] = np.where(missing, np.nan, signal + self.zero)
        load = touches.load.copy()
        load[rows] = self.acting(load[rows])
        return touches.with_(readings=readings, load=load, readings_sd=None)

    def left_by_missing(
        self, read: FloatArray, when_s: FloatArray, missing_s: FloatArray, known_s: FloatArray
    ) -> FloatArray:
        """Mean square (t, m, m) of what touches that may be missing leave; see `bayestouch.model.missing`."""
        effects = [(effect, self.values[effect.name]) for effect in self.listed.plain]
        return left_by_missing(effects, self.calibrated, self.peak, read - self.zero, when_s, missing_s, known_s)

    def left_by_missing_of(self, table: Touches, read: FloatArray) -> FloatArray:
        """`left_by_missing` for the touches of a table, with their mean readings (t, m)."""
        clock = self.clock(table)
        _, begin_s, end_s = holds(table, clock)
        missing_s = missing_in(table, clock, self.listed.plain, self.listed.setting, len(self.calibrated))
        return self.left_by_missing(read, begin_s, missing_s, end_s)

    def without_wrong(self, corrected: Touches) -> Touches:
        """A corrected table without the readings that are probably wrong by an effect of the noise."""
        right = self.right
        if right is None:
            return corrected
        for effect in self.listed.of_noise:
            corrected = without_wrong(corrected, effect, self.values[effect.name], right)
        return corrected

    def corrected_sample(
        self, readings: FloatArray, load: float, time_s: float, held_s: float, history: History | None
    ) -> tuple[FloatArray, float]:
        """One row, corrected as in `corrected`: readings (m,), NaN missing, and load; `history` has earlier touches."""
        missing = np.isnan(readings)
        place = tuple(np.full(1, np.nan) for _ in self.element_place)
        recording = replace(
            self._recording(np.ones(1), np.zeros((1, len(self.peak))), place),
            time_s=np.array([time_s]),
            held_s=np.array([held_s]),
            history=None if history is None else history.above(self.zero),
        )
        read = np.where(missing, 0.0, readings - self.zero)[None]
        signal = self._signal_behind(recording, read, read, STEPS, 1e-9)[0] + self.zero
        return np.where(missing, np.nan, signal), float(self.acting(np.array([load]))[0])

    def _readings(self, recording: Recording, signal: FloatArray) -> FloatArray:
        recording = replace(recording, signal=signal)
        for effect, values in self._corrected:
            recording = replace(recording, signal=effect.signal(recording, values))
        return recording.signal

    def _signal_behind(
        self, recording: Recording, read: FloatArray, signal: FloatArray, steps: int, close: float = 0.0
    ) -> FloatArray:
        """Signals (n, m) that give the readings `read` (n, m), by Newton steps from `signal`.

        There are at most `steps` steps; they end when a step of all signals is at most `close` times the peak.
        """
        step = SLOPE_STEP * self.peak
        for _ in range(steps):
            up, down = (self._readings(recording, signal + sign * step) for sign in (1, -1))
            slope = np.maximum((up - down) / (2 * step), LEAST_SLOPE)
            moved = (read - self._readings(recording, signal)) / slope
            signal = signal + moved
            if close and (np.abs(moved) <= close * self.peak).all():
                break
        return np.asarray(signal)

    def acting(self, read: FloatArray) -> FloatArray:
        """Acting load (n,) from loads as read by the force sensor; NaN where `read` is NaN."""
        return self._posed(read, self._corrected)

    def pressed(self, read: FloatArray) -> FloatArray:
        """True load (n,) from loads as read by the force sensor; NaN where `read` is NaN."""
        return self._posed(read, [pair for pair in self._corrected if pair[0].stage == "rig"])

    def acting_of_pressed(self, load: FloatArray) -> FloatArray:
        """Acting load (n,) from true loads: inverse of `pressing`."""
        return self._posed(load, [pair for pair in self._corrected if pair[0].stage != "rig"])

    def as_read(self, acting: FloatArray) -> FloatArray:
        """Load as read by the force sensor, from acting loads of any shape: inverse of `acting` where it increases."""
        return np.asarray(np.interp(acting, *self._read_by_acting))

    def pressing(self, acting: FloatArray) -> FloatArray:
        """True load from acting loads of any shape: inverse of the effects of the contact."""
        contact = [pair for pair in self._corrected if pair[0].stage != "rig"]
        return np.asarray(np.interp(acting, *self._inverse(contact)))

    def pressing_slope(self, acting: FloatArray) -> FloatArray:
        """Derivative of `pressing`, any shape; zero for acting loads that no tabulated true load gives."""
        return self._derivative(self.pressing, acting)

    def acting_slope(self, pressed: FloatArray) -> FloatArray:
        """Derivative of acting loads over true loads (n,), at least `LEAST_RELATIVE_SLOPE`."""
        return np.maximum(self._derivative(self.acting_of_pressed, pressed), LEAST_RELATIVE_SLOPE)

    def _posed(self, load: FloatArray, effects: Sequence[tuple[Effect, Values]]) -> FloatArray:
        recording = self._recording(
            load, np.zeros((len(load), len(self.peak))), tuple(np.full(len(load), np.nan) for _ in self.element_place)
        )
        for effect, values in effects:
            recording = effect.pose(recording, values)
        return recording.load

    @cached_property
    def _read_by_acting(self) -> tuple[FloatArray, FloatArray]:
        """Acting loads and loads as read; once, as a live reader asks for them at every touch."""
        return self._inverse(self._corrected)

    def _inverse(self, effects: Sequence[tuple[Effect, Values]]) -> tuple[FloatArray, FloatArray]:
        """Loads after some effects, increasing, and loads before them."""
        return np.maximum.accumulate(self._posed(self.load_grid, effects)), self.load_grid

    @cached_property
    def load_grid(self) -> FloatArray:
        """Loads at which inverse functions are tabulated; beyond the last one they are constant."""
        return np.asarray(self.reference_load * np.linspace(0.0, LARGEST_LOAD, GRID))

    @cached_property
    def load_slope(self) -> float:
        """Derivative of the acting load over the load as read, at the reference load."""
        return float(self._derivative(self.acting, np.array([self.reference_load]))[0])

    def relative_slope(self, acting: FloatArray) -> FloatArray:
        """Derivative of acting loads (n,) over the load as read, over that at the reference load.

        The noise of the force sensor is one of the load as read. Where the response flattens, the acting load has less
        of it, and elements tell less of the load.
        """
        slope = self._derivative(self.acting, self.as_read(acting)) / self.load_slope
        return np.where(np.isnan(acting), np.nan, np.maximum(slope, LEAST_RELATIVE_SLOPE))

    def _derivative(self, of: Callable[[FloatArray], FloatArray], load: FloatArray) -> FloatArray:
        """Derivative of a function of loads, by a central difference."""
        step = 1e-4 * self.reference_load
        return np.asarray((of(load + step) - of(load - step)) / (2 * step))

    def arrays(self) -> dict[str, FloatArray]:
        """Arrays for the file of a calibration."""
        flat = [value for effect in self.listed.effects for value in self.values[effect.name]]
        out = {EFFECT_PEAK: self.peak, EFFECT_ZERO: self.zero, EFFECT_VALUES: np.array(flat, dtype=np.float64)}
        if len(self.root):
            out[EFFECT_ROOT] = self.root
        if self.by_effects is not None and self.sd is not None:
            out[EFFECT_NOISE_SD] = self.sd
        return out

    @classmethod
    def of(cls, calibration: Calibration) -> PadEffects | None:
        """Effects of a calibration; None if it has no effects.

        Raises
        ------
        InputError
            For the reasons of `bayestouch.model.effect_list.EffectList.of`.
        """
        listed = EffectList.of(calibration)
        if listed is None:
            return None
        flat = np.asarray(calibration.extra[EFFECT_VALUES], dtype=np.float64)
        there = places_of_values(listed.effects)
        values = {e.name: tuple(map(float, flat[at])) for e, at in zip(listed.effects, there, strict=True)}
        places = pad_of(calibration.sensor).places_mm.values()
        peak, zero = np.asarray(calibration.extra[EFFECT_PEAK]), np.asarray(calibration.extra[EFFECT_ZERO])
        apart = EFFECT_NOISE_SD in calibration.extra
        return cls(
            listed=listed,
            values=values,
            peak=peak,
            zero=zero,
            element_place=tuple(np.asarray(axis, dtype=float) for axis in places),
            root=np.asarray(calibration.extra.get(EFFECT_ROOT, np.zeros((0, 0))), dtype=np.float64),
            sd=np.asarray(calibration.noise.tactile_sd, dtype=np.float64),
            by_effects=NoiseByEffects(listed.noise, peak, zero) if apart else None,
            calibrated=np.nan_to_num(calibration.rows.observed - zero),
        )


def goes_with_place(effect: Effect, values: Values, nowhere: Recording) -> bool:
    """Whether an effect depends on the location: its result is NaN for `nowhere`, a recording with NaN locations."""
    load, signal = effect.pose(nowhere, values).load, effect.signal(nowhere, values)
    return not (np.isfinite(load).all() and np.isfinite(signal).all())
