"""Time of the verbs in two checkouts of the project, run in turn on the same data: the ratio of processor times.

Each verb runs in a process of its own, in one checkout and then in the other, so many times; medians are compared.
The data are a simulated finger without an effect and one with cross-talk, written once by this checkout. Loading the
data is not counted, but where reading is the case; importing what a verb needs is, but for emcee: it loads
`scipy.stats`, half a second, and 0.1.0 calibrates by emcee and diagnoses without. The calibration that `infer` uses is
made by each checkout and not counted: an older version cannot load the files of a newer one.

    git worktree add ../before COMMIT
    python studies/benchmarks/versions.py ../before [--docs]

`--docs` writes the table into the page docs/verified.md.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import click
import numpy as np

import bayestouch
from bayestouch.data.touch_source import joined_touches
from bayestouch.data.touches import Touches

HERE = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(HERE / "studies"))

from _page import DOCS, markdown_table, put_into_page  # noqa: E402

TOUCHES = 4800
#: Copies of the finger's touches in the long table: 65 MB of CSV.
COPIES = 25
CASES = {
    "read a table in CSV": ("long", "bayestouch.load_dataset(sys.argv[1])"),
    "calibrate": ("finger", "bayestouch.calibrate(data)"),
    "calibrate, cross-talk": ("crosstalk", "bayestouch.calibrate(data, **of_touch)"),
    "calibrate, cross-talk, by default": ("crosstalk", "bayestouch.calibrate(data)"),
    f"infer {TOUCHES} touches, importance": ("many", "infer('importance')"),
    f"infer {TOUCHES} touches, emcee": ("many", "infer('emcee')"),
    "from CSV to a file, importance": ("long", "infer_file('importance', 1)"),
    "from CSV to a file, emcee": ("long", "infer_file('emcee', 1)"),
    "from CSV to a file, emcee, two": ("long", "infer_file('emcee', 2)"),
    "diagnose": ("finger", "bayestouch.diagnose(data)"),
    "diagnose, cross-talk": ("crosstalk", "bayestouch.diagnose(data)"),
    "report": ("finger", "bayestouch.report(data, 'report', diagnosis=False)"),
}
PROGRAM = """
import inspect, os, sys
import bayestouch
import emcee

# 0.1.0 has this discrepancy alone; now the default compares it with functions of place, and chooses these here.
of_touch = {"discrepancy": "touch"} if "discrepancy" in inspect.signature(bayestouch.calibrate).parameters else {}

from_file = "load_dataset" in sys.argv[2] or "infer_file" in sys.argv[2]
data = None if from_file else bayestouch.load_dataset(sys.argv[1])
if "infer" in sys.argv[2]:
    calibration = bayestouch.calibrate(data or bayestouch.load_dataset(sys.argv[3]))
    infer = lambda method: bayestouch.infer(data.touches, calibration, method=method, workers=1, draws=1024)
    infer_file = lambda method, workers: bayestouch.infer(
        sys.argv[1] + "/touches.csv", calibration, method=method, summary_only=True, workers=workers, output="p.nc"
    )
began = sum(os.times()[:4])
eval(sys.argv[2])
print(sum(os.times()[:4]) - began)
"""


def prepare(folder: Path) -> None:
    """Write the data sets."""
    design = bayestouch.FingerDesign()
    dataset = bayestouch.simulate(design, seed=3).dataset
    bayestouch.save_dataset(dataset, folder / "finger")
    bayestouch.save_dataset(
        bayestouch.simulate(design, effects={"crosstalk": 0.04}, seed=3).dataset, folder / "crosstalk"
    )
    step = int(np.ptp(dataset.touches.touch)) + 1
    long = joined_touches([dataset.touches.with_(touch=dataset.touches.touch + k * step) for k in range(COPIES)])
    bayestouch.save_dataset(bayestouch.DataSet(dataset.sensor, None, long), folder / "long")
    tips = tuple(float(r) for r in range(1, 41))
    # the calibration of this finger comes with it: a calibration of another finger would find faults in the readings
    many = bayestouch.FingerDesign(touch_radii_mm=tips, samples_per_touch=1, touch_step_deg=1 / 3)
    touches = bayestouch.simulate(many, seed=4).dataset
    kept = first_touches(touches.touches, TOUCHES)
    bayestouch.save_dataset(bayestouch.DataSet(touches.sensor, touches.calibration, kept), folder / "many")


def first_touches(touches: Touches, number: int) -> Touches:
    """The rows of the first so many touches."""
    return touches.select(np.isin(touches.touch, np.unique(touches.touch)[:number]))


def seconds(checkout: Path, folder: Path, case: str) -> float:
    """Processor time of a verb in a checkout, of all its processes."""
    data, call = CASES[case]
    environment = os.environ | {"PYTHONPATH": str(checkout), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, "-c", PROGRAM, str(folder / data), call, str(folder / "finger")]
    with tempfile.TemporaryDirectory() as work:
        done = subprocess.run(command, env=environment, cwd=work, capture_output=True, text=True, check=False)
    if done.returncode:
        raise click.ClickException(f"{case} in {checkout}: {done.stderr.strip().splitlines()[-1]}")
    return float(done.stdout.split()[-1])


@click.command()
@click.argument("before", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option("--repeats", default=3, show_default=True)
@click.option("--only", help="Cases whose name begins so.")
@click.option("--docs", is_flag=True, help="Write the table into docs/verified.md.")
def main(before: Path, repeats: int, only: str | None, docs: bool) -> None:
    """Compare this checkout with the one at BEFORE."""
    if docs and only:
        raise click.UsageError("--docs writes the whole table: leave out --only")
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        prepare(Path(folder))
        print(f"{'processor seconds, medians':38s}{'before':>9s}{'now':>9s}{'ratio':>8s}")
        for case in CASES:
            if only and not case.startswith(only):
                continue
            runs = [[seconds(tree, Path(folder), case) for tree in (before.resolve(), HERE)] for _ in range(repeats)]
            old, new = (statistics.median(one) for one in zip(*runs, strict=True))
            print(f"{case:38s}{old:9.2f}{new:9.2f}{new / old:8.2f}", flush=True)
            ratios = sorted(after / first for first, after in runs)
            rows.append((case, f"{old:.2f}", f"{new:.2f}", f"{new / old:.2f}", f"{ratios[0]:.2f} to {ratios[-1]:.2f}"))
    if docs:
        head = ("verb", "0.1.0, s", "now, s", "ratio of medians", "ratio of each pair of runs")
        put_into_page("benchmarks/versions.py", markdown_table(head, rows), DOCS / "verified.md")


if __name__ == "__main__":
    main()
