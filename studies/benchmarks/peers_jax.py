"""The peers of `peers.py`, run by the Python of their own environment: NUTS of NumPyro and whitened HMC, both in JAX.

Reads the posteriors from an ``.npz`` file, writes the draws of one of the two to another and prints the times as JSON.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from numpyro.infer.hmc import hmc

CHAINS = 4
NUTS_WARMUP, NUTS_DRAWS = 150, 150
HMC_LEFT_OUT, HMC_DRAWS, HMC_STEPS, HMC_LENGTH = 20, 200, 5, 1.6


def density(given: dict[str, np.ndarray]):
    """Log posterior of one touch in (w, θ_c, P), by the same table and bilinear rule as bayestouch."""
    rows = jnp.asarray(given["rows"])
    scale, first, step, angle_first, angle_step, mu, outer = (float(v) for v in given["grid"])
    n_kappa, n_angles = (int(v) for v in given["shape"])
    low, high, most = (float(v) for v in given["support"])
    table = rows.reshape(n_kappa, n_angles, -1)

    def log_density(x, touch):
        share = jax.nn.sigmoid(x[0])
        kappa = jnp.maximum(x[2] * outer * share / (1000 * mu), 0.0)
        across = jnp.clip((jnp.log1p(kappa / scale) - first) / step, 0.0, n_kappa - 1.001)
        along = jnp.clip((x[1] - angle_first) / angle_step, 0.0, n_angles - 1.001)
        i, j = across.astype(int), along.astype(int)
        s, t = across - i, along - j
        lower = table[i, j] * (1 - t) + table[i, j + 1] * t
        upper = table[i + 1, j] * (1 - t) + table[i + 1, j + 1] * t
        z = (x[2] * (lower + s * (upper - lower)) - touch["readings"]) * touch["precision"]
        miss = (x[2] - touch["load"]) / touch["load_sd"]
        inside = (x[1] > low) & (x[1] < high) & (x[2] > 0) & (x[2] < most)
        prior = jax.nn.log_sigmoid(x[0]) + jax.nn.log_sigmoid(-x[0])
        return jnp.where(inside, prior - 0.5 * (z @ z) - 0.5 * miss * miss, -jnp.inf)

    return log_density


def nuts(log_density, touch, key):
    """One NUTS chain in whitened coordinates; adapts its step size and mass during warm-up."""
    init, sample = hmc(lambda z: -log_density(touch["mode"] + touch["root"] @ z, touch), algo="NUTS")
    state = init(jax.random.normal(key, (3,)) * 0.5, num_warmup=NUTS_WARMUP, rng_key=key, dense_mass=True)
    state = jax.lax.fori_loop(0, NUTS_WARMUP, lambda _, s: sample(s), state)

    def keep(s, _):
        s = sample(s)
        return s, s.z

    return jax.lax.scan(keep, state, None, length=NUTS_DRAWS)[1]


def whitened_hmc(log_density, touch, key):
    """One HMC chain in coordinates whitened by the Laplace fit: a fixed number of steps of jittered size."""
    value = jax.value_and_grad(lambda z: -log_density(touch["mode"] + touch["root"] @ z, touch))

    def move(state, key):
        z, energy, gradient = state
        kick, jitter, accept = jax.random.split(key, 3)
        momentum = jax.random.normal(kick, (3,))
        size = HMC_LENGTH / HMC_STEPS * jax.random.uniform(jitter, minval=0.7, maxval=1.2)
        there, p, slope, u = z, momentum, gradient, energy
        for _ in range(HMC_STEPS):
            p = p - 0.5 * size * slope
            there = there + size * p
            u, slope = value(there)
            p = p - 0.5 * size * slope
        ratio = energy - u + 0.5 * (momentum @ momentum - p @ p)
        better = jnp.isfinite(u) & (jnp.log(jax.random.uniform(accept)) < ratio)
        state = jax.tree.map(lambda a, b: jnp.where(better, a, b), (there, u, slope), (z, energy, gradient))
        return state, state[0]

    start = jax.random.normal(key, (3,)) * 0.5
    keys = jax.random.split(key, HMC_LEFT_OUT + HMC_DRAWS)
    return jax.lax.scan(move, (start, *value(start)), keys)[1][HMC_LEFT_OUT:]


def timed(chain, log_density, touches, n: int) -> tuple[dict[str, float], np.ndarray]:
    """Compile, run, and give seconds of both and the draws (chain, draw, touch, 3)."""
    keys = jax.random.split(jax.random.PRNGKey(0), (n, CHAINS))
    over_chains = jax.vmap(lambda touch, key: chain(log_density, touch, key), (None, 0))
    begun = time.perf_counter()
    compiled = jax.jit(jax.vmap(over_chains)).lower(touches, keys).compile()
    compiling, begun, used = time.perf_counter() - begun, time.perf_counter(), time.process_time()
    z = np.asarray(compiled(touches, keys).block_until_ready())
    seconds = {"seconds": time.perf_counter() - begun, "processor": time.process_time() - used, "compiling": compiling}
    return seconds, np.moveaxis(z, 0, 2)


CHAIN = {"nuts": nuts, "hmc": whitened_hmc}


def main(given_path: Path, drawn_path: Path, name: str) -> None:
    """Run one of the two and write what it drew."""
    given = dict(np.load(given_path))
    names = ("readings", "precision", "load", "load_sd", "mode", "root")
    touches = {name: jnp.asarray(given[name], dtype=jnp.float32) for name in names}
    seconds, draws = timed(CHAIN[name], density(given), touches, len(given["load"]))
    np.savez(drawn_path, draws=draws)
    print(json.dumps(seconds))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3])
