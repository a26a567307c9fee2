"""Which effects say that a reference is not what the data set states: those that docs/diagnosis.md names, by body."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch.effects import Setting, catalogue
from bayestouch.finger.model import FingerModel
from bayestouch.model.as_stated import moves_reference
from bayestouch.model.base import SensorModel
from bayestouch.pad.model import PadModel


def setting(finger: bool) -> Setting:
    """A sensor on which every effect of its kind can occur."""
    return Setting(
        finger=finger,
        n_elements=4,
        element_place=(np.linspace(-15.0, 15.0, 4),),
        place_range=((-20.0, 20.0),),
        reference_load=200.0,
        load_unit="N/m" if finger else "N",
        contact="layer" if finger else "",
        has_edges=finger,
        hold_s=5.0,
        gap_s=5.0,
        span_s=1000.0,
        time_unit="s",
        loads_vary=True,
        radii_mm=(9.4, 12.7) if finger else (0.0, 0.0),
    )


@pytest.mark.parametrize(
    ("model", "moving"),
    [
        (FingerModel, {"blunt_edge", "load_misalignment", "load_offset", "prober_eccentricity"}),
        # What the load does between force sensor and elements belongs to a pad's response to the load as stated.
        (PadModel, {"load_misalignment", "load_offset"}),
    ],
)
def test_effects_that_move_references(model: type[SensorModel], moving: set[str]) -> None:
    effects = catalogue(setting(model is FingerModel))
    assert {each.name for each in effects if moves_reference(each, model.reference_stages)} == moving
