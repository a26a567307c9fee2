"""Fuzz the readers: files from strangers must be read, or refused in one line, in bounded time and memory.

Valid files are damaged at random (bytes changed, cut out, repeated, put in from elsewhere, numbers blown up), and each
is read in a child process whose memory and time are limited. Whatever is not read must raise `InputError`: another
exception counts as a crash, and so does a child that dies (a fault in a C library); a hang is an input that takes more
than `SECONDS`. Inputs that crash are kept in the folder given by ``--keep``.

    python studies/fuzz_readers.py [--inputs 100000] [--keep FOLDER] [READER ...]
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import multiprocessing
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

import bayestouch
from bayestouch.errors import InputError
from bayestouch.simulation import FingerDesign, save_simulated, simulate

#: One input may take this long, and a child as much memory as this.
SECONDS, MEMORY = 10, 2 << 30
#: A child reads so many inputs before the next one takes its place.
BATCH = 2_000
WORDS = [
    b"-1", b"0", b"1e400", b"nan", b"inf", b"9" * 400, b"1_0", b'"', b"'", b"[" * 500, b"{" * 500, b"\x00", b"\xff",
    b"\r", b"\n", b",", b";", b"\t", b"a.b." * 40, b"0x7fffffff", b"18446744073709551615", b"<script>",
    b"\x00\x00\x00\x80", b"\xff\xff\xff\x7f", b"\xff" * 8, b"\xf0\x9f\x98\x80", b"null", b"true", b"e01",
    b"touch", b"=", b"[[a]]\n",
]  # fmt: skip


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


def readers(folder: Path) -> dict[str, tuple[str, list[bytes], Callable[[Path], object]]]:
    """By name: suffix, valid files to start from, and the call that reads one."""
    from bayestouch.indenter_text import indenter_from_text
    from bayestouch.posterior import load
    from bayestouch.prior_text import prior_from_text
    from bayestouch.sensor_toml import read_sensor, sensor_to_toml
    from bayestouch.touch_table import read_touches

    design = FingerDesign(
        n_elements=3, pitch_deg=9.0, samples_per_touch=2, edge_step_deg=9.0, flat_step_deg=18.0,
        calibration_span_deg=27.0, touch_radii_mm=(0.0, 9.3), touch_span_deg=9.0, touch_step_deg=9.0,
    )  # fmt: skip
    simulated = simulate(design, seed=1)
    save_simulated(simulated, folder / "csv")
    save_simulated(simulated, folder / "parquet", "parquet")
    data = simulated.dataset
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        calibration = bayestouch.calibrate(data, draws=8)
    calibration.save(folder / "calibration.nc")
    bayestouch.infer(data.touches, calibration, draws=64, workers=1).save(folder / "posterior.nc")

    def bytes_of(*names: str) -> list[bytes]:
        return [(folder / name).read_bytes() for name in names]

    pad = bayestouch.simulation.simulate(bayestouch.simulation.PadDesign(), seed=1).dataset.sensor
    texts = [b"normal:1,2", b"uniform:0,1", b"log-normal:0.1,2", b"r_c=log-normal:2,1.6", b"tips:0=0.5,2=0.25,inf=0.25"]

    def read_text(path: Path) -> None:
        text = path.read_bytes().decode("utf-8", "surrogateescape")
        refused = 0
        for reader in (prior_from_text, indenter_from_text):
            try:
                reader(text)
            except InputError:
                refused += 1

    def read_table(path: Path) -> None:
        read_touches(path, data.sensor)

    return {
        "touch table, CSV": (".csv", bytes_of("csv/touches.csv", "csv/calibration.csv"), read_table),
        "touch table, Parquet": (".parquet", bytes_of("parquet/touches.parquet"), read_table),
        "sensor.toml": (".toml", [*bytes_of("csv/sensor.toml"), sensor_to_toml(pad).encode()], read_sensor),
        "calibration, netCDF": (".nc", bytes_of("calibration.nc"), load),
        "posterior, netCDF": (".nc", bytes_of("posterior.nc"), load),
        "priors, text": (".txt", texts, read_text),
    }  # fmt: skip


def child(pipe: Connection, path: Path, read: Callable[[Path], object], inputs: list[bytes], seed: int, n: int) -> None:
    """Read damaged files one by one; says what each came to before the next is begun."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    warnings.simplefilter("ignore")
    rng = random.Random(seed)
    for _ in range(n):
        data = damaged(rng.choice(inputs), rng)
        path.write_bytes(data)
        signal.alarm(SECONDS)  # nothing handles it: it ends the child, also inside a C library
        try:
            read(path)
            what = "read"
        except InputError as error:
            what = "refused" if "\n" not in str(error) else "crash\nthe message has more than one line"
        except BaseException:
            what = "crash\n" + traceback.format_exc()
        signal.alarm(0)
        pipe.send(what)
    pipe.send(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)


