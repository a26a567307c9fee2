"""Which functions of place are chosen."""

from __future__ import annotations

import numpy as np
from place_cases import MAP, NOTHING, PLACE, SURFACE, drifting, fit_of, missed_fit

from bayestouch.finger.place import functions
from bayestouch.finger.place.choice import choose_functions, place_folds


def test_none_where_nothing_is_missed() -> None:
    assert choose_functions(missed_fit(NOTHING)) is None


def test_an_error_of_the_maps_is_found_as_such() -> None:
    choice = choose_functions(missed_fit(MAP))
    assert choice is not None
    assert choice.functions.kind == functions.MAP
    assert choice.functions.surface is None
    own = choice.functions.own
    # A squared-exponential process of 8° and 2 % is near a Matérn process half as long again; sizes are a grid of 1.4.
    assert own is not None and 6 <= own.length_deg <= 14 and 0.012 < own.sd < 0.035
    assert choice.gain > 10 * choice.gain_sd
    assert "E map" in choice.note and "log density +" in choice.note


def test_an_error_of_the_place_is_found_as_such() -> None:
    choice = choose_functions(missed_fit(PLACE))
    assert choice is not None
    assert choice.functions.kind == functions.PLACE


def test_a_surface_out_of_round_is_found_as_such() -> None:
    choice = choose_functions(missed_fit(SURFACE))
    assert choice is not None
    assert choice.functions.own is None
    assert choice.functions.surface is not None
    # 0.012 /mm is 15 % of the curvature of a circle of 12.7 mm
    assert 0.07 < choice.functions.surface.sd < 0.3
    assert "curvature" in choice.note


def test_a_drift_during_one_pass_over_the_finger_is_no_function_of_place() -> None:
    """Each place was touched at one time: what explains the readings as well belongs to the time."""
    fit = fit_of(drifting())
    assert fit.lack_of_fit > 2
    assert choose_functions(fit) is None
    assert choose_functions(fit, wanted=True) is not None


def test_too_few_places_choose_nothing() -> None:
    assert place_folds(np.arange(10.0)) is None
    folds = place_folds(np.repeat(np.arange(60.0), 2)[::-1])
    assert folds is not None
    # neighbours together, touches of one place together
    assert (np.diff(folds) <= 0).all() and len(np.unique(folds)) == folds.max() + 1 == 20
