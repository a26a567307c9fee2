"""Damaged files, each read in a child process whose memory and time are limited."""

from __future__ import annotations

import multiprocessing
import os
import random
import resource
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path

from bayestouch.errors import InputError

#: One input may take this long, and a child as much memory as this.
SECONDS, MEMORY = 10, 2 << 30
#: A child reads so many inputs before the next one takes its place.
BATCH = 500
OUTCOMES = ("read", "refused", "crash", "died", "hang")
COUNTS = ("batches", "inputs", *OUTCOMES, "seconds", "peak", "slowest")
#: Exit codes of libFuzzer: an input took too long, and the run was interrupted.
TOO_LONG, INTERRUPTED = 70, 72
WORDS = [
    b"-1", b"0", b"1e400", b"nan", b"inf", b"9" * 400, b"1_0", b'"', b"'", b"[" * 500, b"{" * 500, b"\x00", b"\xff",
    b"\r", b"\n", b",", b";", b"\t", b"a.b." * 40, b"0x7fffffff", b"18446744073709551615", b"<script>",
    b"\x00\x00\x00\x80", b"\xff\xff\xff\x7f", b"\xff" * 8, b"\xf0\x9f\x98\x80", b"null", b"true", b"e01",
    b"touch", b"=", b"[[a]]\n",
]  # fmt: skip

#: Files are written a hundred thousand times over: in memory where the system has such a folder.
FOLDER = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None

Read = Callable[[Path], object]


def damaged(data: bytes, rng: random.Random) -> bytes:
    """One to eight changes at random places."""
    text = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 2, 3, 8))):
        n = len(text)
        at, length = rng.randrange(n + 1), rng.choice((1, 1, 2, 4, 8, 64, 1024))
        match rng.randrange(8):
            case 0:
                text[at : at + 1] = bytes([rng.randrange(256)])
            case 1 if n:
                at = min(at, n - 1)
                text[at] ^= 1 << rng.randrange(8)
            case 2:
                del text[at : at + length]
            case 3:
                text[at:at] = text[at : at + length]
            case 4:
                start = rng.randrange(n + 1)
                text[at : at + length] = text[start : start + length]
            case 5:
                word = rng.choice(WORDS)
                text[at : at + len(word)] = word
            case 6:
                text[at:at] = rng.choice(WORDS)
            case _:
                text[at : at + length] = rng.randbytes(min(length, 8))
    if rng.random() < 0.02:
        del text[rng.randrange(len(text) + 1) :]
    return bytes(text)


def outcome(read: Read, path: Path) -> str:
    """What reading a file came to: ``read``, ``refused`` in one line, or ``crash`` with the traceback behind it."""
    try:
        read(path)
    except InputError as error:
        return "refused" if "\n" not in str(error) else "crash\nthe message has more than one line"
    except BaseException:
        return "crash\n" + traceback.format_exc()
    return "read"


def settled(counts: dict[str, float], exitcode: int) -> dict[str, float]:
    """Counts of a process that libFuzzer led and that has ended, with the input that it ended in.

    An input is counted as it is begun, and what it came to when it is over: if the process ended between the two, the
    input was a hang or was the process's death, unless somebody stopped it.
    """
    begun = counts["inputs"] - sum(counts[what] for what in OUTCOMES)
    if exitcode in (0, INTERRUPTED, -signal.SIGINT, -signal.SIGTERM):
        return counts | {"inputs": counts["inputs"] - begun}
    what = "hang" if exitcode == TOO_LONG else "died"
    return counts | {what: counts[what] + begun}


def child(pipe: Connection, path: Path, read: Read, inputs: list[bytes], seed: int, n: int) -> None:
    """Read damaged files one by one; says what each came to before the next is begun."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    warnings.simplefilter("ignore")
    rng = random.Random(seed)
    slowest = 0.0
    for _ in range(n):
        data = damaged(rng.choice(inputs), rng)
        path.write_bytes(data)
        signal.alarm(SECONDS)  # nothing handles it: it ends the child, also inside a C library
        start = time.monotonic()
        what = outcome(read, path)
        slowest = max(slowest, time.monotonic() - start)
        signal.alarm(0)
        pipe.send(what)
    pipe.send((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, slowest))


def fuzz(
    suffix: str, inputs: list[bytes], read: Read, done: dict[str, float], total: int, until: float, keep: Path | None
) -> dict[str, float]:
    """Read damaged files until there are `total` or the clock says `until`.

    Parameters
    ----------
    suffix, inputs, read
        Of the reader: how its files end, valid files to start from, the call that reads one.
    done : dict
        What earlier runs came to, as returned; empty for none. Every batch has its own seed: none is read twice.
    total : int
    until : float
        Time of `time.monotonic`.
    keep : Path or None
        Folder for inputs that crash.

    Returns
    -------
    dict of str to float
        ``batches``, ``inputs``, a count for each of `OUTCOMES`, ``seconds``, and the largest of a child:
        ``peak`` memory in MB, ``slowest`` input in s.
    """
    counts = dict.fromkeys(COUNTS, 0.0) | done
    with tempfile.TemporaryDirectory(dir=FOLDER) as folder:
        path = Path(folder) / f"input{suffix}"
        while counts["inputs"] < total and time.monotonic() < until:
            start = time.monotonic()
            ours, theirs = multiprocessing.Pipe(duplex=False)
            n = int(min(BATCH, total - counts["inputs"]))
            arguments = (theirs, path, read, inputs, int(counts["batches"]), n)
            process = multiprocessing.get_context("fork").Process(target=child, args=arguments)
            process.start()
            theirs.close()
            try:
                while isinstance(message := ours.recv(), str):
                    what, _, detail = message.partition("\n")
                    _count(counts, what, detail, path, keep)
                counts["peak"] = max(counts["peak"], message[0])
                counts["slowest"] = max(counts["slowest"], message[1])
            except EOFError:
                process.join()
                what = "hang" if process.exitcode == -signal.SIGALRM else "died"
                _count(counts, what, f"child ended with {process.exitcode}", path, keep)
            process.join()
            counts["batches"] += 1
            counts["seconds"] += time.monotonic() - start
    return counts


def _count(counts: dict[str, float], what: str, detail: str, path: Path, keep: Path | None) -> None:
    counts["inputs"] += 1
    counts[what] += 1
    if what in ("read", "refused"):
        return
    print(f"{what}, batch {counts['batches']:.0f}: {detail}", file=sys.stderr)
    if keep is not None:
        keep.mkdir(parents=True, exist_ok=True)
        (keep / f"{what}-{counts['inputs']:.0f}{path.suffix}").write_bytes(path.read_bytes())
