"""Options of an inference that are impossible."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from bayestouch.errors import InputError
from bayestouch.reading.options import Kept, Options


def test_what_is_no_whole_number_is_refused() -> None:
    table: Any = SimpleNamespace(n_elements=4)
    calibration: Any = SimpleNamespace(sensor=table)
    Options(seed=0).check(table, calibration)
    with pytest.raises(InputError, match=r"^thin: expected a whole number, at least 1, got 'a'$"):
        Options(kept=Kept(thin="a")).check(table, calibration)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="seed: expected a whole number, at least 0, got -1"):
        Options(seed=-1).check(table, calibration)


@pytest.mark.parametrize("name", ["plug_in", "use_load", "check_sensor", "each_sample"])
def test_an_option_that_is_true_or_false_takes_nothing_else(name: str) -> None:
    """Text such as "no" counts as True in Python."""
    with pytest.raises(InputError, match=f"^{name}: expected True or False, got 'no'"):
        Options(**{name: "no"})  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"^summary_only: expected True or False, got 1"):
        Kept(summary_only=1)  # type: ignore[arg-type]
