"""A finger with an identified E map beside the elastic finger whose map it is."""

from __future__ import annotations

import numpy as np
from known_fingers import true_chain

from bayestouch.chain.empirical import EmpiricalFingerChain, elastic_e_matrix, modes_of


def test_the_series_is_the_prediction_without_offset() -> None:
    elastic = true_chain().with_(offset=np.linspace(-50.0, 70.0, 7))
    mapped = EmpiricalFingerChain(elastic, elastic_e_matrix(elastic, modes_of(elastic)))
    rng = np.random.default_rng(0)
    touches = rng.uniform(0, 12.7, 30), rng.uniform(-1.0, 1.0, 30), rng.uniform(50, 290, 30)
    signal = elastic.predict(*touches) - elastic.offset
    # The tables interpolate over the angle, to 1e-5 of the peak.
    np.testing.assert_allclose(mapped.series(*touches), signal, atol=1e-5 * np.abs(signal).max())
    np.testing.assert_allclose(mapped.predict(*touches), signal + elastic.offset, atol=1e-8 * np.abs(signal).max())
