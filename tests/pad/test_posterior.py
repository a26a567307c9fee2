"""Groups of a pad's calibration that are written on request, and its log posterior density."""

from __future__ import annotations

import numpy as np
import pytest
from pad_simulation import line
from scipy.stats import norm

from bayestouch.errors import InputError
from bayestouch.pad.calibration import calibrate_pad
from bayestouch.priors.parameters import LogNormal


def test_log_posterior_is_likelihood_and_prior() -> None:
    """Without a map touches are independent: their densities and the priors add up to the density that was drawn."""
    pad = line()
    touches = pad.touch(np.linspace(6, 34, 29)[:, None], np.random.default_rng(0), measured=True)
    groups = ("log_likelihood", "log_prior")
    fit = calibrate_pad(pad.dataset(touches), kernel="gaussian", empirical=False, draws=64, groups=groups)
    log, prior = fit.groups["log_likelihood"]["whole_touch"], fit.groups["log_prior"]
    assert log.shape == (4, 16, 29) and set(prior) == set(fit.posterior)
    by_name = {parameter.name: parameter.prior for parameter in fit.parameters}
    jacobian = sum(
        np.log(draws).reshape(4, 16, -1).sum(axis=-1)
        for name, draws in fit.posterior.items()
        if isinstance(by_name[name], LogNormal)
    )
    total = log.sum(axis=-1) + sum(a.reshape(4, 16, -1).sum(axis=-1) for a in prior.values()) + jacobian
    difference = fit.groups["sample_stats"]["lp"] - total
    assert np.std(total) > 1 and np.ptp(difference) < 1e-6
    # readings of a touch at one draw, written out; the noise is that of the fit
    residual = np.abs(fit.rows.observed - fit.rows.predicted)
    typical = norm(0, fit.rows.sd).logpdf(residual).sum()
    assert log.sum(axis=-1).mean() == pytest.approx(typical, rel=0.1)


def test_other_groups_are_refused() -> None:
    pad = line()
    touches = pad.touch(np.linspace(6, 34, 29)[:, None], np.random.default_rng(0), measured=True)
    with pytest.raises(InputError, match=r"groups: .*log_likelihood and log_prior, no others"):
        calibrate_pad(pad.dataset(touches), kernel="gaussian", empirical=False, draws=64, groups=("prior",))
