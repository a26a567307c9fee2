"""The linearised chain of a finger with effects: coordinates that are made independent of the others."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch.finger.linear_chain import LinearChain
from bayestouch.finger.noise import Residuals


@pytest.mark.parametrize("with_constant", [False, True])
def test_a_coordinate_without_coupling_keeps_its_own_precision(with_constant: bool) -> None:
    rng = np.random.default_rng(1)
    roots = rng.standard_normal((3, 4, 6))
    precision = roots @ roots.swapaxes(1, 2)
    none = np.zeros((0, 3))
    constant = np.stack([2 * precision[0], precision[1]]) if with_constant else None
    chain = LinearChain(Residuals(none, none, np.zeros(3)), precision, np.zeros((3, 4)), constant, np.zeros(4), 0.0)
    whole, found = chain.hessian, chain.without_coupling([1]).hessian
    rest = np.ix_([0, 2, 3], [0, 2, 3])
    np.testing.assert_array_equal(found[rest], whole[rest])
    assert found[1, 1] == whole[1, 1]
    np.testing.assert_array_equal(found[1, [0, 2, 3]], 0.0)
    np.testing.assert_array_equal(found[[0, 2, 3], 1], 0.0)
    np.testing.assert_array_equal(chain.hessian, whole)
    np.testing.assert_array_equal(chain.without_coupling([]).hessian, whole)


def test_every_node_of_the_drifts_is_treated_alike() -> None:
    rng = np.random.default_rng(2)
    constant, tangent, none = rng.standard_normal((3, 4, 4)), rng.standard_normal((4, 4)), np.zeros((0, 3))
    noise = Residuals(none, none, np.zeros(3))
    chain = LinearChain(noise, np.zeros((3, 4, 4)), np.zeros((3, 4)), constant, np.zeros(4), 0.0)
    along, apart = chain.along(tangent).constant, chain.without_coupling([1]).constant
    assert along is not None and apart is not None
    for node in range(3):
        np.testing.assert_allclose(along[node], tangent.T @ constant[node] @ tangent)
        assert apart[node, 1, 1] == constant[node, 1, 1] and apart[node, 0, 2] == constant[node, 0, 2]
        assert not apart[node, 1, [0, 2, 3]].any() and not apart[node, [0, 2, 3], 1].any()
