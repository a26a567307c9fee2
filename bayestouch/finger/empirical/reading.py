"""Table of readings of a finger with an identified E map."""

from __future__ import annotations

import numpy as np

from bayestouch.chain.empirical import EmpiricalFingerChain
from bayestouch.finger.reading.reading_table import ANGLES, ReadingTable


def reading_table(chain: EmpiricalFingerChain, low: float, high: float) -> ReadingTable:
    """Table of a finger with an identified E map, for θ_c from `low` to `high`, rad; as `ReadingTable.of`."""
    step = 2 * np.pi / ANGLES
    first, last = int(np.floor(low / step)) - 1, int(np.ceil(high / step)) + 1
    columns = np.arange(first, last + 1) % ANGLES
    knots = chain.spectra.spectra[:, : chain.n_coefficients + 1]
    rows = np.empty((len(knots), len(columns), chain.n_elements), dtype=np.float32)
    for e, weights in enumerate(chain.mode_weights):
        # The weights are for -θ_c, a real inverse transform is a sum over +θ_c: therefore the conjugate.
        around = np.fft.irfft(weights.conj() * knots, n=ANGLES) * ANGLES
        rows[:, :, e] = around[:, columns]
    coordinates = chain.spectra.coordinates
    return ReadingTable(
        kappa_scale=chain.spectra.kappa_scale,
        kappa_first=float(coordinates[0]),
        kappa_step=float(coordinates[1] - coordinates[0]),
        angle_first=first * step,
        angle_step=step,
        shape=(rows.shape[0], rows.shape[1]),
        rows=rows.reshape(-1, chain.n_elements),
    )
