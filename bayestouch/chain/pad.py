"""The measuring chain of a flat pad: readings from touches.

    reading_e = offset_e + P gain_e K(|location - position_e|)

P is the load in N if it is measured; otherwise it is relative to the load of the calibration (unit 1).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.chain.kernels import Kernel, derivatives

#: Names of the coordinates of a location.
COORDINATES = ("x", "y")


@dataclass(frozen=True, eq=False)
class PadChain:
    """A pad with a value for every calibration parameter; m elements, D coordinates.

    Attributes
    ----------
    kernel : Kernel
        Response over distance.
    values : (k,) array
        Parameters of the kernel, the same for all elements.
    gain : (m,) array
        Reading per unit load directly above the element.
    offset : (m,) array
        Reading without touch.
    position : (m, D) array
        Positions of the elements, mm, in the coordinates of the touches.
    """

    kernel: Kernel
    values: FloatArray
    gain: FloatArray
    offset: FloatArray
    position: FloatArray

    @property
    def n_elements(self) -> int:
        """Number of elements."""
        return len(self.gain)

    @property
    def flat(self) -> FloatArray:
        """All parameters in the order of `layout`, shape (d,)."""
        return np.concatenate([self.gain, self.offset, self.position.T.ravel(), self.values])

    @property
    def layout(self) -> tuple[str, ...]:
        """Names of the entries of `flat`: gain[0] …, offset[0] …, x_s[0] …, then those of the kernel."""
        names = ("gain", "offset", *(f"{axis}_s" for axis in COORDINATES[: self.position.shape[1]]))
        by_element = [f"{name}[{e}]" for name in names for e in range(self.n_elements)]
        return (*by_element, *(parameter.name for parameter in self.kernel.parameters))

    def with_flat(self, flat: FloatArray) -> PadChain:
        """Return the pad with other values, in the order of `layout`."""
        m, dimensions = self.position.shape
        gain, offset, position, values = np.split(flat, [m, 2 * m, (2 + dimensions) * m])
        return PadChain(self.kernel, values, gain, offset, position.reshape(dimensions, m).T)

    def sensitivity(self, location: ArrayLike) -> FloatArray:
        """Return the reading per unit load, without the offset.

        Parameters
        ----------
        location : (..., D) array_like
            Location of the touch, mm.

        Returns
        -------
        (..., m) array
        """
        return np.asarray(self.gain * self.kernel(self._separation(location)[1], self.values))

    def sensitivities(self, flats: FloatArray, location: FloatArray) -> FloatArray:
        """Return the `sensitivity` of pads with other values, all together.

        Parameters
        ----------
        flats : (n, d) array
            Values of each pad, in the order of `layout`.
        location : (u, D) array
            Locations of touches, mm.

        Returns
        -------
        (n, u, m) array
        """
        m, dimensions = self.position.shape
        gain, _, position, values = np.split(flats, [m, 2 * m, (2 + dimensions) * m], axis=1)
        axes = position.reshape(-1, dimensions, 1, m)
        square = sum((location[:, axis, None] - axes[:, axis]) ** 2 for axis in range(dimensions))
        return np.asarray(gain[:, None] * self.kernel(np.sqrt(square), values))

    def predict(self, location: ArrayLike, load: ArrayLike) -> FloatArray:
        """Return the readings under touches at `location` (..., D) with `load` (...,); shape (..., m)."""
        return np.asarray(self.offset + np.asarray(load)[..., None] * self.sensitivity(location))

    def sensitivity_derivatives(self, location: ArrayLike) -> FloatArray:
        """Derivative of `sensitivity` with respect to `flat`, shape (..., m, d); zero for the offsets."""
        difference, distance = self._separation(location)
        m, dimensions = self.position.shape
        out = np.zeros((*distance.shape, len(self.flat)))
        own = np.arange(m)
        found = derivatives(self.kernel, distance, self.values)
        out[..., own, own] = found.value
        fall = self.gain * found.over_distance
        direction = difference / np.where(distance == 0, 1.0, distance)[..., None]
        for axis in range(dimensions):
            out[..., own, (2 + axis) * m + own] = -fall * direction[..., axis]
        for k, slope in enumerate(found.over_values):
            out[..., (2 + dimensions) * m + k] = self.gain * slope
        return out

    def _separation(self, location: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Vector from element to touch (..., m, D) and its length (..., m), mm."""
        difference = np.asarray(location, dtype=float)[..., None, :] - self.position
        return difference, np.sqrt((difference**2).sum(axis=-1))


def element_pitch(position: Sequence[Sequence[float]] | FloatArray, extent_mm: float) -> float:
    """Median distance of an element to its nearest neighbour, mm; a quarter of `extent_mm` for one element."""
    points = np.asarray(position, dtype=float)
    if len(points) < 2:
        return 0.25 * extent_mm
    distance = np.sqrt(((points[:, None] - points) ** 2).sum(axis=-1))
    np.fill_diagonal(distance, np.inf)
    nearest = float(np.median(distance.min(axis=1)))
    return nearest if nearest > 0 else 0.25 * extent_mm
