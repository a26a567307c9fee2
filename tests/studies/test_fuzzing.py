"""What is counted of a fuzzer that another program leads."""

from __future__ import annotations

import pytest
from study_modules import study

pytest.importorskip("resource", reason="this system limits no process")


@pytest.mark.parametrize(
    ("exitcode", "inputs", "hang", "died"),
    [(0, 39, 0, 0), (70, 40, 1, 0), (72, 39, 0, 0), (77, 40, 0, 1), (-2, 39, 0, 0), (-9, 40, 0, 1)],
)
def test_the_input_in_which_a_process_ended_is_counted(exitcode: int, inputs: int, hang: int, died: int) -> None:
    """39 inputs were refused, and the process ended in the next one: by time, by a fault of a library, or stopped."""
    module = study("_fuzzing")
    counts = dict.fromkeys(module.COUNTS, 0.0) | {"inputs": 40.0, "refused": 39.0}
    found = module.settled(counts, exitcode)
    assert (found["inputs"], found["hang"], found["died"], found["refused"]) == (inputs, hang, died, 39)


def test_a_crash_that_was_counted_is_counted_once() -> None:
    module = study("_fuzzing")
    counts = dict.fromkeys(module.COUNTS, 0.0) | {"inputs": 40.0, "refused": 39.0, "crash": 1.0}
    assert module.settled(counts, 77) == counts
