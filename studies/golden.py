"""Every number that the verbs write, on small data sets of fixed seeds, and how two such folders differ.

For changes of the code that should change no result: run it before and after, then compare.

    python studies/golden.py -o BEFORE          a finger, a finger with an effect, pads in one and two dimensions
    python studies/golden.py -o AFTER
    python studies/golden.py --compare BEFORE AFTER

The comparison prints each array and each JSON value that is not the same to the bit, and ends with exit status 1 if
there is one. Times, versions and paths are left out.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import json
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

# What says when and with what a file was made, and not what it holds.
NOT_RESULTS = {"created_at", "bayestouch_version", "version", "creation_library_version", "seconds", "made", "time"}


def make(folder: Path, only: str | None = None) -> None:
    """Write data sets, calibrations, posteriors, diagnoses and reports."""
    import bayestouch

    finger = bayestouch.FingerDesign(n_elements=8, edge_step_deg=2.0, flat_step_deg=4.0, touch_step_deg=4.0)
    grid = bayestouch.PadDesign(n_touches=80)
    line = bayestouch.PadDesign(element_x_mm=(0.0, 6.0, 12.0, 18.0), element_y_mm=None, n_touches=60)
    sets = {
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
        _verbs(folder / name, bayestouch.simulate(design, effects=effects, seed=3).dataset)
        print(f"{name}: {sum(path.is_file() for path in (folder / name).rglob('*'))} files")


def _verbs(folder: Path, dataset: Any) -> None:
    import bayestouch

    folder.mkdir(parents=True, exist_ok=True)
    bayestouch.save_dataset(dataset, folder / "data")
    calibration = bayestouch.calibrate(dataset, seed=1)
    calibration.save(folder / "calibration.nc")
    methods = ("emcee", "importance") if isinstance(dataset.sensor.body, bayestouch.Finger) else ("emcee",)
    for method in methods:
        read = bayestouch.infer(dataset.touches, calibration, method=method, seed=2)
        read.save(folder / f"posterior_{method}.nc")
    diagnosis = bayestouch.diagnose(dataset, seed=1)
    diagnosis.save(folder / "diagnosis")
    after = bayestouch.infer(dataset.touches, diagnosis.calibration_after, seed=2)
    after.save(folder / "posterior_after.nc")
    bayestouch.report(dataset, folder / "report", seed=1)


def differences(before: Path, after: Path) -> Iterator[str]:
    """A line for each file, array or value that differs."""
    names = sorted({path.relative_to(root).as_posix() for root in (before, after) for path in root.rglob("*.*")})
    for name in names:
        one, other = before / name, after / name
        if not (one.is_file() and other.is_file()):
            if one.is_dir() or other.is_dir():
                continue
            yield f"{name}: only in {one.parent if one.exists() else other.parent}"
        elif name.endswith(".nc"):
            yield from (f"{name}: {line}" for line in _arrays(one, other))
        elif name.endswith(".json"):
            yield from (f"{name}: {line}" for line in _values(*(json.loads(p.read_text()) for p in (one, other))))
        elif name.endswith((".csv", ".toml")) and one.read_bytes() != other.read_bytes():
            yield f"{name}: other bytes"


def _arrays(one: Path, other: Path) -> Iterator[str]:
    import xarray as xr

    trees = [xr.open_datatree(path, engine="h5netcdf") for path in (one, other)]
    both = [
        {f"{node.path}/{name}": array for node in tree.subtree for name, array in node.variables.items()}
        for tree in trees
    ]
    for name in sorted(set(both[0]) | set(both[1])):
        if name not in both[0] or name not in both[1]:
            yield f"{name} only {'after' if name in both[1] else 'before'}"
            continue
        a, b = (np.asarray(each[name].values) for each in both)
        if a.shape != b.shape or a.dtype != b.dtype:
            yield f"{name}: {a.dtype}{a.shape} and {b.dtype}{b.shape}"
        elif a.tobytes() != b.tobytes() and not _same(a, b):
            yield f"{name}: {_how_far(a, b)}"
    attributes = [
        {f"{node.path}@{key}": value for node in tree.subtree for key, value in node.attrs.items()} for tree in trees
    ]
    yield from _values(*attributes)
    for tree in trees:
        tree.close()


def _same(a: np.ndarray[Any, Any], b: np.ndarray[Any, Any]) -> bool:
    return bool(np.array_equal(a, b, equal_nan=a.dtype.kind in "fc"))


def _how_far(a: np.ndarray[Any, Any], b: np.ndarray[Any, Any]) -> str:
    if a.dtype.kind not in "fc":
        return "other values"
    apart = np.nanmax(np.abs(a - b))
    return f"up to {apart:.3g} apart, {apart / max(float(np.nanmax(np.abs(a))), 1e-300):.1e} of the largest"


def _values(one: Any, other: Any, at: str = "") -> Iterator[str]:
    if isinstance(one, dict) and isinstance(other, dict):
        for key in sorted(set(one) | set(other), key=str):
            if str(key).split("@")[-1] in NOT_RESULTS:
                continue
            if key not in one or key not in other:
                yield f"{at}/{key} only {'after' if key in other else 'before'}"
            else:
                yield from _values(one[key], other[key], f"{at}/{key}")
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        for i, (a, b) in enumerate(zip(one, other, strict=True)):
            yield from _values(a, b, f"{at}[{i}]")
    elif isinstance(one, str) and isinstance(other, str) and one[:1] == other[:1] == "{":
        yield from _values(json.loads(one), json.loads(other), at)
    elif str(one) != str(other) and (type(one) is not type(other) or not np.all(one == other)):
        yield f"{at}: {str(one)[:60]!r} and {str(other)[:60]!r}"


def main(arguments: list[str] | None = None) -> int:
    """Write a folder, or compare two."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("-o", "--output", type=Path, help="folder to write")
    parser.add_argument("--only", help="make this data set alone, such as pad_grid")
    parser.add_argument("--compare", nargs=2, type=Path, metavar=("BEFORE", "AFTER"), help="folders to compare")
    options = parser.parse_args(arguments)
    if options.output is not None:
        make(options.output, options.only)
    if options.compare is None:
        return 0
    lines = list(differences(*options.compare))
    print("\n".join(lines) or "the same to the bit")
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
