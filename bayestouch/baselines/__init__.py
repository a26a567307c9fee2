"""Touches of a pad read by regression without physics: what a model of the sensor has to be better than.

A regression gives each element's reading as a function of location and load: a Gaussian process, or a polynomial with
a penalty on its coefficients. Neither knows where an element is, or that an unloaded pad reads nothing. It is inverted
on a grid of locations and loads, so that a touch gets a posterior as from a calibration.

Needs scikit-learn (``pip install 'bayestouch[baselines]'``).
"""

from bayestouch.baselines.held_out import HeldOutBaseline, baselines
from bayestouch.baselines.reading import RegressionPosteriors, read_by_regression
from bayestouch.baselines.regression import (
    Regression,
    RegressionTouches,
    gaussian_process,
    polynomial,
    require_scikit_learn,
)

__all__ = [
    "HeldOutBaseline",
    "Regression",
    "RegressionPosteriors",
    "RegressionTouches",
    "baselines",
    "gaussian_process",
    "polynomial",
    "read_by_regression",
    "require_scikit_learn",
]
