"""Kernels: response of a pad's element over the distance of the touch, 1 at zero distance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Protocol

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.body.layer import (
    half_space_kernel_1d,
    half_space_kernel_2d,
    layer_kernel_1d,
    layer_kernel_2d,
    over_first,
)
from bayestouch.priors.parameters import LogNormal, Normal, Parameter, Prior

# Step of the central difference over distance, mm. Kernels vary over millimetres, so that the error is 1e-8.
_STEP_MM = 1e-4

# Relative step of the central difference over a kernel's parameters; the error is 1e-6 of the derivative.
_RELATIVE_STEP = 1e-4
# Scale of the prior of the contact half-width, mm: a contact is usually smaller than the pitch.
_CONTACT_MM = 2.0


class Kernel(Protocol):
    """Protocol of the shape of an element's response; ``values`` are in the order of `parameters`.

    The values of several kernels may be given at once, as an array (n, k): the distances then have n as their first
    axis.
    """

    @property
    def name(self) -> str:
        """Name of the kernel in settings."""
        ...

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of the kernel, the same for all elements."""
        ...

    @property
    def starts(self) -> tuple[tuple[float, ...], ...]:
        """Starting values for a fit."""
        ...

    def __call__(self, distance_mm: FloatArray, values: FloatArray) -> FloatArray:
        """Return the response relative to that at zero distance, shape of `distance_mm`."""
        ...


@dataclass(frozen=True)
class KernelDerivatives:
    """A kernel at distances of some shape, with its derivatives.

    Attributes
    ----------
    value : array
        The kernel.
    over_distance : array
        Its derivative over the distance, 1/mm.
    over_values : tuple of arrays
        Its derivative over each of its parameters.
    """

    value: FloatArray
    over_distance: FloatArray
    over_values: tuple[FloatArray, ...]


def derivatives(kernel: Kernel, distance_mm: FloatArray, values: FloatArray) -> KernelDerivatives:
    """A kernel with values (k,) and its derivatives, by central differences: all of them in one call."""
    up, down = (np.tile(values, (len(values), 1)) for _ in range(2))
    for i, (parameter, value) in enumerate(zip(kernel.parameters, values, strict=True)):
        # The minimum step is for parameters at zero (a point contact).
        step = _RELATIVE_STEP * max(abs(value), 0.1)
        up[i, i], down[i, i] = np.clip([value + step, value - step], *parameter.prior.support)
    distances = (distance_mm, np.abs(distance_mm + _STEP_MM), np.abs(distance_mm - _STEP_MM))
    found = kernel(
        np.stack([*distances, *[distance_mm] * (2 * len(values))]), np.concatenate([np.tile(values, (3, 1)), up, down])
    )
    of_values = zip(found[3 : 3 + len(values)], found[3 + len(values) :], np.diag(up - down), strict=True)
    return KernelDerivatives(
        found[0],
        (found[1] - found[2]) / (2 * _STEP_MM),
        tuple((above - below) / width for above, below, width in of_values),
    )


def _of_each(values: FloatArray, distance_mm: FloatArray) -> tuple[FloatArray, ...]:
    """Each of the parameters, from values (k,), or from (n, k) in a shape that broadcasts with distances (n, ...)."""
    return tuple(over_first(each, distance_mm) if each.ndim else each for each in values.T)


@dataclass(frozen=True)
class GaussianKernel:
    """Gaussian kernel ``exp(-ρ²/2w²)``: no physical model, never negative.

    Attributes
    ----------
    pitch_mm : float
        Distance between neighbouring elements; determines the median of the prior of w.
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
        (width,) = _of_each(values, distance_mm)
        return np.asarray(np.exp(-0.5 * (distance_mm / width) ** 2))


@dataclass(frozen=True)
class HalfSpaceKernel:
    """Kernel of the normal stress at depth z in a half-space under a Hertz pressure of half-width a.

    Attributes
    ----------
    pitch_mm : float
        Distance between neighbouring elements; determines the starting values.
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
        # At a = z a fit can hardly distinguish z from a; therefore it starts at a small contact, which can grow.
        return tuple((share * self.pitch_mm, 0.2 * share * self.pitch_mm) for share in (0.4, 0.8, 1.6))

    def __call__(self, distance_mm: FloatArray, values: FloatArray) -> FloatArray:
        depth, contact = _of_each(values, distance_mm)
        kernel = half_space_kernel_1d if self.line else half_space_kernel_2d
        return kernel(distance_mm, depth, contact) / kernel(0.0, depth, contact)


@dataclass(frozen=True)
class LayerKernel:
    """Kernel of the normal stress in a bonded elastic layer, at its base or a little above it.

    At the base the stress falls to zero without a change of sign. Above the base (a sensor on a board has a height) a
    weak negative ring surrounds the touch; it is stronger if the rubber is almost incompressible.

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
        thickness, share, sigma, contact = values.T
        kernel = layer_kernel_1d if self.line else layer_kernel_2d
        # One call for both, so that the table of a layer is computed once.
        flat = distance_mm.reshape(*values.shape[:-1], -1)
        flat = np.concatenate([flat, np.zeros((*values.shape[:-1], 1))], axis=-1)
        stress = kernel(flat, thickness, sigma, contact, share * thickness)
        return np.asarray((stress[..., :-1] / stress[..., -1:]).reshape(distance_mm.shape))


@dataclass(frozen=True)
class ConstantKernel:
    """Kernel that is 1 everywhere, for bodies whose response over location an empirical map must describe."""

    name: ClassVar[str] = "constant"
    parameters: ClassVar[tuple[Parameter, ...]] = ()
    starts: ClassVar[tuple[tuple[float, ...], ...]] = ((),)

    def __call__(self, distance_mm: FloatArray, values: FloatArray) -> FloatArray:
        return np.ones_like(distance_mm)


@dataclass(frozen=True, eq=False)
class KernelWithPriors:
    """A kernel with stated priors.

    Attributes
    ----------
    kernel : Kernel
        The kernel with its default priors.
    stated : mapping of str to Prior
        Priors that replace the default ones, by name of the parameter; names that the kernel does not have are ignored.
    """

    kernel: Kernel
    stated: Mapping[str, Prior]

    @property
    def name(self) -> str:
        return self.kernel.name

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(replace(each, prior=self.stated.get(each.name, each.prior)) for each in self.kernel.parameters)

    @property
    def starts(self) -> tuple[tuple[float, ...], ...]:
        return tuple(
            tuple(self._near(each.name, value) for each, value in zip(self.kernel.parameters, start, strict=True))
            for start in self.kernel.starts
        )

    def _near(self, name: str, value: float) -> float:
        """The starting value, moved into the middle 95 % of a stated prior: a fit from far away may not arrive."""
        if name not in self.stated:
            return value
        low, high = self.stated[name].quantile([0.025, 0.975])
        return float(np.clip(value, low, high))

    def __call__(self, distance_mm: FloatArray, values: FloatArray) -> FloatArray:
        return self.kernel(distance_mm, values)


def _inside(prior: Prior, wanted: float) -> float:
    """The wanted value, moved away from the ends of a prior, where a fit could not start."""
    low, high = prior.support
    return float(np.clip(wanted, low + 0.05 * (high - low), high - 0.02 * (high - low)))


def length_prior(median_mm: float) -> LogNormal:
    """Return the prior of a length with a known scale only: within a factor of 2 with a probability of 68 %."""
    return LogNormal(median_mm, float(np.log(2)))


def _contact_parameter() -> Parameter:
    prior = Normal(0.0, _CONTACT_MM, 0.0)
    return Parameter("a", "a", "a", "mm", prior, "half-width of the contact")
