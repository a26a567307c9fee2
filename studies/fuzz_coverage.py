"""Fuzz a reader led by the lines that its inputs reach, with Atheris (libFuzzer), where that is installed.

The first inputs are the valid files of `fuzz_readers.py`. The run ends at the first input that is neither read nor
refused in one line, which libFuzzer then writes to a file ``crash-…``, or to ``timeout-…`` or ``oom-…``. What it comes
to, that input included, is added to RESULTS, from which ``fuzz_readers.py --docs`` makes the table.

    python studies/fuzz_coverage.py READER RESULTS [-runs=100000] [further options of libFuzzer]
"""

from __future__ import annotations

import json
import multiprocessing
import resource
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

try:
    import atheris
except ImportError:
    print("atheris is not installed: pip install atheris")
    sys.exit()

with atheris.instrument_imports(include=["bayestouch", "tomllib"]):
    import tomllib  # noqa: F401

    from _fuzzing import COUNTS, FOLDER, MEMORY, SECONDS, Read, outcome, settled
    from fuzz_readers import readers


#: What was counted is written every so many seconds, and at the end.
EVERY = 10.0


def led(read: Read, path: Path, corpus: Path, options: list[str], counts: Any) -> None:
    """Fuzz a reader in this process, which libFuzzer ends; `counts` is in shared memory, in the order of `COUNTS`."""
    place = {name: number for number, name in enumerate(COUNTS)}

    def one(data: bytes) -> None:
        path.write_bytes(data)
        counts[place["inputs"]] += 1
        start = time.monotonic()
        what = outcome(read, path)
        took = time.monotonic() - start
        counts[place["seconds"]] += took
        counts[place["slowest"]] = max(counts[place["slowest"]], took)
        counts[place[what.partition("\n")[0]]] += 1
        if what.startswith("crash"):
            raise AssertionError(what)

    limits = [f"-timeout={SECONDS}", f"-rss_limit_mb={MEMORY >> 20}", "-print_final_stats=1"]
    atheris.Setup([sys.argv[0], *options, *limits, str(corpus)], one)
    atheris.Fuzz()


def main(reader: str, results: Path, options: list[str]) -> int:
    """Fuzz the first reader whose name holds `reader`, in a process of its own; return its exit status."""
    with tempfile.TemporaryDirectory(dir=FOLDER) as temporary:
        folder = Path(temporary)
        name, (suffix, inputs, read) = next(item for item in readers(folder).items() if reader in item[0])
        corpus = folder / "corpus"
        corpus.mkdir()
        for number, data in enumerate(inputs):
            (corpus / str(number)).write_bytes(data)
        everything = json.loads(results.read_text()) if results.exists() else {}
        title = f"{name}, led by coverage"
        before = dict.fromkeys(COUNTS, 0.0) | everything.get(title, {})
        counts = multiprocessing.RawArray("d", [before[each] for each in COUNTS])
        arguments = (read, folder / f"input{suffix}", corpus, options, counts)
        process = multiprocessing.get_context("fork").Process(target=led, args=arguments)
        process.start()
        while process.exitcode is None:
            process.join(EVERY)
            now = dict(zip(COUNTS, counts, strict=True))
            if process.exitcode is not None:
                peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
                now = settled(now, process.exitcode) | {"peak": max(now["peak"], peak)}
            results.write_text(json.dumps(everything | {title: now}, indent=1))
    return process.exitcode


if __name__ == "__main__":
    if len(sys.argv) < 3:
        print("usage: fuzz_coverage.py READER RESULTS [-runs=100000]")
        sys.exit()
    sys.exit(main(sys.argv[1], Path(sys.argv[2]), sys.argv[3:]))
