"""Cost of one log-likelihood of a touch on one core, beside what bounds it from below.

Floor: a table lookup of 16 elements needs 16 x (2 x 4 interpolation products and sums) and a residual; the same
number of multiplications and additions on arrays of the same size and precision (float32, as the table has it) is timed
in the same run. The series peer sums the Fourier modes.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import timeit
from collections.abc import Callable

import numpy as np

from bayestouch.chain.finger import FingerChain
from bayestouch.finger.reading.reader import FingerPosterior, IndenterPriors, TouchReadings
from bayestouch.finger.reading.reading_table import ReadingTable

TOUCHES, WALKERS, ELEMENTS = 256, 16, 16
#: Precision of the table and of residuals, in which the floor is computed too.
PRECISION = np.float32


def chain() -> FingerChain:
    """The paper's finger at a soft modulus."""
    angles = np.radians((np.arange(ELEMENTS) - 7.5) * 8.8)
    return FingerChain(
        9.4, 12.7, np.ones(ELEMENTS), np.full(ELEMENTS, 9.9), angles, np.zeros(ELEMENTS), 0.46, 0.15, 300.0
    )


def posterior(full: bool) -> FingerPosterior:
    """Touches with a diagonal covariance, or with the full one that an uncertain calibration needs."""
    finger = chain()
    rng = np.random.default_rng(0)
    radius = rng.uniform(0.3, 12.6, TOUCHES)
    angle = rng.uniform(-0.7, 0.7, TOUCHES)
    readings = finger.predict(radius, angle, np.full(TOUCHES, 200.0)) + rng.normal(0, 3.4, (TOUCHES, ELEMENTS))
    whitener = np.full((TOUCHES, ELEMENTS), 1 / 3.4)
    if full:
        whitener = np.stack([np.diag(row) for row in whitener])
    touches = TouchReadings(
        readings, np.ones(readings.shape, dtype=np.int64), np.full(TOUCHES, 200.0), np.ones(TOUCHES)
    )
    priors = IndenterPriors.of(finger, 200.0)
    table = ReadingTable.of(finger, *priors.location.support)
    return FingerPosterior(finger, touches, priors, whitener, table)


def series(finger: FingerChain, radius: np.ndarray, angle: np.ndarray, load: float) -> np.ndarray:
    """Readings by summing the modes, contact spectrum and all, (n, elements)."""
    from bayestouch.contact import contact_model

    modes = finger.spectra.body.modes
    strain = finger.spectra.body.radial_strain(finger.sensing_radius_mm)
    contact = contact_model("layer", (finger.core_radius_mm, finger.outer_radius_mm), finger.poisson_ratio)
    spectrum = contact.spectrum(load / 1000 * radius / finger.shear_modulus_MPa, modes)
    turn = finger.angle - angle[:, None]
    weights = np.where(modes == 0, 1.0, 2.0)
    return np.einsum("nek,ek,nk->ne", np.cos(turn[..., None] * modes), strain * weights, spectrum, optimize=True)


def best(call: Callable[[], object], number: int, repeat: int = 7) -> float:
    """Shortest time of one call, seconds."""
    return min(timeit.repeat(call, number=number, repeat=repeat)) / number


def floor(points: int) -> tuple[Callable[[], None], np.ndarray]:
    """The multiplications and additions of the log-likelihoods of so many points, and the array they write."""
    rng = np.random.default_rng(1)
    a, b = (rng.random((points, ELEMENTS), dtype=PRECISION) for _ in range(2))
    out = np.empty_like(a)

    def passes() -> None:
        # two rows of four products and sums, then residual and square: 10 fused passes over (n, elements)
        for _ in range(10):
            np.multiply(a, b, out=out)
            np.add(out, a, out=out)

    return passes, out


def main() -> dict[str, float]:
    """Print the table; returns nanoseconds per touch."""
    rng = np.random.default_rng(1)
    n = TOUCHES * WALKERS
    x = np.stack(
        [
            rng.normal(0, 1.5, (TOUCHES, WALKERS)),
            rng.uniform(-0.7, 0.7, (TOUCHES, WALKERS)),
            np.full((TOUCHES, WALKERS), 200.0),
        ],
        axis=-1,
    )
    blocks = np.arange(TOUCHES)
    plugged, full = posterior(False), posterior(True)
    plugged.log_density(x, blocks)
    full.log_density(x, blocks)
    passes, _ = floor(n)
    finger = chain()
    radius, angle = rng.uniform(0.3, 12.6, 512), rng.uniform(-0.7, 0.7, 512)
    results = {
        "tabulated, calibration plugged in": best(lambda: plugged.log_density(x, blocks), 3) / n,
        "tabulated, calibration propagated": best(lambda: full.log_density(x, blocks), 3) / n,
        "likelihood part alone, plugged in": best(lambda: plugged.residual(x, blocks), 3) / n,
        "Fourier series": best(lambda: series(finger, radius, angle, 200.0), 1) / 512,
        "floor: the same number of multiplications": best(passes, 5) / n,
    }
    results = {name: 1e9 * seconds for name, seconds in results.items()}
    lowest = results["floor: the same number of multiplications"]
    print(f"log-likelihood of one touch of {ELEMENTS} elements, one core")
    for name, nanoseconds in results.items():
        print(f"  {name:45s} {nanoseconds:9.0f} ns   {nanoseconds / lowest:7.1f} x floor")
    return results


if __name__ == "__main__":
    main()
