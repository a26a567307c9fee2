"""Plots of results: each function takes the axes to draw on (new ones by default) and returns them."""

from __future__ import annotations

from collections.abc import Container, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.arrays import nearest_turn
from bayestouch.errors import InputError, few, nearest, require_whole, shown
from bayestouch.priors.parameter_text import PriorOfOtherCode
from bayestouch.results.draws_on_file import require_draws

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from bayestouch.priors.parameters import Parameter, Prior
    from bayestouch.results.data import CalibrationData, PosteriorsData


BLUE, RED, GREY = "#0072B2", "#D55E00", "#666666"

#: Label of the axis for each coordinate.
LOCATION_LABELS = {
    "theta_c": "reference location θ (degree)",
    "x": "reference location x (mm)",
    "y": "reference location y (mm)",
}


def new_axes(axes: Axes | None, width: float = 6.4, height: float = 4.0) -> Axes:
    """Given axes, or those of a new figure without a window."""
    if axes is not None:
        return axes
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)  # needed for display in a notebook
    return figure.subplots()


def plot_parameter(calibration: CalibrationData, name: str, axes: Axes | None = None) -> Axes:
    """Plot the posterior of a calibration parameter with its prior.

        Parameters
        ----------
        calibration : CalibrationData
        The calibration.
    name : str
        Name of the parameter: ``"sigma"``, ``"r_s"`` …
    axes : matplotlib Axes, optional
        Axes to draw on.

        Returns
        -------
        matplotlib Axes
            Densities, if all elements share the parameter; otherwise mean and 90 % interval of each element. The
            prior, or its central 90 %, is grey. It is drawn if it is one of the parameter itself, in its unit: not of a
            difference from nominal values, or relative to the data; and not of the user's own class read from a file,
            which has no density.

        Raises
        ------
        InputError
            If there is no such parameter.
    """
    parameter = _parameter(calibration.parameters, name, calibration.posterior)
    draws = np.asarray(calibration.posterior[name])
    axes = new_axes(axes)
    label = _label(parameter)
    drawn = not (parameter.relative or isinstance(parameter.prior, PriorOfOtherCode))
    if draws.ndim == 2:
        axes.hist(draws.ravel(), bins=40, density=True, color=BLUE, alpha=0.7, label="posterior")
        if drawn:
            ends, (low, high) = axes.get_xlim(), _central(parameter.prior)
            value = np.linspace(min(ends[0], low), max(ends[1], high), 400)
            axes.plot(value, np.exp(parameter.prior.log_density(value)), color=GREY, label="prior")
        axes.set(xlabel=label, ylabel="density")
    else:
        each = draws.reshape(-1, draws.shape[-1])
        element = np.arange(1, each.shape[1] + 1)
        middle = each.mean(axis=0)
        interval = np.quantile(each, [0.05, 0.95], axis=0)
        if drawn:
            axes.axhspan(*_central(parameter.prior), color=GREY, alpha=0.15, label="prior, central 90 %")
        axes.errorbar(
            element, middle, np.abs(interval - middle), fmt="o", ms=4, color=BLUE, label="posterior mean, 90 % interval"
        )
        axes.set(xlabel="element", ylabel=label, xticks=element if len(element) <= 20 else element[::5])
    axes.legend(frameon=False, fontsize="small")
    return axes


def _central(prior: Prior) -> tuple[float, float]:
    """Ends of the central 90 %."""
    low, high = (float(np.asarray(prior.quantile(p))) for p in (0.05, 0.95))
    return low, high


def plot_fit(calibration: CalibrationData, element: int = 1, axes: Axes | None = None) -> Axes:
    """Plot measured and predicted readings of one element over the location of the calibration touches.

        Parameters
        ----------
        calibration : CalibrationData
        The calibration.
    element : int
        Number of the element from 1, as in ``e01``.
    axes : matplotlib Axes, optional
        Axes to draw on.

        Raises
        ------
        InputError
            If there is no such element.
    """
    rows = calibration.rows
    require_whole("element", element, 1)
    if element > rows.observed.shape[1]:
        raise InputError(f"element: expected 1 to {rows.observed.shape[1]}, got {element}")
    axes = new_axes(axes)
    where, label = _location(rows.location, len(rows.touch))
    observed, predicted = rows.observed[:, element - 1], rows.predicted[:, element - 1]
    axes.plot(where, observed, "o", ms=4, mfc="none", color=GREY, label="read")
    axes.plot(where, predicted, ".", ms=4, color=BLUE, label="model")
    axes.set(xlabel=label, ylabel=f"e{element:02d}, mean reading{_unit(calibration.sensor.reading_unit)}")
    axes.legend(frameon=False, fontsize="small")
    return axes


def plot_estimates(posteriors: PosteriorsData, name: str, axes: Axes | None = None) -> Axes:
    """Plot posterior mean and 90 % interval of each touch over its reference (or over its number if unknown).

    Raises
    ------
    InputError
        If there is no such parameter, or no touch.
    """
    parameter = _parameter(posteriors.parameters, name, {**posteriors.posterior, **posteriors.estimates})
    _require_touches(posteriors)
    axes = new_axes(axes)
    mean, (low, high) = posteriors.mean(name), posteriors.interval(name)
    reference = reference_near(posteriors, name, mean)
    known = np.isfinite(reference)
    x = reference if known.any() else np.arange(len(mean), dtype=float)
    known = known if known.any() else np.isfinite(mean)
    label = _label(parameter)
    errors = np.stack([mean - low, high - mean])[:, known]
    axes.errorbar(x[known], mean[known], np.maximum(errors, 0), fmt="o", ms=3, lw=0.8, color=BLUE, label="posterior")
    if x is reference:
        ends = np.array([x[known].min(), x[known].max()])
        axes.plot(ends, ends, ":", color=RED, label="right")
    axes.set(xlabel=f"reference {label}" if x is reference else "touch, in order", ylabel=label)
    axes.legend(frameon=False, fontsize="small")
    return axes


