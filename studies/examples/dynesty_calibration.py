"""Draw a calibration by nested sampling with dynesty, and compare it with that of `bayestouch.calibrate`.

pip install dynesty
python studies/examples/dynesty_calibration.py
"""

import dynesty
import numpy as np
from scipy.special import ndtri
from scipy.stats import multivariate_normal

import bayestouch

WIDER, LIVE, SLICES = 2.0, 200, 5


def main() -> dict[str, tuple[float, float]]:
    """Print mean and sd of some parameters; return how the two agree, in standard deviations and as a ratio of sds."""
    design = bayestouch.FingerDesign(n_elements=2, edge_step_deg=4.0, flat_step_deg=8.0)
    data = bayestouch.simulate(design, seed=1).dataset
    calibration = bayestouch.calibrate(data, draws=4000)
    density = bayestouch.log_density(calibration, data)

    covariance = WIDER**2 * density.covariance
    root, wide = np.linalg.cholesky(covariance), multivariate_normal(density.start, covariance)
    sampler = dynesty.NestedSampler(
        lambda x: max(float(density(x)) - float(wide.logpdf(x)), -1e300),
        lambda u: density.start + root @ ndtri(u),
        density.dimension,
        nlive=LIVE,
        sample="rslice",
        bound="single",
        slices=SLICES,
        rstate=np.random.default_rng(0),
    )
    sampler.run_nested(dlogz=0.1, print_progress=False)
    draws = density.to_parameters(sampler.results.samples_equal(rstate=np.random.default_rng(1)))
    print(f"log evidence {sampler.results.logz[-1]:.1f}, up to a constant; {sampler.results.ncall.sum()} calls")

    agreement = {}
    for name in ("sigma", "mu", "force_noise_sd"):
        mine, usual = draws[name], calibration.posterior[name].ravel()
        print(f"{name:15s} dynesty   {mine.mean():.5f} ± {mine.std():.5f}")
        print(f"{name:15s} calibrate {usual.mean():.5f} ± {usual.std():.5f}")
        agreement[name] = (float((mine.mean() - usual.mean()) / usual.std()), float(mine.std() / usual.std()))
    return agreement


if __name__ == "__main__":
    main()
