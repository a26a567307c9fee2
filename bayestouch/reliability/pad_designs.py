"""Expected location errors of other pad designs, as functions of element spacing, noise and rubber thickness."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.distance import pdist

from bayestouch.array_types import FloatArray
from bayestouch.errors import InputError, nearest
from bayestouch.output.summary import Summarised
from bayestouch.pad.calibration import calibrate_pad
from bayestouch.pad.reading.reader import PadReader
from bayestouch.reliability.designs import PLACES
from bayestouch.reliability.pad_maps import PadSpots, pad_spots
from bayestouch.simulation import PadDesign, simulate

VaryPad = Literal["spacing_mm", "noise_percent", "thickness_mm"]


@dataclass(frozen=True, eq=False, repr=False)
class PadDesignMaps(Summarised):
    """Standard deviations of the location for v designs and n places.

    Attributes
    ----------
    vary : str
        Name of the quantity that varies.
    values : (v,) array
        Values of that quantity.
    designs : tuple of PadDesign
        The designs.
    places : (n,) array
        Distances from an element (0) up to halfway to its nearest neighbour (0.5), spacings.
    spots : tuple of PadSpots
        The maps of each design.
    """

    vary: str
    values: FloatArray
    designs: tuple[PadDesign, ...]
    places: FloatArray
    spots: tuple[PadSpots, ...]

    def sd(self) -> FloatArray:
        """Standard deviation of the location (all coordinates) from noise and calibration together, (v, n), mm."""
        return np.stack([each.sd for each in self.spots])


def pad_design_maps(
    design: PadDesign,
    vary: VaryPad,
    values: ArrayLike,
    *,
    places: Sequence[float] = PLACES,
    samples: int = 1,
    use_load: bool = False,
    seed: int = 0,
) -> PadDesignMaps:
    """Reliability of a pad as a function of one quantity of its design.

    Each design is simulated and calibrated with the kernel of its own rubber, which takes a few seconds. The elements
    are at the base of the rubber, so that its thickness is their depth.

    Parameters
    ----------
    design : PadDesign
        The design with all other quantities.
    vary : {"spacing_mm", "noise_percent", "thickness_mm"}
        Quantity that varies: smallest distance between elements (all distances are scaled); noise of one reading in %
        of the peak; thickness.
    values : (v,) array_like
        Values of that quantity.
    places : sequence of float
        Distances from the element in the middle (0) up to halfway to its nearest neighbour (0.5), spacings.
    samples : int
        Samples averaged in each touch.
    use_load : bool
        Whether the force sensor is read.
    seed : int
        Seed of the simulated calibrations.

    Raises
    ------
    InputError
        If there are no values, a value gives an impossible pad, `vary` is unknown, or the spacing varies and two
        elements are at the same place.
    """
    wanted = np.atleast_1d(np.asarray(values, dtype=float))
    if not len(wanted):
        raise InputError("values: expected one at least")
    designs = tuple(changed_pad(design, vary, float(value)) for value in wanted)
    spots = []
    for each in designs:
        calibration = calibrate_pad(
            simulate(replace(each, n_touches=1), seed=seed).dataset, kernel="layer", empirical=False, draws=8
        )
        reader = PadReader.from_calibration(calibration)
        spots.append(pad_spots(reader, pad_places(each, places), reads=samples, use_load=use_load))
    return PadDesignMaps(vary, wanted, designs, np.asarray(places, dtype=float), tuple(spots))


def changed_pad(design: PadDesign, vary: VaryPad, value: float) -> PadDesign:
    """Design of `pad_design_maps` for one value."""
    if vary == "thickness_mm":
        return replace(design, thickness_mm=value)
    if vary == "noise_percent":
        return replace(design, noise_percent_peak=value)
    if vary != "spacing_mm":
        known = get_args(VaryPad)
        raise InputError(f"vary: expected {' or '.join(known)}, got {vary!r}{nearest(str(vary), known)}")
    if not value > 0:
        raise InputError(f"spacing_mm: expected above zero, got {value:g}")
    factor = value / _spacing(_elements(design))
    y = design.element_y_mm
    return replace(
        design,
        element_x_mm=tuple(factor * x for x in design.element_x_mm),
        element_y_mm=None if y is None else tuple(factor * each for each in y),
    )


def pad_places(design: PadDesign, places: Sequence[float] = PLACES) -> FloatArray:
    """Coordinates of places between the element nearest to the middle and its nearest neighbour, (n, D) mm."""
    first, second = _pair(_elements(design))
    return np.asarray(first + np.asarray(places, dtype=float)[:, None] * (second - first))


def _elements(design: PadDesign) -> FloatArray:
    columns = [design.element_x_mm] if design.element_y_mm is None else [design.element_x_mm, design.element_y_mm]
    return np.stack([np.asarray(column, dtype=float) for column in columns], axis=1)


def _spacing(elements: FloatArray) -> float:
    """Smallest distance between two elements, mm; on a regular pad that of the elements in the middle, to the bit."""
    middle = float(np.linalg.norm(np.subtract(*_pair(elements))))
    smallest = float(pdist(elements).min())
    if smallest == 0:
        raise InputError("spacing_mm: two elements are at the same place")
    return middle if np.isclose(middle, smallest) else smallest


def _pair(elements: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Coordinates of the element nearest to the middle of all, and of its nearest neighbour."""
    if len(elements) < 2:
        raise InputError("a pad of one element has no spacing")
    middle = int(np.linalg.norm(elements - elements.mean(axis=0), axis=1).argmin())
    distance = np.linalg.norm(elements - elements[middle], axis=1)
    distance[middle] = np.inf
    return elements[middle], elements[int(distance.argmin())]
