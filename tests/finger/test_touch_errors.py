"""Errors of held-out touches on a finger with elements all around."""

from __future__ import annotations

import numpy as np

from bayestouch.finger.touch_errors import errors_by_touch


def test_an_error_of_location_is_the_shorter_way_around() -> None:
    """Across the seam at ±180° and beyond a turn; an error below half a turn is the same to the last bit."""
    found = np.array([179.5, -179.75, 365.0, 0.1, -30.3])
    true = np.array([-179.5, 179.75, 4.0, 0.3, 12.7])
    one = np.ones(5)
    errors = errors_by_touch(
        {"R": one, "theta_c": found, "P": one}, one, one, {"R": one, "theta_c": true, "P": one}, one
    )
    np.testing.assert_array_equal(errors["theta_rms_deg"][:3], [-1.0, 0.5, 1.0])
    np.testing.assert_array_equal(errors["theta_rms_deg"][3:], (found - true)[3:])
