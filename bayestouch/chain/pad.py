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
from bayestouch.chain.kernels import Kernel, slope

# Relative step of the central difference over a kernel's parameters; the error is 1e-6 of the derivative.
_RELATIVE_STEP = 1e-4

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

    def predict(self, location: ArrayLike, load: ArrayLike) -> FloatArray:
        """Return the readings under touches at `location` (..., D) with `load` (...,); shape (..., m)."""
        return np.asarray(self.offset + np.asarray(load)[..., None] * self.sensitivity(location))

    def sensitivity_derivatives(self, location: ArrayLike) -> FloatArray:
        """Derivative of `sensitivity` with respect to `flat`, shape (..., m, d); zero for the offsets."""
        difference, distance = self._separation(location)
        m, dimensions = self.position.shape
        out = np.zeros((*distance.shape, len(self.flat)))
        own = np.arange(m)
        out[..., own, own] = self.kernel(distance, self.values)
        if len(self.values):
            fall = self.gain * slope(self.kernel, distance, self.values)
            direction = difference / np.where(distance == 0, 1.0, distance)[..., None]
            for axis in range(dimensions):
                out[..., own, (2 + axis) * m + own] = -fall * direction[..., axis]
        first = (2 + dimensions) * m
        for k, value in enumerate(self.values):
            # The minimum step is for parameters at zero (a point contact).
            step = _RELATIVE_STEP * max(abs(value), 0.1)
            up, down = self.values.copy(), self.values.copy()
            up[k], down[k] = _within(self.kernel, k, value + step), _within(self.kernel, k, value - step)
            change = self.kernel(distance, up) - self.kernel(distance, down)
            out[..., first + k] = self.gain * change / (up[k] - down[k])
        return out

    def _separation(self, location: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Vector from element to touch (..., m, D) and its length (..., m), mm."""
        difference = np.asarray(location, dtype=float)[..., None, :] - self.position
        return difference, np.sqrt((difference**2).sum(axis=-1))


def _within(kernel: Kernel, k: int, value: float) -> float:
    low, high = kernel.parameters[k].prior.support
    return float(np.clip(value, low, high))


def element_pitch(position: Sequence[Sequence[float]] | FloatArray, extent_mm: float) -> float:
    """Median distance of an element to its nearest neighbour, mm; a quarter of `extent_mm` for one element."""
    points = np.asarray(position, dtype=float)
    if len(points) < 2:
        return 0.25 * extent_mm
    distance = np.sqrt(((points[:, None] - points) ** 2).sum(axis=-1))
    np.fill_diagonal(distance, np.inf)
    nearest = float(np.median(distance.min(axis=1)))
    return nearest if nearest > 0 else 0.25 * extent_mm
