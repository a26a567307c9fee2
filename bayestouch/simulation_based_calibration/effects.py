"""Simulated touches with effects, whose values are drawn from their priors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.recording import History, Recording
from bayestouch.chain.smooth import matern_3_2
from bayestouch.data.averages import TouchMeans
from bayestouch.data.dataset import DataSet
from bayestouch.data.grouping import grouped_mean, groups
from bayestouch.data.touches import Touches
from bayestouch.effects import Effect, Values
from bayestouch.effects.kinds import of_time
from bayestouch.effects.random import RandomEffect
from bayestouch.effects.stated import StatedModel
from bayestouch.model.effect_list import named_effects
from bayestouch.model.split_data import SplitData
from bayestouch.model.timing import Timing

# Readings that depend on earlier touches are iterated until none changes by more than this share of the peak.
SETTLED = 1e-12


def known_touches(table: Touches) -> Touches:
    """Touches with a measured load, zeros subtracted, of which each row is one reading."""
    touches = table.baseline_corrected()
    return touches.select(touches.in_contact & np.isfinite(touches.load)).with_(reads=None, readings_sd=None)


@dataclass(frozen=True, eq=False)
class SimulatedEffects:
    """Effects of the simulated sensors.

    Attributes
    ----------
    effects : tuple of Effect
        The effects, with their priors for these touches.
    reference_load : float
        Load of the peak readings, N/m or N.
    """

    effects: tuple[Effect, ...] = ()
    reference_load: float = 1.0

    @classmethod
    def of(cls, names: Sequence[str], dataset: DataSet, contact: str, reference_load: float) -> SimulatedEffects:
        """Effects by name, with the priors that a calibration of this data set uses.

        Raises
        ------
        InputError
            A name is unknown, or the effect cannot occur in these touches.
        """
        setting = SplitData.of_calibration(dataset).setting(contact, reference_load)
        return cls(named_effects(list(names), setting), reference_load)

    def stated(self, body: str, contact: str) -> StatedModel | None:
        """Effects that are given to a calibration; None without effects."""
        listed = tuple((effect.name, dict[str, float]()) for effect in self.effects)
        return StatedModel(body, contact, listed) if listed else None

    def draw(self, rng: np.random.Generator) -> tuple[Values, ...]:
        """Values of each effect, from their priors; of a value that selects a kind, one of the kinds."""
        drawn = []
        for effect in self.effects:
            free = effect.parameters[: self.n_ranked(effect)]
            kinds = tuple(float(rng.choice(p.probes)) for p in effect.parameters[len(free) :])
            drawn.append((*(float(p.prior.quantile(rng.random())) for p in free), *kinds))
        return tuple(drawn)

    @staticmethod
    def n_ranked(effect: Effect) -> int:
        """Number of values that a calibration draws; those after them select the kind of a drift."""
        return 2 if of_time([effect]) else len(effect.parameters)

    def named(self, values: tuple[Values, ...]) -> dict[str, FloatArray]:
        """Values by their names in a calibration."""
        return {
            parameter.name: np.asarray(value)
            for effect, each in zip(self.effects, values, strict=True)
            for parameter, value in zip(effect.public_parameters(), each, strict=True)
        }

    def readings(
        self,
        values: tuple[Values, ...],
        touches: Touches,
        means: TouchMeans,
        element_place: tuple[FloatArray, ...],
        place: tuple[FloatArray, ...],
        load: FloatArray,
        peak: FloatArray,
        press: Callable[[Recording], FloatArray],
        measured: Callable[[FloatArray, np.random.Generator], FloatArray],
        rng: np.random.Generator,
        zero: FloatArray | float = 0.0,
    ) -> FloatArray:
        """Readings (n, m) of all samples with the effects, as measured.

        A calibration takes the earlier touches as they were measured, with their noise. So effects that remember them
        are found by iteration: each step settles one more touch at least, with the same random numbers.

        Parameters
        ----------
        values : tuple of values
            Of each effect.
        touches, means : Touches, TouchMeans
            The samples, and their means by touch.
        element_place, place : tuple of arrays
            Nominal places of the elements (m,), and of the touches (t,).
        load : (t,) array
            True loads.
        peak : (m,) array
            Peak readings, the unit of shares.
        press : callable
            Signals (t, m) of touches before effects on the signal.
        measured : callable
            From readings (n, m) without the noise of the sensor to those that are recorded, NaN missing.
        rng : Generator
            Random numbers of drifts, of noise effects and of `measured`.
        zero : (m,) array or float
            Readings without touch.
        """
        ids, group = groups(touches.touch)
        clock = Timing.of(touches)
        by_touch = Recording(
            indenter_radius_mm=means.indenter_radius_mm,
            place=place,
            load=load,
            time_s=grouped_mean(clock.time_s, group, len(ids)),
            held_s=grouped_mean(clock.held_s, group, len(ids)),
            element_place=element_place,
            peak=peak,
            reference_load=self.reference_load,
            signal=np.zeros((len(ids), len(peak))),
        )
        pairs = sorted(
            zip(self.effects, values, strict=True),
            key=lambda pair: pair[0].order,
        )
        for effect, each in pairs:
            by_touch = effect.pose(by_touch, each)
        rows = replace(
            by_touch,
            indenter_radius_mm=by_touch.indenter_radius_mm[group],
            place=tuple(axis[group] for axis in by_touch.place),
            load=by_touch.load[group],
            time_s=clock.time_s,
            held_s=clock.held_s,
            signal=press(by_touch)[group],
        )

        def recorded(history: History | None, rng: np.random.Generator) -> FloatArray:
            now = replace(rows, history=history)
            for effect, each in pairs:
                drifts = [drift_of(d, each, by_touch, rng)[group] * d.scale(now) for d in of_time([effect])]
                now = replace(now, signal=now.signal + drifts[0] if drifts else effect.simulate(now, each, rng))
            return measured(now.signal, rng)

        if not any(effect.remembers for effect in self.effects):
            return recorded(None, rng)
        (own,) = rng.spawn(1)
        readings = recorded(None, deepcopy(own))
        for _ in ids:
            before = readings
            readings = recorded(History.of(group, clock.time_s, before).above(zero), deepcopy(own))
            if np.nanmax(np.abs(readings - before) / peak) <= SETTLED:
                break
        return readings


def drift_of(effect: RandomEffect, values: Values, touches: Recording, rng: np.random.Generator) -> FloatArray:
    """One drift at the times of t touches, (t, m) or (t, 1): a draw of the exact process, as a calibration assumes it.

    `Effect.simulate` interpolates between knots, so that the function has less variance between them.
    """
    sd, time = values[:2]
    distance = np.abs(touches.time_s[:, None] - touches.time_s) / time
    # A slight noise keeps the factor finite where the function is nearly constant.
    root = np.linalg.cholesky(matern_3_2(distance) + 1e-9 * np.eye(len(distance)))
    columns = touches.signal.shape[1] if effect.own(values) else 1
    return np.asarray(sd * root @ rng.standard_normal((len(root), columns)))
