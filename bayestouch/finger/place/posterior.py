"""Posterior of the functions of place, from a calibration."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain
from bayestouch.errors import InputError
from bayestouch.finger.place.functions import MAP, PLACE, PlaceFunctions, Process, fourier

PREFIX = "place_"


@dataclass(frozen=True, eq=False)
class PlacePosterior:
    """Posterior of the weights of functions of place; m elements, k weights of each element, q of the surface.

    Attributes
    ----------
    functions : PlaceFunctions
        The functions.
    angle, response : (m,) arrays
        Angles (rad) and responses of the elements to which own functions refer: their angles are measured from
        `angle`, and their values are shares of `response`.
    own, surface : (m, k), (q,) arrays
        Mean weights at the mode of the parameters of the finger.
    gains : (m, k, 5 + q) array
        Regression of the weights of an element on its response, r_s (mm) and θ_s (rad), on σ and log μ, and on the
        weights of the surface. The small correlation of two elements by errors of the loads is neglected.
    own_covariance : (m, k, k) array
        Covariance of the weights of an element, given all these parameters.
    covariance : (3 m + 2 + q, 3 m + 2 + q) array
        Covariance of responses, r_s, θ_s, σ, log μ, and the weights of the surface.
    """

    functions: PlaceFunctions
    angle: FloatArray
    response: FloatArray
    own: FloatArray
    surface: FloatArray
    gains: FloatArray
    own_covariance: FloatArray
    covariance: FloatArray

    def reference(self, chain: FingerChain) -> FingerChain:
        """The chain with the angles and responses that own functions refer to."""
        return chain.with_(angle=self.angle, response=self.response)

    def log_curvature(self, angle: FloatArray) -> FloatArray:
        """Mean logarithm (...) of the curvature of the surface times ``r_b``, at locations (...) in rad."""
        process = self.functions.surface
        if process is None:
            return np.zeros(np.shape(angle))
        return np.asarray(fourier(angle, process.n_modes) @ (process.weight_sd * self.surface))

    def effective_radius(self, radius_mm: FloatArray, angle: FloatArray, outer_radius_mm: float) -> FloatArray:
        """Composite radius (...), mm, with the mean curvature of the surface at locations (...) in rad.

        `radius_mm` (...) is the composite radius R on a round surface.
        """
        if self.functions.surface is None:
            return radius_mm
        departure = np.expm1(self.log_curvature(angle)) / outer_radius_mm
        return np.asarray(radius_mm / (1 + radius_mm * departure))

    def readings(self, chain: FingerChain, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
        """Mean change (t, m) of the readings by own functions.

        For touches of *effective* radius (mm), location (rad) and load (N/m), all (t,).
        """
        return self.functions.own_readings(self.reference(chain), radius_mm, angle, load, self.own)

    def jacobian(
        self, elastic: FloatArray, chain: FingerChain, touch: tuple[FloatArray, FloatArray, FloatArray]
    ) -> tuple[FloatArray, FloatArray]:
        """Derivative of the readings over the parameters and the weights of the surface; variance by own functions.

        Parameters
        ----------
        elastic : (5, t, m) array
            Derivative of the readings of the chain.
        chain : FingerChain
            The elastic finger.
        touch : three (t,) arrays
            Effective radius (mm), location (rad) and load (N/m).

        Returns
        -------
        (5 + q, t, m) array, (t, m) array
            Derivative over own and shared parameters, then over the weights of the surface; variance of the readings
            by the own functions, given all these.
        """
        own = self.functions.own_columns(self.reference(chain), *touch)
        through = np.moveaxis(np.einsum("tmk,mkj->tmj", own, self.gains, optimize=True), -1, 0)
        surface = np.moveaxis(self.functions.surface_columns(chain, *touch, self.log_curvature(touch[1])), -1, 0)
        half = np.matmul(np.moveaxis(own, 1, 0), self.own_covariance)
        variance = np.einsum("mtk,tmk->tm", half, own, optimize=True)
        return np.concatenate([elastic, surface]) + through, variance

    def with_model_covariance(self, covariance: FloatArray) -> PlacePosterior:
        """The posterior with another covariance (3 m + 2, 3 m + 2) of the parameters of the finger."""
        d = len(covariance)
        moved = np.asarray(np.linalg.solve(self.covariance[:d, :d], self.covariance[:d, d:]).T, dtype=np.float64)
        given = self.covariance[d:, d:] - moved @ self.covariance[:d, d:]
        return replace(self, covariance=joint_covariance(covariance, moved, given))

    def arrays(self) -> dict[str, FloatArray]:
        """Arrays by name, for a file."""
        own, surface = self.functions.own, self.functions.surface
        described = [
            float(self.functions.kind == PLACE),
            *((own.length_deg, own.sd) if own else (0.0, 0.0)),
            *((surface.length_deg, surface.sd) if surface else (0.0, 0.0)),
        ]
        found = {PREFIX + name: getattr(self, name) for name in _ARRAYS}
        # Single precision (seven digits) is enough for a covariance, which is the largest part of the file.
        for name in ("gains", "own_covariance"):
            found[PREFIX + name] = found[PREFIX + name].astype(np.float32)
        return {PREFIX + "functions": np.array(described), **found}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, FloatArray]) -> PlacePosterior | None:
        """Posterior from the arrays of a file; None if the file has no functions of place.

        Raises
        ------
        InputError
            If some of the arrays are missing.
        """
        names = (PREFIX + "functions", *(PREFIX + name for name in _ARRAYS))
        missing = [name for name in names if name not in arrays]
        if len(missing) == len(names):
            return None
        if missing:
            raise InputError("functions of place without it: made by another version", column=missing[0])
        place, length, sd, surface_length, surface_sd = np.asarray(arrays[PREFIX + "functions"]).tolist()
        functions = PlaceFunctions(
            kind=(PLACE if place else MAP) if length else "",
            own=Process(length, sd) if length else None,
            surface=Process(surface_length, surface_sd) if surface_length else None,
        )
        return cls(functions, **{name: np.asarray(arrays[PREFIX + name], dtype=float) for name in _ARRAYS})


def joint_covariance(model: FloatArray, moved: FloatArray, surface: FloatArray) -> FloatArray:
    """Joint covariance (d + q, d + q) of the finger's parameters and the weights of the surface.

    Parameters
    ----------
    model : (d, d) array
        Covariance of the finger's parameters.
    moved : (q, d) array
        Derivative of the mean weights over the finger's parameters.
    surface : (q, q) array
        Covariance of the weights, given the finger's parameters.
    """
    crossed = moved @ model
    return np.block([[model, crossed.T], [crossed, crossed @ moved.T + surface]])


_ARRAYS = tuple(each.name for each in fields(PlacePosterior) if each.name != "functions")
