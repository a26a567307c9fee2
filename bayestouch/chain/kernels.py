"""How the response of a pad's element falls off with the distance of the touch: kernels, 1 at zero distance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from bayestouch.body.layer import (
    half_space_kernel_1d,
    half_space_kernel_2d,
    layer_kernel_1d,
    layer_kernel_2d,
)
from bayestouch.errors import InputError
from bayestouch.parameters import LogNormal, Normal, Parameter, Prior, Uniform
from bayestouch.sensor import Sensor

FloatArray = NDArray[np.float64]

# Central difference of a kernel over distance, mm: kernels vary over millimetres, so that the error is 1e-8.
_STEP_MM = 1e-4

# A contact is smaller than the pitch it is to be located within; the prior's scale in mm where nothing is known.
_CONTACT_MM = 2.0

# Silicone is nearly incompressible; with nothing stated the prior reaches down to foams.
_UNSTATED_POISSON = Uniform(0.2, 0.4999)


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
        return (Parameter("w", "w", "w", "mm", _length(0.5 * self.pitch_mm), "width of the kernel"),)

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
        # a = z would start where z and a can hardly be told apart; a small contact can still grow.
        return tuple((share * self.pitch_mm, 0.2 * share * self.pitch_mm) for share in (0.4, 0.8, 1.6))

    def __call__(self, distance_mm: FloatArray, values: FloatArray) -> FloatArray:
        depth, contact = float(values[0]), float(values[1])
        kernel = half_space_kernel_1d if self.line else half_space_kernel_2d
        return kernel(distance_mm, depth, contact) / kernel(0.0, depth, contact)


@dataclass(frozen=True)
class LayerKernel:
    """Normal stress at the base (or at a share of the thickness) of a bonded elastic layer.

    Attributes
    ----------
    pitch_mm : float
        Distance between neighbouring elements.
    thickness : Prior
        Prior of h, mm.
    poisson_ratio : Prior
        Prior of σ.
    depth_share : float
        Depth of the elements over the thickness; 1 at the base.
    line : bool
        The load is long across the line of elements (plane strain), rather than a disc.
    """

    pitch_mm: float
    thickness: Prior
    poisson_ratio: Prior
    depth_share: float = 1.0
    line: bool = False

    @property
    def name(self) -> str:
        return "layer-line" if self.line else "layer"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (
            Parameter("h", "h", "h", "mm", self.thickness, "thickness of the layer"),
            Parameter("sigma", "σ", r"\sigma", "", self.poisson_ratio, "Poisson's ratio of the rubber"),
            _contact_parameter(),
        )

    @property
    def starts(self) -> tuple[tuple[float, ...], ...]:
        low, high = self.poisson_ratio.support
        sigma = float(np.clip(0.48, low + 0.1 * (high - low), high - 0.02 * (high - low)))
        return tuple(
            (share * self.pitch_mm, sigma, 0.2 * share * self.pitch_mm) for share in (0.5, 1.0, 2.0)
        )

    def __call__(self, distance_mm: FloatArray, values: FloatArray) -> FloatArray:
        thickness, sigma, contact = (float(value) for value in values)
        kernel = layer_kernel_1d if self.line else layer_kernel_2d
        depth = self.depth_share * thickness
        # One call, so that the layer's table (kept for the last parameters only) is made once.
        stress = kernel(np.append(distance_mm.ravel(), 0.0), thickness, sigma, contact, depth)
        return np.asarray(stress[:-1].reshape(distance_mm.shape) / stress[-1])


@dataclass(frozen=True)
class ConstantKernel:
    """1 everywhere: no model of location, for bodies whose response an empirical map must find."""

    name: ClassVar[str] = "constant"
    parameters: ClassVar[tuple[Parameter, ...]] = ()
    starts: ClassVar[tuple[tuple[float, ...], ...]] = ((),)

    def __call__(self, distance_mm: FloatArray, values: FloatArray) -> FloatArray:
        return np.ones_like(distance_mm)


def kernel_names(dimensions: int) -> tuple[str, ...]:
    """Kernels that a pad of 1 or 2 dimensions may have."""
    line = ("layer-line", "half-space-line") if dimensions == 1 else ()
    return ("layer", "half-space", *line, "gaussian", "constant")


def kernel_for(name: str, sensor: Sensor, pitch_mm: float) -> Kernel:
    """Kernel by name with priors from what is stated of the sensor.

    Parameters
    ----------
    name : str
        One of `kernel_names`.
    sensor : Sensor
        A pad, with thickness, depth and Poisson's ratio where they are known.
    pitch_mm : float
        Distance between neighbouring elements.

    Raises
    ------
    InputError
        There is no such kernel.
    """
    thickness = getattr(sensor.body, "thickness_mm", None)
    depth = getattr(sensor.body, "depth_mm", None)
    sigma = sensor.rubber.poisson_ratio
    stated = _length(0.8 * pitch_mm) if depth is None and thickness is None else None
    share = depth / thickness if depth is not None and thickness is not None else 1.0
    line = name.endswith("-line")
    makers: dict[str, Callable[[], Kernel]] = {
        "gaussian": lambda: GaussianKernel(pitch_mm),
        "constant": ConstantKernel,
        "half-space": lambda: HalfSpaceKernel(
            pitch_mm, stated or LogNormal(float(depth or thickness or 1.0), np.log(1.2)), line
        ),
        "layer": lambda: LayerKernel(
            pitch_mm,
            _length(pitch_mm) if thickness is None else LogNormal(thickness, np.log(1.2)),
            _UNSTATED_POISSON if sigma is None else Normal(sigma, 0.02, 0.0, 0.4999),
            share,
            line,
        ),
    }
    maker = makers.get(name.removesuffix("-line"))
    if maker is None or (line and name not in kernel_names(1)):
        raise InputError(f"expected a kernel among {', '.join(kernel_names(1))}, got {name!r}")
    return maker()


def _length(median_mm: float) -> LogNormal:
    """Prior of a length of which only the scale is known: within a factor of two, two times out of three."""
    return LogNormal(median_mm, float(np.log(2)))


def _contact_parameter() -> Parameter:
    prior = Normal(0.0, _CONTACT_MM, 0.0)
    return Parameter("a", "a", "a", "mm", prior, "half-width of the contact")
