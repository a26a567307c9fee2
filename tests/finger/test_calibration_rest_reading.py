"""The reading without contact, which a calibration keeps for touches that have none of their own."""

from __future__ import annotations

import numpy as np
from known_fingers import ANGLES, dataset, known_touches

from bayestouch.data.baseline import NO_REST
from bayestouch.data.touches import touches_from
from bayestouch.finger.calibration import about_offsets, calibrate_finger
from bayestouch.results.keys import REST_READING


def test_the_rest_reading_is_kept_only_where_there_is_one() -> None:
    """Two rows out of contact read 4 and 8 in every element: the calibration keeps 6; without such rows nothing.

    Each is the mean of a million readings, so that touches do not correct it.
    """
    pressed = known_touches(1, step=10.0)
    n, m = pressed.n_rows, len(ANGLES)
    rest = np.repeat([[4.0], [8.0]], m, axis=1)
    both = touches_from(
        np.r_[pressed.touch, 0, 1],
        np.concatenate([pressed.readings + 6.0, rest]),
        indenter_radius_mm=np.r_[pressed.indenter_radius_mm, 0.0, 0.0],
        angle_deg=np.r_[pressed.angle_deg, 0.0, 0.0],
        load=np.r_[pressed.load, 0.0, 0.0],
        contact=np.r_[np.ones(n), 0.0, 0.0],
        reads=np.r_[np.ones(n), 1e6, 1e6],
    )
    without = calibrate_finger(dataset(pressed), contact="layer", draws=8, seed=0)
    zero = "a finger has no offset, so they must be zero without touch (a diagnosis looks for an offset)"
    assert f"{NO_REST}; {zero}" in without.notes
    kept = calibrate_finger(dataset(both), contact="layer", draws=8, seed=0)
    assert REST_READING not in without.extra
    np.testing.assert_allclose(kept.extra[REST_READING], np.full(m, 6.0))


def test_a_calibration_with_offsets_says_that_they_are_fitted() -> None:
    fitted = about_offsets(("other", NO_REST), fitted=True)
    assert fitted == ("other", f"{NO_REST}; the offset of each element is fitted")
    assert "they must be zero" in about_offsets((NO_REST,))[0]
