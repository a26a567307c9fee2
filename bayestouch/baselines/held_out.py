"""Both regressions on the held-out touches of a diagnosis, and their errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.baselines.reading import RegressionPosteriors, read_by_regression
from bayestouch.baselines.regression import Regression, RegressionTouches, gaussian_process, polynomial
from bayestouch.model.held_out import rms_percent
from bayestouch.model.observations import Observations
from bayestouch.model.split_data import SplitData
from bayestouch.parallel.beside import both


@dataclass(frozen=True, eq=False)
class HeldOutBaseline:
    """A regression and the held-out touches as it reads them; t touches, n samples, m elements.

    Attributes
    ----------
    regression : Regression
        The regression of all touches that are not held out.
    held : RegressionTouches
        The held-out touches.
    read : RegressionPosteriors
        Their posteriors.
    samples : (n, m) array
        Reading minus prediction of every sample, over the peak; NaN missing.
    """

    regression: Regression
    held: RegressionTouches
    read: RegressionPosteriors
    samples: FloatArray

    @property
    def load_inside(self) -> FloatArray:
        """1 where the central 90 % interval contains the load, else 0, (t,); NaN where loads were not measured."""
        if self.held.load is None:
            return np.full(len(self.read.load), np.nan)
        low, high = self.read.load_interval.T
        return np.asarray(((low <= self.held.load) & (self.held.load <= high)).astype(float))

    @property
    def errors(self) -> dict[str, float]:
        """Errors against references as the data set states them, by the keys of ``diagnosis.json``.

        ``prediction_error_percent_peak`` is that of samples and ``touch_error_percent_peak`` that of the means of
        touches, both in percent of the peak. The median and the root mean square of the distance between inferred and
        reference location are in mm, that of the load in N, coverages are shares. NaN where loads were not measured.
        """
        distance = np.sqrt(((self.read.location - self.held.location) ** 2).sum(axis=1))
        load = np.full(len(distance), np.nan) if self.held.load is None else self.held.load
        return {
            "prediction_error_percent_peak": rms_percent(self.samples),
            "touch_error_percent_peak": rms_percent(self.read.residual),
            "location_median_mm": float(np.median(distance)),
            "location_rms_mm": float(np.sqrt(np.mean(distance**2))),
            "coverage_90": float(self.read.location_inside.mean()),
            "P_rms_N": float(np.sqrt(np.mean((self.read.load - load) ** 2))),
            "P_coverage_90": float(self.load_inside.mean()),
        }


def baselines(data: SplitData, held_out: Observations, peak: FloatArray) -> tuple[HeldOutBaseline, ...]:
    """Both regressions of all touches that are not held out, and the held-out touches as they read them.

    Parameters
    ----------
    data : SplitData
        Touches of a pad, split as by a diagnosis.
    held_out : Observations
        The held-out touches.
    peak : (m,) array
        Peak reading of each element, the unit of errors.

    Returns
    -------
    tuple of HeldOutBaseline
        The Gaussian process and the polynomial. They use loads if these were measured in all touches, and differ.

    Raises
    ------
    InputError
        scikit-learn is not installed.
    """
    training = data.observations(data.training)
    loads = training.means.load
    loaded = bool(np.isfinite(held_out.means.load).all() and np.isfinite(loads).all() and np.ptp(loads) > 0)
    known = RegressionTouches.of(training, peak, loaded=loaded)
    held = RegressionTouches.of(held_out, peak, loaded=loaded)

    def one(regression: Regression) -> HeldOutBaseline:
        read = read_by_regression(regression, known, held, data.dataset.sensor.force_noise_sd)
        samples = read.residual[held_out.row_touch] + held_out.deviation / peak
        return HeldOutBaseline(regression, held, read, samples)

    return both(lambda: one(gaussian_process(known)), lambda tell: one(polynomial(known)))
