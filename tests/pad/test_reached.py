"""Elements of a pad that no calibration touch comes near to, worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch.pad.reached import Reached

PLACE = np.array([[0.0, 0.0], [4.0, 0.0], [8.0, 0.0], [12.0, 0.0]])


def test_an_element_that_no_touch_presses_has_the_signal_of_the_others() -> None:
    """Touches to x = 3 press two elements with signals 10 and 2; the pitch is 4, and touches press within 2."""
    reached = Reached.of(PLACE, np.array([[0.0, 1.0], [3.0, 0.0], [-1.0, 0.0]]))
    np.testing.assert_allclose(reached.nearest, [1.0, 1.0, 5.0, 9.0])
    every = np.ones(4, dtype=bool)
    np.testing.assert_allclose(reached.sizes(np.array([10.0, 2.0, 8.0, 0.1]), every), [10.0, 2.0, 8.0, 6.0])
    # Without the second element, which is pressed and reads next to nothing.
    some = np.array([True, False, True, True])
    np.testing.assert_allclose(reached.sizes(np.array([10.0, 0.01, 8.0, 0.1]), some), [10.0, 0.01, 10.0, 10.0])


def test_elements_a_pitch_from_all_touches_are_named() -> None:
    every = np.ones(4, dtype=bool)
    note = Reached.of(PLACE, np.array([[4.2, 0.0], [0.0, 1.0]])).note(every)
    assert note.startswith("no calibration touch comes within 4 mm, the distance between elements, of e04: its gain")
    assert "of e03 and e04: their" in Reached.of(PLACE, np.array([[3.9, 0.0], [0.0, 1.0]])).note(every)
    assert not Reached.of(PLACE, np.array([[3.9, 0.0], [0.0, 1.0]])).note(np.array([True, True, False, False]))
    assert not Reached.of(PLACE, np.array([[8.2, 0.0], [0.1, 0.0]])).note(every)


def test_a_single_element_has_no_neighbour_to_be_told_by() -> None:
    reached = Reached.of(PLACE[:1], np.array([[3.0, 0.0], [5.0, 0.0]]))
    assert not reached.pressed.any() and not reached.note(np.array([True]))
    assert reached.sizes(np.array([7.0]), np.array([True])) == pytest.approx([7.0])
