"""Laws by which the authors' approximate model may go from R to the half-width of its contact.

The paper says "squeezing and stretching a Hertz model" and prints no law. Each law here is a function of κ = P R/μ with
a few parameters on grids, each value as probable as any other; a grid's values are contact models with an elliptic
pressure.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.contact.layer import LayerContact
from nicolson_fearing.simulated_fits import WidthModel
from nicolson_fearing.squeezed_hertz import SqueezedHertz
from nicolson_fearing.table_3_effects import LAYER, SQUEEZES_MM, squeezed

FloatArray = NDArray[np.float64]

SQUEEZE, FACTOR, LESS = "squeeze (mm)", "factor", "less than the layer's (mm)"


@dataclass(frozen=True)
class NarrowerLayer:
    """The exact contact on the layer, narrower by a constant: its last row of samples lies inside of the true edge.

    Attributes
    ----------
    less_mm : float
        Taken off the half-width, mm.
    """

    less_mm: float

    def half_width(self, kappa: ArrayLike) -> FloatArray:
        """Half-width in mm, shape of `kappa` (mm²)."""
        assert isinstance(LAYER, LayerContact)
        return np.asarray(np.maximum(LAYER.half_width(kappa) - self.less_mm, 0.0))


@dataclass(frozen=True)
class WidthLaw:
    """A law with its parameters.

    Attributes
    ----------
    name : str
        In words.
    model : callable
        Contact model at values of the parameters.
    grids : mapping of str to tuple of float
        Values of each parameter.
    """

    name: str
    model: Callable[..., WidthModel]
    grids: Mapping[str, tuple[float, ...]] = field(default_factory=dict)

    @property
    def values(self) -> FloatArray:
        """All combinations of the parameters, (n, parameters)."""
        return np.array(list(product(*self.grids.values())))

    def models(self) -> list[WidthModel]:
        """Contact model at each of `values`."""
        return [self.model(*each) for each in self.values]


def _even(first: float, last: float, count: int) -> tuple[float, ...]:
    return tuple(np.linspace(first, last, count).tolist())


def _squeezed_by(factor: float, squeeze_mm: float = 0.0) -> SqueezedHertz:
    return squeezed(squeeze_mm, factor)


EXACT = WidthLaw("exact contact on the layer", lambda: LAYER)
BY_FACTOR = WidthLaw("Hertz times a factor", _squeezed_by, {FACTOR: _even(0.7, 1.1, 17)})
CONSTANT = WidthLaw("Hertz less a constant", squeezed, {SQUEEZE: SQUEEZES_MM[::2]})
LAWS = (
    EXACT,
    BY_FACTOR,
    CONSTANT,
    WidthLaw(
        "Hertz times a factor, less a constant",
        _squeezed_by,
        {FACTOR: _even(0.8, 1.2, 9), SQUEEZE: _even(0.0, 0.6, 9)},
    ),
    WidthLaw("layer less a constant", NarrowerLayer, {LESS: _even(0.0, 0.5, 11)}),
)
