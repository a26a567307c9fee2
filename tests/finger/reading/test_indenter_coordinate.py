"""The coordinate that touches of a finger are drawn in: its density is that of the indenter, by change of variable."""

from __future__ import annotations

import numpy as np
import pytest
import written_out as w
from scipy import stats

from bayestouch.finger.reading.indenter_coordinate import IndenterCoordinate
from bayestouch.priors.indenters import IndenterDistribution, IndenterPrior, UniformCurvature, UniformRadius
from bayestouch.priors.parameters import LogNormal

R = np.array([0.5, 2.0, 5.0, 9.0, 12.0])
TIP = R * w.OUTER / (w.OUTER - R)


@pytest.mark.parametrize(
    ("prior", "below"),
    [
        (UniformRadius(), R / w.OUTER),
        # uniform in 1/r_c from 0 (a flat) to 1/0.4 mm: what is blunter has less
        (UniformCurvature(0.4), 1 - 0.4 / TIP),
        (IndenterDistribution(LogNormal(3.0, 0.8)), stats.lognorm(0.8, scale=3.0).cdf(TIP)),
    ],
)
def test_the_density_of_the_coordinate_is_that_of_the_indenter(prior: IndenterPrior, below: np.ndarray) -> None:
    """Sums over w: one in all, and below each radius what the indenter's own law says."""
    coordinate = IndenterCoordinate(prior.radius_prior(w.OUTER), w.OUTER)
    edges = np.linspace(-16, 16, 64_001)
    middle = 0.5 * (edges[1:] + edges[:-1])
    mass = np.exp(coordinate.log_density(middle)) * np.diff(edges)
    assert mass.sum() == pytest.approx(1, abs=1e-5)
    radius = coordinate.radius(middle)
    # a step of w is up to 1/600 mm of R
    np.testing.assert_allclose([mass[radius < each].sum() for each in R], below, atol=1e-3)
