"""The posterior density of a calibration as a function."""

from __future__ import annotations

from bayestouch.calibration.with_effects import fit_stated
from bayestouch.data.dataset import DataSet, require_dataset
from bayestouch.errors import InputError, about
from bayestouch.model.body import body_of
from bayestouch.model.log_density import LogDensity
from bayestouch.results.data import require_calibration
from bayestouch.results.objects import Calibration

__all__ = ["LogDensity", "log_density"]


def log_density(calibration: Calibration, touches: DataSet) -> LogDensity:
    """Posterior density of the parameters of a calibration, for any sampler.

    `bayestouch.calibrate` draws from this density: the likelihood of the calibration touches times the priors of the
    calibration. The true load of each touch, the drifts and the correction are integrated out.

    Parameters
    ----------
    calibration : Calibration
        A calibration of a finger or a pad, with or without effects. On a pad the empirical map is integrated out; the
        noise with the values of noise effects, and the size and the length of the map, have the values of the
        calibration.
    touches : DataSet
        The data set from which the calibration was made.

    Returns
    -------
    LogDensity
        Vectorised function of points (n, d), with its transforms, prior and likelihood.

    Raises
    ------
    InputError
        The calibration of a finger has an identified E map or ``discrepancy="none"``, or the data set is of another
        sensor.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> dataset = bayestouch.simulate(design, seed=3).dataset
    >>> calibration = bayestouch.calibrate(dataset, draws=200)
    >>> density = bayestouch.log_density(calibration, dataset)
    >>> density
    LogDensity of 23 coordinates, a likelihood of each touch
      log response (4), r_s (4), theta_s (4), sigma, log mu, log noise_sd (4), log
        discrepancy_sd (4), log force_noise_sd
    >>> difference = density(density.start) - density(density.start + 0.01)
    >>> bool(difference > 0)  # the density is largest at the mode
    True
    """
    require_calibration(calibration)
    require_dataset(touches)
    if touches.sensor.body != calibration.sensor.body:
        raise InputError("the data set is of another sensor than the calibration", file=touches.path)
    with about(touches.path):
        model, options = body_of(calibration.sensor).stated(calibration)
        fit = fit_stated(touches, model, draws=8, seed=int(calibration.settings["seed"]), **options)
        return fit.evaluation.log_density(fit.fitted, fit.added, fit.correction)
