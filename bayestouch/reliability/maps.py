"""Maps that predict from a calibration alone how well a finger reads at each location."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.contact import composite_radius
from bayestouch.errors import unknown_name
from bayestouch.output.summary import Summarised, span
from bayestouch.output.text import number, plural
from bayestouch.reliability.information import RadiusScale
from bayestouch.reliability.known_finger import KnownFinger, TouchPlaces
from bayestouch.reliability.location_bias import NAMES, TouchEstimator


@dataclass(frozen=True, eq=False, repr=False)
class SweetSpots(Summarised):
    """Predicted errors of estimates for k indenters at n locations; R in mm, θ_c in degree, P in N/m.

    The uncertainty of a calibration is a random function of location: its size can be predicted, its sign cannot.

    Attributes
    ----------
    indenters_mm : (k,) array
        Indenter radii r_c.
    angle_deg : (n,) array
        Locations.
    noise_sd : mapping of (k, n) arrays
        Standard deviation from noise at one location, by estimate (``R``, ``theta_c``, ``P``).
    bias_rms : mapping of (k, n) arrays
        Error that is common to all samples at a location, rms over calibrations: uncertainty of the calibration and
        discrepancy of the model.
    posterior_sd : (k, n) array
        Root mean square posterior standard deviation of R, with a prior from edge to flat.
    radius_offset : (k, n) array
        Mean error of the posterior mean of R, caused by truncation at edge and flat.
    radius_scatter : (k, n) array
        Standard deviation of the posterior mean of R over noise and calibrations.
    bias_by_element, noise_by_element : mapping of (k, n, m) arrays
        Parts of the variances above that belong to each element.
    calibration_rms : mapping of (k, n) arrays
        Part of `bias_rms` that is uncertainty of the calibration; the squares of both parts add up.
    """

    indenters_mm: FloatArray
    angle_deg: FloatArray
    noise_sd: Mapping[str, FloatArray]
    bias_rms: Mapping[str, FloatArray]
    posterior_sd: FloatArray
    radius_offset: FloatArray
    radius_scatter: FloatArray
    bias_by_element: Mapping[str, FloatArray]
    noise_by_element: Mapping[str, FloatArray]
    calibration_rms: Mapping[str, FloatArray]

    def sd(self, name: str) -> FloatArray:
        """Standard deviation of an estimate from noise, calibration and lack of fit, without truncation, (k, n)."""
        if name not in NAMES:
            raise unknown_name("estimate", name, NAMES)
        return np.asarray(np.hypot(self.noise_sd[name], self.bias_rms[name]))

    @property
    def radius_error(self) -> FloatArray:
        """Expected root mean square error of the posterior mean of R, (k, n)."""
        return np.asarray(np.hypot(self.radius_offset, self.radius_scatter))

    def best(self, name: str = "R") -> float:
        """Location (degree) with the smallest standard deviation, averaged over the indenters."""
        return float(self.angle_deg[(self.sd(name) ** 2).mean(axis=0).argmin()])

    def summary_lines(self) -> list[str]:
        """Lines that ``repr`` shows: the standard deviation of each estimate, and where it is smallest."""
        places = f"{plural(len(self.angle_deg), 'location')}{span(self.angle_deg)}°"
        return [
            f"SweetSpots of {plural(len(self.indenters_mm), 'indenter')} at {places}",
            *(
                f"{name}: sd{span(self.sd(name))} {unit}, smallest at {number(self.best(name))}°"
                for name, unit in zip(NAMES, ("mm", "degree", "N/m"), strict=True)
            ),
        ]


def sweet_spots(
    known: KnownFinger,
    indenters_mm: ArrayLike,
    angle_deg: ArrayLike,
    *,
    load: float | None = None,
    samples: int = 1,
    use_load: bool = True,
    plug_in: bool = False,
) -> SweetSpots:
    """Maps of the expected errors of touches on a calibrated finger.

    Parameters
    ----------
    known : KnownFinger
        The calibrated finger.
    indenters_mm : (k,) array_like
        Indenter radii r_c: 0 knife edge, inf flat.
    angle_deg : (n,) array_like
        Locations.
    load : float, optional
        Load in N/m; by default that of the calibration.
    samples : int
        Samples averaged in each touch.
    use_load : bool
        Whether the force sensor is read.
    plug_in : bool
        Use estimates that weight readings only by noise, as if the calibration were exact; its errors still count.
        `posterior_sd`, `radius_offset` and `radius_scatter` do not change: they are those of posteriors that include
        the error of the calibration.

    Raises
    ------
    InputError
        If there are no indenters or locations, a location is not finite, a touch has fewer readings than unknowns,
        `samples` is below 1, or `load` is not above zero.
    """
    radii, where, touches = _grid(known, indenters_mm, angle_deg, load)
    composite = composite_radius(radii, known.outer_radius_mm)
    estimator = TouchEstimator.of(known, touches, samples=samples, use_load=use_load, plug_in=plug_in)
    shared = np.zeros((touches.n_touches, known.n_elements, known.n_elements))
    if known.errors is not None:
        shared += known.errors.covariance(touches)
    of_calibration = estimator.variance_by_element(shared).sum(axis=-1)
    index = np.arange(known.n_elements)
    shared[:, index, index] += known.noise.discrepancy_sd**2
    shape = len(radii), len(where)
    bias, noise = estimator.variance_by_element(shared), estimator.noise_by_element()
    noise_sd = estimator.noise_sd().reshape(*shape, 3)
    scale = RadiusScale.of(known, np.radians(where), load=load, samples=samples, use_load=use_load)
    mean, scatter, posterior = (np.stack(rows) for rows in zip(*(scale.estimates(r) for r in composite), strict=True))

    def by_name(values: FloatArray) -> dict[str, FloatArray]:
        return {name: values[..., i] for i, name in enumerate(NAMES)}

    parts = {name: (bias[:, i].reshape(*shape, -1), noise[:, i].reshape(*shape, -1)) for i, name in enumerate(NAMES)}
    return SweetSpots(
        indenters_mm=radii,
        angle_deg=where,
        noise_sd=by_name(noise_sd),
        bias_rms={name: np.sqrt(np.maximum(part.sum(axis=-1), 0.0)) for name, (part, _) in parts.items()},
        posterior_sd=posterior,
        radius_offset=mean - composite[:, None],
        radius_scatter=scatter,
        bias_by_element={name: part for name, (part, _) in parts.items()},
        noise_by_element={name: part for name, (_, part) in parts.items()},
        calibration_rms=by_name(np.sqrt(np.maximum(of_calibration, 0.0)).reshape(*shape, 3)),
    )


def draw_bias(
    known: KnownFinger,
    indenters_mm: ArrayLike,
    angle_deg: ArrayLike,
    *,
    draws: int = 200,
    samples: int = 1,
) -> dict[str, FloatArray]:
    """Maps of the bias for calibrations drawn from their posterior: examples of what one finger may look like.

    Parameters as in `sweet_spots`; the load is that of the calibration, and the force sensor is read. The discrepancy
    of the model is not drawn, because its variation is not known.

    Returns
    -------
    mapping of (draws, k, n) arrays
        Bias by estimate: R (mm), theta_c (degree), P (N/m).
    """
    radii, where, touches = _grid(known, indenters_mm, angle_deg, None)
    estimator = TouchEstimator.of(known, touches, samples=samples)
    if known.errors is None:
        drawn = np.zeros((draws, touches.n_touches, 3))
    else:
        drawn = estimator.errors(known.errors.draw(touches, draws, np.random.default_rng(0)))
    return {name: drawn[..., i].reshape(draws, len(radii), len(where)) for i, name in enumerate(NAMES)}


def known_bias(
    known: KnownFinger,
    better: KnownFinger,
    indenters_mm: ArrayLike,
    angle_deg: ArrayLike,
    *,
    load: float | None = None,
    samples: int = 1,
    use_load: bool = True,
    plug_in: bool = False,
) -> dict[str, FloatArray]:
    """Signed bias of estimates with one model, if another model predicts the readings better.

    If the better model has an identified E map, this is the part of the bias that the calibration touches have already
    revealed. If it has another contact model, this is the part of the bias due to that contact model.

    Parameters
    ----------
    known : KnownFinger
        Model that is used for the estimates.
    better : KnownFinger
        Model that predicts the readings better.
    indenters_mm, angle_deg, load, samples, use_load, plug_in
        As in `sweet_spots`.

    Returns
    -------
    mapping of (k, n) arrays
        Bias by estimate: R (mm), theta_c (degree), P (N/m).
    """
    radii, where, touches = _grid(known, indenters_mm, angle_deg, load)
    estimator = TouchEstimator.of(known, touches, samples=samples, use_load=use_load, plug_in=plug_in)
    bias = estimator.errors(better.predict(touches) - known.predict(touches))
    return {name: bias[:, i].reshape(len(radii), len(where)) for i, name in enumerate(NAMES)}


def _grid(
    known: KnownFinger, indenters_mm: ArrayLike, angle_deg: ArrayLike, load: float | None
) -> tuple[FloatArray, FloatArray, TouchPlaces]:
    """Indenters (k,), locations (n,) in degree, and touches by each indenter at each location."""
    radii = np.atleast_1d(np.asarray(indenters_mm, dtype=float))
    where = np.atleast_1d(np.asarray(angle_deg, dtype=float))
    composite = np.asarray(composite_radius(radii, known.outer_radius_mm))
    push = known.typical_load if load is None else load
    return radii, where, TouchPlaces.grid(composite, np.radians(where), push, known.largest_load)
