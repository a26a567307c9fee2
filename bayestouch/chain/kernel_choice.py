"""Kernels of a pad by name, with priors from the stated dimensions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bayestouch.chain.kernels import (
    ConstantKernel,
    GaussianKernel,
    HalfSpaceKernel,
    Kernel,
    LayerKernel,
    length_prior,
)
from bayestouch.data.sensor import Sensor
from bayestouch.errors import unknown_name
from bayestouch.priors.parameters import LogNormal, Normal, Uniform

# Prior if the rubber is not stated, as for a finger.
_UNSTATED_POISSON = Normal(0.47, 0.03, 0.0, 0.4999)

# The elements are on the base, or their housings extend into the layer.
_UNSTATED_DEPTH = Uniform(0.3, 1.0)


def kernel_names(dimensions: int) -> tuple[str, ...]:
    """Names of the kernels for a pad of 1 or 2 dimensions."""
    line = ("layer-line", "half-space-line") if dimensions == 1 else ()
    return ("layer", "half-space", *line, "gaussian", "constant")


def kernel_for(name: str, sensor: Sensor, pitch_mm: float) -> Kernel:
    """Return the kernel with the given name, with priors from the stated dimensions of the sensor.

    Parameters
    ----------
    name : str
        One of `kernel_names`.
    sensor : Sensor
        A pad, with thickness, depth and Poisson's ratio if known.
    pitch_mm : float
        Distance between neighbouring elements.

    Raises
    ------
    InputError
        No kernel has this name.
    """
    thickness = getattr(sensor.body, "thickness_mm", None)
    depth = getattr(sensor.body, "depth_mm", None)
    sigma = sensor.rubber.poisson_ratio
    line = name.endswith("-line")
    stated = depth or thickness
    makers: dict[str, Callable[[], Kernel]] = {
        "gaussian": lambda: GaussianKernel(pitch_mm),
        "constant": ConstantKernel,
        "half-space": lambda: HalfSpaceKernel(
            pitch_mm, length_prior(0.8 * pitch_mm) if stated is None else LogNormal(stated, np.log(1.2)), line
        ),
        "layer": lambda: LayerKernel(
            pitch_mm,
            length_prior(pitch_mm) if thickness is None else LogNormal(thickness, np.log(1.2)),
            _UNSTATED_DEPTH if depth is None or thickness is None else Normal(depth / thickness, 0.05, 0.1, 1.0),
            _UNSTATED_POISSON if sigma is None else Normal(sigma, 0.02, 0.0, 0.4999),
            line,
        ),
    }
    maker = makers.get(name.removesuffix("-line"))
    if maker is None or (line and name not in kernel_names(1)):
        raise unknown_name("kernel", name, kernel_names(1))
    return maker()
