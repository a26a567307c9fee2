"""The posterior density of a calibration as a function, for any sampler."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.errors import InputError, few, number_array, shown
from bayestouch.output.summary import Summarised
from bayestouch.output.text import plural


@dataclass(frozen=True, eq=False, repr=False)
class LogDensity(Summarised):
    """Log posterior density of a calibration in d coordinates, vectorised; of t touches.

    Coordinates are the parameters, or the logarithms of those that are positive (`names` says which); an angle is in
    radians, and the discrepancy of an element is in units of the noise of the mean of a touch. All densities are
    densities of the coordinates: the log prior includes the derivative of the parameters over the coordinates. They are
    known up to a constant, which is the same at all points.

    The densities take points (n, d) and return (n,) values, or take one point (d,) and return one value. Points of
    another shape raise `InputError`.

    Attributes
    ----------
    names : tuple of str
        Name of each coordinate: ``log response[0]``, ``sigma`` …
    units : tuple of str
        Unit of each coordinate; of a logarithm, that of its parameter.
    start : (d,) array
        Mode of the posterior, approximately.
    covariance : (d, d) array
        Covariance of the normal approximation about `start`.
    bounds : pair of (d,) arrays
        Lowest and highest value of each coordinate; the density is zero outside.
    posterior, prior : callable
        Log densities (n,) of points (n, d).
    touches : callable or None
        Log likelihood (n, t) of the mean readings of each touch at points (n, d); None if the touches are not
        independent given the parameters (drifts, corrections, the empirical map of a pad).
    values, coordinates : callable
        From points (n, d) to values by the names of `Calibration.posterior`, each (n,) or (n, m), and back.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> dataset = bayestouch.simulate(design, seed=3).dataset
    >>> calibration = bayestouch.calibrate(dataset, draws=200)
    >>> density = bayestouch.log_density(calibration, dataset)
    >>> density.dimension, density.names[12]
    (23, 'sigma')
    >>> points = density.start + [[0.0], [0.01]]  # two points (2, d)
    >>> first, second = density(points)
    >>> bool(first > second)  # the start is the mode
    True
    >>> round(float(density.to_parameters(density.start)["sigma"]), 2)  # Poisson's ratio
    0.46
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    start: FloatArray
    covariance: FloatArray
    bounds: tuple[FloatArray, FloatArray]
    posterior: Callable[[FloatArray], FloatArray]
    prior: Callable[[FloatArray], FloatArray]
    touches: Callable[[FloatArray], FloatArray] | None
    values: Callable[[FloatArray], dict[str, FloatArray]]
    coordinates: Callable[[Mapping[str, FloatArray]], FloatArray]

    def summary_lines(self) -> list[str]:
        """Lines that ``repr`` shows."""
        families = Counter(name.partition("[")[0] for name in self.names)
        touches = "no likelihood" if self.touches is None else "a likelihood"
        return [
            f"LogDensity of {plural(self.dimension, 'coordinate')}, {touches} of each touch",
            few([name if count == 1 else f"{name} ({count})" for name, count in families.items()], 12),
        ]

    @property
    def dimension(self) -> int:
        """Number of coordinates d."""
        return len(self.start)

    def __call__(self, x: ArrayLike) -> FloatArray:
        """Log posterior density; ``-inf`` outside the bounds."""
        return self._at(x, self.posterior)

    def log_prior(self, x: ArrayLike) -> FloatArray:
        """Log prior density; ``-inf`` outside the bounds."""
        return self._at(x, self._bounded_prior)

    def log_likelihood(self, x: ArrayLike) -> FloatArray:
        """Log likelihood of all readings and loads, the scatter of repeats included; ``-inf`` outside the bounds."""

        def likelihood(points: FloatArray) -> FloatArray:
            posterior = self.posterior(points)
            there = np.isfinite(posterior)
            out = np.full(len(points), -np.inf)
            out[there] = posterior[there] - self.prior(points[there])
            return out

        return self._at(x, likelihood)

    def touch_log_likelihood(self, x: ArrayLike) -> FloatArray:
        """Log likelihood of the mean readings of each touch, (n, t), or (t,) for one point; ``-inf`` out of bounds.

        Raises
        ------
        InputError
            The touches are not independent given the parameters.
        """
        if self.touches is None:
            raise InputError(
                "drifts, corrections or an empirical map tie the touches together: they have no likelihood each"
            )
        touches = self.touches

        def likelihood(points: FloatArray) -> FloatArray:
            # The start is inside: without points there is nothing else that tells the number of touches.
            inside = self._inside(points)
            found = touches(points[inside] if inside.any() else self.start[None])
            out = np.full((len(points), found.shape[1]), -np.inf)
            out[inside] = found[: inside.sum()]
            return out

        return self._at(x, likelihood)

    def to_parameters(self, x: ArrayLike) -> dict[str, FloatArray]:
        """Parameters by name, as in `Calibration.posterior`: (n,) or (n, m), or () and (m,) for one point."""
        points = self._points(x)
        found = self.values(points)
        return found if np.ndim(x) > 1 else {name: value[0] for name, value in found.items()}

    def from_parameters(self, values: Mapping[str, ArrayLike]) -> FloatArray:
        """Points (n, d), or one point (d,), from parameters by name; parameters that follow from others are ignored.

        Raises
        ------
        InputError
            A parameter is missing, or has another shape: chains are to be joined.
        """
        if not isinstance(values, Mapping):
            raise InputError(f"expected parameters by name, got {shown(values)}")
        needed = self.values(self.start[None])
        given = {name: np.asarray(value, dtype=np.float64) for name, value in values.items()}
        for name in (each for each in needed if each in given):
            shape = needed[name].shape[1:]
            if given[name].shape not in (shape, (*given[name].shape[:1], *shape)):
                expected = str(("n", *shape)).replace("'", "")
                raise InputError(f"{name}: expected values of n points {expected}, got shape {given[name].shape}")
        single = all(given[name].ndim < needed[name].ndim for name in given.keys() & needed.keys())
        try:
            points = self.coordinates({name: value[None] if single else value for name, value in given.items()})
        except KeyError as missing:
            raise InputError(f"parameter {missing} is missing") from None
        return points[0] if single else points

    def _at(self, x: ArrayLike, function: Callable[[FloatArray], FloatArray]) -> FloatArray:
        found = function(self._points(x))
        return found if np.ndim(x) > 1 else np.asarray(found[0])

    def _points(self, x: ArrayLike) -> FloatArray:
        points = np.atleast_2d(number_array("points", x, 0, 1, 2, 3))
        if points.ndim != 2 or points.shape[1] != self.dimension:
            raise InputError(f"expected points (n, {self.dimension}), got {np.shape(x)}")
        return points

    def _inside(self, points: FloatArray) -> BoolArray:
        """Whether points (n, d) are inside the bounds."""
        low, high = self.bounds
        return np.asarray(((points > low) & (points < high)).all(axis=1))

    def _bounded_prior(self, points: FloatArray) -> FloatArray:
        inside, out = self._inside(points), np.full(len(points), -np.inf)
        out[inside] = self.prior(points[inside])
        return out
