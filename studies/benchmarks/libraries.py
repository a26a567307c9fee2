"""Where the package does itself what a library could: how the two compare. docs/dependencies.md draws on this.

* Effective sample size, R-hat and Pareto shape of many touches: ours take all at once, ArviZ one parameter at a time.
* Posterior files read by `bayestouch.results` and by xarray, without and behind the checks of `bayestouch.results`;
  then damaged files (`_fuzzing.py`), each in a child process of limited memory and time.
* Blocks of draws written in place, and into the regions of a zarr store that is then turned into the netCDF file that
  was asked for. Needs zarr, which is no dependency: without it this part is left out.

Times are the shortest of so many runs.

    python studies/benchmarks/libraries.py [--touches 256] [--inputs 400] [--repeats 3]
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import importlib.util
import shutil
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import xarray as xr

import bayestouch
from bayestouch.data.files import reading
from bayestouch.errors import InputError
from bayestouch.results.growing_file import GrowingFile
from bayestouch.results.hdf5_heaps import check_heaps
from bayestouch.results.hdf5_reading import read_hdf5
from bayestouch.results.netcdf import read_groups
from bayestouch.sampling.diagnostics import bulk_statistics
from bayestouch.sampling.pareto import pareto_shape
from bayestouch.simulation import FingerDesign, simulate

sys.path.insert(0, str(Path(__file__).parents[1]))
from _fuzzing import fuzz

CHAINS, DRAWS, PARAMETERS = 4, 256, 3
#: Blocks of touches, written one after the other.
BLOCKS, BLOCK = 8, 1024


def seconds(call: Callable[[], object], repeats: int) -> float:
    """Least wall time of a call, which a busy machine disturbs least."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return min(times)


def grades(touches: int, repeats: int) -> dict[str, float]:
    """Seconds, by whom, to grade the draws and weights of so many touches; and the largest relative difference."""
    import arviz as az

    rng = np.random.default_rng(1)
    steps = rng.standard_normal((CHAINS, DRAWS, touches * PARAMETERS))
    draws = steps.copy()
    for n in range(1, DRAWS):  # correlated, as chains are
        draws[:, n] = 0.5 * draws[:, n - 1] + steps[:, n]
    log_weights = -0.5 * rng.standard_normal((touches, CHAINS * DRAWS)) ** 2 * rng.uniform(0.2, 2.0, (touches, 1))

    def by_arviz() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        series = np.moveaxis(draws, -1, 0)
        ess = np.array([az.ess(each) for each in series])
        rhat = np.array([az.rhat(each) for each in series])
        return ess, rhat, np.array([float(az.psislw(row)[1]) for row in log_weights])

    def ours() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return (*bulk_statistics(draws), pareto_shape(log_weights))

    found = {"ours": seconds(ours, repeats), "ArviZ": seconds(by_arviz, repeats)}
    found["difference"] = max(float(np.max(np.abs(a - b) / np.abs(b))) for a, b in zip(ours(), by_arviz(), strict=True))
    return found


def by_xarray(path: Path) -> dict[str, xr.Dataset]:
    """All groups below the root, by the library alone."""
    opened = xr.open_groups(path, engine="h5netcdf", decode_times=False, mask_and_scale=False)
    try:
        return {name.strip("/"): group.load() for name, group in opened.items()}
    finally:
        for group in opened.values():
            group.close()


def checked(path: Path) -> dict[str, xr.Dataset]:
    """The same behind the checks of links, kinds, sizes and heaps."""
    check_heaps(path)
    read_hdf5(path, "posterior", (), (), 1 << 30, only="")  # nothing is read, everything is looked at
    return by_xarray(path)


def refusing(read: Callable[[Path], object]) -> Callable[[Path], object]:
    """What a reader raises becomes one line, as in `bayestouch.results.netcdf`."""

    def one_line(path: Path) -> object:
        try:
            with reading(path) as file:
                return read(file)
        except InputError:
            raise
        except Exception as error:
            raise InputError(" ".join(str(error).split())[:120]) from None

    return one_line


READERS: dict[str, Callable[[Path], object]] = {
    "bayestouch.results": lambda path: read_groups(path),
    "xarray": refusing(by_xarray),
    "xarray behind our checks": refusing(checked),
}


