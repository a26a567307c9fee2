"""Results that users work with: `Calibration` and `TouchPosteriors`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, Self

from bayestouch.array_types import FloatArray
from bayestouch.results.data import CalibrationData, PosteriorsData

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike
    from pandas import DataFrame


class Calibration(CalibrationData):
    """A calibrated sensor: the posterior of every calibration parameter.

    Attributes
    ----------
    sensor : Sensor
        Description of the sensor.
    parameters : tuple of Parameter
        The unknowns with their priors. A parameter has one value an element if `mode` holds an array.
    mode : mapping
        Maximum a posteriori values, scalar () or by element (m,), in public units
        (``r_s`` mm, ``theta_s`` degree, ``mu`` MPa, ``response`` reading per N/m; ``gain`` of a finger reading per
        strain, of a pad reading per N …).
    posterior : mapping
        Draws, (chain, draw) or (chain, draw, m) arrays, with the same names.
    covariance : (d, d) array
        Laplace covariance of the parameters in the order and units of `layout`.
    layout : tuple of str
        Name of each row of `covariance`: ``"sigma"``, ``"r_s[3]"`` …
    noise : Noise
        Noise of the readings and of the force sensor.
    rows : TouchRows
        The calibration touches with the fit.
    settings : mapping
        What is needed to repeat the run: contact model or kernel, seed, version, options; text or numbers.
    statistics : mapping of str to float
        Quality of the fit: ``lack_of_fit``, ``error_percent_peak`` and others.
    extra : mapping of arrays
        Further arrays that a body needs (for example the empirical map of a pad).
    notes : tuple of str
        What was corrected or assumed, one sentence each, for the report.
    groups : mapping of mappings of arrays
        Groups of the ArviZ schema that were asked for, such as ``log_likelihood``: arrays (chain, draw, ...) by group
        and variable; and ``lp`` of ``sample_stats``, the log posterior density of each draw, up to a constant.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> dataset = bayestouch.simulate(design, seed=3).dataset
    >>> calibration = bayestouch.calibrate(dataset, draws=200)
    >>> calibration.posterior["r_s"].shape  # chains, draws, elements
    (4, 50, 4)
    >>> calibration.posterior["r_s"].mean(axis=(0, 1)).round(1)  # depths of the elements, mm
    array([10.1,  9.6,  9.9,  9.8])
    >>> round(float(calibration.statistics["lack_of_fit"]))  # 1 if the model is right
    1
    >>> calibration.save("calibration.nc")
    """

    def summary_lines(self) -> list[str]:
        """Lines that ``repr`` shows."""
        from bayestouch.results.lines import calibration_lines

        return calibration_lines(self)

    def plot_parameter(self, name: str, axes: Axes | None = None) -> Axes:
        """Plot the posterior of a parameter with its prior, see `bayestouch.results.plots.plot_parameter`."""
        from bayestouch.results.plots import plot_parameter

        return plot_parameter(self, name, axes)

    def plot_fit(self, element: int = 1, axes: Axes | None = None) -> Axes:
        """Plot measured and predicted readings of one element (from 1) in the calibration touches."""
        from bayestouch.results.plots import plot_fit

        return plot_fit(self, element, axes)

    def _repr_html_(self) -> str:
        from bayestouch.results.html import calibration_html

        return calibration_html(self)

    def summary(self) -> DataFrame:
        """Table of the parameters, one row each.

        Returns
        -------
        pandas.DataFrame
            Index ``parameter``; ``symbol``, ``unit``, posterior ``mean`` and ``sd``, ``lowest``, ``highest``, ``prior``
            and ``meaning``. Of a parameter with a value for each element: the mean of the elements' means, the median
            of their sds, and the lowest and highest mean, which are NaN of others. Elements without readings are left
            out. `to_dataframe` has every element.
        """
        from bayestouch.results.tables import parameter_table

        return parameter_table(self)

    def save(self, path: str | Path) -> None:
        """Write to a netCDF file (ArviZ groups); a temporary file is renamed when complete."""
        from bayestouch.results.files import save_calibration

        save_calibration(self, path)

    def to_arviz(self) -> Any:
        """Draws as an ArviZ object: `InferenceData`, or `DataTree` since ArviZ 1."""
        from bayestouch.results.files import to_arviz

        return to_arviz(self)

    def to_dataframe(self) -> DataFrame:
        """Table of mean, sd and quantiles, one row for each parameter and element."""
        from bayestouch.results.files import to_dataframe

        return to_dataframe(self)


class TouchPosteriors(PosteriorsData):
    """Posteriors of touches: location, indenter radius and load of each touch as draws.

    ``posteriors[3]``, ``posteriors[:20]`` and ``posteriors[condition]`` are posteriors of some of the touches, by their
    position in the table; `sel` chooses by number, tip and place. ``len(posteriors)`` is the number of touches.

    Attributes
    ----------
    sensor : Sensor
        The sensor that was touched.
    parameters : tuple of Parameter
        Touch parameters with their priors: ``R``, ``theta_c``, ``P`` on a finger (``r_c`` is derived from R);
        ``x``, ``y``, ``P`` on a pad.
    posterior : mapping of (chain, draw, t) arrays
        Draws, in public units (mm, degree, N/m or N). The draws of a large file are read from it when they are
        used. Empty if only summaries were kept. On a full ring of elements ``theta_c`` of a touch may go on beyond the
        angle at which the row ends (179° to 182°), so that its draws are together.
    sample_stats : mapping of (t,) arrays
        ``ess_bulk`` and ``rhat`` (of the worst parameter of the touch), ``acceptance``, ``pareto_k``, and ``grade``:
        1 if the targets are met. They always refer to all draws, also to those that were not kept. ``beyond_prior``
        is 1 if the touch is beyond the loads or places that the calibration allows, and ``without_reading`` is 1 if it
        has no reading that was used; then ``grade`` is 0.
    reference : mapping of (t,) arrays
        Reference values with the same names as `posterior`; NaN unknown.
    rows : TouchRows
        The touches with the prediction at the posterior mean.
    settings, notes
        As in `Calibration`.
    tips : TipProbabilities or None
        Probability of each known tip for each touch, if the prior over indenters has known tips.
    estimates : mapping of (5, t) arrays
        Mean, sd and 5, 50 and 95 % quantiles of all draws, also of those not kept. Empty if all draws are kept
        in memory; a result of `infer` with `output` has them always, so that its file need not be read for them.
    groups : mapping of mappings of (chain, draw, t) or (chain, draw, t, m) arrays
        Groups of the ArviZ schema that were asked for, by group and variable. Not read from files where they take more
        than 1 GB together: a note names them, and xarray opens them. What is saved then does not have them.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> dataset = bayestouch.simulate(design, seed=3).dataset
    >>> calibration = bayestouch.calibrate(dataset, draws=200)
    >>> touches = bayestouch.infer(dataset.touches, calibration, draws=256)
    >>> len(touches), touches.posterior["R"].shape  # chains, draws, touches
    (45, (4, 64, 45))
    >>> some = touches.sel(tip=3.9, place=slice(-10, 10))
    >>> some.summary()["place"].tolist(), some.mean("R").round()  # degree, mm
    ([-10.0, 0.0, 10.0], array([3., 3., 3.]))
    >>> low, high = some.interval("R", 0.9)  # mm
    >>> bool(((low < some.mean("R")) & (some.mean("R") < high)).all())
    True
    """

    def summary_lines(self) -> list[str]:
        """Lines that ``repr`` shows."""
        from bayestouch.results.lines import touches_lines

        return touches_lines(self)

    def plot_pp(self, truth: Mapping[str, FloatArray] | None = None, **options: Any) -> Axes:
        """P-P plot of touches with known truth, see `bayestouch.pp_plot`."""
        from bayestouch.results.probability_plot import pp_plot

        return pp_plot(self, truth, **options)

    def plot_estimates(self, name: str, axes: Axes | None = None) -> Axes:
        """Plot posterior mean and 90 % interval of every touch against its reference value."""
        from bayestouch.results.plots import plot_estimates

        return plot_estimates(self, name, axes)

    def plot_touch(self, touch: int, names: tuple[str, str] | None = None, axes: Axes | None = None) -> Axes:
        """Plot the draws of one touch, one parameter against another."""
        from bayestouch.results.plots import plot_touch

        return plot_touch(self, touch, names, axes)

    def plot_residuals(self, axes: Axes | None = None) -> Axes:
        """Plot reading minus prediction divided by its standard deviation, by touch and element."""
        from bayestouch.results.plots import plot_residuals

        return plot_residuals(self, axes)

    def _repr_html_(self) -> str:
        from bayestouch.results.html import touches_html

        return touches_html(self)

    def __len__(self) -> int:
        return len(self.rows.touch)

    def __getitem__(self, index: int | slice | ArrayLike) -> Self:
        from bayestouch.results.selection import positions_of, touches_at

        return touches_at(self, positions_of(self.rows, index))

    def __iter__(self) -> Iterator[Self]:
        return (self[position] for position in range(len(self)))

    def sel(
        self,
        touch: float | ArrayLike | slice | None = None,
        *,
        tip: float | ArrayLike | slice | None = None,
        place: float | ArrayLike | slice | None = None,
        place_x: float | ArrayLike | slice | None = None,
        place_y: float | ArrayLike | slice | None = None,
    ) -> Self:
        """Posteriors of the touches that meet every condition, in the order of the table.

        Parameters
        ----------
        touch : float, array_like or slice, optional
            Number of the touch in the table. Here as below: a number, several numbers, or a range with both ends
            included, such as ``slice(-10, 10)``.
        tip : float, array_like or slice, optional
            Reference radius r_c of the indenter, mm: 0 knife edge, inf flat.
        place : float, array_like or slice, optional
            Reference location: degrees on a finger, mm on a pad with one line of elements.
        place_x, place_y : float, array_like or slice, optional
            Reference location on a pad in two dimensions, mm.

        Raises
        ------
        InputError
            If touches of this sensor have no such coordinate, or no touch meets the conditions.

        Examples
        --------
        ``posteriors.sel(tip=3.9, place=slice(-10, 10)).summary()``
        """
        from bayestouch.results.selection import positions_with, touches_at

        wanted = {"touch": touch, "tip": tip, "place": place, "place_x": place_x, "place_y": place_y}
        return touches_at(self, positions_with(self.rows, wanted))

    def summary(self) -> DataFrame:
        """Table of the estimates, one row a touch.

        Returns
        -------
        pandas.DataFrame
            Index ``touch``; ``tip`` (mm) and ``place`` (degree or mm; on a pad in two dimensions ``place_x`` and
            ``place_y``), the reference values, NaN unknown; posterior mean ``NAME`` and standard deviation ``NAME_sd``
            of each parameter, whose units are in ``attrs["units"]``; ``grade``, 1 if the sampler's targets are met.
            `to_dataframe` has the quantiles as well, one row for each parameter and touch.
        """
        from bayestouch.results.tables import touch_table

        return touch_table(self)

    def save(self, path: str | Path) -> None:
        """Write to a netCDF file (ArviZ groups); a temporary file is renamed when complete."""
        from bayestouch.results.files import save_touches

        save_touches(self, path)

    def to_arviz(self) -> Any:
        """Draws as an ArviZ object: `InferenceData`, or `DataTree` since ArviZ 1."""
        from bayestouch.results.files import to_arviz

        return to_arviz(self)

    def to_dataframe(self) -> DataFrame:
        """Table of mean, sd and quantiles, one row for each parameter and touch."""
        from bayestouch.results.files import to_dataframe

        return to_dataframe(self)
