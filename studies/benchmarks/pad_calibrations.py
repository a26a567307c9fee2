"""How well emcee draws the calibrations of the measured pads, and where the normal approximation is another one.

    python studies/benchmarks/pad_calibrations.py [NAME ...]

Prints a row of the table in docs/statistics.md for each pad: processor time of all chains, and the standard deviation
of the draws of each parameter over that of the normal approximation.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from _processor import processor_seconds

from bayestouch import load_dataset
from bayestouch.data.sensor import pad_of
from bayestouch.pad.calibration import choose_pad
from bayestouch.pad.density import PadDensity
from bayestouch.pad.sampling import sample_density
from bayestouch.pad.start import fit_without_effects

NAMES = ("array8-soft", "baro-line", "fluid-oil-1.5")


def main(names: tuple[str, ...]) -> None:
    """Print the table."""
    shared = Path(os.environ.get("BAYESTOUCH_SHARED", Path(__file__).parents[3] / "shared"))
    print("| pad | unknowns | accepted | bulk ESS of 1,000 | R-hat | time | sd over that of the normal approximation |")
    print("|---|---|---|---|---|---|---|")
    for name in names:
        dataset = load_dataset(shared / "measured" / name)
        chosen = choose_pad(dataset, kernel="auto")
        begun = processor_seconds()
        density = PadDensity.of(fit_without_effects(chosen.problem, chosen.model, pad_of(dataset.sensor)))
        drawn = sample_density(density, draws=1000, seed=0)
        seconds = processor_seconds() - begun
        ratio = drawn.draws[:, :, 0].reshape(-1, len(density.names)).std(axis=0) / np.sqrt(np.diag(density.covariance))
        at_bound = np.min(np.abs(density.mode - np.array(density.bounds)), axis=0) < 1e-6
        bound = ", ".join(f"{density.names[i]} {ratio[i]:.2f}" for i in np.flatnonzero(at_bound))
        print(
            f"| `{name}`, {chosen.problem.known.n_touches:,} touches | {len(ratio)} | {drawn.acceptance[0]:.2f} "
            f"| {drawn.ess_bulk.min():.0f} | {drawn.rhat.max():.3f} | {seconds:.1f} s "
            f"| {ratio[~at_bound].min():.2f} to {ratio[~at_bound].max():.2f}"
            f"{'; at a bound: ' + bound if bound else ''} |",
            flush=True,
        )


if __name__ == "__main__":
    main(tuple(sys.argv[1:]) or NAMES)
