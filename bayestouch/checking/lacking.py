"""What a data set lacks for a report, and which touches would make up for it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bayestouch.data.averages import TouchMeans
from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import Finger
from bayestouch.data.splits import with_calibration
from bayestouch.data.touches import Touches
from bayestouch.errors import InputError


def baseline_corrected_means(touches: Touches) -> TouchMeans:
    """Means of the touches, no-contact readings subtracted."""
    return touches.baseline_corrected().averaged()


def lacking(dataset: DataSet) -> Iterator[str]:
    """What a report cannot say of these data, or not well, and which touches would let it."""
    if dataset.calibration is None:
        yield "no calibration table: touches.csv is split by location, one half to calibrate with"
    known = baseline_corrected_means(dataset.touches if dataset.calibration is None else dataset.calibration)
    if isinstance(dataset.sensor.body, Finger):
        yield from _finger_advice(dataset, dataset.sensor.body, known)
    if not np.nansum(known.pure_error_dof) > 0:
        yield "no touch is repeated: noise cannot be told from what the model misses; take 3 to 5 samples of each touch"
    tables = [table for table in (dataset.calibration, dataset.touches) if table is not None]
    if all(table.in_contact.all() for table in tables):
        yield "no reading without contact (depth, load or contact 0): an offset of the readings cannot be taken away"
    yield from _references(dataset)


def _finger_advice(dataset: DataSet, finger: Finger, known: TouchMeans) -> Iterator[str]:
    from bayestouch.finger.known_touches import KnownTouches

    if known.angle_deg is None:
        yield "cannot be calibrated: no angle_deg"
        return
    try:
        KnownTouches.of(baseline_corrected_means(_calibration_of(dataset)), finger)
    except InputError as error:
        yield f"cannot be calibrated: {error.message}"
        return
    edges = known.angle_deg[(known.indenter_radius_mm == 0) & np.isfinite(known.angle_deg)]
    angles = np.asarray(finger.element_angles_deg)
    if not edges.size:
        yield "no knife edge to calibrate with: it is the sharpest look at the depth of each element"
    elif len(angles) > 1:
        pitch = float(np.median(np.diff(np.sort(angles))))
        nearest = np.abs((angles[:, None] - edges + 180) % 360 - 180).min(axis=1)
        bare = [f"e{e + 1:02d}" for e in np.flatnonzero(nearest > pitch / 2)]
        if bare:
            yield f"no knife edge within half a pitch ({pitch / 2:.3g}°) of {', '.join(bare)}"
    if not np.isinf(known.indenter_radius_mm).any():
        yield "no flat to calibrate with: it says how the rubber spreads a load (Poisson's ratio)"


def _calibration_of(dataset: DataSet) -> Touches:
    table = with_calibration(dataset).calibration
    assert table is not None
    return table


def _references(dataset: DataSet) -> Iterator[str]:
    touches, body = dataset.touches, dataset.sensor.body
    names = {"angle_deg": touches.angle_deg, "x_mm": touches.x_mm, "y_mm": touches.y_mm}
    absent = [name for name in body.location_columns if (c := names[name]) is None or not np.isfinite(c).any()]
    if absent:
        yield f"no {' and '.join(absent)} in touches: errors of the location cannot be given"
    if not np.isfinite(touches.load).any():
        yield f"no {body.load_column} in touches: errors of the load cannot be given"
    if isinstance(body, Finger) and np.isnan(touches.indenter_radius_mm).all():
        yield "no indenter_radius_mm in touches: errors of the radius cannot be given"
