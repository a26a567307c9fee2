"""Draw a calibration with emcee alone, and compare it with that of `bayestouch.calibrate`.

python studies/examples/plain_emcee.py
"""

import emcee
import numpy as np

import bayestouch

STEPS, LEFT_OUT = 4000, 1000


def main() -> dict[str, tuple[float, float]]:
    """Print mean and sd of some parameters; return how the two agree, in standard deviations and as a ratio of sds."""
    design = bayestouch.FingerDesign(n_elements=2, edge_step_deg=4.0, flat_step_deg=8.0)
    data = bayestouch.simulate(design, seed=1).dataset
    calibration = bayestouch.calibrate(data, draws=4000)
    density = bayestouch.log_density(calibration, data)

    walkers = 8 * density.dimension
    start = np.random.default_rng(0).multivariate_normal(density.start, density.covariance, walkers)
    start = start[np.isfinite(density(start))]
    moves = [(emcee.moves.DEMove(), 0.8), (emcee.moves.StretchMove(), 0.2)]
    start = start[: len(start) // 2 * 2]
    sampler = emcee.EnsembleSampler(len(start), density.dimension, density, moves=moves, vectorize=True)
    sampler.run_mcmc(start, STEPS)
    draws = density.to_parameters(sampler.get_chain(discard=LEFT_OUT, thin=20, flat=True))

    agreement = {}
    for name in ("sigma", "mu", "force_noise_sd"):
        mine, usual = draws[name], calibration.posterior[name].ravel()
        print(f"{name:15s} emcee     {mine.mean():.5f} ± {mine.std():.5f}")
        print(f"{name:15s} calibrate {usual.mean():.5f} ± {usual.std():.5f}")
        agreement[name] = (float((mine.mean() - usual.mean()) / usual.std()), float(mine.std() / usual.std()))
    return agreement


if __name__ == "__main__":
    main()
