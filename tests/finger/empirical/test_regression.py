"""Regression of an element's coefficients where the readings leave some of them open."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch.errors import InputError
from bayestouch.finger.empirical.regression import DiagonalElement, Weights


def test_a_coefficient_that_rounding_alone_determines_is_refused_without_a_prior() -> None:
    """Its singular value is not zero, but 1e-14 of the largest: no more than rounding leaves of a zero."""
    element = DiagonalElement(
        singular=np.array([1.0, 1e-14]),
        projected=np.zeros(2),
        outside=0.0,
        n=5,
        base=np.zeros(2),
        basis=np.eye(2),
        family_root=np.zeros((2, 0)),
    )
    without_prior = Weights(np.array([np.inf]), np.ones(1), np.ones(1))
    with pytest.raises(InputError, match="5 touches determine only 1 of 2 coefficients"):
        element.mean(without_prior)
