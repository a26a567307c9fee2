"""A correction without a cause on a finger: what each of its functions does to readings, written out."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.chain.smooth import SmoothBasis
from bayestouch.finger import correction_basis
from bayestouch.finger.correction_basis import FingerCorrectionBasis
from bayestouch.model.correction import Correction

ELEMENT, PEAK = np.array([-10.0, 5.0, 20.0]), np.array([3.0, 4.0, 5.0])
ANGLE, LOAD, RADIUS = (
    np.array([-15.0, 0.0, 12.0, 30.0]),
    np.array([20.0, 40.0, 60.0, 80.0]),
    np.array([0.0, 2.0, 4.0, 8.0]),
)


def basis(load: np.ndarray = LOAD) -> FingerCorrectionBasis:
    """Elements at -10, 5 and 20 degree, touched from -15 to 30, under loads about 40 N/m."""
    recording: Any = SimpleNamespace(place=(ANGLE,), load=load)
    spectra = SimpleNamespace(at=lambda kappa, n: np.exp(-kappa[:, None] * np.arange(n + 1)))
    chain: Any = SimpleNamespace(outer_radius_mm=16.0, shear_modulus_MPa=0.5, spectra=spectra)
    return FingerCorrectionBasis.of(ELEMENT, PEAK, 40.0, chain, recording)


def test_settings() -> None:
    lengths = (correction_basis.SHARED_LENGTH, correction_basis.OWN_LENGTH, correction_basis.WIDE_LENGTH)
    assert lengths == (5.0, 9.0, 7.0)
    assert (correction_basis.LOADED_REACH, correction_basis.LEAST_LOAD_SD) == (30.0, 0.02)


def test_basis_over_what_was_touched() -> None:
    """From the first touch less the last element to the last touch less the first element."""
    found = basis()
    np.testing.assert_allclose(found.element_deg, ELEMENT)
    assert (found.reference_load, found.widest) == (40.0, 16.0)
    # Up to a flat under the largest load, and waves that Process has of 9 degree.
    assert found.felt.nodes[-1] == pytest.approx(16.0 * 80 / 1000) and found.felt.process.length_deg == 9.0
    np.testing.assert_allclose(found.felt.felt[-1, :3], np.exp(-1.28 / 0.5 * np.arange(3)))
    assert found.load_mean == pytest.approx(1.25) and found.load_sd == pytest.approx(np.std([0.5, 1, 1.5, 2]))
    at = np.array([-35.0, -3.0, 17.0, 40.0])
    np.testing.assert_array_equal(found.shared(at), SmoothBasis.of(-35, 40, 5.0, most=90)(at))
    np.testing.assert_array_equal(found.wide(at), SmoothBasis.of(-35, 40, 7.0, most=60)(at))
    np.testing.assert_array_equal(found.loaded(at[1:3]), SmoothBasis.of(-30, 30, 9.0)(at[1:3]))
    for own, element in zip(found.own, ELEMENT, strict=True):
        np.testing.assert_allclose(own(at), SmoothBasis.of(-15 - element, 30 - element, 9.0)(at), rtol=1e-9, atol=1e-12)


def test_ranges_that_rounding_makes_uneven_have_the_same_knots() -> None:
    """31.5 degree, seven spacings of knots: 31.500000000000004 from the first element, and 31.5 from the second."""
    element, touched = np.array([-31.7, 4.4]), np.array([-15.75, 15.75])
    low, high = (end - element for end in touched)
    assert ((high - low) / 9.0 * 2 > 7).tolist() == [True, False]
    recording: Any = SimpleNamespace(place=(touched,), load=LOAD[:2])
    spectra = SimpleNamespace(at=lambda kappa, n: np.exp(-kappa[:, None] * np.arange(n + 1)))
    chain: Any = SimpleNamespace(outer_radius_mm=16.0, shear_modulus_MPa=0.5, spectra=spectra)
    found = FingerCorrectionBasis.of(element, PEAK[:2], 40.0, chain, recording)
    for own, e in zip(found.own, element, strict=True):
        np.testing.assert_allclose(own.knots, np.linspace(-15.75, 15.75, 9) - e, atol=1e-12)
    assert found.columns(RADIUS[:2], touched, LOAD[:2])["own"].shape == (18, 2, 2)


def test_columns() -> None:
    """In proportion to load and peak; wide contacts by P R over a flat's; the load about its mean."""
    made = basis()
    parts = made.columns(RADIUS, ANGLE, LOAD)
    assert list(parts) == ["shared", "map", "own", "wide", "loaded"]
    for t in range(4):
        share = LOAD[t] / 40
        own_rows, loaded_rows, map_rows = np.zeros((3, 3), dtype=object)
        for e in range(3):
            away, scale = ANGLE[t] - ELEMENT[e], share * PEAK[e]
            at = np.array([away])
            np.testing.assert_allclose(parts["shared"][:, t, e], made.shared(at)[0] * scale, atol=1e-12)
            wide = RADIUS[t] / 16 * share
            np.testing.assert_allclose(parts["wide"][:, t, e], made.wide(at)[0] * scale * wide, atol=1e-12)
            own_rows[e] = made.own[e](at)[0] * scale
            map_rows[e] = made.felt(RADIUS[t : t + 1], LOAD[t : t + 1], at[None])[0, 0] * scale
            loaded_rows[e] = made.loaded(at)[0] * scale * (share - 1.25) / made.load_sd
        for name, rows in (("map", map_rows), ("own", own_rows), ("loaded", loaded_rows)):
            k = len(parts[name]) // 3
            for e in range(3):
                wanted = np.zeros((k, 3))
                wanted[:, e] = rows[e]
                np.testing.assert_allclose(parts[name][e * k : (e + 1) * k, t], wanted, atol=1e-12)


@pytest.mark.parametrize(("spread", "there"), [(0.0199, False), (0.0201, True)])
def test_loads_that_hardly_vary_tell_nothing(spread: float, there: bool) -> None:
    load = 40 * (1 + spread * np.array([1.0, -1.0, 1.0, -1.0]))
    assert ("loaded" in basis(load).columns(RADIUS, ANGLE, load)) == there


def test_columns_of_a_chosen_correction() -> None:
    """Each part at its size; those of none are left out."""
    parts = {"a": np.ones((2, 3, 1)), "b": np.full((1, 3, 1), 5.0), "c": np.full((1, 3, 1), 7.0)}
    made: Any = SimpleNamespace(columns=lambda *where: parts)
    chosen = Correction(made, {"a": 0.1, "b": 0.0, "c": 0.03}, None)  # type: ignore[arg-type]
    np.testing.assert_allclose(chosen.columns()[:, 0, 0], [0.1, 0.1, 0.21])


def test_loads_that_vary_by_just_the_limit_tell_nothing() -> None:
    """More than the limit is asked for."""
    at_limit = replace(basis(), load_sd=correction_basis.LEAST_LOAD_SD)
    assert "loaded" not in at_limit.columns(RADIUS, ANGLE, LOAD)
