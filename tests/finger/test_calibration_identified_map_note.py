"""What a calibration says of a lack of fit that stays with the identified E map, and what it does not say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import bayestouch
from bayestouch import Calibration
from bayestouch.data.dataset import DataSet
from bayestouch.simulation import FingerDesign

DESIGN = FingerDesign(
    n_elements=6,
    touch_radii_mm=(3.9,),
    touch_step_deg=10.0,
    flat_step_deg=6.0,
    samples_per_touch=5,
    calibration_span_deg=60.0,
)


def identified(dataset: DataSet) -> Calibration:
    return bayestouch.calibrate(dataset, e_map="empirical", draws=100, seed=0)


def notes_on_the_map(calibration: Calibration) -> list[str]:
    return [note for note in calibration.notes if "identified E map" in note]


def test_a_rough_property_of_place_is_not_denied() -> None:
    """Every place has an error of its own, in proportion to the load: no smooth map takes it up."""
    dataset = bayestouch.simulate(DESIGN, seed=1).dataset
    table = dataset.calibration
    assert table is not None and table.angle_deg is not None
    places, at = np.unique(table.angle_deg, return_inverse=True)
    share = 0.05 * np.random.default_rng(0).standard_normal(len(places))
    readings = table.readings * (1 + share[at])[:, None]
    found = identified(replace(dataset, calibration=replace(table, readings=readings)))
    assert found.statistics["lack_of_fit_empirical"] > 1.5
    (note,) = notes_on_the_map(found)
    assert "from place to place faster than the map" in note
    assert "no property of place" not in note


def test_a_smooth_property_of_place_is_taken_up_by_the_map() -> None:
    found = identified(bayestouch.simulate(DESIGN, effects={"soft_spot": 0.3}, seed=1).dataset)
    assert found.statistics["lack_of_fit"] > 1.5 > found.statistics["lack_of_fit_empirical"]
    assert notes_on_the_map(found) == []


def test_an_element_without_readings_is_not_in_the_lack_of_fit_of_the_map() -> None:
    """With one of six dead the mean is that of five elements that fit: about 1. The prior alone has a mean of 20."""
    dataset = bayestouch.simulate(DESIGN, seed=1).dataset
    table = dataset.calibration
    assert table is not None
    readings = np.where(np.arange(6) == 2, np.nan, table.readings)
    found = identified(replace(dataset, calibration=replace(table, readings=readings)))
    assert found.statistics["lack_of_fit_empirical"] < 1.3
    assert notes_on_the_map(found) == []
