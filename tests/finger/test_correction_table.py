"""The table of a finger's correction: where its locations are, and what each of its columns holds."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from bayestouch.errors import InputError
from bayestouch.finger import correction_table as module
from bayestouch.model.correction import CorrectionWeights


def corrected() -> Any:
    """A fit of which the correction is 2 P + 3 P² + 5 P (P R) for one element, touched from -1.5 to 2.2 degree."""
    model = SimpleNamespace(
        correction_inputs=lambda vector: (None, np.array([-1.5, 0.0, 2.2]), None),
        finger=SimpleNamespace(outer_radius_mm=16.0),
        reference_load=10.0,
    )
    return SimpleNamespace(model=model, vector=None)


def columns(radius: np.ndarray, angle: np.ndarray, load: np.ndarray) -> np.ndarray:
    return np.stack([load, load**2, load**2 * radius / 1000])[..., None]


@pytest.fixture
def table(monkeypatch: pytest.MonkeyPatch) -> module.CorrectionTable:
    """Weights 2, 3 and 5, that follow two parameters, and whose variances are 0.25, 0.01 and 7 besides."""
    mean, slope = np.array([2.0, 3.0, 5.0]), np.array([[1.0, 0.0], [0.5, 2.0], [0.0, -8.0]])
    weights = CorrectionWeights(mean, slope, np.diag([0.25, 0.01, 7.0]))
    monkeypatch.setattr(module, "finger_model", lambda model: model)
    monkeypatch.setattr(module, "weights_of", lambda fitted: weights)
    return module.table_of(corrected(), cast(Any, SimpleNamespace(columns=columns, sizes={})))


def test_table_of_a_correction_that_is_known_in_closed_form(table: module.CorrectionTable) -> None:
    """Half degrees from 5 degree below -2 to 5 degree above 3."""
    np.testing.assert_allclose(table.angle_deg, np.linspace(-7.0, 8.0, 31))
    for found, value in ((table.even, 2.0), (table.loaded, 3.0), (table.wide, 5.0)):
        np.testing.assert_allclose(found, np.full((31, 1), value), rtol=1e-9)


TOUCHES = np.array([0.0, 4.0]), np.radians([-1.3, 2.0]), np.array([10.0, 20.0])


def test_what_is_uncertain_of_a_correction(table: module.CorrectionTable) -> None:
    """Variances of 0.25 P² + 0.01 P⁴ + 7 (P² R)², R in m, and slopes P + 0.5 P², 2 P² - 8 P² R."""
    radius, _, load = TOUCHES
    ridge = load**2 * radius / 1000
    wanted = 0.25 * load**2 + 0.01 * load**4 + 7 * ridge**2
    # single precision
    np.testing.assert_allclose(table.covariance_at(*TOUCHES), wanted[:, None, None], rtol=1e-6)
    slope = np.stack([load + 0.5 * load**2, 2 * load**2 - 8 * ridge])
    np.testing.assert_allclose(table.by_parameter(*TOUCHES), slope[:, :, None], rtol=1e-6)
    outside = radius, np.radians([-7.1, 8.1]), load
    assert not table.covariance_at(*outside).any() and not table.by_parameter(*outside).any()
    assert not table.readings(*outside).any()


def test_a_part_that_no_function_has_is_not_stored(monkeypatch: pytest.MonkeyPatch) -> None:
    weights = CorrectionWeights(np.ones(1), np.ones((1, 2)), np.eye(1))
    monkeypatch.setattr(module, "finger_model", lambda model: model)
    monkeypatch.setattr(module, "weights_of", lambda fitted: weights)
    chosen: Any = SimpleNamespace(columns=lambda radius, angle, load: (0.1 * load)[None, :, None], sizes={})
    found = module.table_of(corrected(), chosen)
    np.testing.assert_array_equal(found.terms, [0])
    assert found.slope.shape == (16, 2, 1, 1) and found.covariance.shape == (16, 1, 1)


def test_between_two_locations() -> None:
    """Uncertainty is stored at -2, 0 and 2 degree: at 0.5 degree a quarter of the way."""
    nothing = np.zeros((5, 1))
    slope, covariance = np.array([0.0, 4.0, 8.0]), np.array([1.0, 5.0, 25.0])
    table = module.CorrectionTable(
        np.linspace(-2, 2, 5),
        nothing,
        nothing,
        nothing,
        np.array([0]),
        slope.reshape(3, 1, 1, 1),
        covariance.reshape(3, 1, 1),
        np.zeros(0),
        np.zeros((0, 5, 1)),
    )
    there = np.zeros(1), np.radians([0.5]), np.array([3.0])
    np.testing.assert_allclose(table.by_parameter(*there), 3 * 5.0)
    np.testing.assert_allclose(table.covariance_at(*there), 9 * 10.0)


def test_a_table_as_a_file_holds_it(table: module.CorrectionTable) -> None:
    found = module.CorrectionTable.from_arrays(table.arrays())
    assert found is not None
    for where in (found.readings, found.by_parameter, found.covariance_at):
        np.testing.assert_array_equal(where(*TOUCHES), getattr(table, where.__name__)(*TOUCHES))
    assert module.CorrectionTable.from_arrays({"other": np.zeros(1)}) is None
    part = {name: array for name, array in table.arrays().items() if name != "placed_slope"}
    with pytest.raises(InputError, match="placed_slope"):
        module.CorrectionTable.from_arrays(part)


def test_a_table_of_version_0_1() -> None:
    """Each element had a standard deviation of its own, for each N/m, whatever the parameters."""
    arrays = {f"placed_{name}": np.full((3, 2), value) for name, value in (("even", 1.0), ("wide", 0), ("loaded", 0))}
    sd = np.array([[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]])
    found = module.CorrectionTable.from_arrays(arrays | {"placed_sd": sd, "placed_angle_deg": np.array([-1.0, 0, 1.0])})
    assert found is not None
    there = np.zeros(2), np.radians([0.0, 1.0]), np.array([10.0, 20.0])
    np.testing.assert_allclose(found.covariance_at(*there), [np.diag([9.0, 16.0]), np.diag([100.0, 144.0])])
    assert not found.by_parameter(*there).any()


NODES = np.array([0.0, 0.2, 0.5])


@pytest.fixture
def felt(monkeypatch: pytest.MonkeyPatch) -> module.CorrectionTable:
    """A correction of weights 2, 3 and 5 of P, P² and P (P R)², with a polynomial through three values of P R."""
    weights = CorrectionWeights(np.array([2.0, 3.0, 5.0]), np.ones((3, 1)), np.diag([0.25, 0.01, 7.0]))
    monkeypatch.setattr(module, "finger_model", lambda model: model)
    monkeypatch.setattr(module, "weights_of", lambda fitted: weights)
    monkeypatch.setattr(module, "pressure_nodes", lambda chosen: NODES)
    return module.table_of(corrected(), cast(Any, SimpleNamespace(columns=curved, sizes={"map": 0.1})))


def curved(radius: np.ndarray, angle: np.ndarray, load: np.ndarray) -> np.ndarray:
    pressed = np.minimum(load * radius / 1000, NODES[-1])
    return np.stack([load, load**2, load * pressed**2])[..., None]


def test_a_correction_that_depends_on_p_r_by_a_polynomial(felt: module.CorrectionTable) -> None:
    """Mean and variance at P R of 0, 0.08 and, beyond the last value, 1."""
    np.testing.assert_array_equal(felt.terms, [2, 3, 4, 5])
    touches = np.array([0.0, 4.0, 50.0]), np.radians([-1.3, 2.0, 0.0]), np.array([10.0, 20.0, 20.0])
    columns = curved(*touches)[..., 0]
    np.testing.assert_allclose(felt.readings(*touches)[:, 0], np.array([2.0, 3.0, 5.0]) @ columns, rtol=1e-9)
    wanted = np.array([0.25, 0.01, 7.0]) @ columns**2
    # single precision
    np.testing.assert_allclose(felt.covariance_at(*touches)[:, 0, 0], wanted, rtol=1e-5)
    np.testing.assert_allclose(felt.by_parameter(*touches)[0, :, 0], columns.sum(axis=0), rtol=1e-5)


def test_such_a_table_as_a_file_holds_it(felt: module.CorrectionTable) -> None:
    found = module.CorrectionTable.from_arrays(felt.arrays())
    assert found is not None
    for where in (found.readings, found.by_parameter, found.covariance_at):
        np.testing.assert_array_equal(where(*TOUCHES), getattr(felt, where.__name__)(*TOUCHES))
    part = {name: array for name, array in felt.arrays().items() if name != "placed_nodes"}
    with pytest.raises(InputError, match="placed_nodes"):
        module.CorrectionTable.from_arrays(part)


@pytest.mark.parametrize(
    ("sizes", "own"),
    [
        ({"map": 0.01}, True),
        ({"map": 0.01, "own": 0.003, "shared": 0.0, "wide": 0.0, "loaded": 0.0}, True),
        ({"own": 0.003}, False),
        ({"map": 0.0, "own": 0.003}, False),
        ({"map": 0.01, "loaded": 0.003}, False),
        ({"map": 0.01, "shared": 0.003}, False),
        ({"map": 0.01, "wide": 0.003}, False),
    ],
)
def test_a_correction_by_functions_of_each_element(sizes: dict[str, float], own: bool) -> None:
    assert module.errs_by_element(cast(Any, SimpleNamespace(sizes=sizes))) == own
