"""Peers on the same posteriors, in one run: NumPyro's NUTS (vmapped), whitened HMC in JAX, nested sampling, and ours.

Posteriors are those of `many_touches.py` with the calibration plugged in, the likelihood in all of them the same table.
The two in JAX start from the same Laplace fits and draw in coordinates whitened by them; dynesty starts from the prior,
as nested sampling does, and draws a few touches only; so does plain emcee. The peers live in an environment of their
own, which the first run makes (`peers-requirements.txt`); compiling is not counted. What is compared is the processor
time for an effective sample size of 400 of each parameter: that of the median touch, and of the worst in a hundred.

All are pinned to one core, and take turns: the touches are shared out over rounds, in each of which every sampler runs
once, forwards and backwards in turn. A ratio is that of two times of the same round.

    python studies/benchmarks/peers.py [touches] [--environment DIR] [--rounds N]
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

sys.path.append(str(Path(__file__).parent))
import many_touches

from bayestouch.finger.reading.draws import FingerSampler
from bayestouch.finger.reading.modes import find_modes, hessian_at
from bayestouch.finger.reading.reader import FingerPosterior, TouchReadings, noise_whitener
from bayestouch.reading.draws import DrawPlan, draw
from bayestouch.sampling.diagnostics import ess_bulk

HERE = Path(__file__).parent
# Touches for which costs are given, and the effective sample size.
WHOLE, ESS = 4800, many_touches.ESS


class Cost(NamedTuple):
    """Seconds of processor for 4,800 touches: as the median touch costs, and as the worst in a hundred."""

    median: float
    worst_1: float


def environment(folder: Path) -> Path:
    """Python of the peers' environment, made where it is not there, or not whole, or has other versions."""
    python, requirements = folder / "bin" / "python", HERE / "peers-requirements.txt"
    # a copy of the requirements says that all of them are installed
    wanted, installed = requirements.read_text("utf-8"), folder / requirements.name
    if not installed.exists() or installed.read_text("utf-8") != wanted:
        subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
        subprocess.run([str(python), "-m", "pip", "install", "--quiet", "-r", str(requirements)], check=True)
        installed.write_text(wanted, "utf-8")
    return python


def written(sampler: FingerSampler, touches: TouchReadings, path: Path) -> None:
    """Write the posteriors with their Laplace fits."""
    posterior = FingerPosterior(
        sampler.chain, touches, sampler.priors, noise_whitener(sampler.noise, touches), sampler.table
    )
    mode = find_modes(posterior)
    table = sampler.table
    grid = (table.kappa_scale, table.kappa_first, table.kappa_step, table.angle_first, table.angle_step)
    np.savez(
        path,
        rows=table.rows,
        grid=(*grid, sampler.chain.shear_modulus_MPa, sampler.chain.outer_radius_mm),
        shape=table.shape,
        support=(*sampler.priors.location.support, sampler.priors.load.support[1]),
        readings=touches.readings,
        precision=posterior.whitener,
        load=touches.load,
        load_sd=touches.load_sd,
        mode=mode,
        root=np.linalg.cholesky(np.linalg.inv(hessian_at(posterior, mode))),
    )


def told_by(python: Path, script: str, given: Path, drawn: Path, *more: str) -> dict[str, Any]:
    """What a script of the peers prints, after it has read `given` and written `drawn`."""
    clean = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    command = [str(python), str(HERE / script), str(given), str(drawn), *more]
    told: dict[str, Any] = json.loads(
        subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, env=clean).stdout
    )
    return told


def seconds_at_ess(processor: float, touches: int, ess: np.ndarray) -> Cost:
    """Seconds of processor for 4,800 touches at an effective sample size of 400, from those of a run.

    More draws take longer in proportion; fewer are not counted as cheaper than they were.
    """
    low, middle = np.quantile(ess, [0.01, 0.5])
    each = processor / touches * WHOLE
    return Cost(each * max(1.0, ESS / middle), each * max(1.0, ESS / low))


def by_jax(python: Path, name: str, given: Path, drawn: Path) -> Cost:
    """Cost of a sampler of `peers_jax.py`."""
    told = told_by(python, "peers_jax.py", given, drawn, name)
    with np.load(drawn) as draws:
        z = draws["draws"]
    return seconds_at_ess(told["processor"], z.shape[2], worst(z))


