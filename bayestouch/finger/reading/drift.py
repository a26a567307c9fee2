"""Drifts of a file of touches, found from the file itself.

Zeros and gains wander on after the calibration. Each touch tells something of them, after its own radius, location
and load have taken what they explain; touches before and after tell the rest. The drift that a touch is read with
comes from the others alone, so that no reading is used twice.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray

# A prior that wide lets a touch's own parameters take whatever they explain.
LOOSE = np.array([4.0, 0.5, 1.0])


@dataclass(frozen=True, eq=False)
class TouchEvidence:
    """What each touch says of an addition to its readings, linear about its mode.

    Attributes
    ----------
    residual : (t, m) array
        Reading minus prediction at the mode, without any drift.
    jacobian : (t, m, 3) array
        Derivative of the prediction over the touch's coordinates (w, θ_c, P).
    covariance : (t, m, m) array
        Of the readings, drifts left out; missing readings have a very large variance.
    shift : (t, 3) array
        Prior mean minus mode of the coordinates: of a load that was measured; zero otherwise.
    precision : (t, 3) array
        Prior precision of the coordinates.
    """

    residual: FloatArray
    jacobian: FloatArray
    covariance: FloatArray
    shift: FloatArray
    precision: FloatArray

    def about_addition(self) -> tuple[FloatArray, FloatArray]:
        """Precision (t, m, m) and precision times mean (t, m) of the addition to each touch's readings."""
        inverse = np.linalg.inv(self.covariance)
        weighted = inverse @ self.jacobian
        curvature = self.jacobian.swapaxes(1, 2) @ weighted + np.einsum("ti,ij->tij", self.precision, np.eye(3))
        solved = np.linalg.solve(curvature, weighted.swapaxes(1, 2))
        precision = inverse - weighted @ solved
        # About the prior mean of the coordinates rather than the mode.
        centred = self.residual - np.einsum("tmi,ti->tm", self.jacobian, self.shift)
        return precision, np.einsum("tmn,tn->tm", precision, centred)


def drift_of_others(
    columns: FloatArray, precision: FloatArray, information: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Mean (t, m) and covariance (t, m, m) of each touch's drift, from all other touches.

    Parameters
    ----------
    columns : (t, m, k) array
        What each weight of the drifts, standard normal, adds to the readings of each touch.
    precision, information : (t, m, m), (t, m) arrays
        From `TouchEvidence.about_addition`.
    """
    t, m, k = columns.shape
    weighted = precision @ columns
    total = np.eye(k) + columns.reshape(-1, k).T @ weighted.reshape(-1, k)
    slope = np.einsum("tmk,tm->k", columns, information)
    root = np.linalg.cholesky(total)
    mean = columns @ np.linalg.solve(root.T, np.linalg.solve(root, slope))
    spread = np.linalg.solve(root, columns.reshape(-1, k).T).T.reshape(t, m, k)
    covariance = spread @ spread.swapaxes(1, 2)
    # Take the touch's own evidence out again.
    left = np.eye(m) - covariance @ precision
    mean = np.linalg.solve(left, (mean - np.einsum("tmn,tn->tm", covariance, information))[..., None])[..., 0]
    covariance = np.linalg.solve(left, covariance)
    return mean, 0.5 * (covariance + covariance.swapaxes(1, 2))
