"""Model-fitted E map, one element at a time: section 3.1 and Table 1 of the paper.

For each element the simplex method of Nelder and Mead minimises the squared error over Poisson's ratio, sensing
radius and angle, with the gain solved linearly at every step.

The criterion as printed, ``Σ (G D - ε̂)²``, does not identify these parameters: with the best G it is ``|ε̂|²``
times the squared sine of the angle between readings and model. It goes to zero with the strain itself if the element
approaches the core of an incompressible rubber. This module minimises the squared sine: the squared error of the
readings, ``Σ (D - ε̂/G)²``, divided by ``Σ D²``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.arrays import turned
from bayestouch.data.averages import TouchMeans
from bayestouch.data.sensor import Sensor, finger_of
from bayestouch.errors import InputError
from bayestouch.paper.simplex.pressure import KnownPressure, shallowest_radius

WINDOW_DEG = 50.0
"""Range of touches about an element in the paper, degree."""
LARGEST_POISSON_RATIO = 0.4999
# Step of the first simplex, and unit of its size in the convergence criterion.
STEPS = np.array([0.02, 0.1, 1.0])  # σ, r_s (mm), θ_s (degree)
FEWEST_TOUCHES = 6  # the fit has four unknowns


@dataclass(frozen=True)
class ElementFit:
    """Fit of one element.

    Attributes
    ----------
    element : int
        Number of the element, from 0.
    poisson_ratio, sensing_radius_mm, angle_deg : float
        σ, r_s, θ_s.
    gain : float
        Reading per unit of compressive strain, ``1/G_ii``.
    error_percent_peak : float
        Root mean square of reading minus fit in % of the peak: the fitted reading directly under a knife edge with
        the mean load.
    noise_percent_peak : float
        Standard deviation of one reading in the same unit; NaN without repeated readings.
    n_touches : int
        Number of touches in the fit.
    converged : bool
        Whether the simplex reached the convergence criterion.
    """

    element: int
    poisson_ratio: float
    sensing_radius_mm: float
    angle_deg: float
    gain: float
    error_percent_peak: float
    noise_percent_peak: float
    n_touches: int
    converged: bool


def fit_element(
    means: TouchMeans,
    sensor: Sensor,
    element: int,
    shear_modulus_MPa: float,
    *,
    contact: str | None = None,
    pressure: KnownPressure | None = None,
) -> ElementFit:
    """Return the fit of σ, r_s, θ_s and gain of one element to the touches around it.

    Parameters
    ----------
    means : TouchMeans
        Averaged touches with the no-contact reading subtracted.
    sensor : Sensor
        A finger.
    element : int
        Number of the element, from 0.
    shear_modulus_MPa : float
        μ; it only scales the gain if all touches are knife edges.
    contact : str, optional
        Contact model (`bayestouch.contact.CONTACT_MODELS`) to fit flats and round tips too. By default only
        knife edges are fitted, which need no contact model.
    pressure : KnownPressure, optional
        Pressures of these touches, if already computed; they are the same for all elements.

    Raises
    ------
    InputError
        If too few touches are near the element, or it reads zero under all of them.
    """
    from scipy.optimize import minimize

    finger = finger_of(sensor, "the simplex fit of Table 1")
    pressure = pressure or KnownPressure.of(means, finger, shear_modulus_MPa, contact)
    readings = means.readings[pressure.rows, element]
    design = finger.element_angles_deg[element]
    off = turned(pressure.angle_deg - design)
    near = (np.abs(off) <= WINDOW_DEG / 2) & np.isfinite(readings)
    if near.sum() < FEWEST_TOUCHES:
        raise InputError(
            f"element e{element + 1:02d} has {near.sum()} known touches within {WINDOW_DEG / 2:g} degrees; "
            f"expected at least {FEWEST_TOUCHES}"
        )
    data = readings[near]
    if not data.any():
        raise InputError(f"element e{element + 1:02d} reads zero under all touches: it is not connected, or stuck")
    strain = pressure.strain(near)

    def misfit(x: FloatArray) -> float:
        model = strain(*(x * STEPS))
        power = float(model @ model)
        return 1.0 if power == 0 else 1 - float(data @ model) ** 2 / (power * float(data @ data))

    # The number of modes is sufficient up to this radius, and the strain is zero at the core.
    thickness = finger.outer_radius_mm - finger.core_radius_mm
    depths = (finger.core_radius_mm + 1e-3 * thickness, shallowest_radius(finger))
    bounds = [(0.0, LARGEST_POISSON_RATIO), depths, (design - WINDOW_DEG / 4, design + WINDOW_DEG / 4)]
    nominal = 0.46 if sensor.rubber.poisson_ratio is None else sensor.rubber.poisson_ratio
    start = np.array([min(nominal, 0.48), finger.sensing_radius_mm, design]) / STEPS
    limits = [(low / step, high / step) for (low, high), step in zip(bounds, STEPS, strict=True)]
    for _ in range(4):  # restarted at the result until it does not change, as Numerical Recipes advises
        simplex = np.vstack([start, start + np.eye(3) * np.where(start + 1 > np.array(limits)[:, 1], -1, 1)])
        found = minimize(
            misfit,
            start,
            method="Nelder-Mead",
            bounds=limits,
            options={"initial_simplex": simplex, "xatol": 1e-5, "fatol": 1e-13, "maxfev": 2000},
        )
        settled = np.abs(found.x - start).max() < 1e-3
        start = found.x
        if settled:
            break
    model = strain(*(found.x * STEPS))
    gain = float(data @ model) / float(model @ model)
    sigma, radius, angle = (float(value) for value in found.x * STEPS)
    peak = abs(gain) * pressure.peak_strain(sigma, radius)
    return ElementFit(
        element=element,
        poisson_ratio=sigma,
        sensing_radius_mm=radius,
        angle_deg=angle,
        gain=gain,
        error_percent_peak=100 * float(np.sqrt(np.mean((data - gain * model) ** 2))) / peak,
        noise_percent_peak=100 * float(np.sqrt(means.pure_error_variance[element])) / peak,
        n_touches=int(near.sum()),
        converged=bool(found.success and settled),
    )
