"""The nested sampler among the peers of `peers.py`, run by the Python of their own environment: dynesty.

Reads the posteriors from an ``.npz`` file, draws the first few of them, writes the effective sample sizes to another
file and prints the time as JSON. The prior is uniform in share, angle and load, so that the unit cube is only scaled.
"""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from dynesty import NestedSampler

# Live points (with 100 the effective sample size is about 500), touches (seconds each), and evidence that may be left.
LIVE, TOUCHES, LEFT = 100, 4, 0.05


def likelihood(given: dict[str, np.ndarray], touch: int) -> Callable[[np.ndarray], float]:
    """Log likelihood of one touch in (share, θ_c, P), by the same table and bilinear rule as bayestouch."""
    scale, first, step, angle_first, angle_step, mu, outer = (float(v) for v in given["grid"])
    n_kappa, n_angles = (int(v) for v in given["shape"])
    table = given["rows"].reshape(n_kappa, n_angles, -1)
    readings, precision = given["readings"][touch], given["precision"][touch]
    load, load_sd = float(given["load"][touch]), float(given["load_sd"][touch])

    def log_likelihood(x: np.ndarray) -> float:
        share, angle, pressed = x.tolist()
        kappa = pressed * outer * share / (1000 * mu)
        across = min(max((math.log1p(kappa / scale) - first) / step, 0.0), n_kappa - 1.001)
        along = min(max((angle - angle_first) / angle_step, 0.0), n_angles - 1.001)
        i, j = int(across), int(along)
        s, t = across - i, along - j
        lower = table[i, j] * (1 - t) + table[i, j + 1] * t
        upper = table[i + 1, j] * (1 - t) + table[i + 1, j + 1] * t
        z = (pressed * (lower + s * (upper - lower)) - readings) * precision
        miss = (pressed - load) / load_sd
        return float(-0.5 * (z @ z) - 0.5 * miss * miss)

    return log_likelihood


def main(given_path: Path, drawn_path: Path) -> None:
    """Draw the first `TOUCHES` posteriors, one after the other."""
    given = dict(np.load(given_path))
    low, high, most = (float(v) for v in given["support"])
    scales, start = np.array([1.0, high - low, most]), np.array([0.0, low, 0.0])
    ess, touches = [], min(TOUCHES, len(given["load"]))
    begun, used = time.perf_counter(), time.process_time()
    for touch in range(touches):
        sampler = NestedSampler(
            likelihood(given, touch),
            lambda unit: start + scales * unit,
            3,
            nlive=LIVE,
            rstate=np.random.default_rng(touch),
        )
        # what is left of the evidence weighs less than a twentieth: the weights of draws, not the evidence, matter here
        sampler.run_nested(dlogz=LEFT, print_progress=False)
        weights = sampler.results.importance_weights()
        ess.append(1 / np.sum(weights**2))
    seconds = {"seconds": time.perf_counter() - begun, "processor": time.process_time() - used, "touches": touches}
    np.savez(drawn_path, ess=np.array(ess), draws=len(weights))
    print(json.dumps(seconds))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
