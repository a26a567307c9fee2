"""What is true of a simulated finger, for studies that score against it."""

from __future__ import annotations

import numpy as np

from bayestouch.chain.finger import FingerChain
from bayestouch.data.sensor import Finger
from bayestouch.simulation import SimulatedDataSet


def true_chain(simulated: SimulatedDataSet, largest_load: float) -> FingerChain:
    """The finger as it was built, for loads up to the largest (N/m)."""
    finger, truth = simulated.dataset.sensor.body, simulated.truth
    assert isinstance(finger, Finger)
    response, depth, angle = (np.asarray(truth[name], dtype=float) for name in ("response", "r_s", "theta_s"))
    return FingerChain(
        core_radius_mm=finger.core_radius_mm,
        outer_radius_mm=finger.outer_radius_mm,
        response=response,
        sensing_radius_mm=depth,
        angle=np.radians(angle),
        offset=np.zeros(finger.n_elements),
        poisson_ratio=float(truth["sigma"]),
        shear_modulus_MPa=float(truth["mu"]),
        largest_load=largest_load,
    )
