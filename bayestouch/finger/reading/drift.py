"""Drifts of a table of touches, estimated from the touches themselves.

Zeros and gains continue to drift after the calibration. The residual of each touch, after its radius, location and load
are fitted, has information on the drift. The drift that is used for a touch is estimated from all other touches, so
that no reading is used twice.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray

# Wide prior sd of (w, θ_c, P over the reference load): the parameters of a touch explain as much as they can.
LOOSE = np.array([4.0, 0.5, 1.0])


@dataclass(frozen=True, eq=False)
class TouchEvidence:
    """Information of each touch on an addition to its readings, linearised at the mode of the touch.

    Attributes
    ----------
    residual : (t, m) array
        Reading minus prediction at the mode, without drift.
    jacobian : (t, m, 3) array
        Derivative of the prediction over the coordinates (w, θ_c, P) of the touch.
    covariance : (t, m, m) array
        Covariance of the readings without drifts; missing readings have a very large variance.
    shift : (t, 3) array
        Prior mean minus mode of the coordinates for a measured load; zero otherwise.
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
        # Residual at the prior mean of the coordinates instead of the mode.
        centred = self.residual - np.einsum("tmi,ti->tm", self.jacobian, self.shift)
        return precision, np.einsum("tmn,tn->tm", precision, centred)


def drift_of_others(
    columns: FloatArray, precision: FloatArray, information: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Mean (t, m) and covariance (t, m, m) of the drift of each touch, estimated from all other touches.

    Parameters
    ----------
    columns : (t, m, k) array
        Change of the readings of each touch per unit of each standard normal weight of the drifts.
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
    # Remove the information of the touch itself.
    left = np.eye(m) - covariance @ precision
    mean = np.linalg.solve(left, (mean - np.einsum("tmn,tn->tm", covariance, information))[..., None])[..., 0]
    covariance = np.linalg.solve(left, covariance)
    return mean, 0.5 * (covariance + covariance.swapaxes(1, 2))
