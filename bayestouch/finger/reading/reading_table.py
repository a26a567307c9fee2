"""Table of the readings of all elements over contact width and contact location.

For a calibrated sensor, readings per N/m depend only on κ = P R/μ and on the contact location θ_c. A row of the table
has the readings of all elements, so that one lookup gives a whole touch.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.chain.empirical import EmpiricalFingerChain
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.response import ContactSpectra

# Number of angles per turn. A peak is about 4° wide; the error of linear interpolation over 0.09° is below 1e-4 of it.
ANGLES = 4096


@dataclass(frozen=True, eq=False)
class ReadingTable:
    """Readings per N/m on a grid of ``log(1 + κ/κ_s)`` and θ_c, with bilinear interpolation.

    Attributes
    ----------
    kappa_scale, kappa_first, kappa_step : float
        ``κ_s`` in mm², first knot and spacing of ``log(1 + κ/κ_s)``.
    angle_first, angle_step : float
        First θ_c and spacing, rad.
    shape : (int, int)
        Number of knots in κ and in θ_c.
    rows : (n_kappa * n_angles, m) float32 array
        Readings per N/m; seven digits are enough, since the noise is in the fourth or larger.
    """

    kappa_scale: float
    kappa_first: float
    kappa_step: float
    angle_first: float
    angle_step: float
    shape: tuple[int, int]
    rows: NDArray[np.float32]

    @classmethod
    def of(cls, chain: FingerChain, low: float, high: float) -> ReadingTable:
        """Table of an elastic finger for θ_c from `low` to `high`, rad."""
        # The angle from touch to element decreases with the contact location: therefore the conjugate.
        strain = chain.mode_strain.conj()
        peak = strain[:, :1].real + 2 * strain[:, 1:].real.sum(axis=1, keepdims=True)
        turn = np.exp(-1j * chain.spectra.body.modes * chain.angle[:, None])
        return cls._of_modes(chain.spectra, strain / peak * turn * chain.response[:, None], low, high)

    @classmethod
    def of_map(cls, chain: EmpiricalFingerChain, low: float, high: float) -> ReadingTable:
        """Table of a finger with an identified E map for θ_c from `low` to `high`, rad."""
        # The weights are for -θ_c, a real inverse transform is a sum over +θ_c: therefore the conjugate.
        return cls._of_modes(chain.spectra, chain.mode_weights.conj(), low, high)

    @classmethod
    def _of_modes(
        cls, spectra: ContactSpectra, weights: NDArray[np.complex128], low: float, high: float
    ) -> ReadingTable:
        """Table of elements that read Fourier modes of the pressure with weights (m, k)."""
        step = 2 * np.pi / ANGLES
        first, last = int(np.floor(low / step)) - 1, int(np.ceil(high / step)) + 1
        columns = np.arange(first, last + 1) % ANGLES
        coordinates, knots = spectra.coordinates, spectra.spectra[:, : weights.shape[1]]
        rows = np.empty((len(coordinates), len(columns), len(weights)), dtype=np.float32)
        for e, weight in enumerate(weights):
            around = np.fft.irfft(weight * knots, n=ANGLES) * ANGLES
            rows[:, :, e] = around[:, columns]
        return cls(
            kappa_scale=spectra.kappa_scale,
            kappa_first=float(coordinates[0]),
            kappa_step=float(coordinates[1] - coordinates[0]),
            angle_first=first * step,
            angle_step=step,
            shape=(rows.shape[0], rows.shape[1]),
            rows=rows.reshape(-1, len(weights)),
        )

    def __call__(self, kappa: FloatArray, angle: FloatArray) -> NDArray[np.float32]:
        """Readings per N/m, (n, m), for κ (mm²) and θ_c (rad), both (n,); beyond the table its limits are used."""
        n_kappa, n_angles = self.shape
        across = (np.log1p(kappa / self.kappa_scale) - self.kappa_first) / self.kappa_step
        along = (angle - self.angle_first) / self.angle_step
        # `np.clip` has four times the overhead, which counts where one touch is read at a time.
        np.minimum(np.maximum(across, 0.0, out=across), n_kappa - 1.001, out=across)
        np.minimum(np.maximum(along, 0.0, out=along), n_angles - 1.001, out=along)
        row = across.astype(np.int64)
        column = along.astype(np.int64)
        s = (across - row).astype(np.float32)[:, None]
        t = (along - column).astype(np.float32)[:, None]
        place = row * n_angles + column
        lower = _between(self.rows, place, t)
        upper = _between(self.rows, place + n_angles, t)
        upper -= lower
        upper *= s
        upper += lower
        return upper


def _between(rows: NDArray[np.float32], place: NDArray[np.int64], t: NDArray[np.float32]) -> NDArray[np.float32]:
    """Linear interpolation between neighbouring rows."""
    left = rows.take(place, axis=0)
    right = rows.take(place + 1, axis=0)
    right -= left
    right *= t
    right += left
    return right
