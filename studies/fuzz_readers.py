"""Fuzz the readers: files from strangers must be read, or refused in one line, in bounded time and memory.

Valid files are damaged at random (bytes changed, cut out, repeated, put in from elsewhere, numbers blown up), and each
is read in a child process whose memory and time are limited. Whatever is not read must raise `InputError`: another
exception counts as a crash, and so does a child that dies (a fault in a C library); a hang is an input that takes more
than 10 s. The damage is blind: `fuzz_coverage.py` is led by the lines that inputs reach. Inputs that crash are kept in
the folder given by ``--keep``.

    python studies/fuzz_readers.py [--inputs 2000] [--seconds S] [--results FILE] [--keep FOLDER] [READER ...]

With ``--results`` a run goes on from what the file says was done, so that the whole may be run in pieces of
``--seconds`` for a reader. With ``--docs`` nothing is run: the table in ``docs/robustness.md`` is made from the file.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import json
import math
import sys
import tempfile
import time
import warnings
from pathlib import Path

from _fuzzing import Read, fuzz
from _page import put_into_page

import bayestouch
from bayestouch.errors import InputError
from bayestouch.simulation import FingerDesign, save_simulated, simulate


def readers(folder: Path) -> dict[str, tuple[str, list[bytes], Read]]:
    """By name: suffix, valid files to start from, and the call that reads one."""
    from bayestouch.data.sensor_toml import read_sensor, sensor_to_toml
    from bayestouch.data.touch_table import read_touches
    from bayestouch.effects import StatedModel, read_model
    from bayestouch.priors.indenter_text import indenter_from_text
    from bayestouch.priors.prior_text import prior_from_text
    from bayestouch.reporting.diagnosed import saved_diagnosis
    from bayestouch.reporting.page import before_after
    from bayestouch.results.reading import load

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
    stated = ("crosstalk", {"share": 0.04}), ("gain_drift", {})
    models = [StatedModel("finger", "layer", stated).to_toml().encode(), b"body = 'pad'\n[[effect]]\nname = 'creep'\n"]
    texts = [b"normal:1,2", b"uniform:0,1", b"log-normal:0.1,2", b"r_c=log-normal:2,1.6", b"tips:0=0.5,2=0.25,inf=0.25"]

    def read_text(path: Path) -> None:
        text = path.read_bytes().decode("utf-8", "surrogateescape")
        refusals = []
        for reader in (prior_from_text, indenter_from_text):
            try:
                reader(text)
            except InputError as error:
                refusals.append(error)
        if len(refusals) == 2:
            raise refusals[0]

    def read_table(path: Path) -> None:
        read_touches(path, data.sensor)

    diagnosis = bayestouch.diagnose(data, sample=False, draws=8)
    (folder / "diagnosis").mkdir()
    diagnosis.save(folder / "diagnosis")

    def read_json(path: Path) -> None:
        (folder / "diagnosis" / "diagnosis.json").write_bytes(path.read_bytes())
        before_after(saved_diagnosis(folder / "diagnosis", data).numbers)

    return {
        "touch table, CSV": (".csv", bytes_of("csv/touches.csv", "csv/calibration.csv"), read_table),
        "touch table, Parquet": (".parquet", bytes_of("parquet/touches.parquet"), read_table),
        "sensor.toml": (".toml", [*bytes_of("csv/sensor.toml"), sensor_to_toml(pad).encode()], read_sensor),
        "model.toml": (".toml", models, read_model),
        "calibration, netCDF": (".nc", bytes_of("calibration.nc"), load),
        "posterior, netCDF": (".nc", bytes_of("posterior.nc"), load),
        "priors, text": (".txt", texts, read_text),
        "diagnosis.json": (".json", bytes_of("diagnosis/diagnosis.json"), read_json),
    }  # fmt: skip


def table(results: dict[str, dict[str, float]]) -> str:
    """The results as a table in Markdown."""
    lines = [
        "| reader | inputs | read | refused | crashes | hangs | peak MB | slowest, ms | mean, ms |",
        "|---|--:|--:|--:|--:|--:|--:|--:|--:|",
    ]
    for name, r in results.items():
        counts = (r["inputs"], r["read"], r["refused"], r["crash"] + r["died"], r["hang"])
        cells = [f"{count:,.0f}" for count in counts]
        times = (f"{r['peak']:.0f}", f"{1e3 * r['slowest']:.0f}", f"{1e3 * r['seconds'] / max(r['inputs'], 1):.1f}")
        lines.append(f"| {name} | {' | '.join((*cells, *times))} |")
    return "\n".join(lines) + "\n"


def main(
    total: int = 2_000,
    names: list[str] | None = None,
    *,
    seconds: float = math.inf,
    results: Path | None = None,
    keep: Path | None = None,
) -> dict[str, dict[str, float]]:
    """Print the table; returns counts by reader (see `_fuzzing.fuzz`)."""
    out: dict[str, dict[str, float]] = {}
    if results is not None and results.exists():
        out = json.loads(results.read_text())
    with tempfile.TemporaryDirectory() as folder:
        for name, (suffix, inputs, read) in readers(Path(folder)).items():
            if names and not any(part in name for part in names):
                continue
            warm = Path(folder) / f"warm{suffix}"
            warm.write_bytes(inputs[0])
            read(warm)  # what is imported is imported before the child is forked
            out[name] = fuzz(suffix, inputs, read, out.get(name, {}), total, time.monotonic() + seconds, keep)
            if results is not None:
                results.write_text(json.dumps(out, indent=1))
    print(table(out))
    return out


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--inputs", type=int, default=2_000)
    parser.add_argument("--seconds", type=float, default=math.inf)
    parser.add_argument("--results", type=Path)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--docs", action="store_true")
    parser.add_argument("readers", nargs="*")
    o = parser.parse_args()
    if o.docs:
        put_into_page("fuzz_readers.py", table(json.loads(o.results.read_text())))
        sys.exit()
    main(o.inputs, o.readers, seconds=o.seconds, results=o.results, keep=o.keep)
