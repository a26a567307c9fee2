"""Input of the calibration of a pad: known touches, loads, priors."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.chain.noise import Noise
from bayestouch.chain.pad import element_pitch
from bayestouch.data.arrays import responding
from bayestouch.data.averages import TouchMeans, average
from bayestouch.data.baseline import shared_rest_reads
from bayestouch.data.sensor import Sensor, pad_of
from bayestouch.data.touches import Touches
from bayestouch.errors import InputError
from bayestouch.model.observations import Observations, history_of
from bayestouch.model.timing import Timing
from bayestouch.model.usable_touches import without_load
from bayestouch.pad.added_noise import NoiseByEffects, NoiseWithEffects
from bayestouch.pad.known_touches import choose_samples, counted_samples, faintest_readings, pad_readings
from bayestouch.pad.noise import LeftOut, fit_noise
from bayestouch.pad.priors import PadPriors, check_places, pad_priors
from bayestouch.priors.parameters import Prior

# Assumed noise of a force sensor whose noise is not stated, over the mean load.
UNSTATED_FORCE_NOISE = 0.005

# Degrees of freedom of rest readings from which the noise of one read is known within a third.
LEAST_AT_REST = 4

# Largest number of touches: the covariance between so many takes 128 MB while the map of an element is built.
_MOST_TOUCHES = 4000


OfLoads = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True, eq=False)
class PadProblem:
    """Known touches and priors of the calibration of a pad; n touches, m elements.

    Attributes
    ----------
    known : TouchMeans
        Touches with location and load in N; all loads are 1 if none was measured.
    observed : Observations
        The same touches with their samples; NaN for elements that do not respond.
    priors : PadPriors
        Priors of the parameters.
    pitch_mm : float
        Distance between neighbouring elements.
    read_variance : (m,) array
        Variance of one read: from repeats or, where no touch was read twice, from the rest readings; NaN unknown. With
        `by_effects`, without what effects of the noise add.
    load_share : (n,) array
        Standard error of each load, over the load; NaN if loads were not measured.
    force_sd : float
        Noise of one reading of the force sensor, N; NaN if loads were not measured.
    samples : str
        Samples of a touch that are used: ``"mean"``, ``"first"`` or ``"last"``.
    usable : (m,) bool array
        Elements that respond.
    rest : (m,) array or None
        Rest reading that was subtracted from touches without one of their own.
    rest_reads : (m,) array or None
        Number of raw reads behind `rest`; None if no touch needed it.
    seed : int
        Seed of the random numbers.
    by_effects : NoiseByEffects or None
        What effects of the noise add to the noise of the readings.
    """

    known: TouchMeans
    observed: Observations
    priors: PadPriors
    pitch_mm: float
    read_variance: FloatArray
    load_share: FloatArray
    force_sd: float
    samples: str
    usable: NDArray[np.bool_]
    rest: FloatArray | None
    rest_reads: FloatArray | None
    seed: int
    by_effects: NoiseByEffects | None = None

    @property
    def present(self) -> NDArray[np.bool_]:
        """Whether each reading is present, (n, m)."""
        return self.known.counts > 0

    @property
    def load_measured(self) -> bool:
        """Whether loads were measured."""
        return not bool(np.isnan(self.load_share).any())

    def noise_of(self, left_out: LeftOut, *, scattered: bool = False) -> tuple[Noise, float]:
        """Noise by predictions of readings that are left out; see `fit_noise`."""
        return fit_noise(left_out, self.read_variance, self.force_sd, scattered=scattered, by_effects=self.by_effects)


def pad_problem(
    sensor: Sensor,
    table: Touches,
    *,
    samples: str,
    seed: int,
    kernel: str = "auto",
    stated: Mapping[str, Prior] | None = None,
    relative_slope: OfLoads | None = None,
    noise: NoiseWithEffects | None = None,
) -> tuple[PadProblem, list[str]]:
    """Input of the calibration of a pad, and notes on touches that were left out and on assumptions.

    `stated` are priors by name of the parameter, for a pad with this kernel. `relative_slope` gives the noise of
    loads (n,) over the noise of the force sensor; loads that are corrected for effects have their own. `noise` is that
    of the readings where effects of the noise were fitted to the scatter of samples.

    Raises
    ------
    InputError
        The sensor is not a pad, these touches cannot calibrate it, or a stated prior is impossible.
    """
    pad = pad_of(sensor, "a calibration with kernels")
    corrected = table.baseline_corrected()
    notes = list(corrected.notes)
    if samples == "auto":
        samples, why = choose_samples(corrected, faintest_readings(corrected, table.rest_reading()))
        notes += [why] if why else []
    known = pad_readings(corrected, pad.dimensions, samples)
    located = np.asarray(np.isfinite(known.location).all(axis=1))
    if not located.any():
        raise InputError(f"no calibration touch has a location: {' and '.join(pad.location_columns)} needed")
    if not located.all():
        notes.append(f"{int((~located).sum())} calibration touches without location are left out")
    known, force_sd, more = _with_loads(known.select(located), sensor)
    notes += more
    check_places(known, kernel, without=int(located.sum()) - known.n_touches)
    if known.n_touches > _MOST_TOUCHES:
        notes.append(f"{_MOST_TOUCHES:,} of {known.n_touches:,} calibration touches are used, chosen at random")
        order = np.random.default_rng(seed).permutation(known.n_touches)
        known = known.select(np.sort(order[:_MOST_TOUCHES]))
    usable = responding(known.readings) & (np.isfinite(known.readings).sum(axis=0) > 1)
    for e in np.flatnonzero(~usable):
        notes.append(f"e{e + 1:02d} has no readings, or constant ones: it is left out")
    known = replace(known, counts=np.where(usable, known.counts, 0))
    rest = table.rest_reading()
    priors, odd = pad_priors(sensor, known, rest_subtracted=rest is not None, usable=usable)
    slope = 1.0 if relative_slope is None else relative_slope(known.load)
    problem = PadProblem(
        known=known,
        observed=_observed(counted_samples(corrected, samples), known, usable),
        priors=priors.with_stated(stated or {}, kernel, sensor),
        pitch_mm=element_pitch(priors.position, float(np.ptp(known.location, axis=0).max())),
        read_variance=_read_variance(known, table) if noise is None else noise.own_sd**2,
        load_share=force_sd * slope / np.sqrt(known.reads_of_load) / known.load,
        force_sd=force_sd,
        samples=samples,
        usable=usable,
        rest=rest,
        rest_reads=shared_rest_reads(table),
        seed=seed,
        by_effects=None if noise is None else noise.by_effects,
    )
    return problem, [*notes, *odd]


def _read_variance(known: TouchMeans, table: Touches) -> FloatArray:
    """`PadProblem.read_variance`.

    Only rest readings of one touch are compared: between touches the readings may drift.
    """
    at_rest = average(table.with_(contact=np.where(table.in_contact, 0.0, 1.0)))
    enough = (at_rest.pure_error_dof >= LEAST_AT_REST) & (at_rest.pure_error_variance > 0)
    repeated = known.pure_error_variance
    return np.where(np.isnan(repeated) & enough, at_rest.pure_error_variance, repeated)


def _observed(table: Touches, known: TouchMeans, usable: NDArray[np.bool_]) -> Observations:
    """Known touches with their samples, on the clock of the table."""
    table = table.select(np.isin(table.touch, known.touch))
    table = table.with_(readings=np.where(usable, table.readings, np.nan))
    clock = Timing.of(table)
    span = (float(clock.time_s.min()), float(clock.time_s.max()))
    history = history_of(table, clock.time_s)
    observed = Observations.of(table, clock.time_s, clock.held_s, clock.unit, history, span)
    return replace(observed, means=replace(known, readings=np.where(known.counts > 0, known.readings, np.nan)))


def _with_loads(known: TouchMeans, sensor: Sensor) -> tuple[TouchMeans, float, list[str]]:
    """Touches with a load, noise of the force sensor in N (NaN if no load was measured), and notes."""
    measured = np.isfinite(known.load)
    if not measured.any():
        note = "no load is measured in the calibration: loads are relative to its own, whose spread is inferred"
        return replace(known, load=np.ones(known.n_touches)), np.nan, [note]
    notes = []
    usable = measured & (known.load > 0)
    if not usable.any():
        raise InputError("every measured load is below zero: the gains are not identifiable", column="load_N")
    if not usable.all():
        notes.append(without_load(int((~usable).sum())))
    force_sd, assumed = stated_or_assumed_noise(sensor, known.load[usable])
    return known.select(usable), force_sd, [*notes, *assumed]


def stated_or_assumed_noise(sensor: Sensor, load: FloatArray) -> tuple[float, list[str]]:
    """Noise of the force sensor in N, from measured loads (n,) where it is not stated, and a note in this case."""
    if sensor.force_noise_sd is not None:
        return sensor.force_noise_sd, []
    note = f"the force sensor's noise is not stated: {UNSTATED_FORCE_NOISE:.1%} of the mean load is assumed"
    return UNSTATED_FORCE_NOISE * float(load.mean()), [note]
