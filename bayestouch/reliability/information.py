"""Fisher information of one touch about R, θ_c and P, including errors of the calibration.

Location and load are unknown too, so the information about R is what remains after both are fitted. The integral of its
square root from the knife edge defines a scale ``u(R)`` on which the estimate of any radius has standard deviation one.
On this scale, edge and flat are the only boundaries. The effect of truncation on a posterior, and the probability of
confusing two indenters, are one-dimensional integrals.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.contact import composite_radius, indenter_radius
from bayestouch.errors import InputError
from bayestouch.output.summary import Summarised
from bayestouch.reliability.known_finger import KnownFinger, TouchPlaces

#: Number of knots in R from edge to flat.
RADIUS_KNOTS = 49


def touch_information(
    known: KnownFinger, touches: TouchPlaces, *, samples: int = 1, use_load: bool = True
) -> FloatArray:
    """Fisher information about R (mm), θ_c (rad) and P (N/m), (t, 3, 3).

    Parameters
    ----------
    known : KnownFinger
        The calibrated finger.
    touches : TouchPlaces
        The touches.
    samples : int
        Number of samples averaged; it reduces the noise but not the errors of the calibration.
    use_load : bool
        Whether the reading of the force sensor is used.
    """
    jacobian = known.touch_jacobian(touches)
    weighted = np.linalg.solve(known.covariance(touches, samples), jacobian)
    information = jacobian.swapaxes(1, 2) @ weighted
    information[:, 2, 2] += known.load_sd(samples, use_load) ** -2
    return np.asarray(information)


@dataclass(frozen=True, eq=False, repr=False)
class RadiusScale(Summarised):
    """Scale u(R) at n locations, on which estimates of the radius have standard deviation one.

    Attributes
    ----------
    outer_radius_mm : float
        ``r_b``.
    angle : (n,) array
        Locations, rad.
    radius_mm : (k,) array
        Knots in R, from 0 to ``r_b``.
    scale : (n, k) array
        u at the knots; 0 at the knife edge.
    """

    outer_radius_mm: float
    angle: FloatArray
    radius_mm: FloatArray
    scale: FloatArray

    @classmethod
    def of(
        cls,
        known: KnownFinger,
        angle: ArrayLike,
        *,
        load: float | None = None,
        samples: int = 1,
        use_load: bool = True,
    ) -> RadiusScale:
        """Scale at locations `angle` (n,), rad, for a load (N/m; by default the typical load of the calibration).

        Raises
        ------
        InputError
            If there are no locations, a location is not finite, a touch has fewer readings than unknowns, `samples` is
            below 1, or `load` is not above zero.
        """
        known.check_unknowns(use_load)
        where = np.atleast_1d(np.asarray(angle, dtype=float))
        radius = np.linspace(0.0, known.outer_radius_mm, RADIUS_KNOTS)
        push = known.typical_load if load is None else load
        touches = TouchPlaces.grid(radius, where, push, known.largest_load)
        information = touch_information(known, touches, samples=samples, use_load=use_load)
        variance = np.linalg.inv(information)[:, 0, 0].reshape(len(radius), len(where)).T
        speed = 1 / np.sqrt(variance)
        steps = 0.5 * (speed[:, 1:] + speed[:, :-1]) * np.diff(radius)
        scale = np.concatenate([np.zeros((len(where), 1)), np.cumsum(steps, axis=1)], axis=1)
        return cls(known.outer_radius_mm, where, radius, scale)

    def at(self, radius_mm: ArrayLike) -> FloatArray:
        """Values of u at composite radii (q,), shape (n, q)."""
        wanted = np.atleast_1d(np.asarray(radius_mm, dtype=float))
        return np.stack([np.interp(wanted, self.radius_mm, row) for row in self.scale])

    def distinguished(self, first_r_c: ArrayLike, second_r_c: ArrayLike) -> FloatArray:
        """Probability of identifying the right one of two indenters with even prior odds, (n, q); r_c in mm, both (q,).

        On this scale both estimates are normal with unit standard deviation: ``Φ(|u_1 - u_2|/2)``.
        """
        from scipy.special import ndtr

        first, second = (self.at(composite_radius(r, self.outer_radius_mm)) for r in (first_r_c, second_r_c))
        return np.asarray(ndtr(0.5 * np.abs(second - first)))

    def threshold(self, from_r_c: float = 0.0, probability: float = 0.95) -> FloatArray:
        """r_c (mm) of the nearest blunter indenter that is distinguished from `from_r_c` with this probability, (n,).

        Parameters
        ----------
        from_r_c : float
            Indenter to start from; a knife edge by default.
        probability : float
            Probability of identifying the right one of the two with even prior odds.

        Returns
        -------
        (n,) array
            inf if only the flat itself is distinguished; NaN if nothing is.
        """
        from scipy.special import ndtri

        if not 0.5 < probability < 1:
            raise InputError(f"probability: expected between 0.5 and 1, got {probability:g}")
        needed = 2 * ndtri(probability)
        start = self.at(composite_radius(from_r_c, self.outer_radius_mm))[:, 0]
        target = start + needed
        out = np.full(len(self.angle), np.nan)
        for i, (row, value) in enumerate(zip(self.scale, target, strict=True)):
            if row[0] <= value <= row[-1]:
                out[i] = float(
                    indenter_radius(
                        min(np.interp(value, row, self.radius_mm), self.outer_radius_mm), self.outer_radius_mm
                    )
                )
        return out

    def estimates(self, radius_mm: float, offset: ArrayLike = 0.0) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Expected posteriors of R for a touch, averaged over the noise; the prior is uniform from edge to flat.

        Parameters
        ----------
        radius_mm : float
            True composite radius R.
        offset : (n,) array_like
            Error of the estimate (on this scale) that is common to all touches at the location.

        Returns
        -------
        mean, scatter, sd : (n,) arrays
            Mean and standard deviation of the posterior means, and rms of the posterior standard deviations; mm.
        """
        fine = np.linspace(0.0, self.outer_radius_mm, 6 * RADIUS_KNOTS)
        u = self.at(fine)
        nodes, weights = np.polynomial.hermite_e.hermegauss(21)
        weights = weights / weights.sum()
        centre = self.at(radius_mm)[:, 0] + np.asarray(offset, dtype=float)
        seen = centre[:, None] + nodes
        log = -0.5 * (u[:, None] - seen[..., None]) ** 2
        density = np.exp(log - log.max(axis=-1, keepdims=True))
        density[..., [0, -1]] *= 0.5  # trapezoid rule
        density /= density.sum(axis=-1, keepdims=True)
        mean = density @ fine
        variance = np.maximum(density @ fine**2 - mean**2, 0.0)
        average = mean @ weights
        scatter = np.sqrt(np.maximum((mean**2) @ weights - average**2, 0.0))
        return average, scatter, np.sqrt(variance @ weights)
