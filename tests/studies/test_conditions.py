"""The same result in other surroundings: each of two runs at once is compared with the plain one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import pytest
from study_modules import study

module = study("conditions")


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (None, "same to the last bit"),
        ("calibration-0.nc", "differs by 5.0e-01 of the largest value of an array"),
        ("posterior-1.nc", "differs by 5.0e-01 of the largest value of an array"),
    ],
)
def test_each_of_two_runs_is_compared(wrong: str | None, said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """All files hold a 2, but for one of the two runs at once, which holds a 3."""

    class Process:
        returncode = 0

        def __init__(self, command: list[str], cwd: Path, **_: Any) -> None:
            name = command[command.index("-o") + 1]
            with h5py.File(cwd / name, "w") as file:
                file["value"] = [3.0 if cwd.name == "two" and name == wrong else 2.0]

        def communicate(self) -> tuple[bytes, bytes]:
            return b"", b""

    monkeypatch.setattr(module.subprocess, "Popen", Process)
    surroundings = (module.Surrounding("plain"), module.Surrounding("two at once", folder="two", at_once=2))
    assert module.main(surroundings=surroundings) == {"plain": "same to the last bit", "two at once": said}
