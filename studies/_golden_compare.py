"""How two folders of `golden.py` differ."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from _page import markdown_table
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

# What says when and with what a file was made, and not what it holds.
NOT_RESULTS = {"created_at", "bayestouch_version", "version", "creation_library_version", "seconds", "made", "time"}

#: Rows of the summary: name, and the files of a data set that belong to it.
RESULTS = {
    "simulated data": "simulated/*.csv",
    "error lines": "errors.json",
    "`calibrate`": "calibration.nc",
    "`infer`, emcee": "posterior_emcee.nc",
    "`infer`, importance": "posterior_importance.nc",
    "`diagnose`: numbers": "diagnosis/diagnosis.json",
    "`diagnose`: calibration before": "diagnosis/calibration_before.nc",
    "`diagnose`: calibration after": "diagnosis/calibration_after.nc",
    "`infer` with the calibration after": "posterior_after.nc",
    "`report`": "report/report.json",
}


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


def summary(before: Path, after: Path) -> str:
    """Markdown table: for each result of each data set, how much of it is the same, and how far apart its draws are."""
    rows = []
    for name in sorted(path.name for path in after.iterdir() if (before / path.name).is_dir()):
        for title, pattern in RESULTS.items():
            files = sorted(path.relative_to(after / name) for path in (after / name).glob(pattern))
            pairs = [(before / name / file, after / name / file) for file in files]
            pairs = [pair for pair in pairs if pair[0].is_file()]
            if pairs:
                rows.append((name, title, *_row(pairs)))
    head = ("data set", "result", "values the same to the bit", "means of draws apart, sd", "sd over that before")
    return markdown_table(head, rows)


def _row(pairs: Sequence[tuple[Path, Path]]) -> tuple[str, str, str]:
    same, total = 0, 0
    apart: list[float] = []
    ratios: list[float] = []
    for one, other in pairs:
        if one.suffix == ".nc":
            a, b = _variables(one), _variables(other)
            both = [name for name in a if name in b]
            same += sum(_equal(a[name], b[name]) for name in both)
            total += len(both)
            for name in both:
                if name.startswith("/posterior/") and a[name].ndim >= 2 and a[name].shape == b[name].shape:
                    more = _of_draws(a[name], b[name])
                    apart, ratios = apart + more[0], ratios + more[1]
        elif one.suffix == ".json":
            a, b = (_leaves(json.loads(path.read_text("utf-8"))) for path in (one, other))
            both = [name for name in a if name in b]
            same += sum(a[name] == b[name] for name in both)
            total += len(both)
        else:
            same, total = same + (one.read_bytes() == other.read_bytes()), total + 1
    if not apart:
        return f"{same} of {total}", "", ""
    return f"{same} of {total}", f"{max(apart):.2f}", f"{min(ratios):.2f} to {max(ratios):.2f}"


def _of_draws(a: FloatArray, b: FloatArray) -> tuple[list[float], list[float]]:
    """Distance of means in sds, and ratio of sds, of each number that is drawn."""
    first, second = (each.reshape(each.shape[0] * each.shape[1], -1).astype(float) for each in (a, b))
    sd = first.std(axis=0)
    # a number that is held has the same draw each time, up to rounding
    drawn = np.isfinite(sd) & (sd > 1e-9 * np.abs(first).max(axis=0))
    shift = np.abs(second.mean(axis=0) - first.mean(axis=0))[drawn] / sd[drawn]
    return shift.tolist(), (second.std(axis=0)[drawn] / sd[drawn]).tolist()


def _variables(path: Path) -> dict[str, np.ndarray[Any, Any]]:
    import xarray as xr

    with xr.open_datatree(path, engine="h5netcdf") as tree:
        return {
            f"{node.path}/{name}": np.asarray(array.values)
            for node in tree.subtree
            for name, array in node.variables.items()
        }


def _equal(a: np.ndarray[Any, Any], b: np.ndarray[Any, Any]) -> bool:
    return a.shape == b.shape and a.dtype == b.dtype and (a.tobytes() == b.tobytes() or _same(a, b))


def _leaves(value: Any, at: str = "") -> dict[str, Any]:
    """Every single value of a JSON document by its path, without times and versions."""
    if isinstance(value, dict):
        kept = {key: each for key, each in value.items() if str(key) not in NOT_RESULTS}
        return {path: leaf for key, each in kept.items() for path, leaf in _leaves(each, f"{at}/{key}").items()}
    if isinstance(value, list):
        return {path: leaf for i, each in enumerate(value) for path, leaf in _leaves(each, f"{at}[{i}]").items()}
    return {at: value}