def fuzz(
    name: str, suffix: str, inputs: list[bytes], read: Callable[[Path], object], total: int, keep: Path | None
) -> dict[str, float]:
    """Read `total` damaged files; counts by outcome, peak memory of a child in MB, seconds."""
    counts: dict[str, float] = dict.fromkeys(("inputs", "read", "refused", "crash", "died", "hang"), 0)
    peak, seed, start, seen = 0, 0, time.monotonic(), set()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"input{suffix}"
        while counts["inputs"] < total:
            ours, theirs = multiprocessing.Pipe(duplex=False)
            n = int(min(BATCH, total - counts["inputs"]))
            process = multiprocessing.get_context("fork").Process(
                target=child, args=(theirs, path, read, inputs, seed, n)
            )
            process.start()
            theirs.close()
            seed += 1
            try:
                while isinstance(message := ours.recv(), str):
                    what, _, detail = message.partition("\n")
                    counts["inputs"] += 1
                    counts[what] += 1
                    if what == "crash" and (last := detail.strip().rpartition("\n")[2][:60]) not in seen:
                        seen.add(last)
                        print(f"{name}: {detail}", file=sys.stderr)
                        _keep(path, keep, name, len(seen))
                peak = max(peak, message)
            except EOFError:
                process.join()
                what = "hang" if process.exitcode == -signal.SIGALRM else "died"
                counts["inputs"] += 1
                counts[what] += 1
                seen.add(f"{what} {seed}")
                print(f"{name}: child ended with {process.exitcode} ({what})", file=sys.stderr)
                _keep(path, keep, name, len(seen))
            process.join()
    return counts | {"peak": peak / 1024, "seconds": time.monotonic() - start}


def _keep(path: Path, keep: Path | None, name: str, number: int) -> None:
    if keep is not None:
        keep.mkdir(parents=True, exist_ok=True)
        (keep / f"{name.split(',')[0].replace(' ', '-')}-{number}{path.suffix}").write_bytes(path.read_bytes())


def main(total: int = 100_000, names: list[str] | None = None, keep: Path | None = None) -> dict[str, dict[str, float]]:
    """Print the table; returns counts by reader."""
    print(
        f"{'reader':24s}{'inputs':>9s}{'read':>9s}{'refused':>9s}{'crashes':>9s}{'hangs':>7s}{'peak MB':>9s}{'s':>7s}"
    )
    out = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, (suffix, inputs, read) in readers(Path(folder)).items():
            if names and not any(part in name for part in names):
                continue
            read_warm = Path(folder) / f"warm{suffix}"
            read_warm.write_bytes(inputs[0])
            read(read_warm)  # what is imported is imported before the child is forked
            r = out[name] = fuzz(name, suffix, inputs, read, total, keep)
            print(
                f"{name:24s}{r['inputs']:9.0f}{r['read']:9.0f}{r['refused']:9.0f}{r['crash'] + r['died']:9.0f}"
                f"{r['hang']:7.0f}{r['peak']:9.0f}{r['seconds']:7.0f}",
                flush=True,
            )
    return out


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--inputs", type=int, default=100_000)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("readers", nargs="*")
    options = parser.parse_args()
    main(options.inputs, options.readers, options.keep)
