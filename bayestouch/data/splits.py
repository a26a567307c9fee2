"""Splitting one table into touches to calibrate with and touches to be read, by where they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray, IntArray
from bayestouch.data.dataset import DataSet
from bayestouch.data.grouping import first_of, groups
from bayestouch.data.touches import Touches
from bayestouch.errors import InputError

#: Positions closer than this share of the whole range are one: stages report the same place with other
#: last digits, and no scan has a million lines.
_SAME = 1e-6


def checkerboard(touches: Touches, cell: float | None = None) -> BoolArray:
    """Choose touches to calibrate with, in alternate cells of location.

    Along a line or around a finger every other cell is chosen, in the plane those of one colour of a
    checkerboard. All rows of a touch go together (by the first location it has in contact, or at all), and
    so do all touches of one location; angles a full turn apart are one location.

    Parameters
    ----------
    touches : Touches
    cell : float, optional
        Side of a cell in the unit of the location (degree or mm). By default every distinct position
        along a coordinate is a cell of its own where positions form a line or a grid; where they are
        scattered in the plane the cell is `default_cell`.

    Returns
    -------
    bool array, shape (n_rows,)
        True in rows to calibrate with. False in rows of a touch without location.

    Raises
    ------
    InputError
        No touch has a location, or all are in one cell.
    """
    coordinates, group = _locations(touches)
    located = np.all([~np.isnan(values) for values in coordinates], axis=0)
    if not located.any():
        raise InputError("touches without a reference location cannot be split by location")
    if cell is not None and not (np.isfinite(cell) and cell > 0):
        raise InputError(f"expected a cell above zero, got {cell!r}")
    side = default_cell(touches) if cell is None else cell
    index = np.zeros(len(located), dtype=np.int64)
    for values in coordinates:
        index[located] += _lines(values[located]) if side is None else _cells(values[located], side)
    chosen = located & (index % 2 == 0)
    if not (located & ~chosen).any() or not chosen.any():
        raise InputError("all touches are in one cell: nothing is left to be held out (give calibration.csv)")
    return np.asarray(chosen[group], dtype=np.bool_)


def default_cell(touches: Touches) -> float | None:
    """Side of the cells that `checkerboard` takes by default.

    None where every distinct position is a cell of its own (a line, or a grid filled to a quarter at
    least); else √(area / number of locations), the spacing if the locations were evenly spread.
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
    """Give a data set without calibration one, by a checkerboard over its touches; the note says how.

    A data set that has a calibration is returned as it is. No-contact rows that belong to no touch in
    contact are put in both halves, so that both have the same baseline.

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
    """Coordinates of each touch, and the touch of each row."""
    ids, group = groups(touches.touch)
    angle = None if touches.angle_deg is None else touches.angle_deg % 360
    columns = [values for values in (angle, touches.x_mm, touches.y_mm) if values is not None]
    if not columns:
        raise InputError("touches without a reference location cannot be split by location")
    coordinates = []
    for values in columns:
        in_contact = first_of(np.where(touches.in_contact, values, np.nan), group, len(ids))
        coordinates.append(np.where(np.isnan(in_contact), first_of(values, group, len(ids)), in_contact))
    return coordinates, group


def _lines(values: FloatArray) -> IntArray:
    """Number the distinct positions along one coordinate in their order."""
    distinct, inverse = np.unique(values, return_inverse=True)
    new = np.diff(distinct) > _SAME * np.ptp(distinct) if len(distinct) > 1 else np.zeros(0, dtype=bool)
    return np.asarray(np.r_[0, np.cumsum(new)][inverse], dtype=np.int64) if len(values) else np.zeros(0, np.int64)


def _cells(values: FloatArray, side: float) -> IntArray:
    # The small addition keeps 0.3 / 0.1 in the cell that the decimal means.
    return np.asarray(np.floor((values - values.min()) / side + 1e-9), dtype=np.int64)
