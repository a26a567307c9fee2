"""All 4,800 touches of the paper's design (40 locations x 20 samples x 6 indenters): seconds, and ratio to plain emcee.

Every touch is to reach an effective sample size of 400 for each of R, θ_c, P: of chains the bulk ESS as ArviZ has it,
of weighted points, which are independent, 1/Σw². Plain emcee (stretch moves, one vectorised run a touch, the same
tabulated likelihood) is timed on a few touches and extrapolated. It runs on one core, the others on all: the ratio is
that of processor times.

    python studies/benchmarks/many_touches.py [touches]
"""

from __future__ import annotations

import os
import sys
import time
from dataclasses import replace

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from bayestouch.chain.finger import FingerChain
from bayestouch.chain.noise import Noise
from bayestouch.finger.reading.covariance import CalibrationCovariance
from bayestouch.finger.reading.draws import FingerSampler
from bayestouch.finger.reading.modes import find_modes, hessian_at
from bayestouch.finger.reading.reader import FingerPosterior, IndenterPriors, TouchReadings, noise_whitener
from bayestouch.finger.reading.reading_table import ReadingTable
from bayestouch.reading.draws import DrawPlan, draw

ELEMENTS, LOAD, NOISE_PERCENT, MODULUS = 16, 200.0, 1.72, 0.15
ESS = 400.0
# Draws that leave nearly every touch above that. Bulk ESS is itself uncertain by 8 % in such chains: 67 touches of
# 4,800 come out below by chance and are drawn again. Weights are not: the least of 4,800 is 97 % of the points.
BY_CHAINS, BY_WEIGHTS = DrawPlan(640, seed=1), DrawPlan(416, seed=1, method="importance")
# The shortest of so many runs counts: what else the machine does only adds.
REPEATS = 3
PLAIN_TOUCHES, PLAIN_WALKERS, PLAIN_STEPS = 4, 32, 1500


def finger() -> FingerChain:
    """The paper's finger; a response of 1 count per N/m."""
    angles = np.radians((np.arange(ELEMENTS) - 7.5) * 8.8)
    one = np.ones(ELEMENTS)
    return FingerChain(9.4, 12.7, one, 9.9 * one, angles, 0 * one, 0.46, MODULUS, 1.5 * LOAD)


def design(n: int, seed: int = 0) -> tuple[FingerSampler, TouchReadings]:
    """Raw samples over 40 locations, composite radii over (0.3, 12.6) mm."""
    chain = finger()
    rng = np.random.default_rng(seed)
    noise = Noise(np.full(ELEMENTS, NOISE_PERCENT / 100 * LOAD), np.zeros(ELEMENTS), 0.0, 1.0)
    radius = rng.uniform(0.3, 12.6, n)
    angle = np.radians(rng.integers(-20, 20, n).astype(float))
    clean = chain.predict(radius, angle, np.full(n, LOAD))
    touches = TouchReadings(
        readings=clean + noise.tactile_sd * rng.standard_normal(clean.shape),
        counts=np.ones(clean.shape, dtype=np.int64),
        load=LOAD + rng.standard_normal(n),
        load_sd=np.ones(n),
    )
    # A calibration of the quality a practice finger gets: 0.25 % in response, 15 µm, 0.016 degree, σ 3e-4, μ 0.6 %.
    sd = np.repeat([0.0025, 0.015, np.radians(0.016)], ELEMENTS)
    covariance = np.diag(np.concatenate([sd, [3e-4, 6e-3]]) ** 2)
    priors = IndenterPriors.of(chain, LOAD)
    table = ReadingTable.of(chain, *priors.location.support)
    return FingerSampler(chain, priors, table, noise, CalibrationCovariance(chain, covariance)), touches


def plain_emcee(sampler: FingerSampler, touches: TouchReadings) -> float:
    """Seconds a touch that plain emcee needs for the effective sample size, from a few touches."""
    import emcee

    spent, least = 0.0, []  # processor time: on a machine that does other things too, that of a free core
    rows = np.linspace(0, touches.n_touches - 1, PLAIN_TOUCHES).astype(np.int64)
    for row in rows:
        one = touches.select(np.array([row]))
        posterior = FingerPosterior(
            sampler.chain, one, sampler.priors, noise_whitener(sampler.noise, one), sampler.table
        )
        mode = find_modes(posterior)
        rng = np.random.default_rng(int(row))
        root = np.linalg.cholesky(np.linalg.inv(hessian_at(posterior, mode)[0]))
        start = mode[0] + rng.standard_normal((PLAIN_WALKERS, 3)) @ root.T
        begun = time.process_time()
        ensemble = emcee.EnsembleSampler(
            PLAIN_WALKERS, 3, lambda x, p=posterior: p.log_density(x[None], np.array([0]))[0], vectorize=True
        )
        ensemble.run_mcmc(start, PLAIN_STEPS)
        spent += time.process_time() - begun
        # independent draws from the autocorrelation time: walkers of one ensemble are no independent chains
        tau = ensemble.get_autocorr_time(tol=0).max()
        least.append(PLAIN_WALKERS * PLAIN_STEPS / tau)
    return spent / PLAIN_TOUCHES * ESS / float(np.mean(least))


def timed(sampler: FingerSampler, touches: TouchReadings, plan: DrawPlan) -> tuple[float, float, dict[str, np.ndarray]]:
    """Seconds for all touches on all cores, seconds of processor time, and the draws with their grades."""
    best, drawn = (np.inf, np.inf), {}
    for _ in range(REPEATS):
        begun, used = time.perf_counter(), sum(os.times()[:4])
        drawn = draw(sampler, touches, plan)
        best = min(best, (time.perf_counter() - begun, sum(os.times()[:4]) - used))
    return *best, drawn


def main(n: int = 4800) -> dict[str, float]:
    """Print the table; returns seconds by method."""
    sampler, touches = design(n)
    plug_in = replace(sampler, reading_covariance=None)
    runs = {
        "emcee in lockstep, calibration propagated": (sampler, BY_CHAINS),
        "emcee in lockstep, plug-in": (plug_in, BY_CHAINS),
        "importance, calibration propagated": (sampler, BY_WEIGHTS),
        "importance, plug-in": (plug_in, BY_WEIGHTS),
    }
    plain = plain_emcee(sampler, touches) * n
    seconds = {"plain emcee, touch by touch (extrapolated)": plain}
    print(
        f"{n} touches, ESS >= {ESS:.0f} of each parameter of each touch, {os.cpu_count()} cores; plain emcee plugged in"
    )
    print(f"  {'plain emcee, touch by touch (extrapolated)':42s} {plain:7.1f} s")
    for name, (run, plan) in runs.items():
        seconds[name], used, drawn = timed(run, touches, plan)
        print(
            f"  {name:42s} {seconds[name]:7.2f} s  {used:6.2f} s of processor  {plain / used:6.0f} x plain  "
            f"least ESS {drawn['ess_bulk'].min():4.0f}  good {drawn['grade'].mean():7.2%}  "
            f"drawn again {np.mean(drawn['round'] > drawn['round'].min()):.2%}"
        )
    return seconds


if __name__ == "__main__":
    main(*(int(argument) for argument in sys.argv[1:]))
