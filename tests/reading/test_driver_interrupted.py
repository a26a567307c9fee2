"""Runs that are killed go on where they were and end the same, to the last byte."""

from __future__ import annotations

import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import xarray as xr
from streamed_cases import DRAWS, blocks_of_seven, calibrated, saved

import bayestouch
from bayestouch.data.touches import Touches
from bayestouch.errors import InputError
from bayestouch.results.objects import Calibration
from bayestouch.results.partial import partial_folder


@pytest.fixture(scope="module")
def read() -> tuple[Touches, Calibration]:
    return calibrated()


_SCRIPT = """
import sys, bayestouch
from bayestouch.reading import driver as run
run.BLOCK_DRAWS, run.BLOCK_UNIT = 1, 3
data = bayestouch.load_dataset({folder!r})
calibration = bayestouch.load({calibration!r})
options = dict(method="importance", draws={draws}, seed={seed}, workers=1)
bayestouch.infer(data.touches, calibration, output={output!r}, **options)
"""


class Killed:
    """A run of its own process, killed when so many blocks are done and a little later."""

    def __init__(self, folder: Path, calibration: Path, output: Path, draws: int = 1000, seed: int = 1) -> None:
        self.output, self.finished = output, output.with_name(f"{output.name}.partial") / "finished.txt"
        self.script = _SCRIPT.format(
            folder=str(folder), calibration=str(calibration), output=str(output), draws=draws, seed=seed
        )

    def done(self) -> int:
        return len(self.finished.read_text().split()) if self.finished.exists() else 0

    def start(self) -> subprocess.Popen[bytes]:
        return subprocess.Popen([sys.executable, "-c", self.script], stderr=subprocess.PIPE)

    def whole(self) -> None:
        assert subprocess.run([sys.executable, "-c", self.script], check=False).returncode == 0

    def kill(self, blocks: int, later: float, how: signal.Signals = signal.SIGKILL) -> bool:
        """Whether it was killed before its result was in place.

        A process that is killed while it removes its folder, or while Python ends, has delivered its result.
        """
        process, target = self.start(), self.done() + blocks
        deadline = time.monotonic() + 120
        while process.poll() is None and self.done() < target and time.monotonic() < deadline:
            time.sleep(0.001)
        time.sleep(later)
        process.send_signal(how)
        _, error = process.communicate()
        assert process.returncode in (0, -how, 1), error.decode()
        return process.returncode != 0 and not self.output.exists()


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    return saved(tmp_path_factory.mktemp("killed"))


def _killed_again_and_again(files: tuple[Path, Path], tmp_path: Path, kills: int, rng: random.Random) -> None:
    uninterrupted = Killed(*files, tmp_path / "whole.nc")
    uninterrupted.whole()
    run = Killed(*files, tmp_path / "posterior.nc")
    killed = 0
    while killed < kills:
        before = run.done()
        if run.kill(rng.choice([0, 1, 2]), rng.uniform(0, 0.03), rng.choice([signal.SIGKILL, signal.SIGINT])):
            killed += 1
            assert run.done() >= before, "no finished block is lost"
        else:  # it was quicker
            assert run.output.read_bytes() == uninterrupted.output.read_bytes()
            run.output.unlink()
    run.whole()
    # bit for bit, the whole file
    assert run.output.read_bytes() == uninterrupted.output.read_bytes()
    assert not run.finished.parent.exists()


@pytest.mark.slow
def test_a_killed_run_goes_on_and_ends_the_same(files: tuple[Path, Path], tmp_path: Path) -> None:
    _killed_again_and_again(files, tmp_path, 3, random.Random(3))


@pytest.mark.slow
def test_a_run_killed_six_times_ends_the_same(files: tuple[Path, Path], tmp_path: Path) -> None:
    """A hundred kills are in `studies/interruptions.py`."""
    _killed_again_and_again(files, tmp_path, 6, random.Random(4))


_DEADLY = """
import os, signal, sys, bayestouch
from bayestouch.reading import draws
here, usual, draws.SHARED_FROM = os.getpid(), draws.draw_groups, 1

def deadly(sampler, touches, plan, numbers, rounds):
    if os.getpid() != here and numbers[0] > 0:
        os.kill(os.getpid(), signal.SIGKILL)
    return usual(sampler, touches, plan, numbers, rounds)

data = bayestouch.load_dataset({folder!r})
calibration = bayestouch.load({calibration!r})
options = dict(method="importance", draws=128, seed=1)
whole = bayestouch.infer(data.touches, calibration, workers=1, **options)
draws.draw_groups = deadly
rest = bayestouch.infer(data.touches, calibration, workers=2, **options)
assert all((rest.posterior[name] == draws).all() for name, draws in whole.posterior.items())
"""


@pytest.mark.skipif(sys.platform != "linux", reason="processes are forked on Linux only")
def test_a_process_that_is_killed_is_stood_in_for(files: tuple[Path, Path]) -> None:
    """A process forked to draw is killed, as for want of memory: its parent draws the rest."""
    script = _DEADLY.format(folder=str(files[0]), calibration=str(files[1]))
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, check=False, timeout=120)
    assert ended.returncode == 0, ended.stderr.decode()


@pytest.mark.slow
def test_what_a_killed_run_leaves_is_no_result(files: tuple[Path, Path], tmp_path: Path) -> None:
    run = Killed(*files, tmp_path / "posterior.nc")
    assert run.kill(2, 0.0)
    assert run.done() >= 2
    left = run.finished.parent / "posterior"
    with pytest.raises(InputError, match="expected a posterior file"):
        bayestouch.load(left)
    with pytest.raises(OSError, match="signature"):
        xr.open_datatree(left, engine="h5netcdf")
    # Other options are another run: it begins anew, and ends as if nothing had been there.
    other = Killed(*files, tmp_path / "posterior.nc", draws=400, seed=2)
    clean = Killed(*files, tmp_path / "clean.nc", draws=400, seed=2)
    other.whole()
    clean.whole()
    assert other.output.read_bytes() == clean.output.read_bytes()


def test_a_line_cut_off_does_not_count(tmp_path: Path) -> None:
    with partial_folder(tmp_path / "a.nc", "x") as partial:
        partial.add(0)
        partial.add(4096)
        with (partial.folder / "finished.txt").open("a") as stream:
            stream.write("81")
        assert partial.finished() == {0, 4096}
        assert partial.layout() is None, "no growing file"


def test_two_runs_at_once_do_not_mix(tmp_path: Path) -> None:
    with (
        partial_folder(tmp_path / "a.nc", "x"),
        pytest.raises(InputError, match="another run is writing"),
        partial_folder(tmp_path / "a.nc", "x"),
    ):
        pass


def test_a_full_disk_is_one_line_and_the_run_goes_on_later(
    read: tuple[Touches, Calibration], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from bayestouch.results.growing_file import GrowingFile

    blocks_of_seven(monkeypatch)
    path, write, writes = tmp_path / "posterior.nc", GrowingFile.write, 0

    def full(self: GrowingFile, *arguments: object) -> None:
        nonlocal writes
        writes += 1
        if writes == 3:
            raise OSError(28, "No space left on device")
        write(self, *arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(GrowingFile, "write", full)
    with pytest.raises(InputError, match=r"posterior\.nc: cannot be written: No space left"):
        bayestouch.infer(*read, draws=DRAWS, seed=5, output=path)
    assert not path.exists()
    blocks = -(-read[0].n_touches // 7)
    bayestouch.infer(*read, draws=DRAWS, seed=5, output=path)
    assert writes == 3 + blocks - 2, "two blocks were there"
