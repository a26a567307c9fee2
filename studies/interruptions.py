"""Fault table of `bayestouch infer`: what was injected, how many times, and what was lost.

A run writes the posteriors of 1,024 simulated touches in eight blocks. It is killed at a random moment, started
again, killed again, and so on; whenever it comes to its end its file is compared byte by byte with that of a run that
nothing disturbed. After each fault: is there a file that should not be, does anything open what was left behind, and
did a block that was finished stay finished?

    python studies/interruptions.py [--kills 100] [--dask-kills 20] [--seed 0]
"""

from __future__ import annotations

import argparse
import faulthandler
import json
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import bayestouch
from bayestouch.commands import cli
from bayestouch.data.touch_table import write_touches
from bayestouch.data.touches import touches_from
from bayestouch.errors import InputError
from bayestouch.finger.calibration import finger_chain
from bayestouch.parallel import cluster
from bayestouch.reading import draws
from bayestouch.reading import driver as run
from bayestouch.simulation import FingerDesign

TOUCHES, BLOCK, DRAWS = 1024, 128, 128
#: How long an undisturbed run may take on a busy machine, seconds.
LONGEST = 300


@dataclass
class Tally:
    """What happened to one kind of fault."""

    injected: int = 0
    completed: int = 0  # runs that came to their end, with faults on the way
    refused: int = 0  # starts that were refused although nothing runs
    wrong: int = 0  # files that are not what they should be
    half: int = 0  # something half written that opens as a result, or is in its place
    blocks_lost: int = 0  # finished blocks that did not stay finished

    @property
    def lost(self) -> int:
        """Everything that should not be."""
        return self.refused + self.wrong + self.half + self.blocks_lost


@dataclass(frozen=True)
class Bench:
    """A calibrated finger, touches, and the file that an undisturbed run writes."""

    folder: Path
    whole: bytes
    seconds: float

    @property
    def output(self) -> Path:
        """File that disturbed runs write."""
        return self.folder / "posterior.nc"

    @property
    def left(self) -> Path:
        """What an interrupted run leaves."""
        return self.folder / "posterior.nc.partial"

    def start(self, *more: str, room: int | None = None) -> Run:
        """The command in a process of its own; `room` is the most that a file may grow to, bytes."""
        return Run(self.folder, self.output, more, room)

    def finished(self) -> int:
        """Blocks that are done."""
        file = self.left / "finished.txt"
        return file.read_text().count("\n") if file.exists() else 0


class Run:
    """The command in a process forked from this one, so that a kill hits its work and not its imports."""

    def __init__(self, folder: Path, output: Path, more: tuple[str, ...] = (), room: int | None = None) -> None:
        self.returncode: int | None = None
        self._said = folder / "stderr.txt"
        command = ["infer", str(folder / "touches.csv"), "--quiet", "-o", str(output), "--method", "importance"]
        command += ["--calibration", str(folder / "calibration.nc"), "--draws", str(DRAWS), *more]
        sys.stdout.flush()
        self.pid = os.fork()
        if self.pid == 0:
            os.dup2(os.open(self._said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), 2)
            status = 1
            faulthandler.register(signal.SIGUSR1)  # tells where it hangs
            try:
                os.environ["SOURCE_DATE_EPOCH"] = "0"  # the time of writing, the only bytes that runs do not share
                # As it is, but for smaller blocks, more processes than so few touches deserve, and less patience.
                run.BLOCK_DRAWS, run.BLOCK_UNIT, draws.SHARED_FROM, cluster.PATIENCE = 1, BLOCK, 64, 4.0
                if room is not None:
                    resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))
                status = cli.main(command)
            except BaseException:
                traceback.print_exc()
            finally:
                sys.stderr.flush()
                os._exit(status)

    def ended(self) -> bool:
        """Whether it has."""
        if self.returncode is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            self.returncode = os.waitstatus_to_exitcode(status) if pid else None
        return self.returncode is not None

    def kill(self, how: signal.Signals) -> None:
        """Send it a signal, if it still runs."""
        if not self.ended():
            os.kill(self.pid, how)

    def error(self) -> bytes:
        """Wait for its end, and give what it said."""
        until = time.monotonic() + LONGEST
        while not self.ended():
            if time.monotonic() > until:
                os.kill(self.pid, signal.SIGUSR1)
                time.sleep(1.0)
                os.kill(self.pid, signal.SIGKILL)
                raise SystemExit(f"a run hangs: {self._said.read_text()}")
            time.sleep(0.005)
        return self._said.read_bytes()


