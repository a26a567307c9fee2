"""Where a pad will locate touches well: the maps of `bayestouch.reliability.maps`, with location in place of radius."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.errors import InputError
from bayestouch.pad.reading.reader import PadReader


@dataclass(frozen=True, eq=False)
class PadSpots:
    """Standard deviations of the location of touches at n places, before any touch; D coordinates, m elements.

    Attributes
    ----------
    location : (n, D) array
        mm.
    noise_sd : (n, D) array
        What the noise of the readings gives, in mm; on a pad calibrated without repeats that is all that the map does
        not explain.
    bias_rms : (n, D) array
        Root mean square, over calibrations, of the error that every touch there shares.
    by_element : (n, D, m) array
        Part of each variance that each element causes, noise and calibration together.
    """

    location: FloatArray
    noise_sd: FloatArray
    bias_rms: FloatArray
    by_element: FloatArray

    @property
    def sd(self) -> FloatArray:
        """Standard deviation of the distance's two (or one) coordinates together, (n,), mm."""
        return np.asarray(np.sqrt((self.noise_sd**2 + self.bias_rms**2).sum(axis=1)))


def pad_spots(reader: PadReader, location: ArrayLike, *, load: float | None = None, reads: int = 1) -> PadSpots:
    """Map how well a calibrated pad will locate touches.

    Parameters
    ----------
    reader : PadReader
        From `PadReader.from_calibration`.
    location : (n, D) array_like
        Places, mm.
    load : float, optional
        In the calibration's unit; its mean by default.
    reads : int
        Raw readings averaged in each touch.

    Raises
    ------
    InputError
        If the places have another number of coordinates than the pad.
    """
    where = _places(reader, location)
    weights, noise, calibration = _weights(reader, where, load, reads)
    own = weights**2
    return PadSpots(
        location=where,
        noise_sd=np.sqrt((own * noise[:, None]).sum(axis=-1)),
        bias_rms=np.sqrt((own * calibration[:, None]).sum(axis=-1)),
        by_element=own * (noise + calibration)[:, None],
    )


def pad_known_bias(
    reader: PadReader, better: PadReader, location: ArrayLike, *, load: float | None = None, reads: int = 1
) -> FloatArray:
    """Bias of the location, with its sign, of reading with one model touches that another predicts better; (n, D) mm.

    Parameters
    ----------
    reader : PadReader
        What touches are read with, such as a kernel alone.
    better : PadReader
        What predicts them better, such as the kernel with its empirical map.
    location, load, reads
        As in `pad_spots`.
    """
    where = _places(reader, location)
    push = reader.load if load is None else load
    weights, _, _ = _weights(reader, where, load, reads)
    readings = [each.map.offset + push * each.map.at(where)[0] for each in (reader, better)]
    missed = np.where(reader.usable, readings[1] - readings[0], 0.0)
    return np.asarray(np.einsum("ndm,nm->nd", weights, missed))


def _places(reader: PadReader, location: ArrayLike) -> FloatArray:
    where = np.asarray(location, dtype=float)
    if where.ndim != 2 or where.shape[1] != reader.map.dimensions:
        raise InputError(f"expected places (n, {reader.map.dimensions}) in mm, got shape {where.shape}")
    return where


def _weights(
    reader: PadReader, where: FloatArray, load: float | None, reads: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Change of the location per unit error of each reading (n, D, m); variances by noise and calibration (n, m)."""
    push = np.full(len(where), reader.load if load is None else load)
    sensitivity, slope = reader.map.slopes(where)
    _, variance, covariance = reader.map.at(where)
    signal = push[:, None] * sensitivity
    noise = reader.noise.mean_sd(np.full(signal.shape, reads), signal) ** 2
    calibration = reader.map.reading_variance(variance, covariance, push)
    total = np.where(reader.usable, noise + calibration, np.inf)
    jacobian = np.concatenate([push[:, None, None] * slope, sensitivity[:, None]], axis=1)  # (n, D + 1, m)
    information = (jacobian / total[:, None]) @ jacobian.swapaxes(1, 2)
    information[:, -1, -1] += reader.load_sd**-2.0
    # Never singular: the prior of a location is the region that was calibrated.
    width = reader.map.high - reader.map.low
    axes = np.arange(reader.map.dimensions)
    information[:, axes, axes] += 12 / width**2
    weights = np.linalg.solve(information, jacobian / total[:, None])[:, :-1]
    return np.asarray(weights), noise, calibration
