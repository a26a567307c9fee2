"""The touches that a report advises are those of `bayestouch.next_touches`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bayestouch
from bayestouch.reporting.next_touches import COUNT, about_next_touches


@pytest.mark.parametrize("body", ["finger", "pad"])
def test_best_touches_with_the_expected_sd(body: str) -> None:
    if body == "finger":
        design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
        one = bayestouch.calibrate(bayestouch.simulate(design, seed=3).dataset, draws=200)
    else:
        pad = bayestouch.PadDesign(
            element_x_mm=(0.0, 6.0, 12.0), element_y_mm=None, calibration_step_mm=1.0, n_touches=30
        )
        one = bayestouch.calibrate(bayestouch.simulate(pad, seed=3).dataset, kernel="gaussian", draws=200)
    found = about_next_touches(one)
    assert found is not None
    best = bayestouch.next_touches(one, count=COUNT, about="places")
    assert list(found["units"]) == list(best.quantities)
    sds = [found["expected_sd"], *(each["expected_sd"] for each in found["touches"])]
    name = best.quantities[0]
    np.testing.assert_allclose([each[name] for each in sds], [best.before[0], *best.after[:, 0]])
    place = one.sensor.body.location_columns[0]
    assert [each["place"][place] for each in found["touches"]] == getattr(best.touches, place).tolist()
    identified = replace(one, settings={**one.settings, "e_map": "empirical"})
    assert body == "pad" or about_next_touches(identified) is None