def files(folder: Path, inputs: int, repeats: int) -> dict[str, dict[str, float]]:
    """Seconds to read a calibration of a small finger, by reader, and what became of damaged ones."""
    design = FingerDesign(n_elements=3, pitch_deg=9.0, edge_step_deg=9.0, flat_step_deg=18.0)
    path = folder / "calibration.nc"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        bayestouch.calibrate(simulate(design, seed=1).dataset, draws=8).save(path)
    found = {}
    for name, read in READERS.items():
        taken = seconds(lambda read=read: read(path), repeats)  # type: ignore[misc]
        counts = fuzz(".nc", [path.read_bytes()], read, {}, inputs, float("inf"), None)
        found[name] = {"taken": taken, **counts}
    return found


def block(first: int) -> dict[str, xr.Dataset]:
    """Draws of one block of touches, as a posterior file holds them."""
    rng = np.random.default_rng(first)
    shape, dims = (CHAINS, DRAWS, BLOCK), ("chain", "draw", "touch")
    draws = {name: (dims, rng.standard_normal(shape)) for name in ("r_c", "R", "theta_c", "P")}
    return {"posterior": xr.Dataset(draws, coords={"touch": np.arange(first, first + BLOCK)})}


def writing(folder: Path, repeats: int) -> dict[str, float]:
    """Seconds to write all blocks into one netCDF file, by how, and the files on the way."""
    blocks = [block(BLOCK * number) for number in range(BLOCKS)]
    total = BLOCKS * BLOCK
    store, target = folder / "store.zarr", folder / "posterior.nc"

    def growing() -> None:
        made = GrowingFile.create(folder / "growing", blocks[0], {}, total)
        for number, groups in enumerate(blocks):
            made.write(groups, BLOCK * number)
        made.finish()

    def regions() -> None:
        shutil.rmtree(store, ignore_errors=True)
        empty = xr.zeros_like(blocks[0]["posterior"].isel(touch=[0])).isel(touch=np.zeros(total, dtype=int))
        layout = {name: {"chunks": (CHAINS, DRAWS, BLOCK)} for name in empty.data_vars}
        empty.chunk({"touch": BLOCK}).to_zarr(store, compute=False, encoding=layout)
        for number, groups in enumerate(blocks):
            touches = slice(BLOCK * number, BLOCK * (number + 1))
            groups["posterior"].to_zarr(store, region={"touch": touches})

    def whole() -> None:
        target.unlink(missing_ok=True)
        with xr.open_zarr(store) as opened:
            opened.drop_encoding().to_netcdf(target, group="posterior", engine="h5netcdf")

    found = {"in place": seconds(growing, repeats)}
    if importlib.util.find_spec("zarr") is not None:
        found |= {"zarr regions": seconds(regions, repeats), "to netCDF": seconds(whole, repeats)}
        found["files"] = sum(path.is_file() for path in store.rglob("*"))
    return found


def main(touches: int = 256, inputs: int = 400, repeats: int = 3) -> None:
    """Print all tables."""
    with tempfile.TemporaryDirectory() as folder:
        # First: the children that read damaged files may hold so much memory, what was imported before included.
        print(f"a calibration read; then {inputs} damaged ones")
        for name, found in files(Path(folder), inputs, repeats).items():
            outcomes = ", ".join(f"{key} {found[key]:.0f}" for key in ("read", "refused", "crash", "died", "hang"))
            print(f"  {name}: {1e3 * found['taken']:.0f} ms; {outcomes}; peak {found['peak']:.0f} MB", flush=True)
        written = writing(Path(folder), repeats)
        print(f"{BLOCKS} blocks of {BLOCK} touches, {CHAINS * DRAWS} draws of 4 parameters, in one netCDF file")
        print("  " + ", ".join(f"{name} {value:.3g}" for name, value in written.items()))
    graded = grades(touches, repeats)
    print(f"{touches} touches of {PARAMETERS} parameters, {CHAINS} chains of {DRAWS} draws: ESS, R-hat, Pareto shape")
    print(f"  ours {graded['ours']:.3f} s, ArviZ {graded['ArviZ']:.2f} s: {graded['ArviZ'] / graded['ours']:.0f} times")
    print(f"  largest relative difference {graded['difference']:.1e}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--touches", type=int, default=256)
    parser.add_argument("--inputs", type=int, default=400)
    parser.add_argument("--repeats", type=int, default=3)
    o = parser.parse_args()
    main(o.touches, o.inputs, o.repeats)
