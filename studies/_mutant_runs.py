"""Runs of tests on copies of the project, one copy a process, so that changes do not meet."""

from __future__ import annotations

import compileall
import contextlib
import multiprocessing
import os
import py_compile
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from cosmic_ray.mutating import mutate_and_test
from cosmic_ray.testing import run_tests
from cosmic_ray.work_item import TestOutcome, WorkItem, WorkResult

MEMORY = 8 << 30  # bytes a process may ask for: a change may ask for any number of elements


def _copy(root: Path, copy: Path) -> None:
    """What is under version control or new, with its bytecode, which each import checks against the source."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=root, capture_output=True, check=True)
    for name in listed.stdout.decode().split("\0"):
        if name and (root / name).is_file():
            (copy / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(root / name, copy / name)
    mode = py_compile.PycInvalidationMode.CHECKED_HASH
    for folder in ("bayestouch", "tests"):
        compileall.compile_dir(copy / folder, quiet=2, invalidation_mode=mode)


def _enter(copies: Any, root: Path) -> None:
    """Make one copy the home of this process and of all it starts."""
    copy = copies.get()
    os.chdir(copy)
    os.environ |= {"PYTHONPATH": str(copy), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MPLBACKEND": "agg"}
    shared = root.parent / "shared"
    if "BAYESTOUCH_SHARED" not in os.environ and shared.is_dir():
        os.environ["BAYESTOUCH_SHARED"] = str(shared)
    with contextlib.suppress(ImportError):
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, resource.getrlimit(resource.RLIMIT_AS)[1]))


@contextlib.contextmanager
def workers(root: Path, processes: int) -> Iterator[Executor]:
    """Processes with a copy of the project each, at work in it."""
    context = multiprocessing.get_context("spawn")
    with TemporaryDirectory(prefix="mutants-") as folder:
        copies = context.Queue()
        for number in range(processes):
            copy = Path(folder, str(number), "bayestouch")
            copy.mkdir(parents=True)
            _copy(root, copy)
            copies.put(copy)
        with ProcessPoolExecutor(processes, context, _enter, (copies, root)) as pool:
            yield pool


def _command(tests: Sequence[Path]) -> str:
    options = ("-x", "-q", "--no-header", "--tb=line", "-p", "no:cacheprovider")
    return shlex.join([sys.executable, "-m", "pytest", *options, *(path.as_posix() for path in tests)])


def timed(test: Path, limit: float) -> float | None:
    """Seconds of a core that a file takes unchanged; None where it fails, nothing runs, or `limit` is passed."""
    start = os.times()
    outcome, output = run_tests(_command([test]), limit)
    end = os.times()
    took = end.children_user + end.children_system - start.children_user - start.children_system
    return took if outcome == TestOutcome.SURVIVED and " passed" in output else None


def tested(item: WorkItem, tests: Sequence[Path], limit: float) -> WorkResult:
    """Make the change, run the tests to the first failure, undo the change. Above `limit` seconds is a failure."""
    return mutate_and_test(item.mutations, _command(tests), limit)
