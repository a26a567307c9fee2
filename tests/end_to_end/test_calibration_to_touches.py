"""What passes from a calibration's file to the draws of touches, by quadrature of a written-out posterior.

The covariance that a calibration leaves is taken from the draws on file (which `test_draws_to_files.py` holds against
the calibration touches), carried to the readings by differences of the prediction, and added to the noise.
"""

from __future__ import annotations

import crosstalk
import numpy as np
import pytest
import written_out as w
from calibrated_files import Calibrated
from handed_over import DRAWS, NAMES, SAMPLES, by_quadrature, moments, touched

import bayestouch


@pytest.mark.parametrize("method", ["emcee", "importance"])
@pytest.mark.parametrize(("exact", "load"), [(False, True), (False, False), (True, True)])
def test_draws_of_touches_hold_noise_calibration_and_load(
    hardly_known: Calibrated, method: str, exact: bool, load: bool
) -> None:
    """Means and sds of thirty touches.

    The sd of 1,400 effective draws is good to 1.9 %, the mean ratio over 30 touches to 0.35 %: 1.5 % is four of these.
    A calibration whose variance is 10 % too small takes 2.9, 2.9 and (without the force sensor) 3.4 % off.
    """
    table = touched()
    read = bayestouch.infer(
        table,
        hardly_known.load(),
        draws=DRAWS,
        seed=4,
        method=method,
        plug_in=exact,
        use_load=load,
        check_sensor=False,
    )
    mean, sd = moments(read)
    expected_mean, expected_sd = by_quadrature(hardly_known, table, SAMPLES, (mean, sd), exact=exact, load=load)
    ratio = (sd / expected_sd).mean(axis=0)
    np.testing.assert_allclose(ratio, 1, atol=0.015, err_msg=str(NAMES))
    z = (mean - expected_mean) / expected_sd
    # a mean of 1,400 draws scatters by 0.027 sd: five of these each, and 4/sqrt(30) of it in the mean of all
    assert np.abs(z).max() < 0.14
    assert np.abs(z.mean(axis=0)).max() < 0.025


def test_an_uncertain_calibration_is_most_of_what_is_not_known(hardly_known: Calibrated) -> None:
    """So that the test above tells: variances with it are more than twice those without."""
    table, calibration = touched(), hardly_known.load()
    full, exact = (
        moments(bayestouch.infer(table, calibration, draws=400, plug_in=each, check_sensor=False))[1]
        for each in (False, True)
    )
    assert np.median((full / exact)[:, :2] ** 2) > 2


@pytest.mark.parametrize("exact", [False, True])
def test_draws_of_touches_read_with_effects_hold_the_calibration(with_crosstalk: Calibrated, exact: bool) -> None:
    """The same through crosstalk: readings, and what an uncertain share, reach and lean leave of them.

    A mean ratio over 30 touches is good to 0.35 %. Without the calibration's part the sds are a third too small.
    """
    rng, n = np.random.default_rng(12), SAMPLES
    pressed = w.Pressed(rng.uniform(2.5, 8, 30), np.radians(rng.uniform(-17, 17, 30)), rng.uniform(160, 240, 30))
    table = w.recorded(w.true_finger(), pressed, rng, samples=n, after=crosstalk.leaked)
    read = bayestouch.infer(table, with_crosstalk.load(), draws=DRAWS, seed=4, plug_in=exact, check_sensor=False)
    mean, sd = moments(read)
    mode, noise, means = with_crosstalk.group("mode"), with_crosstalk.group("noise"), table.averaged()
    values = np.array([mode[f"crosstalk_{name}"] for name in ("share", "reach", "lean")])
    vector = np.concatenate([w.parameters_of(mode), values])
    variance = noise["tactile_sd"] ** 2 / n + noise["discrepancy_sd"] ** 2
    covariance = np.tile(np.diag(variance), (30, 1, 1))
    if not exact:
        own = [with_crosstalk.draws[f"crosstalk_{name}"][:, None] for name in ("share", "reach", "lean")]
        draws = np.concatenate([w.parameters_of(with_crosstalk.draws), *own], axis=1)
        slope = crosstalk.slopes(vector, w.Pressed(*mean.T))
        covariance += np.einsum("dti,de,etj->tij", slope, np.cov(draws.T), slope)
    chain = w.finger_at(vector[:-3])
    found = [
        w.touch_posterior(
            lambda *touch: crosstalk.leaked(chain.predict(*touch), values),
            means.readings[k],
            covariance[k],
            (means.load[k], float(noise["force_sd"]) / np.sqrt(n)),
            mean[k],
            sd[k],
        )
        for k in range(30)
    ]
    ratio = (sd / np.stack([each.sd for each in found])).mean(axis=0)
    # the covariance is that at the mode of the noise alone; it changes by a per cent over a posterior
    np.testing.assert_allclose(ratio, 1, atol=0.015, err_msg=str(NAMES))
    z = (mean - np.stack([each.mean for each in found])) / sd
    assert np.abs(z).max() < 0.14
