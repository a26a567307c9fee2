"""Values of two noise effects that are fitted one after the other, on simulated fingers."""

from __future__ import annotations

import pytest

import bayestouch
from bayestouch.calibration.with_effects import fit_stated
from bayestouch.effects.stated import StatedModel

TRUTH = {"outliers": 0.02, "signal_dependent_noise": 0.06}


@pytest.mark.slow
@pytest.mark.parametrize("order", [tuple(TRUTH), tuple(reversed(TRUTH))])
def test_outliers_and_noise_that_grows_with_the_signal_keep_their_parts(order: tuple[str, ...]) -> None:
    """Probability and share within 2.5 sd of what was simulated, whichever comes first.

    Large deviations at large signals are no wrong readings, and wrong readings are no noise that grows.
    """
    design = bayestouch.FingerDesign(n_elements=3, calibration_span_deg=25.0, touch_step_deg=5.0)
    data = bayestouch.simulate(design, effects=TRUTH, seed=1).dataset
    model = StatedModel("finger", "layer", tuple((name, {}) for name in order))
    added = fit_stated(data, model, draws=1, seed=0, contact="layer").added
    assert tuple(each.effect.name for each in added) == order
    for each in added:
        value, sd, true = each.values[0], each.sd[0], TRUTH[each.effect.name]
        assert abs(value - true) < 2.5 * sd and sd < 0.2 * true