def nested(python: Path, given: Path, drawn: Path) -> Cost:
    """Cost of dynesty."""
    told = told_by(python, "peers_nested.py", given, drawn)
    with np.load(drawn) as draws:
        ess = draws["ess"]
    return seconds_at_ess(told["processor"], told["touches"], ess)


def ours(sampler: FingerSampler, touches: TouchReadings, plan: DrawPlan) -> Cost:
    """Cost of a method of bayestouch, in one process."""
    used = time.process_time()
    result = draw(sampler, touches, plan, workers=1)
    return seconds_at_ess(time.process_time() - used, touches.n_touches, result["ess_bulk"])


def plain(sampler: FingerSampler, touches: TouchReadings) -> Cost:
    """Cost of plain emcee: the mean of a few touches."""
    each = many_touches.plain_emcee(sampler, touches) * WHOLE
    return Cost(each, float("nan"))


def one_round(sampler: FingerSampler, touches: TouchReadings, python: Path, backwards: bool) -> dict[str, Cost]:
    """Cost of every sampler on the same touches, one after the other."""
    with tempfile.TemporaryDirectory() as temporary:
        given, drawn = Path(temporary) / "posteriors.npz", Path(temporary) / "draws.npz"
        written(sampler, touches, given)
        turns: dict[str, Callable[[], Cost]] = {
            "dynesty, from the prior": lambda: nested(python, given, drawn),
            "plain emcee": lambda: plain(sampler, touches),
            "NumPyro NUTS, vmapped": lambda: by_jax(python, "nuts", given, drawn),
            "whitened HMC in JAX": lambda: by_jax(python, "hmc", given, drawn),
            "emcee in lockstep": lambda: ours(sampler, touches, many_touches.BY_CHAINS),
            "importance": lambda: ours(sampler, touches, many_touches.BY_WEIGHTS),
        }
        found = {name: turns[name]() for name in (reversed(turns) if backwards else turns)}
        return {name: found[name] for name in turns}


def main(n: int = 480, folder: Path | None = None, rounds: int = 3) -> dict[str, list[Cost]]:
    """Print the table; returns the costs of each sampler, one a round. Each round has its share of n touches."""
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})  # all that is started here inherits it
    sampler, every = many_touches.design(n)
    sampler = replace(sampler, reading_covariance=None)
    draw(sampler, every.select(np.arange(8)), many_touches.BY_CHAINS, workers=1)  # imports emcee
    python = environment(folder or Path(tempfile.gettempdir()) / "bayestouch-peers")
    parts = enumerate(np.array_split(np.arange(n), rounds))
    done = [one_round(sampler, every.select(part), python, bool(number % 2)) for number, part in parts]
    costs = {name: [each[name] for each in done] for name in done[0]}
    print(
        f"{n} touches in {rounds} rounds, calibration plugged in, one core; seconds of processor for 4,800 at ESS 400"
    )
    print(f"  {'':24s} {'median touch':>13s} {'worst in a hundred':>19s} {'times importance (rounds)':>27s}")
    for name, each in costs.items():
        ratios = [mine.median / best.median for mine, best in zip(each, costs["importance"], strict=True)]
        ratio, least, most = (
            f"{value:.3g}" if value < 100 else f"{value:,.0f}"
            for value in (float(np.median(ratios)), min(ratios), max(ratios))
        )
        middle, worst_1 = np.median(each, axis=0)
        print(f"  {name:24s} {middle:13.1f} {worst_1:19.1f} {f'{ratio} ({least} to {most})':>27s}")
    return costs


def worst(draws: np.ndarray) -> np.ndarray:
    """Bulk ESS of each touch's worst parameter from draws (chain, draw, touch, parameter)."""
    return np.min([ess_bulk(draws[..., k]) for k in range(draws.shape[-1])], axis=0)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("touches", type=int, nargs="?", default=480)
    parser.add_argument("--environment", type=Path, default=None, help="folder of the peers' environment")
    parser.add_argument("--rounds", type=int, default=3)
    chosen = parser.parse_args()
    main(chosen.touches, chosen.environment, chosen.rounds)
