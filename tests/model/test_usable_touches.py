"""Which touches of a table fits can use, and what is said of the others."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from bayestouch.data.touches import touches_from
from bayestouch.finger import body as finger
from bayestouch.model.usable_touches import have_references, remarks_on
from bayestouch.pad import body as pad

NAN = np.nan
FINGER, PAD = finger.BODY.references, pad.BODY.references


def table(**changes: Any) -> Any:
    """Touches 3, 3, 1, 2 on a finger; the first row is at rest."""
    values: dict[str, Any] = {
        "n_rows": 4,
        "touch": np.array([3, 3, 1, 2]),
        "in_contact": np.array([False, True, True, True]),
        "readings": np.array([[NAN, NAN], [1.0, NAN], [2.0, NAN], [3.0, NAN]]),
        "load": np.array([0.0, 5.0, NAN, 6.0]),
        "indenter_radius_mm": np.full(4, 3.0),
        "angle_deg": np.zeros(4),
        "x_mm": np.zeros(4),
        "y_mm": None,
        "reads": None,
    }
    return SimpleNamespace(**(values | changes))


def test_touches_with_every_reference() -> None:
    """Rows that press with something read; unknown loads are no hindrance, loads of zero are."""
    assert have_references(table(), FINGER).tolist() == [True, True, True]
    assert have_references(table(load=np.array([5.0, 0.0, NAN, -1.0])), FINGER).tolist() == [False, True, False]
    assert have_references(table(angle_deg=np.array([1.0, NAN, 1.0, 1.0])), FINGER).tolist() == [False, True, True]
    assert have_references(table(indenter_radius_mm=np.array([1.0, 1.0, NAN, 1.0])), FINGER).tolist() == [
        True,
        False,
        True,
    ]
    assert have_references(table(indenter_radius_mm=np.full(4, NAN)), PAD).tolist() == [True, True, True]
    assert have_references(table(y_mm=np.array([0.0, 0.0, 0.0, NAN])), PAD).tolist() == [True, True, False]
    readings = np.array([[1.0, 1.0], [NAN, NAN], [2.0, NAN], [3.0, NAN]])
    assert have_references(table(readings=readings), FINGER).tolist() == [False, True, True]


def test_no_touch_has_references_without_a_location() -> None:
    assert have_references(table(angle_deg=None, x_mm=None), FINGER).tolist() == [False, False, False]


def test_remarks() -> None:
    """On elements without readings, and touches that were read once."""
    rows = np.ones(4, dtype=bool)
    dead, once = remarks_on(table(), rows)
    assert dead == "e02: no readings, or the same one in every row; left out"
    assert once.startswith("no touch was read twice")
    assert remarks_on(table(reads=np.array([1.0, NAN, 1.0, 2.0])), rows) == (dead,)
    assert len(remarks_on(table(reads=np.array([1.0, NAN, 1.0, 1.0])), rows)) == 2
    several = touches_from([3, 3, 1, 2], np.array([[0.0, NAN], [1.0, NAN], [2.0, NAN], [3.0, NAN]]), contact=1.0)
    assert remarks_on(several, rows) == (dead,)
    assert len(remarks_on(table(in_contact=np.ones(4, dtype=bool)), np.array([False, True, True, True]))) == 2


def test_a_remark_names_samples_that_are_all_equal() -> None:
    noted = (
        "the samples of each touch are all equal: the noise is that of readings far from the touch, and effects of the "
        "noise cannot be seen"
    )
    for last, said in ((1.0, (noted,)), (1.5, ())):
        made = touches_from([0, 0, 1, 1], np.array([[1.0], [last], [2.0], [2.0]]), contact=1.0)
        assert remarks_on(made, np.ones(4, dtype=bool)) == said
