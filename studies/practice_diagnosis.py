"""The practice fingers, diagnosed and then examined on touches that neither fit nor choice has seen.

Each finger is diagnosed as the command line does it. The exam's touches, with tips of other radii, are then read with
the calibration before and the one after; what was built in, from the truth, stands beside it.

    python studies/practice_diagnosis.py [-o FOLDER] [--scheduler ADDRESS] [finger-a finger-b ...]
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

import bayestouch
from bayestouch.data.touch_table import read_touches

ROOT = Path(__file__).parents[1]
SHARED = Path(os.environ.get("BAYESTOUCH_SHARED", ROOT.parent / "shared"))
SCORES = ("R_bias", "R_rms", "R_coverage", "theta_rms", "theta_coverage", "P_rms", "P_coverage")


def diagnose(dataset: Path, output: Path, scheduler: str | None) -> tuple[dict[str, Any], float]:
    """Run ``bayestouch diagnose``; returns diagnosis.json and the seconds it took."""
    start = time.perf_counter()
    command = [sys.executable, "-m", "bayestouch", "diagnose", str(dataset), "-o", str(output), "--quiet"]
    command += [] if scheduler is None else ["--scheduler", scheduler]
    subprocess.run(command, check=True)
    return json.loads((output / "diagnosis.json").read_text(encoding="utf-8")), time.perf_counter() - start


def examine(exam: Path, calibration: Path, *, use_load: bool) -> dict[str, float | None]:
    """Errors of the posterior means of R (mm), θ_c (degree) and P (N/m), and coverage of their 90 % intervals.

    Location and radius are as commanded; the load is the force sensor's mean, whose noise is small beside the error of
    a load that is inferred without it. A load that is inferred with it follows it: its errors are None.
    """
    calibrated = bayestouch.load(calibration)
    assert isinstance(calibrated, bayestouch.Calibration)
    posteriors = bayestouch.infer(read_touches(exam, calibrated.sensor), calibrated, use_load=use_load, seed=0)
    scores: dict[str, float | None] = dict.fromkeys(SCORES)
    for name in ("R", "theta_c") if use_load else ("R", "theta_c", "P"):
        draws, true = posteriors.posterior[name], posteriors.reference[name]
        miss = draws.mean(axis=(0, 1)) - true
        low, high = np.quantile(draws, [0.05, 0.95], axis=(0, 1))
        short = name.split("_")[0]
        scores[f"{short}_bias"] = float(miss.mean())
        scores[f"{short}_rms"] = float(np.sqrt((miss**2).mean()))
        scores[f"{short}_coverage"] = float(((low <= true) & (true <= high)).mean())
    return scores


def line(label: str, values: dict[str, float | None]) -> str:
    """One line of the exam's table."""
    known = [values[name] for name in SCORES]
    return f"  {label:22s}" + "".join(f"{'-':>16s}" if value is None else f"{value:>16.3f}" for value in known)


def print_finger(name: str, diagnosis: dict[str, Any], truth: dict[str, float], seconds: float) -> None:
    """What was said, and what is true."""
    effects = [
        each["name"]
        + " ("
        + ", ".join(f"{k} {v['mean']:.4g} ± {v['sd'] or 0:.2g}" for k, v in each["parameters"].items())
        + ")"
        for each in diagnosis["effects"]
    ]
    print(f"\n{name}: {diagnosis['verdict']}; {' + '.join(effects) or 'no effect'}   [{seconds:.0f} s]")
    print(f"  true: {', '.join(f'{key} {value:g}' for key, value in truth.items()) or 'nothing added'}")
    if diagnosis["unexplained"]["where"]:
        print(f"  unexplained: {diagnosis['unexplained']['where']}")
    for key in diagnosis["before"]:
        values = [diagnosis[when][key] for when in ("before", "after", "after_against_stated")]
        if None not in values:
            before, after, stated = values
            print(f"  held out, {key:32s} {before:8.3f} -> {after:8.3f} (references as stated: {stated:.3f})")


def main(arguments: list[str] | None = None) -> dict[str, dict[str, Any]]:
    """Diagnose and examine; print the tables; returns both by finger."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("build/practice_diagnosis"))
    parser.add_argument("--scheduler", metavar="ADDRESS", help="Dask cluster that does the work")
    parser.add_argument("fingers", nargs="*")
    options = parser.parse_args(arguments)
    practice = SHARED / "practice"
    if not practice.exists():
        print(f"no practice data in {SHARED}: nothing to do")
        return {}
    results: dict[str, dict[str, Any]] = {}
    for name in options.fingers or sorted(path.name for path in practice.glob("finger-*")):
        output, truth = options.output / name, practice / "truth" / name
        diagnosis, seconds = diagnose(practice / name, output, options.scheduler)
        built = json.loads((truth / "truth.json").read_text(encoding="utf-8"))["effects"]
        print_finger(name, diagnosis, built, seconds)
        print("  exam" + " " * 18 + "".join(f"{score:>16s}" for score in SCORES))
        results[name] = {"diagnosis": diagnosis, "truth": built, "seconds": seconds}
        for use_load, label in ((True, "load read"), (False, "load inferred")):
            for when in ("before", "after"):
                scores = examine(truth / "exam.csv", output / f"calibration_{when}.nc", use_load=use_load)
                results[name][f"{label}, {when}"] = scores
                print(line(f"{label}, {when}", scores))
    (options.output / "exam.json").write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    return results


if __name__ == "__main__":
    main()
