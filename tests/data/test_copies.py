"""Copies of touches: whole tables, single touches, and equal readings that are no copies."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bayestouch.data.copies import copies, notes_on_copies
from bayestouch.data.touches import Touches, touches_from

TOUCHES, SAMPLES = 5, 3


def noisy(seed: int, number: int = 0, time: float = 0.0) -> dict[str, Any]:
    """Columns of a table of touches with noise, places and loads of their own."""
    rng = np.random.default_rng(seed)
    touch = np.repeat(np.arange(TOUCHES), SAMPLES)
    return {
        "touch": touch + number,
        "readings": rng.normal(100.0, 5.0, (len(touch), 3)),
        "load": np.round(rng.uniform(1, 3, TOUCHES), 2)[touch],
        "angle_deg": np.linspace(-20, 20, TOUCHES)[touch],
        "time_s": time + np.arange(float(len(touch))),
    }


def table(*parts: dict[str, Any]) -> Touches:
    return touches_from(**{name: np.concatenate([part[name] for part in parts]) for name in parts[0]})


def test_a_table_that_is_there_twice() -> None:
    """Under new numbers, also if the times are not those of before."""
    one = noisy(1)
    for again in (
        {**one, "touch": one["touch"] + 10},
        {**one, "touch": one["touch"] + 10, "time_s": one["time_s"] + 9},
    ):
        first = np.arange(TOUCHES) * SAMPLES
        np.testing.assert_array_equal(copies(table(one, again)), np.stack([first + TOUCHES * SAMPLES, first], axis=1))
    assert not len(copies(table(one, noisy(2, number=10))))


@pytest.mark.parametrize("number", [-TOUCHES, -2, -1, 0])
def test_copies_are_found_by_any_number(number: int) -> None:
    one = noisy(1, number=number)
    assert len(copies(table(one, {**one, "touch": one["touch"] + 10}))) == TOUCHES


def test_touches_that_are_the_calibration() -> None:
    """Also without their places, as of touches to be read."""
    calibration = table(noisy(1), noisy(2, number=10))
    np.testing.assert_array_equal(copies(table(noisy(2)), calibration)[:, 1], 15 + np.arange(TOUCHES) * SAMPLES)
    unknown = table(noisy(2)).with_(angle_deg=None)
    assert len(copies(unknown, calibration)) == TOUCHES and not len(copies(table(noisy(3)), calibration))


def test_what_is_no_copy() -> None:
    """Other loads, other places, one other sample, and readings that touches have by chance."""
    one = noisy(1)
    for changed in (
        {"load": one["load"] + 1},
        {"angle_deg": one["angle_deg"] + 1},
        {"readings": one["readings"] + (one["time_s"] % SAMPLES == 0)[:, None]},
    ):
        assert not len(copies(table({**one, **changed}), table(one)))
    for readings in (np.zeros((15, 3)), np.where(one["readings"] > 100, 1023.0, 0.0)):
        extreme = {**one, "readings": readings}
        assert not len(copies(table(extreme, {**extreme, "touch": one["touch"] + 10})))


def test_readings_without_noise_are_copies_only_at_the_same_time() -> None:
    exact = noisy(1)
    exact["readings"] = exact["readings"][::SAMPLES].repeat(SAMPLES, axis=0)
    later = {**exact, "touch": exact["touch"] + 10}
    assert len(copies(table(exact, later))) > 2
    assert not len(copies(table(exact, {**later, "time_s": exact["time_s"] + 60})))


@pytest.mark.parametrize(("count", "said"), [(1, "1 of 6 touches is a copy"), (5, "5 of 10 touches are copies")])
def test_the_line_names_file_and_row(count: int, said: str) -> None:
    one = noisy(1)
    again = {name: values[: count * SAMPLES] for name, values in {**one, "touch": one["touch"] + 10}.items()}
    files = "calibration.csv", "touches.csv"
    assert list(notes_on_copies(table(one, again), table(noisy(4)), files)) == [
        "calibration.csv, row 17: the readings, loads and places of this touch are those of calibration.csv, row 2; "
        f"{said}, which count twice"
    ]
    assert list(notes_on_copies(table(one), table(one), files)) == [
        "touches.csv, row 2: the readings, loads and places of this touch are those of calibration.csv, row 2; "
        "5 of 5 touches are copies, whose errors are those of touches that were calibrated with"
    ]
    assert list(notes_on_copies(None, table(noisy(4)), files)) == []
