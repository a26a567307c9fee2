"""Fuzz a reader led by the lines that its inputs reach, with Atheris (libFuzzer), where that is installed.

The first inputs are the valid files of `fuzz_readers.py`. The run ends at the first input that is neither read nor
refused in one line, which libFuzzer then writes to a file ``crash-…``. What it comes to is added to RESULTS, from
which ``fuzz_readers.py --docs`` makes the table.

    python studies/fuzz_coverage.py READER RESULTS [-runs=100000] [further options of libFuzzer]
"""

from __future__ import annotations

import json
import resource
import sys
import tempfile
import time
from pathlib import Path

try:
    import atheris
except ImportError:
    print("atheris is not installed: pip install atheris")
    sys.exit()

with atheris.instrument_imports(include=["bayestouch", "tomllib"]):
    import tomllib  # noqa: F401

    from _fuzzing import COUNTS, FOLDER, MEMORY, SECONDS, outcome
    from fuzz_readers import readers


#: What was counted is written after so many inputs.
EVERY = 500


def main(reader: str, results: Path, options: list[str]) -> None:
    """Fuzz the first reader whose name holds `reader`."""
    folder = Path(tempfile.mkdtemp(dir=FOLDER))
    name, (suffix, inputs, read) = next(item for item in readers(folder).items() if reader in item[0])
    corpus, path = folder / "corpus", folder / f"input{suffix}"
    corpus.mkdir()
    for number, data in enumerate(inputs):
        (corpus / str(number)).write_bytes(data)
    everything = json.loads(results.read_text()) if results.exists() else {}
    counts = everything.setdefault(f"{name}, led by coverage", dict.fromkeys(COUNTS, 0.0))

    def one(data: bytes) -> None:
        path.write_bytes(data)
        start = time.monotonic()
        what = outcome(read, path)
        counts["slowest"] = max(counts["slowest"], time.monotonic() - start)
        counts["seconds"] += time.monotonic() - start
        counts["inputs"] += 1
        counts[what.partition("\n")[0]] += 1
        if counts["inputs"] % EVERY == 0:
            counts["peak"] = max(counts["peak"], resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
            results.write_text(json.dumps(everything, indent=1))
        if what.startswith("crash"):
            raise AssertionError(what)

    limits = [f"-timeout={SECONDS}", f"-rss_limit_mb={MEMORY >> 20}", "-print_final_stats=1"]
    atheris.Setup([sys.argv[0], *options, *limits, str(corpus)], one)
    atheris.Fuzz()


if __name__ == "__main__":
    if len(sys.argv) < 3:
        print("usage: fuzz_coverage.py READER RESULTS [-runs=100000]")
        sys.exit()
    main(sys.argv[1], Path(sys.argv[2]), sys.argv[3:])
