"""Processes that share out the cases of a study end with it, also if it is killed."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from study_modules import STUDIES

PROGRAM = """
import os, sys, time
sys.path.insert(0, {studies!r})
from _shared_out import finished

def waiting(shared, case):
    open(os.path.join(shared, str(os.getpid())), "w").close()
    time.sleep(case)

if __name__ == "__main__":
    list(finished(waiting, {folder!r}, [600.0, 600.0], processes=2))
"""


def is_running(pid: int) -> bool:
    """Whether a process does not only wait for its parent to take note of its end."""
    try:
        return Path(f"/proc/{pid}/stat").read_text("utf-8").rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.skipif(sys.platform != "linux", reason="processes are looked up in /proc")
def test_workers_end_with_a_study_that_is_killed(tmp_path: Path) -> None:
    seen = tmp_path / "seen"
    seen.mkdir()
    program = tmp_path / "program.py"
    program.write_text(PROGRAM.format(studies=str(STUDIES), folder=str(seen)), encoding="utf-8")
    study = subprocess.Popen(
        [sys.executable, str(program)], env={**os.environ, "PYTHONPATH": str(STUDIES.parent)}, stderr=subprocess.DEVNULL
    )
    try:
        end = time.monotonic() + 60
        while len(list(seen.iterdir())) < 2 and time.monotonic() < end:
            time.sleep(0.1)
        workers = [int(each.name) for each in seen.iterdir()]
        assert len(workers) == 2 and all(map(is_running, workers))
    finally:
        study.kill()
        study.wait()
    end = time.monotonic() + 20
    while any(map(is_running, workers)) and time.monotonic() < end:
        time.sleep(0.1)
    assert not any(map(is_running, workers))