def plot_touch(
    posteriors: PosteriorsData, touch: int, names: tuple[str, str] | None = None, axes: Axes | None = None
) -> Axes:
    """Plot the draws of two parameters of one touch against each other, with the reference values if known.

    If each sample was read, the first sample of the touch is drawn, and the legend says so.
    ``posteriors[k].plot_touch(touch)`` draws the one at position k of the table.

    Parameters
    ----------
    posteriors : PosteriorsData
        Posteriors with draws.
    touch : int
        Number of the touch.
    names : pair of str, optional
        The two parameters. By default location and radius on a finger, x and y (or load) on a pad.
    axes : matplotlib Axes, optional
        Axes to draw on.

    Raises
    ------
    InputError
        If there is no such touch or parameter, or only summaries were kept.
    """
    place = np.flatnonzero(posteriors.rows.touch == touch)
    if not place.size:
        raise InputError(f"touch: {touch} is not among the {len(posteriors.rows.touch)} touches")
    require_draws(posteriors.posterior)
    if names is None:
        names = shown_pair(posteriors.posterior)
    if isinstance(names, str) or not isinstance(names, Sequence) or len(names) != 2:
        raise InputError(f"names: expected two parameters, such as ('theta_c', 'R'), got {shown(names)}")
    axes = new_axes(axes, 4.6, 4.4)
    columns, reference = [], []
    for name in names:
        _parameter(posteriors.parameters, name, posteriors.posterior)
        columns.append(np.asarray(posteriors.posterior[name][..., place[0]]).ravel())
        reference.append(float(reference_near(posteriors, name, columns[-1].mean())[place[0]]))
    which = "" if place.size == 1 else f", the first of {place.size} samples"
    axes.plot(*columns, ".", ms=2, alpha=0.4, color=BLUE, label=f"draws of touch {touch}{which}")
    if np.isfinite(reference).all():
        axes.plot(*[[value] for value in reference], "x", ms=9, mew=2, color=RED, label="reference")
    axes.set(
        **{
            f"{axis}label": _label(_parameter(posteriors.parameters, n, None))
            for axis, n in zip("xy", names, strict=True)
        }
    )
    axes.legend(frameon=False, fontsize="small")
    return axes


def plot_residuals(posteriors: PosteriorsData, axes: Axes | None = None) -> Axes:
    """Plot reading minus prediction divided by its standard deviation, by touch and element.

    Raises
    ------
    InputError
        If there is no touch.
    """
    rows = posteriors.rows
    _require_touches(posteriors)
    axes = new_axes(axes)
    with np.errstate(invalid="ignore", divide="ignore"):
        z = (rows.observed - rows.predicted) / rows.sd
    mesh = axes.pcolormesh(
        np.arange(len(z) + 1) - 0.5, np.arange(z.shape[1] + 1) + 0.5, z.T, cmap="PuOr", vmin=-4, vmax=4, rasterized=True
    )
    axes.set(xlabel="touch, in order", ylabel="element")
    assert axes.figure is not None
    axes.figure.colorbar(mesh, ax=axes, label="residual / its sd", extend="both")
    return axes


def _require_touches(posteriors: PosteriorsData) -> None:
    if not len(posteriors.rows.touch):
        raise InputError("there are no touches to plot")


def _parameter(parameters: tuple[Parameter, ...], name: str, known: Any) -> Parameter:
    found = {parameter.name: parameter for parameter in parameters}
    # A list is no key.
    if not isinstance(name, str) or name not in found or (known is not None and name not in known):
        names = [each for each in found if known is None or each in known]
        raise InputError(f"{name}: no such parameter; expected one of {few(names, 20)}{nearest(str(name), names)}")
    return found[name]


def reference_near(posteriors: PosteriorsData, name: str, mean: FloatArray) -> FloatArray:
    """Reference of every touch, NaN unknown; an angle, which may be stated from 0 to 360, is turned near the mean."""
    if name not in posteriors.reference:
        return np.full(len(posteriors.rows.touch), np.nan)
    reference = np.asarray(posteriors.reference[name])
    return nearest_turn(reference, mean) if name == "theta_c" else reference


def _label(parameter: Parameter) -> str:
    return f"${parameter.latex}$" + _unit(parameter.unit)


def _unit(unit: str) -> str:
    return f" ({unit})" if unit else ""


def _location(location: Any, count: int) -> tuple[FloatArray, str]:
    for name in ("theta_c", "x"):
        if name in location and np.isfinite(location[name]).any():
            return np.asarray(location[name]), LOCATION_LABELS[name]
    return np.arange(count, dtype=float), "touch, in order"


def shown_pair(names: Container[str]) -> tuple[str, str]:
    """Two parameters that are plotted against each other by default: location and radius, x and y, or x and load."""
    order = [name for name in ("theta_c", "x", "R", "y", "P") if name in names]
    return (order[0], order[1]) if len(order) > 1 else ("theta_c", "R")
