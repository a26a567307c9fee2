"""Posteriors of 20 touches, the hard ones among them, against dense quadrature: by chains and by importance sampling,
with the calibration taken as exact and with what it leaves uncertain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from known_fingers import dataset, known_touches
from touch_quadrature import Marginals, OneTouch, integrate

import bayestouch
from bayestouch.chain.neighbours import calibration_jacobian
from bayestouch.data.touches import Touches, touches_from
from bayestouch.finger.calibration import finger_chain
from bayestouch.finger.reading.covariance import reading_covariance

# True R (mm; an edge is 0, a flat 12.7), location (degree; elements every 8.8 to ±26.4), samples, force reading.
CASES = [
    (0.3, 0.0, 1, True),
    (0.3, 0.0, 1, False),
    (0.3, 4.4, 20, True),
    (0.3, 27.0, 4, False),
    (0.0, -8.8, 1, True),
    (12.5, 0.0, 1, True),
    (12.5, -13.2, 1, False),
    (12.6, 4.4, 20, False),
    (12.65, 8.8, 20, True),
    (12.7, -26.4, 4, True),
    (4.0, 4.4, 1, True),
    (4.0, 13.2, 20, False),
    (6.0, 26.4, 1, True),
    (6.0, 29.0, 4, True),
    (3.0, 31.0, 20, True),
    (2.0, -33.0, 1, False),
    (2.0, 8.8, 1, False),
    (9.0, -4.4, 1, False),
    (9.0, 17.6, 20, True),
    (1.0, 1.5, 4, True),
]
# So many draws that Monte Carlo error is well inside the bounds: of 60,000 the sd of a normal posterior scatters by
# 0.3 % and its 5 % quantile by 0.009 sd, those of the most skewed posterior here by twice that.
DRAWS = 1 << 13
# They come from copies of each touch, drawn side by side with other random numbers: emcee takes its time by steps.
COPIES = 8


@dataclass(frozen=True, eq=False)
class Read:
    """Touches of a calibrated finger, as a table and one by one."""

    calibration: bayestouch.Calibration
    table: Touches
    means: np.ndarray
    loads: np.ndarray


@pytest.fixture(scope="module")
def read() -> Read:
    calibration = bayestouch.calibrate(dataset(known_touches(1, step=3.0)), draws=200)
    chain = finger_chain(calibration)
    rng = np.random.default_rng(6)
    rows, loads = [], []
    for radius, angle, samples, force in CASES:
        clean = chain.predict(radius, np.radians(angle), 200.0)
        sd = calibration.noise.mean_sd(np.ones(clean.shape), clean)
        rows.append(clean + sd * rng.standard_normal((samples, len(clean))))
        loads.append(200.0 + calibration.noise.force_sd * rng.standard_normal(samples) if force else [np.nan] * samples)
    touch = np.repeat(np.arange(len(CASES)), [case[2] for case in CASES])
    table = touches_from(
        touch=np.concatenate([touch + copy * len(CASES) for copy in range(COPIES)]),
        readings=np.concatenate(rows * COPIES),
        load=np.concatenate(loads * COPIES),
    )
    means = np.array([readings.mean(axis=0) for readings in rows])
    return Read(calibration, table, means, np.array([np.mean(load) for load in loads]))


def one(read: Read, number: int, extra: np.ndarray | float = 0.0) -> OneTouch:
    return OneTouch.of(read.calibration, read.means[number], CASES[number][2], read.loads[number], extra)


@pytest.fixture(scope="module")
def plugged_in(read: Read) -> list[Marginals]:
    return [integrate(one(read, number)) for number in range(len(CASES))]


@pytest.fixture(scope="module")
def propagated(read: Read, plugged_in: list[Marginals]) -> list[Marginals]:
    """The covariance of what the calibration leaves uncertain is that at the peak of the plugged-in posterior."""
    out = []
    for number, marginals in enumerate(plugged_in):
        jacobian = calibration_jacobian(finger_chain(read.calibration), *np.array(marginals.peak)[:, None])
        out.append(integrate(one(read, number, reading_covariance(jacobian, read.calibration.covariance)[0])))
    return out


@pytest.mark.slow
@pytest.mark.parametrize("method", ["emcee", "importance"])
@pytest.mark.parametrize("calibration", ["plugged_in", "propagated"])
def test_twenty_touches_agree_with_quadrature(
    read: Read, calibration: str, method: str, request: pytest.FixtureRequest
) -> None:
    expected: list[Marginals] = request.getfixturevalue(calibration)
    plug_in = calibration == "plugged_in"
    options = {"method": method, "draws": DRAWS, "seed": 1, "workers": 1}
    # Copies share their noise, which the check of the sensor would take for a fault.
    result = bayestouch.infer(read.table, read.calibration, plug_in=plug_in, check_sensor=False, **options)
    # The Pareto shape of good weights scatters: one copy in a hundred may be graded poor, and is held to the same.
    assert result.sample_stats["grade"].mean() > 0.98
    for number, marginals in enumerate(expected):
        copies = slice(number, None, len(CASES))
        ess = result.sample_stats["ess_bulk"][copies].sum()
        assert ess > 0.6 * DRAWS * COPIES
        for name, (mean, sd, *ends) in marginals.statistics.items():
            draws = result.posterior[name][:, :, copies].ravel()
            where = f"touch {number} {CASES[number]}, {name}"
            # plus 0.003 sd for the reading table, off by up to 0.02 in the log likelihood
            assert abs(draws.mean() - mean) < 4 * sd / np.sqrt(ess) + 0.003 * sd, where
            assert draws.std() == pytest.approx(sd, rel=0.03), where
            quantiles = np.quantile(draws, [0.05, 0.95])
            np.testing.assert_allclose(quantiles, ends, rtol=0, atol=0.05 * sd, err_msg=where)


@pytest.mark.slow
def test_the_hard_ones_are_there(plugged_in: list[Marginals], propagated: list[Marginals]) -> None:
    """Cut off at the edge, cut off at the flat, spread over all radii; and the calibration's uncertainty shows."""
    lowest, highest = (np.array([m.statistics["R"][end] for m in plugged_in]) for end in (2, 3))
    assert highest.min() < 0.7
    assert lowest.max() > 12.3
    assert (highest - lowest).max() > 8.0
    wider = [
        b.statistics["theta_c"][1] / a.statistics["theta_c"][1] for a, b in zip(plugged_in, propagated, strict=True)
    ]
    assert max(wider) > 1.2
