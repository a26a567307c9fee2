"""Planned touches on a calibrated pad: readings, and what the calibration does not know of them.

A calibration stores the variance of its empirical map at each place, but not the covariance of two places. The map is
therefore written out again as random functions over the touches of the calibration and those that are planned, and is
conditioned on the readings of the calibration. What is known of the kernel's parameters is that of the draws. Noise and
the map's size and length are those of the calibration. With effects, readings and loads are as corrected for them, and
the values of the effects count as known.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.chain.kernel_choice import kernel_for
from bayestouch.chain.pad import COORDINATES, PadChain, element_pitch
from bayestouch.chain.pad_map import PadMap
from bayestouch.data.arrays import read_once
from bayestouch.data.averages import TouchMeans
from bayestouch.data.touches import Touches, touches_from
from bayestouch.model.linear import covariance_of, with_covariance_of
from bayestouch.model.planned import Group, PlannedReadings, PlannedTouches, covariance_of_shared, with_load_error
from bayestouch.model.planned_table import planned_table
from bayestouch.pad.candidates import kernel_shape
from bayestouch.pad.corrected import PadEffects
from bayestouch.pad.priors import PadPriors, pad_priors, prior_precision, stated_priors
from bayestouch.pad.residual_map import MapDiscrepancy
from bayestouch.priors.parameters import Prior
from bayestouch.results.keys import USABLE
from bayestouch.results.objects import Calibration
from bayestouch.results.units import load_unit
from bayestouch.sampling.rank_one import inverse_root

# Largest number of functions of the map of an element.
MOST_FUNCTIONS = 120
# Largest number of places at which the sensitivity is asked for.
MOST_PLACES = 60


def planned(calibration: Calibration, table: Touches) -> PlannedTouches:
    """Planned touches on a pad.

    Raises
    ------
    InputError
        For the reasons of `planned_table`.
    """
    means, known, effects = planned_table(table, calibration), _known(calibration), PadEffects.of(calibration)
    usable = np.asarray(calibration.extra[USABLE]) > 0
    priors, _ = pad_priors(
        calibration.sensor, known, rest_subtracted=calibration.rest_reading is not None, usable=usable
    )
    priors = priors.with_stated(stated_priors(calibration), str(calibration.settings["kernel"]), calibration.sensor)
    chain, prior = _chain(calibration, priors)
    t, m = known.n_touches, chain.n_elements
    acting = means.load if effects is None else effects.acting(means.load)
    place, load = np.concatenate([known.location, means.location]), np.concatenate([known.load, acting])
    counts = np.concatenate([known.counts, np.where(usable, means.counts, 0)])
    of_signal = _Signal.of(calibration, place, load)
    noise = calibration.noise if effects is None else effects.noise(calibration.noise)
    # The map is that of each element alone: errors that elements share count in its readings like all others.
    alone = noise.mean_variance(read_once(counts), of_signal.mean)
    functions, left = _map_columns(calibration, chain, priors, place, load, alone, counts > 0)
    variance, shared = noise.own_variance(read_once(counts), of_signal.mean) + left, noise.shared_errors(counts)
    own = chain.sensitivity_derivatives(place) * load[:, None, None]
    own[:, np.arange(m), m + np.arange(m)] = 1.0
    columns = np.concatenate([own, functions], axis=2) * (counts > 0)[:, :, None]
    load_sd = _load_sd(calibration, effects, load, np.concatenate([known.reads_of_load, means.reads_of_load]))
    by_load = of_signal.by_load * load_sd[:, None]
    root = inverse_root(variance[:t], (by_load[:t], *shared[:, :t]), counts[:t] > 0)
    white = np.einsum("tij,tjd->tid", root, columns[:t], optimize=True).reshape(t * m, -1)
    of_prior = [prior_precision(each, value) for each, value in zip(prior, chain.flat, strict=True)]
    precision = np.append(of_prior, np.ones(functions.shape[2]))
    information = white.T @ white + np.diag(precision)
    if of_kernel := [parameter.name for parameter in chain.kernel.parameters]:
        # Bounds cut off the posterior of the kernel: to first order it would be several times as wide.
        kernel = own.shape[2] - len(of_kernel) + np.arange(len(of_kernel))
        drawn = np.cov([calibration.posterior[each].ravel() for each in of_kernel])
        information = with_covariance_of(information, kernel, np.atleast_2d(drawn))
    covariance = covariance_of(information)
    # What a user asks for is the true load.
    acts = np.ones(means.n_touches) if effects is None else effects.acting_slope(effects.pressed(means.load))
    slopes = np.concatenate([of_signal.along, of_signal.by_load[:, :, None]], axis=2)[t:]
    slopes[:, :, -1] *= acts[:, None]
    slopes = np.where(usable[:, None], slopes, 0.0)
    map_ = of_signal.map
    width = np.append(12 / (map_.high - map_.low) ** 2, 0.0) + np.zeros((means.n_touches, 1))
    width[:, -1] = (load_sd[t:] / acts) ** -2.0
    names = COORDINATES[: known.location.shape[1]]
    return PlannedTouches(
        readings=PlannedReadings(
            np.where(usable, of_signal.mean[t:] + map_.offset, 0.0),
            columns[t:],
            covariance,
            with_load_error(variance[t:], np.where(usable, of_signal.by_load[t:], 0.0), load_sd[t:])
            + covariance_of_shared(np.where(usable, shared[:, t:], 0.0)),
        ),
        parameters=(*_parameters(calibration, chain, usable, len(covariance)), *_sensitivity(calibration, columns[:t])),
        coordinates={**{name: ("mm", 1.0) for name in names}, "P": (load_unit(calibration), 1.0)},
        slopes=slopes,
        precision=width,
        asked=names,
    )


def _known(calibration: Calibration) -> TouchMeans:
    """Touches of a calibration; loads that were not measured are 1."""
    rows = calibration.rows
    columns = {f"{name}_mm": values for name, values in rows.location.items()}
    table = touches_from(
        np.arange(len(rows.touch)),
        rows.observed,
        load=np.where(np.isnan(rows.load), 1.0, rows.load),
        contact=1.0,
        reads=read_once(rows.counts.max(axis=1)),
        **columns,
    )
    return replace(table.averaged(), load_reads=rows.load_reads)


def _chain(calibration: Calibration, priors: PadPriors) -> tuple[PadChain, tuple[Prior, ...]]:
    """The chain at the posterior mean of a calibration, and the priors of its parameters.

    At the mode a parameter of the kernel may be at a bound, where the readings need not depend on it.
    """
    dimensions = priors.position.shape[1]
    mean = {name: draws.mean(axis=(0, 1)) for name, draws in calibration.posterior.items()}
    location = np.stack(list(calibration.rows.location.values()), axis=1)
    pitch = element_pitch(priors.position, float(np.ptp(location, axis=0).max()))
    kernel = priors.kernel(kernel_for(str(calibration.settings["kernel"]), calibration.sensor, pitch))
    position = np.stack([mean[f"{axis}_s"] for axis in COORDINATES[:dimensions]], axis=1)
    values = np.array([float(mean[parameter.name]) for parameter in kernel.parameters])
    return PadChain(kernel, values, mean["gain"], mean["offset"], position), priors.of(kernel)


@dataclass(frozen=True, eq=False)
class _Signal:
    """Signals of touches from the tables of a calibration.

    Mean (n, m), derivative over the load (n, m), and along each coordinate of the place (n, m, D).
    """

    map: PadMap
    mean: FloatArray
    by_load: FloatArray
    along: FloatArray

    @classmethod
    def of(cls, calibration: Calibration, place: FloatArray, load: FloatArray) -> _Signal:
        map_ = PadMap.from_arrays(calibration.extra)
        by_load, slope = map_.slopes(place, load)
        along = load[:, None, None] * slope.swapaxes(1, 2)
        return cls(map_, load[:, None] * map_.at(place, load)[0], by_load, along)


def _map_columns(
    calibration: Calibration,
    chain: PadChain,
    priors: PadPriors,
    place: FloatArray,
    load: FloatArray,
    variance: FloatArray,
    present: NDArray[np.bool_],
) -> tuple[FloatArray, FloatArray]:
    """Readings of touches (n,) per unit of each weight of the map (n, m, k), and the variance left out (n, m)."""
    n, m = variance.shape
    size = float(calibration.statistics.get("map_size_everywhere", 0.0))
    if size == 0:
        return np.zeros((n, m, 0)), np.zeros((n, m))
    map_ = MapDiscrepancy(
        location=place,
        load=load,
        variance=np.where(present, variance, np.inf),
        amplitude=priors.amplitude,
        shape=kernel_shape(chain, place),
        misfit=size,
        relative=float(calibration.statistics["map_size_of_kernel"]),
        length_mm=float(calibration.statistics["map_length_mm"]),
    )
    functions, left = map_.functions(variance, MOST_FUNCTIONS)
    columns = np.zeros((n, m, sum(map(len, functions))))
    first = 0
    for e, each in enumerate(functions):
        columns[:, e, first : first + len(each)] = each.T
        first += len(each)
    return columns, left


def _load_sd(calibration: Calibration, effects: PadEffects | None, load: FloatArray, reads: FloatArray) -> FloatArray:
    """Error of each acting load: of the force sensor and load scatter, or the spread of the loads."""
    settings = calibration.settings
    if not settings["load_measured"]:
        return load * float(settings["load_sd"]) / float(settings["load_mean"])
    sensor = calibration.noise.mean_load_sd(reads) * (1.0 if effects is None else effects.relative_slope(load))
    sd = np.hypot(sensor, calibration.noise.load_scatter)
    return np.where(np.isfinite(sd) & (sd > 0), sd, load)


def _parameters(calibration: Calibration, chain: PadChain, usable: NDArray[np.bool_], d: int) -> tuple[Group, ...]:
    """Gains, positions and kernel as functions of d unknowns."""
    m, dimensions = chain.position.shape
    eye, alive = np.eye(d), np.flatnonzero(usable)
    units = {parameter.name: parameter.unit for parameter in calibration.parameters}
    own = [(0, "gain"), *((2 + axis, f"{name}_s") for axis, name in enumerate(COORDINATES[:dimensions]))]
    groups = [Group(name, units[name], eye[block * m + alive]) for block, name in own]
    first = (2 + dimensions) * m
    groups += [
        Group(each.name, each.unit, eye[first + k : first + k + 1]) for k, each in enumerate(chain.kernel.parameters)
    ]
    return tuple(groups)


def _sensitivity(calibration: Calibration, columns: FloatArray) -> tuple[Group, ...]:
    """Sensitivity of the elements at places of the calibration, kernel and map together; nothing without a map.

    `columns` (t, m, d) are those of the calibration touches. Of many touches, up to `MOST_PLACES` are taken.
    """
    if calibration.settings["empirical_map"] != "yes":
        return ()
    m = columns.shape[1]
    some = np.unique(np.linspace(0, len(columns) - 1, MOST_PLACES).round().astype(np.int64))
    rows = columns[some].copy()
    # The offset of an element is no part of its sensitivity.
    rows[:, :, m : 2 * m] = 0.0
    load = np.where(np.isnan(calibration.rows.load), 1.0, calibration.rows.load)[some]
    flat = (rows / load[:, None, None]).reshape(-1, columns.shape[2])
    unit = next(parameter.unit for parameter in calibration.parameters if parameter.name == "gain")
    return (Group("sensitivity", unit, flat[flat.any(axis=1)]),)
