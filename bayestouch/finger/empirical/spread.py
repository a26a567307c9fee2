"""Uncertainty of the readings of touches due to an E map that was identified with effects."""

from __future__ import annotations

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.chain.recording import Recording
from bayestouch.finger.derivatives import by_signal
from bayestouch.finger.empirical.map import EmpiricalCalibration
from bayestouch.finger.model import FingerModel


def map_derivatives(
    identified: EmpiricalCalibration,
    model: FingerModel,
    recording: Recording,
    vector: FloatArray,
    rows: IntArray,
) -> FloatArray:
    """Derivative of the readings (d, t, m) over the d parameters of the calibration, with the map fitted again.

    It is zero for responses, depths and angles of the elements, which the map replaces.

    Parameters
    ----------
    identified : EmpiricalCalibration
        The map.
    model : FingerModel
        The finger with the effects that are equal in all samples, at these touches.
    recording : Recording
        The touches with the signals before the effects on the signal.
    vector : (q,) array
        Parameters of `model`.
    rows : (q,) int array
        Indices of these parameters among those of the calibration.
    """
    assert model.pose is not None
    shared = np.einsum("tij,stj->sti", by_signal(model, recording, vector), identified.by_shared(*model.pose))
    out = np.concatenate([np.zeros((3 * model.n_elements, *recording.signal.shape)), shared])
    for place in range(model.n_base, len(vector)):
        up, down, step = model.about_value(vector, place)
        moved = model.readings(recording, up).touches - model.readings(recording, down).touches
        out[rows[place]] += moved / (2 * step)
    return out


def own_covariance(
    identified: EmpiricalCalibration, model: FingerModel, recording: Recording, vector: FloatArray, scale: FloatArray
) -> FloatArray:
    """Covariance (t, m, m) of the readings due to the map, at given parameters of the calibration.

    Parameters are as in `map_derivatives`; `scale` (t, m) is the factor of the effects that differ between samples.
    """
    assert model.pose is not None
    through = scale[:, :, None] * by_signal(model, recording, vector)
    own = identified.own_variance(*model.pose)
    return np.asarray(np.einsum("tij,tj,tkj->tik", through, own, through, optimize=True))
