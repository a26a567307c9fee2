"""What an E map that was identified beside effects leaves uncertain of the readings of touches."""

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
    """Derivative of the readings (d, t, m) over the d parameters of the calibration, the map refitted.

    Zero for responses, depths and angles of the elements: the map has taken their place.

    Parameters
    ----------
    identified : EmpiricalCalibration
        The map.
    model : FingerModel
        The finger with the effects that are the same in all samples, at these touches.
    recording : Recording
        The touches with the signals that leave the body.
    vector : (q,) array
        Parameters of `model`.
    rows : (q,) int array
        Their places among the parameters of the calibration.
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
    """Covariance (t, m, m) of the readings that the map leaves at given parameters of the calibration.

    As `map_derivatives`; `scale` (t, m) is the factor of the effects that differ from sample to sample.
    """
    assert model.pose is not None
    through = scale[:, :, None] * by_signal(model, recording, vector)
    own = identified.own_variance(*model.pose)
    return np.asarray(np.einsum("tij,tj,tkj->tik", through, own, through, optimize=True))
