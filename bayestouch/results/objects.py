"""What the verbs return: a calibration, and posteriors of touches."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from bayestouch.array_types import FloatArray
from bayestouch.results.data import CalibrationData, PosteriorsData

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from pandas import DataFrame


class Calibration(CalibrationData):
    """A calibrated sensor: every calibration parameter as a random variable.

    Attributes
    ----------
    sensor : Sensor
        The sensor as built.
    parameters : tuple of Parameter
        The unknowns with their priors. By element where `mode` holds an array.
    mode : mapping
        Maximum a posteriori, scalar () or by element (m,) arrays, in public units
        (``r_s`` mm, ``theta_s`` degree, ``mu`` MPa, ``gain`` reading per strain, ``response`` reading per N/m …).
    posterior : mapping
        Draws, (chain, draw) or (chain, draw, m) arrays, by the same names.
    covariance : (d, d) array
        Laplace covariance of the parameters in the order and units of `layout`.
    layout : tuple of str
        Name of each row of `covariance`: ``"sigma"``, ``"r_s[3]"`` …
    noise : Noise
        Noise of readings and force sensor.
    rows : TouchRows
        The calibration touches with their fit.
    settings : mapping
        Whatever repeats the run: contact model or kernel, seed, version, options; text or numbers.
    statistics : mapping of str to float
        ``lack_of_fit``, ``error_percent_peak`` and the like.
    extra : mapping of arrays
        Arrays a body needs beside these (a pad's empirical map).
    notes : tuple of str
        What was handled or assumed, one sentence each, for the report.
    """

    def summary_lines(self) -> list[str]:
        """Lines of the ``repr``."""
        from bayestouch.results.lines import calibration_lines

        return calibration_lines(self)

    def plot_parameter(self, name: str, axes: Axes | None = None) -> Axes:
        """Posterior of a parameter beside its prior, see `bayestouch.results.plots.plot_parameter`."""
        from bayestouch.results.plots import plot_parameter

        return plot_parameter(self, name, axes)

    def plot_fit(self, element: int = 1, axes: Axes | None = None) -> Axes:
        """Readings of one element (from 1) in the calibration touches, and the model's."""
        from bayestouch.results.plots import plot_fit

        return plot_fit(self, element, axes)

    def _repr_html_(self) -> str:
        from bayestouch.results.html import calibration_html

        return calibration_html(self)

    def save(self, path: str | Path) -> None:
        """Write to netCDF (ArviZ groups); a temporary file is renamed when complete."""
        from bayestouch.results.files import save_calibration

        save_calibration(self, path)

    def to_arviz(self) -> Any:
        """The draws as ArviZ holds them: `InferenceData`, or a `DataTree` with ArviZ 1."""
        from bayestouch.results.files import to_arviz

        return to_arviz(self)

    def to_dataframe(self) -> DataFrame:
        """Mean, sd and quantiles of every parameter, a row each."""
        from bayestouch.results.files import to_dataframe

        return to_dataframe(self)


class TouchPosteriors(PosteriorsData):
    """Posteriors of touches.

    Attributes
    ----------
    sensor : Sensor
        The sensor that was touched.
    parameters : tuple of Parameter
        Touch parameters with their priors: ``R``, ``theta_c``, ``P`` on a finger (``r_c`` is derived from R);
        ``x``, ``y``, ``P`` on a pad.
    posterior : mapping of (chain, draw, t) arrays
        Draws, in public units (mm, degree, N/m or N); of a large file they are read when asked for. Empty where only
        summaries were kept.
    sample_stats : mapping of (t,) arrays
        ``ess_bulk`` and ``rhat`` (worst parameter of the touch), ``acceptance``, ``pareto_k``, and ``grade``: 1 where
        the targets are met. They are those of all draws, however few were kept.
    reference : mapping of (t,) arrays
        Reference values by the same names as `posterior`, NaN unknown.
    rows : TouchRows
        The touches with the prediction at the posterior mean.
    settings, notes
        As in `Calibration`.
    tips : TipProbabilities or None
        How probable each tip is for each touch, where the prior over indenters has known tips.
    summary : mapping of (5, t) arrays
        Mean, sd and 5, 50 and 95 % quantiles of all draws, however few were kept; empty where all are.
    """

    def summary_lines(self) -> list[str]:
        """Lines of the ``repr``."""
        from bayestouch.results.lines import touches_lines

        return touches_lines(self)

    def plot_pp(self, truth: Mapping[str, FloatArray] | None = None, **options: Any) -> Axes:
        """P-P plot of touches with known truth, see `bayestouch.pp_plot`."""
        from bayestouch.results.probability_plot import pp_plot

        return pp_plot(self, truth, **options)

    def plot_estimates(self, name: str, axes: Axes | None = None) -> Axes:
        """Posterior mean and 90 % interval of every touch over its reference."""
        from bayestouch.results.plots import plot_estimates

        return plot_estimates(self, name, axes)

    def plot_touch(self, touch: int, names: tuple[str, str] | None = None, axes: Axes | None = None) -> Axes:
        """Draws of one touch, two parameters against each other."""
        from bayestouch.results.plots import plot_touch

        return plot_touch(self, touch, names, axes)

    def plot_residuals(self, axes: Axes | None = None) -> Axes:
        """Reading minus prediction over its standard deviation, by touch and element."""
        from bayestouch.results.plots import plot_residuals

        return plot_residuals(self, axes)

    def _repr_html_(self) -> str:
        from bayestouch.results.html import touches_html

        return touches_html(self)

    def save(self, path: str | Path) -> None:
        """Write to netCDF (ArviZ groups); a temporary file is renamed when complete."""
        from bayestouch.results.files import save_touches

        save_touches(self, path)

    def to_arviz(self) -> Any:
        """The draws as ArviZ holds them: `InferenceData`, or a `DataTree` with ArviZ 1."""
        from bayestouch.results.files import to_arviz

        return to_arviz(self)

    def to_dataframe(self) -> DataFrame:
        """Mean, sd and quantiles of every parameter, a row each."""
        from bayestouch.results.files import to_dataframe

        return to_dataframe(self)
