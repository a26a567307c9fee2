"""Touches on a pad that is read with an effect of the load."""

from __future__ import annotations

import numpy as np
from pad_simulation import FORCE_NOISE, flattened, flattening

import bayestouch


def test_measured_loads_of_a_result_are_as_read() -> None:
    """Also those below the threshold, from which no acting load leads back; their mean is that of the samples."""
    pad, calibration = flattening()
    rng = np.random.default_rng(8)
    load = np.array([0.05, 0.2, 1.0, 3.0])
    place = np.full((4, 1), 16.0)
    table = pad.touch(place, rng, load=load, measured=True, acting=flattened(load), samples=4)
    table = table.with_(load=table.load + FORCE_NOISE * rng.standard_normal(table.n_rows))
    for plug_in in (False, True):
        result = bayestouch.infer(table, calibration, plug_in=plug_in)
        np.testing.assert_allclose(result.rows.load, table.load.reshape(4, 4).mean(axis=1), rtol=1e-12)
        np.testing.assert_array_equal(result.reference["P"], result.rows.load)
    assert np.isnan(bayestouch.infer(table, calibration, use_load=False).rows.load).all()
