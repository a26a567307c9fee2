"""How the response of a pad's element falls off with the distance of the touch: kernels, 1 at zero distance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.body.layer import (
    half_space_kernel_1d,
    half_space_kernel_2d,
    layer_kernel_1d,
    layer_kernel_2d,
)
from bayestouch.priors.parameters import LogNormal, Normal, Parameter, Prior

# Central difference of a kernel over distance, mm: kernels vary over millimetres, so that the error is 1e-8.
_STEP_MM = 1e-4

# A contact is smaller than the pitch it is to be located within; the prior's scale in mm where nothing is known.
_CONTACT_MM = 2.0


class Kernel(Protocol):
    """Shape of an element's response; ``values`` are its parameters in the order of `parameters`."""

    @property
    def name(self) -> str:
        """Name in settings."""
        ...

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Its unknowns, shared by all elements."""
        ...

    @property
    def starts(self) -> tuple[tuple[float, ...], ...]:
        """Values from which a fit may start."""
        ...

    def __call__(self, distance_mm: FloatArray, values: FloatArray) -> FloatArray:
        """Response over that at zero distance, shape of `distance_mm`."""
        ...


def slope(kernel: Kernel, distance_mm: FloatArray, values: FloatArray) -> FloatArray:
    """Derivative of a kernel over distance, 1/mm; shape of `distance_mm`."""
    up, down = (kernel(np.abs(distance_mm + step), values) for step in (_STEP_MM, -_STEP_MM))
    return np.asarray((up - down) / (2 * _STEP_MM))


@dataclass(frozen=True)
class GaussianKernel:
    """``exp(-ρ²/2w²)``: no physics, nothing negative.

    Attributes
    ----------
    pitch_mm : float
        Distance between neighbouring elements; centres the prior of w.
    """

    pitch_mm: float
    name: ClassVar[str] = "gaussian"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("w", "w", "w", "mm", length_prior(0.5 * self.pitch_mm), "width of the kernel"),)

    @property
    def starts(self) -> tuple[tuple[float, ...], ...]:
        return tuple((share * self.pitch_mm,) for share in (0.25, 0.5, 1.0))

    def __call__(self, distance_mm: FloatArray, values: FloatArray) -> FloatArray:
        return np.asarray(np.exp(-0.5 * (distance_mm / values[0]) ** 2))


@dataclass(frozen=True)
class HalfSpaceKernel:
    """Normal stress at depth z in a half-space under a Hertz pressure of half-width a.

    Attributes
    ----------
    pitch_mm : float
        Distance between neighbouring elements; centres the prior of z where no depth is stated.
    depth : Prior
        Prior of z, mm.
    line : bool
        The load is long across the line of elements (plane strain), rather than a disc.
    """

    pitch_mm: float
    depth: Prior
    line: bool = False

    @property
    def name(self) -> str:
        return "half-space-line" if self.line else "half-space"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (
            Parameter("z", "z", "z", "mm", self.depth, "depth of the elements in the half-space"),
            _contact_parameter(),
        )

    @property
    def starts(self) -> tuple[tuple[float, ...], ...]:
        # a = z would start where z and a can hardly be distinguished; a small contact can still grow.
        return tuple((share * self.pitch_mm, 0.2 * share * self.pitch_mm) for share in (0.4, 0.8, 1.6))

    def __call__(self, distance_mm: FloatArray, values: FloatArray) -> FloatArray:
        depth, contact = float(values[0]), float(values[1])
        kernel = half_space_kernel_1d if self.line else half_space_kernel_2d
        return kernel(distance_mm, depth, contact) / kernel(0.0, depth, contact)


@dataclass(frozen=True)
class LayerKernel:
    """Normal stress in a bonded elastic layer, at its base or somewhat above it.

    At the base the stress falls to zero without changing sign; above it (a sensor on a board has a height) a shallow
    negative ring surrounds the touch, deeper the more nearly the rubber is incompressible.

    Attributes
    ----------
    pitch_mm : float
        Distance between neighbouring elements.
    thickness : Prior
        Prior of h, mm.
    depth_share : Prior
        Prior of the elements' depth over the thickness; 1 at the base.
    poisson_ratio : Prior
        Prior of σ.
    line : bool
        The load is long across the line of elements (plane strain), rather than a disc.
    """

    pitch_mm: float
    thickness: Prior
    depth_share: Prior
    poisson_ratio: Prior
    line: bool = False

    @property
    def name(self) -> str:
        return "layer-line" if self.line else "layer"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (
            Parameter("h", "h", "h", "mm", self.thickness, "thickness of the layer"),
            Parameter("depth_share", "z/h", "z/h", "", self.depth_share, "depth of the elements over thickness"),
            Parameter("sigma", "σ", r"\sigma", "", self.poisson_ratio, "Poisson's ratio of the rubber"),
            _contact_parameter(),
        )

    @property
    def starts(self) -> tuple[tuple[float, ...], ...]:
        sigma, depth = _inside(self.poisson_ratio, 0.48), _inside(self.depth_share, 0.9)
        shares = (0.5, 1.0, 2.0)
        return tuple((share * self.pitch_mm, depth, sigma, 0.2 * share * self.pitch_mm) for share in shares)

    def __call__(self, distance_mm: FloatArray, values: FloatArray) -> FloatArray:
        thickness, share, sigma, contact = (float(value) for value in values)
        kernel = layer_kernel_1d if self.line else layer_kernel_2d
        # One call for both: the layer's table is made once for its parameters.
        stress = kernel(np.append(distance_mm.ravel(), 0.0), thickness, sigma, contact, share * thickness)
        return np.asarray(stress[:-1].reshape(distance_mm.shape) / stress[-1])


@dataclass(frozen=True)
class ConstantKernel:
    """1 everywhere: no model of location, for bodies whose response an empirical map must find."""

    name: ClassVar[str] = "constant"
    parameters: ClassVar[tuple[Parameter, ...]] = ()
    starts: ClassVar[tuple[tuple[float, ...], ...]] = ((),)

    def __call__(self, distance_mm: FloatArray, values: FloatArray) -> FloatArray:
        return np.ones_like(distance_mm)


def _inside(prior: Prior, wanted: float) -> float:
    """The value wanted, moved off the ends of a prior, where a fit could not start."""
    low, high = prior.support
    return float(np.clip(wanted, low + 0.05 * (high - low), high - 0.02 * (high - low)))


def length_prior(median_mm: float) -> LogNormal:
    """Prior of a length of which only the scale is known: within a factor of two, two times out of three."""
    return LogNormal(median_mm, float(np.log(2)))


def _contact_parameter() -> Parameter:
    prior = Normal(0.0, _CONTACT_MM, 0.0)
    return Parameter("a", "a", "a", "mm", prior, "half-width of the contact")
