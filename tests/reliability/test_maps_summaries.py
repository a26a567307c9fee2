"""Maps print where a sensor is best, and no arrays."""

from __future__ import annotations

import numpy as np

from bayestouch.reliability import PadSpots, SweetSpots


def test_a_finger_says_where_each_estimate_is_best() -> None:
    """Two indenters at three locations; sds are noise and calibration, 3 and 4 for 5."""
    noise = {"R": np.array([[0.3, 0.6, 0.9], [0.3, 0.6, 0.9]])}
    bias = {"R": np.array([[0.4, 0.8, 1.2], [0.4, 0.8, 1.2]])}
    for name, size in (("theta_c", 0.1), ("P", 2.0)):
        noise[name] = size * np.array([[3.0, 2.0, 1.0]] * 2)
        bias[name] = np.zeros((2, 3))
    nothing = np.zeros((2, 3))
    spots = SweetSpots(
        np.array([0.0, 3.9]), np.array([-4.0, 0.0, 4.0]), noise, bias, nothing, nothing, nothing, noise, bias, bias
    )
    assert repr(spots).splitlines() == [
        "SweetSpots of 2 indenters at 3 locations from −4 to 4°",
        "  R: sd from 0.500 to 1.50 mm, smallest at −4°",
        "  theta_c: sd from 0.100 to 0.300 degree, smallest at 4°",
        "  P: sd from 2 to 6 N/m, smallest at 4°",
    ]
    assert "<strong>SweetSpots of 2 indenters" in spots._repr_html_()


def test_a_pad_says_where_the_location_is_best() -> None:
    spots = PadSpots(
        np.array([[0.0, 1.5], [2.0, 1.5]]),
        np.array([[0.3, 0.0], [0.0, 0.1]]),
        np.array([[0.0, 0.4], [0.0, 0.0]]),
        np.zeros((2, 2, 4)),
        np.zeros((2, 2)),
    )
    assert repr(spots).splitlines() == [
        "PadSpots of 2 places",
        "  sd of the location from 0.100 to 0.500 mm, smallest at (2, 1.50) mm",
    ]
