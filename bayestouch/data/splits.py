"""Splitting one table by location into touches for calibration and touches to be read."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray, IntArray
from bayestouch.data.dataset import DataSet
from bayestouch.data.grouping import first_of, groups
from bayestouch.data.touches import Touches
from bayestouch.errors import InputError

#: Positions closer than this share of the whole range are equal: a stage reports the same position with
#: different last digits, and no scan has a million lines.
_SAME = 1e-6


def checkerboard(touches: Touches, cell: float | None = None) -> BoolArray:
    """Return a mask of the rows for calibration: touches in alternate cells of location.

    Along a line or around a finger every other cell is chosen; in the plane, the cells of one colour of a
    checkerboard. On a staggered grid, whose touches are all in cells of one colour, every other touch along each line
    is chosen. All rows of a touch are in the same part: the first location in contact decides or, if there is none,
    the first location. All touches at one location are in the same part. Angles that differ by a full turn are one
    location.

    Parameters
    ----------
    touches : Touches
    cell : float, optional
        Side of a cell in the unit of the location (degree or mm). By default, if the positions form a line or a
        grid, every distinct position along a coordinate is one cell; if they are scattered in the plane, the side is
        `default_cell`.

    Returns
    -------
    bool array, shape (n_rows,)
        True in rows for calibration. False in rows of a touch without location.

    Raises
    ------
    InputError
        There are no rows, no touch has a location, or all are in one cell.
    """
    coordinates, group = _locations(touches)
    located = np.all([~np.isnan(values) for values in coordinates], axis=0)
    if not located.any():
        raise InputError("touches without a reference location cannot be split by location")
    if cell is not None and not (np.isfinite(cell) and cell > 0):
        raise InputError(f"expected a cell above zero, got {cell!r}")
    side = default_cell(touches) if cell is None else cell
    cells = [_lines(values[located]) if side is None else _cells(values[located], side) for values in coordinates]
    colour = np.sum(cells, axis=0) % 2
    if (colour == colour[0]).all():
        # a staggered grid: along x, its touches are two cells apart
        colour = np.sum([cells[0] // 2, *cells[1:]], axis=0) % 2
    chosen = np.zeros(len(located), dtype=np.bool_)
    chosen[located] = colour == 0
    if not (located & ~chosen).any() or not chosen.any():
        raise InputError("all touches are in one cell: nothing is left to be held out (give calibration.csv)")
    return np.asarray(chosen[group], dtype=np.bool_)


def default_cell(touches: Touches) -> float | None:
    """Side of the cells that `checkerboard` uses by default.

    None if every distinct position is one cell (a line, or a grid of which at least a quarter is filled);
    otherwise √(area / number of locations), the spacing of the same number of evenly spread locations.
    """
    coordinates, _ = _locations(touches)
    if len(coordinates) == 1:
        return None
    x, y = (values[~np.isnan(coordinates).any(axis=0)] for values in coordinates)
    lines = np.stack([_lines(x), _lines(y)], axis=1)
    locations = len(np.unique(lines, axis=0))
    n_x, n_y = (len(np.unique(column)) for column in lines.T)
    if not locations or n_x * n_y <= 4 * locations:
        return None
    return float(np.sqrt(np.ptp(x) * np.ptp(y) / locations))


def with_calibration(dataset: DataSet, cell: float | None = None) -> DataSet:
    """Return a data set with calibration touches, taken from its touches by `checkerboard` if it has none.

    A data set with a calibration table is returned unchanged. A note describes the split. No-contact rows that
    belong to no touch in contact are in both parts, so that both have the same baseline.

    Raises
    ------
    InputError
        As `checkerboard`.
    """
    if dataset.calibration is not None:
        return dataset
    touches = dataset.touches
    chosen = checkerboard(touches, cell)
    baseline = ~np.isin(touches.touch, touches.touch[touches.in_contact])
    calibration, rest = touches.select(chosen | baseline), touches.select(~chosen | baseline)
    side = default_cell(touches) if cell is None else cell
    unit = "degree" if touches.angle_deg is not None else "mm"
    what = "position" if side is None else "cell"
    how = f"every other {what}" if touches.y_mm is None else f"a checkerboard of {what}s"
    size = "" if side is None else f" of {side:.3g} {unit}"
    note = (
        f"no calibration table: touches in {how}{size} calibrate ({calibration.n_touches} touches), "
        f"the others are read ({rest.n_touches})"
    )
    return replace(
        dataset,
        calibration=calibration.with_(notes=()),
        touches=rest,
        notes=(*dataset.notes, note),
    )


def _locations(touches: Touches) -> tuple[list[FloatArray], IntArray]:
    """Coordinates of each touch, and the index of the touch of each row."""
    if not touches.n_rows:
        raise InputError("the table of touches has no rows")
    ids, group = groups(touches.touch)
    angle = None if touches.angle_deg is None else _around(touches.angle_deg)
    columns = [values for values in (angle, touches.x_mm, touches.y_mm) if values is not None]
    if not columns:
        raise InputError("touches without a reference location cannot be split by location")
    coordinates = []
    for values in columns:
        in_contact = first_of(np.where(touches.in_contact, values, np.nan), group, len(ids))
        coordinates.append(np.where(np.isnan(in_contact), first_of(values, group, len(ids)), in_contact))
    return coordinates, group


def _around(degrees: FloatArray) -> FloatArray:
    """Angles counted on from the touch after the widest gap, so that a row of touches is not cut in two; NaN missing.

    Angles just below a whole turn, which are 0 with a rounding error, are below 0.
    """
    there = np.unique(degrees[~np.isnan(degrees)] % 360)
    gaps = np.diff(there, append=there[:1] + 360)
    # Gaps of a full ring are equal up to rounding: the last of them ends at the least angle.
    first = there[(np.flatnonzero(gaps > gaps.max(initial=0) - 360 * _SAME)[-1:] + 1) % max(len(there), 1)]
    on = (degrees - first.sum()) % 360
    return np.asarray(np.where(on > 360 * (1 - _SAME), on - 360, on), dtype=np.float64)


def _lines(values: FloatArray) -> IntArray:
    """Index of each value's position among the distinct positions along one coordinate, in ascending order."""
    distinct, inverse = np.unique(values, return_inverse=True)
    new = np.diff(distinct) > _SAME * np.ptp(distinct) if len(distinct) > 1 else np.zeros(0, dtype=bool)
    return np.asarray(np.r_[0, np.cumsum(new)][inverse], dtype=np.int64) if len(values) else np.zeros(0, np.int64)


def _cells(values: FloatArray, side: float) -> IntArray:
    # The small addition puts 0.3 / 0.1 in cell 3 in spite of rounding.
    return np.asarray(np.floor((values - values.min()) / side + 1e-9), dtype=np.int64)
