"""Touches read with a calibration, and their posteriors by quadrature."""

from __future__ import annotations

import numpy as np
import written_out as w
from calibrated_files import Calibrated

from bayestouch.data.touches import Touches
from bayestouch.results.objects import TouchPosteriors

NAMES = ("R", "theta_c", "P")


TOUCHES, SAMPLES, DRAWS = 30, 64, 1600


def touched(seed: int = 2, samples: int = SAMPLES) -> Touches:
    """Round tips between the elements, of so many samples that the calibration is most of what is not known."""
    rng = np.random.default_rng(seed)
    angle = np.radians(rng.uniform(-17, 17, TOUCHES))
    pressed = w.Pressed(rng.uniform(2.5, 8, TOUCHES), angle, rng.uniform(160, 240, TOUCHES))
    return w.recorded(w.true_finger(), pressed, rng, samples=samples)


def moments(read: TouchPosteriors) -> tuple[np.ndarray, np.ndarray]:
    """Mean and sd (t, 3) of R (mm), location (rad) and load, of the draws."""
    draws = np.stack([read.posterior[name].reshape(-1, len(read.rows.touch)) for name in NAMES], axis=-1)
    draws[..., 1] = np.radians(draws[..., 1])
    return draws.mean(axis=0), draws.std(axis=0)


def by_quadrature(
    known: Calibrated, table: Touches, samples: int, about: tuple[np.ndarray, np.ndarray], *, exact: bool, load: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Mean and sd of each touch from the files' numbers; calibration `exact` or as uncertain as its draws."""
    draws = known.draws
    vector = w.parameters_of(known.group("mode"))
    chain, means = w.finger_at(vector), table.averaged()
    noise = (draws["noise_sd"] ** 2).mean(axis=0) / samples + (draws["discrepancy_sd"] ** 2).mean(axis=0)
    force_sd = np.sqrt((draws["force_noise_sd"] ** 2).mean() / samples)
    covariance = np.tile(np.diag(noise), (len(means.load), 1, 1))
    if not exact:
        slope = w.slopes(vector, w.Pressed(*about[0].T))
        covariance += np.einsum("dti,de,etj->tij", slope, np.cov(w.parameters_of(draws).T), slope)
    found = [
        w.touch_posterior(
            chain.predict,
            means.readings[k],
            covariance[k],
            (means.load[k], force_sd) if load else None,
            about[0][k],
            about[1][k],
        )
        for k in range(len(means.load))
    ]
    return np.stack([each.mean for each in found]), np.stack([each.sd for each in found])
