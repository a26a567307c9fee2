"""Peers on the same posteriors, side by side: NumPyro's NUTS (vmapped), whitened HMC in JAX, nested sampling, and ours.

Posteriors are those of `many_touches.py` with the calibration plugged in, the likelihood in all of them the same table.
The two in JAX start from the same Laplace fits and draw in coordinates whitened by them; dynesty starts from the prior,
as nested sampling does, and draws the first touches only. The peers live in an environment of their own, which the
first run makes (`peers-requirements.txt`); compiling is not counted. What is compared is the time for an effective
sample size of 400 of each parameter: that of the median touch, and of the worst in a hundred.

    python studies/benchmarks/peers.py [touches] [--environment DIR]
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

sys.path.append(str(Path(__file__).parent))
import many_touches

from bayestouch.finger.reading.draws import FingerSampler
from bayestouch.finger.reading.modes import find_modes
from bayestouch.finger.reading.reader import FingerPosterior, TouchReadings, noise_whitener
from bayestouch.reading.draws import draw
from bayestouch.sampling.diagnostics import ess_bulk

HERE = Path(__file__).parent


def environment(folder: Path) -> Path:
    """Python of the peers' environment, made where it is not there."""
    python = folder / "bin" / "python"
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
        requirements = str(HERE / "peers-requirements.txt")
        subprocess.run([str(python), "-m", "pip", "install", "--quiet", "-r", requirements], check=True)
    return python


def written(sampler: FingerSampler, touches: TouchReadings, path: Path) -> None:
    """Write the posteriors with their Laplace fits."""
    posterior = FingerPosterior(
        sampler.chain, touches, sampler.priors, noise_whitener(sampler.noise, touches), sampler.table
    )
    mode, hessian = find_modes(posterior)
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
        root=np.linalg.cholesky(np.linalg.inv(hessian)),
    )


def told_by(python: Path, script: str, given: Path, drawn: Path) -> dict[str, Any]:
    """What a script of the peers prints, after it has read `given` and written `drawn`."""
    clean = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    command = [str(python), str(HERE / script), str(given), str(drawn)]
    told: dict[str, Any] = json.loads(
        subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, env=clean).stdout
    )
    return told


def main(n: int = 480, folder: Path | None = None, whole: int = 4800) -> dict[str, float]:
    """Print the table; returns processor seconds for 4,800 touches by method. The peers draw the first n."""
    sampler, every = many_touches.design(whole)
    sampler, touches = replace(sampler, reading_covariance=None), every.select(np.arange(n))
    draw(sampler, touches.select(np.arange(8)), many_touches.BY_CHAINS)  # imports emcee
    rows = []
    with tempfile.TemporaryDirectory() as temporary:
        given, drawn = Path(temporary) / "posteriors.npz", Path(temporary) / "draws.npz"
        written(sampler, touches, given)
        python = environment(folder or Path(tempfile.gettempdir()) / "bayestouch-peers")
        told = told_by(python, "peers_jax.py", given, drawn)
        for name, title in (("nuts", "NumPyro NUTS, vmapped"), ("hmc", "whitened HMC in JAX")):
            spent = told[name]
            with np.load(drawn) as draws:
                z = draws[name]
            rows.append((title, spent["seconds"], spent["processor"], worst(z), z.shape[0] * z.shape[1], n))
        told = told_by(python, "peers_nested.py", given, drawn)
        with np.load(drawn) as draws:
            spent = told["seconds"], told["processor"]
            rows.append(("dynesty, from the prior", *spent, draws["ess"], int(draws["draws"]), told["touches"]))
    runs = {"emcee in lockstep": many_touches.BY_CHAINS, "importance": many_touches.BY_WEIGHTS}
    for title, plan in runs.items():
        begun, used = time.perf_counter(), sum(os.times()[:4])
        result = draw(sampler, every, plan)
        spent = time.perf_counter() - begun, sum(os.times()[:4]) - used
        rows.append((title, *spent, result["ess_bulk"], plan.draws, whole))
    plain = many_touches.plain_emcee(sampler, touches)
    print(f"peers on {n} touches, ours on {whole}, calibration plugged in; seconds of processor for 4,800 at ESS 400")
    titles = f"{'s here':>8s} {'s of proc.':>10s} {'draws':>6s} {'ESS 1 %':>8s} {'median':>7s} {'4,800, median':>14s}"
    print(f"  {'':24s} {titles} {'1 %':>8s}")
    found = {"plain emcee": plain * 4800}
    for title, wall, used, ess, draws, touched in rows:
        low, middle = np.quantile(ess, [0.01, 0.5])
        # more draws take longer in proportion; fewer are not counted as cheaper than they were
        each = used / touched * 4800
        found[title] = each * max(1.0, 400 / middle)
        print(
            f"  {title:24s} {wall:8.2f} {used:10.2f} {draws:6d} {low:8.0f} {middle:7.0f} "
            f"{found[title]:14.1f} {each * max(1.0, 400 / low):8.1f}"
        )
    print(f"  {'plain emcee (mean touch)':24s} {'':8s} {'':10s} {'':6s} {'':8s} {'':7s} {plain * 4800:14.1f}")
    return found


def worst(draws: np.ndarray) -> np.ndarray:
    """Bulk ESS of each touch's worst parameter from draws (chain, draw, touch, parameter)."""
    return np.min([ess_bulk(draws[..., k]) for k in range(draws.shape[-1])], axis=0)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("touches", type=int, nargs="?", default=480)
    parser.add_argument("--environment", type=Path, default=None, help="folder of the peers' environment")
    chosen = parser.parse_args()
    main(chosen.touches, chosen.environment)
