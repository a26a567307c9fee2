"""References are drawn by the turn that is nearest the posterior."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from posterior_cases import touches


def test_a_reference_from_0_to_360_is_drawn_beside_the_draws() -> None:
    made = touches()
    mean = made.mean("theta_c")
    near = mean + np.linspace(-3, 3, len(mean))
    for turns in (0, 360, -720):
        stated = replace(made, reference={**made.reference, "theta_c": near + turns})
        points, right = stated.plot_estimates("theta_c").get_lines()[:2]
        np.testing.assert_allclose(points.get_xdata(), near, atol=1e-9)
        np.testing.assert_array_equal(points.get_ydata(), mean)
        np.testing.assert_allclose(right.get_xdata(), [near.min(), near.max()], atol=1e-9)
        cross = stated.plot_touch(int(made.rows.touch[1]), ("theta_c", "R")).get_lines()
        if np.isfinite(made.reference["R"][1]):
            np.testing.assert_allclose(cross[1].get_xdata(), near[1:2], atol=1e-9)
