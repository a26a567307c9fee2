"""Values of effects of fingers, simulated by the independent simulator, as `bayestouch.calibrate` recovers them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from finger_cases import CASES, Case, recovered

from bayestouch.effects import effect_classes
from bayestouch.effects.effect import EffectParameter
from bayestouch.effects.listing import FINGER

# A right sd is left behind by one value in 16,000.
FAR = 4.0


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.key)
def test_values_are_recovered_with_their_signs(case: Case, workers_folder: Path) -> None:
    found = recovered(case, 1, workers_folder)
    for name, value in case.values.items():
        if name == "own":
            # One of two kinds, which are tried one by one.
            assert found.value[name] == value, name
            continue
        assert abs(found.value[name] - value) < FAR * found.sd[name], (name, found.value, found.sd)
    null = {p.name: p.null or 0.0 for p in _parameters(case)}
    for name in case.seen:
        # Five of its sds from nothing, so that its sign (and a factor of two) is no chance; a limit is nothing at 1.5.
        # Sizes of what is random have no sign, and a drift of ten correlation times shows its own to a third.
        nothing = 1.5 if np.isinf(null[name]) else null[name]
        far = 2.0 if name in ("sd", "probability") else 5.0
        assert abs(found.value[name] - nothing) > far * found.sd[name], (name, found.value, found.sd)
    # With the right effect nothing is left over: 976 mean readings scatter by sqrt(2/976), pure error by half of that.
    assert found.calibration.statistics["lack_of_fit"] < 1 + 4 * np.sqrt(2 / 976 * 1.25)


def test_every_effect_of_fingers_is_tried() -> None:
    """And those that have a sign with both."""
    only_pads = {"load_nonlinearity", "creep_by_element"}
    built_in = {name for name, cls in effect_classes().items() if cls.__module__.startswith("bayestouch.")}
    assert {case.name for case in CASES} == built_in - only_pads
    for name in built_in - only_pads:
        cases = [case for case in CASES if case.name == name]
        for parameter in _parameters(cases[0]):
            if parameter.null == 0 and parameter.prior.support[0] < 0:
                assert {np.sign(case.values[parameter.name]) for case in cases} == {-1.0, 1.0}, name


def _parameters(case: Case) -> tuple[EffectParameter, ...]:
    effect = effect_classes()[case.name].suited(
        replace(FINGER, contact=case.contact, n_elements=case.design.n_elements)
    )
    assert effect is not None
    return effect.parameters
