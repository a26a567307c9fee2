"""Would a compiled kernel make batches quicker? The density of a touch in C, beside numpy's.

The kernel (`compiled_density.c`) looks a touch up in the reading table, subtracts the reading, whitens and sums the
squares in one pass, in float32 as numpy does it, with the vector instructions of this machine. It takes the place of
`FingerPosterior.log_density`, and without the sum that of `residual`, which the search for modes and the proposals
call. Printed are the time of one log density, the processor time of both methods on 4,800 touches, and how much of it
is left when all densities are free (no such kernel can save more), and when the searches for modes and proposals are
free, too: random numbers, points of the proposals, weights or chains, and their grades. Last comes the floor: the
multiplications and additions of all densities that a method needs, on arrays, as `log_likelihood.py` counts them.

    python studies/benchmarks/compiled.py [touches]      # with a C compiler, cc
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import ctypes
import statistics
import subprocess
import sys
import tempfile
import time
import timeit
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import log_likelihood
import many_touches
import numpy as np

from bayestouch.finger.reading.draws import FingerGroup, FingerSampler
from bayestouch.finger.reading.reader import FingerPosterior
from bayestouch.reading.draws import DrawPlan, draw

REPEATS = 3
USUAL = FingerPosterior.residual, FingerPosterior.log_density
SEARCHED = FingerSampler.groups


class Table(ctypes.Structure):
    """`Table` of the kernel."""

    _fields_ = (
        ("rows", ctypes.c_void_p),
        ("n_kappa", ctypes.c_int),
        ("n_angles", ctypes.c_int),
        *(
            (name, ctypes.c_double)
            for name in ("kappa_scale", "kappa_first", "kappa_step", "angle_first", "angle_step")
        ),
        ("modulus", ctypes.c_double),
    )


def library(m: int) -> ctypes.CDLL:
    """The kernel for m elements."""
    source = Path(__file__).with_name("compiled_density.c")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "density.so"
        flags = ["-O3", "-march=native", "-ffast-math", "-shared", "-fPIC", f"-DM={m}"]
        subprocess.run(["cc", *flags, "-o", path, source, "-lm"], check=True)
        return ctypes.CDLL(str(path))


def called(kernel: Any, posterior: FingerPosterior, x: np.ndarray, blocks: np.ndarray, squared: bool) -> np.ndarray:
    """Whitened residuals (B, W, m) at points x (B, W, 3) of the touches `blocks` (B,), or sums of squares (B, W)."""
    table = posterior.table
    assert table is not None
    readings, whitener = (each[blocks] for each in posterior._compared_with)
    full = whitener if whitener.ndim == 3 else whitener[:, :, None] * np.eye(whitener.shape[1], dtype=np.float32)
    w, angle, load = (np.ascontiguousarray(x[..., k]) for k in range(3))
    radius = np.ascontiguousarray(posterior.radius(w))
    columns = np.ascontiguousarray(full.swapaxes(1, 2))
    grid = (table.kappa_scale, table.kappa_first, table.kappa_step, table.angle_first, table.angle_step)
    given = Table(table.rows.ctypes.data, *table.shape, *grid, posterior.chain.shear_modulus_MPa)
    out = np.empty(load.shape if squared else (*load.shape, readings.shape[1]), dtype=np.float32)
    pointers = [each.ctypes.data_as(ctypes.c_void_p) for each in (radius, angle, load, readings, columns)]
    kernel(ctypes.byref(given), *pointers, *load.shape, int(squared), out.ctypes.data_as(ctypes.c_void_p))
    return out


@contextmanager
def replaced(residual: Callable[..., Any], log_density: Callable[..., Any]) -> Iterator[None]:
    """Take other functions for residuals and log densities for a while."""
    FingerPosterior.residual, FingerPosterior.log_density = residual, log_density
    try:
        yield
    finally:
        FingerPosterior.residual, FingerPosterior.log_density = USUAL


@contextmanager
def noted_searches(spent: list[float], densities: list[float]) -> Iterator[None]:
    """Note the processor time of searches for modes and proposals for a while, without that of `densities` in them."""

    def groups(*arguments: Any) -> Iterator[FingerGroup]:
        found = SEARCHED(*arguments)
        while True:
            begun = time.process_time() - sum(densities)
            group = next(found, None)
            spent.append(time.process_time() - sum(densities) - begun)
            if group is None:
                return
            yield group

    FingerSampler.groups = groups
    try:
        yield
    finally:
        FingerSampler.groups = SEARCHED


def compiled(m: int) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """`residual` and `log_density` by the kernel."""
    kernel = library(m).density

    def residual(posterior: FingerPosterior, x: np.ndarray, blocks: np.ndarray) -> np.ndarray:
        return called(kernel, posterior, x, blocks, squared=False)

    def log_density(posterior: FingerPosterior, x: np.ndarray, blocks: np.ndarray) -> np.ndarray:
        prior = posterior.log_prior(x, blocks)
        squares = called(kernel, posterior, x, blocks, squared=True).astype(np.float64)
        return np.where(np.isfinite(prior), prior - 0.5 * squares, -np.inf)

    return residual, log_density


def timed(spent: list[float], points: list[int]) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """numpy's `residual` and `log_density`; processor time and number of points of each call go to the lists."""
    inside = [False]

    def noted(usual: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            if inside[0]:
                return usual(*arguments)
            inside[0], begun = True, time.process_time()
            try:
                return usual(*arguments)
            finally:
                inside[0] = False
                spent.append(time.process_time() - begun)
                points.append(int(np.prod(arguments[1].shape[:2])))

        return call

    return noted(USUAL[0]), noted(USUAL[1])


def processor(call: Callable[[], object]) -> float:
    """Processor time of a call, s."""
    begun = time.process_time()
    call()
    return time.process_time() - begun


def floor() -> float:
    """Seconds of the multiplications and additions of one density, all elements."""
    passes, out = log_likelihood.floor(log_likelihood.TOUCHES * log_likelihood.WALKERS)
    return min(timeit.repeat(passes, number=3, repeat=5)) / 3 / len(out)


def one_density(functions: tuple[Callable[..., Any], Callable[..., Any]]) -> dict[str, float]:
    """Nanoseconds of one log density with the calibration propagated, and the largest difference in it."""
    posterior, rng = log_likelihood.posterior(True), np.random.default_rng(1)
    blocks, walkers = np.arange(log_likelihood.TOUCHES), log_likelihood.WALKERS
    shape = (len(blocks), walkers)
    x = np.stack([rng.normal(0, 1.5, shape), rng.uniform(-0.7, 0.7, shape), np.full(shape, 200.0)], axis=-1)
    mine, theirs = functions[1](posterior, x, blocks), posterior.log_density(x, blocks)

    def best(call: Callable[[], object]) -> float:
        return 1e9 * min(timeit.repeat(call, number=3, repeat=7)) / 3 / mine.size

    return {
        "numpy": best(lambda: posterior.log_density(x, blocks)),
        "compiled": best(lambda: functions[1](posterior, x, blocks)),
        "prior alone, in both": best(lambda: posterior.log_prior(x, blocks)),
        "difference": float(np.max(np.abs(mine - theirs) / np.abs(theirs))),
    }


def main(n: int = 4800) -> dict[str, dict[str, float]]:
    """Print both comparisons; returns processor times by method."""
    sampler, touches = many_touches.design(n)
    functions = compiled(many_touches.ELEMENTS)
    found = one_density(functions)
    print(f"one log density, {many_touches.ELEMENTS} elements, calibration propagated")
    for name in ("numpy", "compiled", "prior alone, in both"):
        print(f"  {name:24s}{found[name]:6.0f} ns")
    print(f"  largest difference {found['difference']:.0e} of its value")
    print(f"{n} touches on one core, seconds of processor, medians of {REPEATS}")
    plans: dict[str, DrawPlan] = {"importance": many_touches.BY_WEIGHTS, "emcee": many_touches.BY_CHAINS}
    times = {}
    for method, plan in plans.items():
        names = ("numpy", "compiled", "densities free", "searches free, too", "floor")
        runs: dict[str, list[float]] = {name: [] for name in names}

        def run(plan: DrawPlan = plan) -> float:
            return processor(lambda: draw(sampler, touches, plan, workers=1))

        with replaced(*functions):
            run()
        for _ in range(REPEATS):
            runs["numpy"].append(run())
            with replaced(*functions):
                runs["compiled"].append(run())
            densities, searches, points = list[float](), list[float](), list[int]()
            with replaced(*timed(densities, points)), noted_searches(searches, densities):
                runs["densities free"].append(run() - sum(densities))
            runs["searches free, too"].append(runs["densities free"][-1] - sum(searches))
            runs["floor"].append(floor() * sum(points))
        times[method] = {name: statistics.median(values) for name, values in runs.items()}
        print(
            f"  {method:12s}" + "".join(f"{name} {value:5.2f}   " for name, value in times[method].items()), flush=True
        )
    return times


if __name__ == "__main__":
    main(*(int(argument) for argument in sys.argv[1:]))
