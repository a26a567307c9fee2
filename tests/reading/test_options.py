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