def environment(folder: Path) -> dict[str, str]:
    """Compiled modules are kept, wherever that is switched off: most of a start would be compiling."""
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    return {**kept, "PYTHONPYCACHEPREFIX": str(folder / "bytecode"), "OMP_NUM_THREADS": "1"}


def bench(folder: Path) -> Bench:
    """Simulate, calibrate, and read undisturbed."""
    calibration = bayestouch.calibrate(bayestouch.simulate(FingerDesign(), seed=3).dataset, draws=200)
    calibration.save(folder / "calibration.nc")
    chain, rng = finger_chain(calibration), np.random.default_rng(1)
    load = float(calibration.settings["typical_load"]) * rng.uniform(0.5, 1.5, TOUCHES)
    readings = chain.predict(rng.uniform(0.3, 12.6, TOUCHES), np.radians(rng.uniform(-60, 60, TOUCHES)), load)
    readings += calibration.noise.tactile_sd * rng.standard_normal(readings.shape)
    write_touches(touches_from(np.arange(TOUCHES), readings, load=load), folder / "touches.csv", calibration.sensor)
    path, begun = folder / "whole.nc", 0.0
    for _ in range(2):  # the first time solves and imports what this process has not yet
        path.unlink(missing_ok=True)
        begun = time.perf_counter()
        process = Run(folder, path)
        if (error := process.error()) and process.returncode:
            raise SystemExit(error.decode())
    return Bench(folder, path.read_bytes(), time.perf_counter() - begun)


def opens(path: Path) -> bool:
    """Whether anything takes it for a result."""
    try:
        bayestouch.load(path)
    except InputError:
        return False
    return True


def look(made: Bench, tally: Tally, before: int) -> None:
    """Look at what a fault left."""
    if made.output.exists():  # it was done after all
        tally.wrong += made.output.read_bytes() != made.whole
        tally.completed += 1
        made.output.unlink()
        return
    # A file that is whole but not yet in its place is not half written.
    left = made.left / "posterior"
    tally.half += left.exists() and opens(left) and left.read_bytes() != made.whole
    tally.blocks_lost += max(0, before - made.finished())


def complete(made: Bench, tally: Tally, *more: str) -> None:
    """Start once more and let it come to its end."""
    process = made.start(*more)
    error = process.error()
    if process.returncode:
        print(error.decode(), file=sys.stderr)
        tally.refused += 1
    else:
        look(made, tally, 0)


def signalled(made: Bench, how: signal.Signals, times: int, rng: random.Random) -> Tally:
    """Kill the run at random moments; every few kills it is left to come to its end."""
    tally = Tally()
    while tally.injected < times:
        before = made.finished()
        process = made.start()
        time.sleep(rng.uniform(0.0, 1.1 * made.seconds))
        process.kill(how)
        error = process.error()
        if process.returncode == -how:
            tally.injected += 1
        elif process.returncode:
            print(error.decode(), file=sys.stderr)
            tally.refused += 1
        look(made, tally, before)
        if rng.random() < 0.2:
            complete(made, tally)
    complete(made, tally)
    return tally


def disk_full(made: Bench, times: int, rng: random.Random) -> Tally:
    """No file may grow beyond a random size, as on a disk that is full: from the start, or all of a sudden."""
    tally = Tally()
    while tally.injected < times:
        room, before = int(rng.uniform(0, len(made.whole))), made.finished()
        if rng.random() < 0.3:
            process = made.start(room=room)
        else:
            process = made.start()
            until, wanted = time.monotonic() + LONGEST, before + rng.randint(0, 6)
            while not process.ended() and made.finished() < wanted and time.monotonic() < until:
                time.sleep(0.002)
            if not process.ended():
                resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (room, room))
        error = process.error()
        # one line that names the file, no traceback
        tally.injected += process.returncode != 0
        tally.wrong += process.returncode not in (0, 2) or b"Traceback" in error
        look(made, tally, before)
        if rng.random() < 0.5:
            complete(made, tally)
    complete(made, tally)
    return tally


