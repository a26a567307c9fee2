"""Maps that predict how well a pad locates touches; like `bayestouch.reliability.maps`, for location, not radius."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.errors import InputError
from bayestouch.output.summary import Summarised, span
from bayestouch.output.text import number, plural
from bayestouch.pad.reading.reader import PadReader
from bayestouch.sampling.rank_one import shared_directions

# A force sensor that is averaged without end, as a share of the load: the precision of an exact load is no number.
_EXACT_LOAD = 1e-6


@dataclass(frozen=True, eq=False, repr=False)
class PadSpots(Summarised):
    """Predicted standard deviations of the location at n places; D coordinates, m elements.

    Attributes
    ----------
    location : (n, D) array
        Places, mm.
    noise_sd : (n, D) array
        Standard deviation from what is new in each touch: noise of the readings, error of the load, and place in the
        region where neither tells it, mm. On a pad calibrated without repeats, the noise is everything that the map
        does not explain.
    bias_rms : (n, D) array
        Error that is common to all touches at a place, rms over calibrations.
    by_element : (n, D, m) array
        Part of each variance that belongs to each element, noise and calibration together. An error that elements share
        is divided among them by what each contributes: a part may be below zero.
    of_none : (n, D) array
        Part of each variance that belongs to no element: error of the load, and place.
    """

    location: FloatArray
    noise_sd: FloatArray
    bias_rms: FloatArray
    by_element: FloatArray
    of_none: FloatArray

    @property
    def sd(self) -> FloatArray:
        """Standard deviation of the location, all coordinates together, (n,), mm."""
        return np.asarray(np.sqrt((self.noise_sd**2 + self.bias_rms**2).sum(axis=1)))

    def summary_lines(self) -> list[str]:
        """Lines that ``repr`` shows: the standard deviation of the location, and where it is smallest."""
        best = ", ".join(number(float(value)) for value in self.location[self.sd.argmin()])
        return [
            f"PadSpots of {plural(len(self.location), 'place')}",
            f"sd of the location{span(self.sd)} mm, smallest at ({best}) mm",
        ]


def pad_spots(
    reader: PadReader,
    location: ArrayLike,
    *,
    load: float | None = None,
    reads: float = 1,
    use_load: bool = True,
) -> PadSpots:
    """Maps of the expected location errors of a calibrated pad.

    The errors are those about the place of the touch. If another place gives nearly the same readings, such as the
    mirror image of a place beside a row of elements, a touch may be located there: the error is then larger.

    Parameters
    ----------
    reader : PadReader
        Result of `PadReader.from_calibration`.
    location : (n, D) array_like
        Places, mm.
    load : float, optional
        Load in the unit of the calibration; by default the mean of the calibration.
    reads : float
        Number of raw readings averaged in each touch; inf for what remains however many are averaged. The force sensor
        is read as often, or `reader.load_reads` times.
    use_load : bool
        Whether the force sensor is read. It makes no difference where the calibration measured no loads.

    Raises
    ------
    InputError
        If the number of coordinates is not that of the pad, `load` is not above zero, or `reads` is below 1.
    """
    where = _places(reader, location)
    found = _weights(reader, where, load, reads, use_load)
    own, together = found.weights**2, np.concatenate([found.by_noise, found.by_map], axis=2)
    of_noise, of_map = ((each.sum(axis=-1) ** 2).sum(axis=-1) for each in (found.by_noise, found.by_map))
    return PadSpots(
        location=where,
        noise_sd=np.sqrt((own * found.noise[:, None]).sum(axis=-1) + of_noise + found.of_none),
        bias_rms=np.sqrt((own * found.calibration[:, None]).sum(axis=-1) + of_map),
        by_element=own * (found.noise + found.calibration)[:, None]
        + (together * together.sum(axis=-1, keepdims=True)).sum(axis=2),
        of_none=found.of_none,
    )


def pad_known_bias(
    reader: PadReader,
    better: PadReader,
    location: ArrayLike,
    *,
    load: float | None = None,
    reads: float = 1,
    use_load: bool = True,
) -> FloatArray:
    """Signed bias of locations inferred with one model, if another model predicts readings better; (n, D) mm.

    Parameters
    ----------
    reader : PadReader
        Model that is used for the estimates, such as a kernel alone.
    better : PadReader
        Model that predicts the readings better, such as the kernel with its empirical map.
    location, load, reads, use_load
        As in `pad_spots`.
    """
    where = _places(reader, location)
    push = reader.load if load is None else load
    weights = _weights(reader, where, load, reads, use_load).weights
    loads = np.full(len(where), push)
    readings = [each.map.offset + push * each.map.at(where, loads)[0] for each in (reader, better)]
    missed = np.where(reader.usable, readings[1] - readings[0], 0.0)
    return np.asarray(np.einsum("ndm,nm->nd", weights, missed))


def _places(reader: PadReader, location: ArrayLike) -> FloatArray:
    where = np.asarray(location, dtype=float)
    if where.ndim != 2 or where.shape[1] != reader.map.dimensions:
        raise InputError(f"expected places (n, {reader.map.dimensions}) in mm, got shape {where.shape}")
    return where


@dataclass(frozen=True, eq=False)
class _Weights:
    """How errors of readings, load and prior change the location at n places.

    Attributes
    ----------
    weights : (n, D, m) array
        Change of the location per unit error of each reading.
    noise, calibration : (n, m) array
        Variance of each reading from noise, and from the calibration: what no other element shares.
    by_noise, by_map : (n, D, k, m), (n, D, c, m) arrays
        Change of the location by one standard deviation of each error of noise and calibration that elements share,
        through each element.
    of_none : (n, D) array
        Variance of the location from the errors of the felt load and of the prior of the place.
    """

    weights: FloatArray
    noise: FloatArray
    calibration: FloatArray
    by_noise: FloatArray
    by_map: FloatArray
    of_none: FloatArray


def _weights(reader: PadReader, where: FloatArray, load: float | None, reads: float, use_load: bool) -> _Weights:
    if load is not None and not 0 < load < np.inf:
        raise InputError(f"load: expected above zero, got {load:g}")
    if not reads >= 1:
        raise InputError(f"reads: expected 1 or more, got {reads:g}")
    push = np.full(len(where), reader.load if load is None else load)
    by_load, slope = reader.map.slopes(where, push)
    sensitivity, variance, covariance = reader.map.at(where, push)
    signal = push[:, None] * sensitivity
    counts = np.full(signal.shape, reads)
    noise = reader.noise.own_sd(counts, signal) ** 2
    calibration = reader.map.reading_variance(variance, covariance, push)
    total = np.where(reader.usable, noise + calibration, np.inf)
    jacobian = np.concatenate([push[:, None, None] * slope, by_load[:, None]], axis=1)  # (n, D + 1, m)
    pulled = jacobian / total[:, None]
    of_map = push[:, None, None] * reader.map.shared_at(where)
    of_noise = np.where(reader.usable, np.moveaxis(reader.noise.shared_errors(counts), 0, 1), 0.0)
    directions, _ = shared_directions(1 / total, np.concatenate([of_map, of_noise], axis=1))
    pulled -= (jacobian @ directions.swapaxes(1, 2)) @ directions
    information = pulled @ jacobian.swapaxes(1, 2)
    # Never singular, because the prior of the location is limited to the calibrated region.
    width = reader.map.high - reader.map.low
    prior = np.tile(np.append(12 / width**2, 0.0), (len(where), 1))
    prior[:, -1] = _felt_load_sd(reader, push, reads, use_load) ** -2.0
    covariance = np.linalg.inv(information + prior[:, None] * np.eye(prior.shape[1]))[:, :-1]
    weights = covariance @ pulled
    of_none = np.einsum("ndk,nk->nd", covariance**2, prior)
    by_noise, by_map = (weights[:, :, None] * each[:, None] for each in (of_noise, of_map))
    return _Weights(weights, noise, calibration, by_noise, by_map, of_none)


def _felt_load_sd(reader: PadReader, load: FloatArray, reads: float, use_load: bool) -> FloatArray:
    """Standard deviation of felt loads (n,) (see `PadTouches`) before the elements are read."""
    sd = np.full(len(load), reader.load_sd)
    if use_load and reader.load_measured:
        load_reads = reads if reader.load_reads is None else reader.load_reads
        sd = reader.measured_load_sd(load, np.full(len(load), load_reads))
    return np.asarray(np.maximum(np.hypot(sd, reader.noise.load_scatter), _EXACT_LOAD * load))
