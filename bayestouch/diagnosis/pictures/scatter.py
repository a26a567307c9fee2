"""Figures of effects that are visible within touches: scatter of samples about the mean of their touch."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bayestouch.data.grouping import readings_of_groups
from bayestouch.diagnosis.rounds import SearchRound
from bayestouch.model.base import deviation_left
from bayestouch.model.fitting import Fitted
from bayestouch.output.pictures import BLUE, GREY, RED, Picture, canvas, drawing, legend_below, rendered

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def scatter_picture(number: int, each: SearchRound, following: SearchRound) -> Picture:
    """Figure of samples before and after an effect that acts within touches or on the noise."""
    assert each.added is not None
    effect = each.added.effect
    before, after = _Samples(each.before), _Samples(following.before)
    draw = {
        "outliers": _tails,
        "common_mode_noise": _together,
        "signal_dependent_noise": _against_signal,
    }.get(effect.name, _while_held)
    with drawing():
        figure, axes = canvas(3.8, 1, 1)
        caption = draw(axes[0, 0], before, after)
        content = rendered(figure, "png")
    return Picture(
        f"effect-{number}-{effect.name}",
        "effects",
        f"{effect.name}: {effect.summary}",
        caption,
        caption,
        content,
        "png",
    )


class _Samples:
    """Samples of a fitted model's touches, relative to the mean of their touch; n samples, m elements."""

    def __init__(self, fitted: Fitted) -> None:
        observed, model = fitted.model.known, fitted.model
        predicted = model.predict(fitted.vector)
        within = deviation_left(observed.deviation, predicted.samples)
        present = ~np.isnan(observed.deviation)
        count = readings_of_groups(present, observed.row_touch, observed.n_touches)[observed.row_touch]
        self.share = np.where(count > 1, within / np.sqrt(1 - 1 / np.maximum(count, 2)), np.nan)
        self.share = self.share / model.peak
        self.sd = fitted.noise.sd / model.peak
        self.signal = predicted.touches[observed.row_touch] / model.peak
        self.held_s, self.unit = observed.held_s, observed.unit
        self.noise, self.peak = fitted.noise, model.peak


def _tails(axes: Axes, before: _Samples, after: _Samples) -> str:
    z = (after.share / after.sd).ravel()
    old = (before.share / after.sd).ravel()
    ends = np.linspace(-12, 12, 97)
    middle = 0.5 * (ends[1:] + ends[:-1])
    normal = np.exp(-0.5 * middle**2) / np.sqrt(2 * np.pi) * np.isfinite(old).sum() * (ends[1] - ends[0])
    axes.hist(np.clip(old, -12, 12), ends.tolist(), color=RED, label="all readings")
    axes.hist(z, ends.tolist(), color=BLUE, label="without those taken to be wrong")
    axes.plot(middle, normal, color=GREY, label="normal noise")
    axes.set(yscale="log", ylim=(0.5, None), xlabel="sample minus mean of its touch, over the noise", ylabel="readings")
    legend_below(axes, 3)
    return (
        "Samples about the mean of their touch (the outermost bars hold all beyond). Normal noise would follow the "
        "grey line; readings far outside it are taken to be wrong and left out."
    )


def _together(axes: Axes, before: _Samples, after: _Samples) -> str:
    rows = before.share
    some = np.isfinite(rows).all(axis=1)
    half = rows.shape[1] // 2
    one, two = 100 * rows[some][:, :half].mean(axis=1), 100 * rows[some][:, half:].mean(axis=1)
    together = float(np.corrcoef(one, two)[0, 1])
    axes.plot(one, two, ".", color=RED, ms=4, alpha=0.5)
    axes.set(
        xlabel="mean of the first half of the elements (% of the peak)",
        ylabel="mean of the second half",
        title=f"correlation {together:.2f}; independent noise has 0",
    )
    return (
        "Each point is a sample minus the mean of its touch, averaged over either half of the elements. A slanted "
        "cloud is an error that all elements share."
    )


def _against_signal(axes: Axes, before: _Samples, after: _Samples) -> str:
    size = np.abs(before.signal)
    some = np.isfinite(before.share)
    ends = np.unique(np.quantile(size[some], np.linspace(0, 1, 16)))
    place = np.clip(np.searchsorted(ends, size[some], side="right") - 1, 0, len(ends) - 2)
    count = np.bincount(place, minlength=len(ends) - 1)
    rms = np.sqrt(np.bincount(place, weights=before.share[some] ** 2, minlength=len(count)) / np.maximum(count, 1))
    middle = np.bincount(place, weights=size[some], minlength=len(count)) / np.maximum(count, 1)
    fitted = np.sqrt(np.mean(after.sd**2) + after.noise.added.variance(middle, np.ones(1)))
    axes.errorbar(100 * middle, 100 * rms, 100 * rms / np.sqrt(2 * count), fmt="o", color=RED, label="samples")
    axes.axhline(
        100 * float(np.sqrt(np.mean(before.sd**2))), color=GREY, ls=":", label="noise that is the same everywhere"
    )
    axes.plot(100 * middle, 100 * fitted, color=BLUE, label="noise that grows with the signal")
    axes.set(
        xlabel="size of the predicted reading (% of the peak)", ylabel="sd of samples (% of the peak)", ylim=(0, None)
    )
    legend_below(axes, 3)
    return "Scatter of samples about the mean of their touch against the size of the reading."


def _while_held(axes: Axes, before: _Samples, after: _Samples) -> str:
    for samples, colour, label in ((before, RED, "before"), (after, BLUE, "after")):
        large = np.abs(samples.signal) > 0.3
        value = np.where(large & np.isfinite(samples.share), samples.share / samples.signal, np.nan)
        held = np.broadcast_to(samples.held_s[:, None], value.shape)
        times = np.unique(np.round(samples.held_s, 9))
        if len(times) > 15:
            times = np.quantile(samples.held_s, np.linspace(0, 1, 15))
        nearest = np.abs(held[..., None] - times).argmin(axis=-1)
        some = np.isfinite(value)
        count = np.bincount(nearest[some], minlength=len(times))
        mean = np.bincount(nearest[some], weights=value[some], minlength=len(times)) / np.maximum(count, 1)
        square = np.bincount(nearest[some], weights=value[some] ** 2, minlength=len(times)) / np.maximum(count, 1)
        error = np.sqrt(np.maximum(square - mean**2, 0) / np.maximum(count, 1))
        axes.errorbar(times, 100 * mean, 100 * error, fmt="o-", color=colour, capsize=2, label=label)
    axes.axhline(0, color=GREY, lw=0.8)
    axes.set(xlabel=f"time since the touch began ({before.unit})", ylabel="sample − prediction (% of the reading)")
    legend_below(axes, 2)
    return (
        "How readings change while a touch is held, beyond the prediction: mean over all readings above 30 % of the "
        "peak, relative to the mean of their touch, with standard errors."
    )
