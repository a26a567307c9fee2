"""How much effort is enough: number of calibration touches, number of samples averaged in a touch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.array_types import FloatArray
from bayestouch.errors import InputError
from bayestouch.output.summary import Summarised
from bayestouch.reliability.designs import INDENTERS_MM, places_deg
from bayestouch.reliability.expected_calibration import expected_finger
from bayestouch.reliability.known_finger import KnownFinger
from bayestouch.reliability.maps import sweet_spots
from bayestouch.simulation import FingerDesign

#: A standard deviation is good enough if it exceeds the smallest possible one by at most this share.
ENOUGH = 0.1


@dataclass(frozen=True, eq=False, repr=False)
class Effort(Summarised):
    """Standard deviation of an estimate (rms over indenters and places) as a function of a count.

    Attributes
    ----------
    name : str
        The estimate: ``R`` (mm), ``theta_c`` (degree) or ``P`` (N/m).
    count : (s,) int array
        Number of calibration touches, or of samples averaged; increasing.
    sd : (s,) array
        Standard deviation from noise, calibration and lack of fit.
    floor : float
        Limit of the standard deviation for a large count.
    """

    name: str
    count: NDArray[np.int64]
    sd: FloatArray
    floor: float

    def enough(self, share: float = ENOUGH) -> float:
        """Smallest count for which the standard deviation is at most (1 + share) times the floor.

        Interpolated as in `needed`; inf if no count of `count` is enough.
        """
        return self.needed((1 + share) * self.floor)

    def needed(self, sd: float) -> float:
        """Smallest count for which the standard deviation is at most `sd`; inf if no count of `count` is enough.

        Between the counts, the variance above the floor is interpolated as a power of the count (-1 for noise).
        """
        good = np.flatnonzero(self.sd <= sd)
        if not good.size:
            return float(np.inf)
        first = int(good[0])
        if first == 0:
            return float(self.count[0])
        pair = slice(first - 1, first + 1)
        above = np.log(np.maximum(self.sd[pair] ** 2 - self.floor**2, 1e-12 * self.floor**2))
        wanted = np.log(max(sd**2 - self.floor**2, 1e-12 * self.floor**2))
        return float(np.exp(np.interp(-wanted, -above, np.log(self.count[pair]))))


def calibration_effort(
    design: FingerDesign,
    edge_steps_deg: Sequence[float] = (18.0, 12.0, 9.0, 6.0, 3.0, 2.0, 1.0),
    *,
    flats_per_edge: float = 1 / 3,
    name: str = "R",
    indenters_mm: Sequence[float] = INDENTERS_MM,
    samples: int = 1,
    use_load: bool = False,
    lack_of_fit_percent: float = 0.0,
) -> Effort:
    """Standard deviation of an estimate as a function of the number of calibration touches.

    Parameters
    ----------
    design : FingerDesign
        Sensor, noise, samples of each calibration touch, and the arc of the calibration touches.
    edge_steps_deg : sequence of float
        Steps between knife edges to compare.
    flats_per_edge : float
        Number of flats per knife edge.
    name, indenters_mm, samples, use_load, lack_of_fit_percent
        As in `design_maps`; `samples` are those of the touches to be inferred.

    Returns
    -------
    Effort
        The floor is the standard deviation with an exact calibration.

    Raises
    ------
    InputError
        If there are no steps, `flats_per_edge` is not above zero, or as in `sweet_spots`.
    """
    if not len(edge_steps_deg):
        raise InputError("edge_steps_deg: expected one step at least")
    if not 0 < flats_per_edge < np.inf:
        raise InputError(f"flats_per_edge: expected above zero, got {flats_per_edge:g}")
    places, counts, sds = places_deg(design), [], []

    def rms(known: KnownFinger) -> float:
        spots = sweet_spots(known, indenters_mm, places, samples=samples, use_load=use_load)
        return float(np.sqrt((spots.sd(name) ** 2).mean()))

    for step in sorted(edge_steps_deg, reverse=True):
        plan = replace(design, edge_step_deg=step, flat_step_deg=step / flats_per_edge)
        counts.append(plan.plan(np.random.default_rng(0)).n_calibration)
        sds.append(rms(expected_finger(plan, lack_of_fit_percent=lack_of_fit_percent)))
    floor = rms(expected_finger(design, calibrated=False, lack_of_fit_percent=lack_of_fit_percent))
    return Effort(name, np.array(counts), np.array(sds), floor)


def averaging_effort(
    known: KnownFinger,
    angle_deg: ArrayLike,
    samples: Sequence[int] = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000),
    *,
    name: str = "R",
    indenters_mm: Sequence[float] = INDENTERS_MM,
    use_load: bool = False,
) -> Effort:
    """Standard deviation of an estimate as a function of the number of samples averaged in a touch.

    Parameters
    ----------
    known : KnownFinger
        The calibrated finger, or a planned one from `expected_finger`.
    angle_deg : (n,) array_like
        Locations.
    samples : sequence of int
        Numbers of samples to compare.
    name, indenters_mm, use_load
        As in `calibration_effort`.

    Returns
    -------
    Effort
        The floor is the part from calibration and lack of fit.

    Raises
    ------
    InputError
        If `samples` is empty, or as in `sweet_spots`.
    """
    if not len(samples):
        raise InputError("samples: expected one number at least")
    count = np.array(sorted(samples), dtype=np.int64)

    def rms(number: int) -> float:
        spots = sweet_spots(known, indenters_mm, angle_deg, samples=number, use_load=use_load)
        return float(np.sqrt((spots.sd(name) ** 2).mean()))

    # The noise with 10⁶ times the largest number of samples is negligible.
    return Effort(name, count, np.array([rms(int(n)) for n in count]), rms(int(count[-1]) * 10**6))
