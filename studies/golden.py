"""Every number that the verbs write, on small data sets of fixed seeds, and how two such folders differ.

For changes of the code that should change no result: run it before and after, then compare.

    python studies/golden.py -o BEFORE          a finger, a finger with an effect, pads in one and two dimensions
    python studies/golden.py -o AFTER
    python studies/golden.py --compare BEFORE AFTER

The comparison prints each array and each JSON value that is not the same to the bit, and ends with exit status 1 if
there is one. Times, versions and paths are left out.

Against another version, whose checkout is in the folder OLD:

    PYTHONPATH=OLD python studies/golden.py -o BEFORE
    python studies/golden.py -o AFTER --like BEFORE
    python studies/golden.py --compare BEFORE AFTER [--docs]

With `--like` every verb gets what the other version had: the same data set, `infer` the calibrations of the other
version. So a difference of one verb does not change the results of the next. `--docs` writes a summary into the page
docs/verified.md.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import json
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

from _golden_compare import differences, summary
from _page import DOCS, put_into_page

#: Wrong input: its name, the file that is changed, what is replaced by what, and the command that is given it.
WRONG = (
    ("a word in place of a reading", "touches.csv", (4, 2, "much"), ("infer", "{data}/touches.csv")),
    ("a word in place of a load", "calibration.csv", (2, 4, "strong"), ("calibrate", "{data}")),
    ("a negative radius", "calibration.csv", (3, 2, "-1"), ("check", "{data}")),
    ("a body that is unknown", "sensor.toml", ("body = ", "body = 'glove' # "), ("calibrate", "{data}")),
    ("a key that is missing", "sensor.toml", ("[geometry]", "[geometries]"), ("calibrate", "{data}")),
    ("an unknown option", "sensor.toml", ("", ""), ("calibrate", "{data}", "--kernels", "layer")),
    ("no such folder", "sensor.toml", ("", ""), ("calibrate", "{data}/none")),
    ("no such effect", "sensor.toml", ("", ""), ("simulate", "--effect", "crostalk=0.1")),
)


def make(folder: Path, only: str | None = None, like: Path | None = None) -> None:
    """Write data sets, calibrations, posteriors, diagnoses and reports; `like` is a folder whose inputs are used."""
    import bayestouch

    finger = bayestouch.FingerDesign(n_elements=8, edge_step_deg=2.0, flat_step_deg=4.0, touch_step_deg=4.0)
    grid = bayestouch.PadDesign(n_touches=80)
    line = bayestouch.PadDesign(element_x_mm=(0.0, 6.0, 12.0, 18.0), element_y_mm=None, n_touches=60)
    sets: dict[str, tuple[Any, dict[str, float]]] = {
        "finger": (finger, {}),
        "finger_crosstalk": (finger, {"crosstalk": 0.04}),
        "pad_line": (line, {}),
        "pad_grid": (grid, {}),
        "pad_creep": (grid, {"creep": 0.05}),
        "pad_three": (replace(line, element_x_mm=(0.0, 6.0, 12.0), calibration_step_mm=1.0, n_touches=24), {}),
    }
    for name, (design, effects) in sets.items():
        if only not in (None, name):
            continue
        simulated = bayestouch.simulate(design, effects=effects, seed=3).dataset
        bayestouch.save_dataset(simulated, folder / name / "simulated")
        _verbs(folder / name, None if like is None else like / name)
        print(f"{name}: {sum(path.is_file() for path in (folder / name).rglob('*'))} files", flush=True)


def _verbs(folder: Path, like: Path | None) -> None:
    import bayestouch

    source = folder / "simulated" if like is None else like / "data"
    shutil.copytree(source, folder / "data", dirs_exist_ok=True)
    dataset = bayestouch.load_dataset(folder / "data")
    calibration = bayestouch.calibrate(dataset, seed=1)
    calibration.save(folder / "calibration.nc")
    if like is not None:
        calibration = bayestouch.load(like / "calibration.nc")
    methods = ("emcee", "importance") if isinstance(dataset.sensor.body, bayestouch.Finger) else ("emcee",)
    for method in methods:
        read = bayestouch.infer(dataset.touches, calibration, method=method, seed=2)
        read.save(folder / f"posterior_{method}.nc")
    diagnosis = bayestouch.diagnose(dataset, seed=1)
    diagnosis.save(folder / "diagnosis")
    after = diagnosis.calibration_after
    if like is not None:
        after = bayestouch.load(like / "diagnosis" / "calibration_after.nc")
    bayestouch.infer(dataset.touches, after, seed=2).save(folder / "posterior_after.nc")
    bayestouch.report(dataset, folder / "report", seed=1)
    said = {name: _said(folder, *case) for name, *case in WRONG}
    (folder / "errors.json").write_text(json.dumps(said, indent=1), "utf-8")


def _said(folder: Path, file: str, change: tuple[Any, ...], command: tuple[str, ...]) -> dict[str, Any]:
    """Exit status and lines of a command on a copy of the data set with one wrong thing."""
    import bayestouch

    wrong = folder / "wrong"
    shutil.copytree(folder / "data", wrong)
    path = wrong / file
    text = path.read_text("utf-8")
    if len(change) == 3:
        row, column, word = change
        lines = [line.split(",") for line in text.splitlines()]
        lines[row][min(column, len(lines[row]) - 1)] = word
        path.write_text("\n".join(map(",".join, lines)) + "\n", "utf-8")
    elif change[0]:
        path.write_text(text.replace(*change), "utf-8")
    calibration = ("--calibration", "calibration.nc") if command[0] == "infer" else ()
    output = () if command[0] == "check" else ("-o", "out")
    words = [word.format(data="wrong") for word in (*command, *calibration, *output)]
    run = [sys.executable, "-m", "bayestouch", *words]
    environment = os.environ | {"PYTHONPATH": str(Path(bayestouch.__file__).parents[1])}  # the version that runs here
    done = subprocess.run(run, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    shutil.rmtree(wrong)
    return {"status": done.returncode, "said": done.stderr.strip().splitlines()}


def main(arguments: list[str] | None = None) -> int:
    """Write a folder, or compare two."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("-o", "--output", type=Path, help="folder to write")
    parser.add_argument("--only", help="make this data set alone, such as pad_grid")
    parser.add_argument("--like", type=Path, help="folder whose data sets and calibrations are used")
    parser.add_argument("--compare", nargs=2, type=Path, metavar=("BEFORE", "AFTER"), help="folders to compare")
    parser.add_argument("--docs", action="store_true", help="write the summary of the comparison into the page")
    options = parser.parse_args(arguments)
    if options.output is not None:
        make(options.output, options.only, options.like)
    if options.compare is None:
        return 0
    if options.docs:
        put_into_page("golden.py", summary(*options.compare), DOCS / "verified.md")
        return 0
    lines = list(differences(*options.compare))
    print("\n".join(lines) or "the same to the bit")
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