@contextmanager
def scheduler_and_workers(made: Bench, n: int) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A Dask scheduler and workers, each a process of its own that can be killed: the scheduler comes first."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "scheduler.json"
        file = ["--scheduler-file", str(place)]
        common: dict[str, Any] = {"stderr": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "cwd": folder}
        common["env"] = environment(made.folder)
        dask = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0"]
        processes = [subprocess.Popen([*dask, "--no-dashboard", *file], **common)]
        processes += [worker(file, common) for _ in range(n)]
        try:
            until = time.monotonic() + LONGEST
            while not (place.exists() and place.stat().st_size):
                if time.monotonic() > until:
                    raise SystemExit("the scheduler does not start")
                time.sleep(0.05)
            yield json.loads(place.read_text())["address"], processes
        finally:
            for process in processes[::-1]:
                process.kill()
                process.wait()


def worker(file: list[str], common: dict[str, Any]) -> subprocess.Popen[bytes]:
    """A worker without a nanny: what is killed stays dead."""
    spoken = [sys.executable, "-m", "distributed.cli.dask_worker", "--nthreads", "1", "--no-nanny", "--no-dashboard"]
    return subprocess.Popen([*spoken, *file], **common)


def worker_killed(made: Bench, times: int, rng: random.Random) -> Tally:
    """One of three workers is killed at a random moment: the run goes on with the others."""
    tally = Tally()
    while tally.injected < times:
        with scheduler_and_workers(made, 3) as (address, processes):
            for victim in processes[1:3]:
                process = made.start("--scheduler", address)
                until = time.monotonic() + rng.uniform(0.3, 1.5) * made.seconds
                while not process.ended() and time.monotonic() < until:
                    time.sleep(0.01)
                victim.kill()
                victim.wait()
                error = process.error()
                tally.injected += 1
                if process.returncode:
                    print(error.decode(), file=sys.stderr)
                    tally.refused += 1
                look(made, tally, made.finished())
    return tally


def scheduler_killed(made: Bench, times: int, rng: random.Random) -> Tally:
    """The scheduler is killed: the run ends with one line, and goes on with the next scheduler."""
    tally = Tally()
    while tally.injected < times:
        before = made.finished()
        with scheduler_and_workers(made, 1) as (address, processes):
            process = made.start("--scheduler", address)
            until = time.monotonic() + 60
            # somewhere in the middle: after its first blocks
            wanted = before + rng.randint(1, 4)
            while not process.ended() and made.finished() < wanted and time.monotonic() < until:
                time.sleep(0.01)
            processes[0].kill()
            processes[0].wait()
            error = process.error()
        tally.injected += process.returncode != 0
        # Dask says what it lost; the last line is ours
        ours = process.returncode != 2 or b"tcp://" in error.splitlines()[-1]
        tally.wrong += process.returncode not in (0, 2) or not ours
        look(made, tally, before)
        if rng.random() < 0.5:
            complete(made, tally)
    complete(made, tally)
    return tally


def main(kills: int = 100, dask_kills: int = 20, seed: int = 0, folder: Path | None = None) -> dict[str, Tally]:
    """Print the fault table."""
    rng = random.Random(seed)
    with tempfile.TemporaryDirectory(dir=folder) as temporary:
        made = bench(Path(temporary))
        print(f"{TOUCHES} touches in {TOUCHES // BLOCK} blocks, {made.seconds:.1f} s undisturbed, all of it counted")
        few = max(1, dask_kills // 4)
        faults: dict[str, Callable[[], Tally]] = {
            "SIGKILL": lambda: signalled(made, signal.SIGKILL, kills, rng),
            "SIGTERM": lambda: signalled(made, signal.SIGTERM, kills, rng),
            "disk full": lambda: disk_full(made, max(1, kills // 5), rng),
            "Dask worker killed": lambda: worker_killed(made, dask_kills, rng) if dask_kills else Tally(),
            "Dask scheduler killed": lambda: scheduler_killed(made, few, rng) if dask_kills else Tally(),
        }
        titles = ("injected", "runs completed", "refused", "wrong", "half-written", "blocks lost", "lost in all")
        print(f"{'fault':22s}" + "".join(f" {title:>14s}" for title in titles))
        results = {}
        for name, inject in faults.items():
            results[name] = found = inject()
            values = (found.injected, found.completed, found.refused, found.wrong, found.half, found.blocks_lost)
            print(f"{name:22s}" + "".join(f" {value:14d}" for value in (*values, found.lost)), flush=True)
    return results


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=100, help="by each of SIGKILL and SIGTERM")
    parser.add_argument("--dask-kills", type=int, default=20, help="of a worker; a quarter of that of a scheduler")
    parser.add_argument("--seed", type=int, default=0)
    chosen = parser.parse_args()
    main(chosen.kills, chosen.dask_kills, chosen.seed)
