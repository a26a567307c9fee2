"""P-P plot: a test whether posteriors of touches contain the true value as often as they claim.

For each touch, the share of draws below the true value is computed. If the posteriors are right and the true values
follow the prior, these shares are uniform. The band contains the whole curve with the stated probability. Its limits
are pointwise binomial limits, widened according to simulated uniform samples (Säilynoja, Bürkner and Vehtari 2022,
doi:10.1007/s11222-022-10090-6).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.data.arrays import nearest_turn, turned
from bayestouch.errors import InputError, nearest, not_a, number_array, shown
from bayestouch.results.data import PosteriorsData
from bayestouch.results.draws_on_file import require_draws

if TYPE_CHECKING:
    from matplotlib.axes import Axes


# Number of points at which curve and band are compared, and of simulated samples that give the width of the band.
PLACES, SIMULATIONS = 100, 4000
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7")
DASHES = ("-", "--", "-.", ":")


def shares_below(
    posteriors: PosteriorsData, truth: Mapping[str, ArrayLike] | None = None, names: str | Iterable[str] | None = None
) -> dict[str, FloatArray]:
    """Share of the draws below the true value, for every touch with a known true value.

    Parameters
    ----------
    posteriors : PosteriorsData
        Posteriors of t touches.
    truth : mapping of (t,) array_like, optional
        True values by parameter, in the units of the posteriors; NaN unknown. By default the reference values of
        location and radius from the touch table; not those of the load, which is a reading and not a true value.
    names : str or iterable of str, optional
        Parameters to use; by default all that have true values.

    Returns
    -------
    dict of (n,) arrays
        Shares by parameter. Radii at the limits of the prior (edge, flat) are left out, because their share is 0 or 1
        for any posterior.

    Raises
    ------
    InputError
        If these are no posteriors, a name is not a parameter, an array has the wrong length, no touch has a known true
        value, or only summaries were kept.
    """
    if not isinstance(posteriors, PosteriorsData):
        raise not_a("posteriors of touches", posteriors, "bayestouch.infer makes them, bayestouch.load reads them")
    require_draws(posteriors.posterior)
    if not isinstance(truth, Mapping | None):
        raise InputError(f"P-P plot: expected true values by parameter, such as {{'R': [...]}}, got {shown(truth)}")
    known = (
        dict(truth) if truth is not None else {k: v for k, v in posteriors.reference.items() if k not in ("P", "r_c")}
    )
    supports = {parameter.name: parameter.prior.support for parameter in posteriors.parameters}
    found: dict[str, FloatArray] = {}
    for name in known if names is None else (names,) if isinstance(names, str) else names:
        if name not in posteriors.posterior:
            parameters = list(posteriors.posterior)
            question = nearest(str(name), parameters)
            raise InputError(f"P-P plot: {name} is not among the parameters {', '.join(parameters)}{question}")
        if name not in known:
            with_truth = ", ".join(each for each in known if each in posteriors.posterior) or "none"
            raise InputError(f"P-P plot: {name} has no true values; parameters with true values: {with_truth}")
        draws, true = posteriors.posterior[name], number_array(f"P-P plot: true {name}", known[name], 1)
        if true.shape != draws.shape[2:]:
            raise InputError(f"P-P plot: expected the true {name} of {draws.shape[2]} touches, got {true.shape}")
        low, high = supports.get(name, (-np.inf, np.inf))
        if name == "theta_c":  # angles may be stated from 0 to 360, and draws lie from -180 to 180
            true = nearest_turn(true, draws.mean(axis=(0, 1)))
        inside = np.isfinite(true) & (true > low) & (true < high * (1 - 1e-6))
        difference = draws[..., inside] - true[inside]
        if name == "theta_c":
            difference = turned(difference)
        if inside.any():
            found[name] = np.asarray((difference < 0).mean(axis=(0, 1)) + 0.5 * (difference == 0).mean(axis=(0, 1)))
    if not found:
        raise InputError("P-P plot: no touch has a known true value; give them as truth={'theta_c': ..., 'R': ...}")
    return found


@dataclass(frozen=True, eq=False)
class UniformBand:
    """Band that contains the whole cumulative curve of n uniform numbers with a stated probability.

    Attributes
    ----------
    place, low, high : (`PLACES` + 1,) arrays
        Points between 0 and 1, and the limits of the band there.
    least : (`SIMULATIONS`,) array
        Sorted smallest pointwise two-sided probabilities of simulated curves.
    """

    place: FloatArray
    low: FloatArray
    high: FloatArray
    least: FloatArray

    @classmethod
    def of(cls, n: int, level: float = 0.95) -> UniformBand:
        """Band for n numbers."""
        from scipy.stats import binom

        place = np.arange(PLACES + 1) / PLACES
        rng = np.random.default_rng(0)
        steps = rng.multinomial(n, np.full(PLACES, 1 / PLACES), SIMULATIONS)
        # logarithm of the two-sided probability of each count at each point, from a table
        least = np.sort(_two_sided(n)[np.arange(PLACES - 1), np.cumsum(steps, axis=1)[:, :-1]].min(axis=1))
        tail = float(np.quantile(least, 1 - level)) / 2
        low, high = np.asarray(binom.ppf(tail, n, place)) / n, np.asarray(binom.isf(tail, n, place)) / n
        low[[0, -1]], high[[0, -1]] = (0, 1), (0, 1)
        return cls(place, low, high, least)

    def p_value(self, shares: FloatArray) -> float:
        """Probability of a curve at least as far from the diagonal, if the numbers are uniform."""
        n = len(shares)
        count = (shares[:, None] <= self.place[1:-1]).sum(axis=0)
        return float(
            (1 + np.searchsorted(self.least, _two_sided(n)[np.arange(PLACES - 1), count].min(), "right"))
            / (1 + SIMULATIONS)
        )


@lru_cache(maxsize=4)
def _two_sided(n: int) -> FloatArray:
    """Twice the smaller tail of the binomial distribution for every inner point and count, (places, n + 1)."""
    from scipy.stats import binom

    place, count = np.arange(1, PLACES)[:, None] / PLACES, np.arange(n + 1)
    return np.asarray(2 * np.minimum(binom.cdf(count, n, place), binom.sf(count - 1, n, place)))


def pp_plot(
    posteriors: PosteriorsData,
    truth: Mapping[str, ArrayLike] | None = None,
    *,
    names: str | Iterable[str] | None = None,
    level: float = 0.95,
    axes: Axes | None = None,
) -> Axes:
    """Plot the share of touches whose share of draws below the true value is at most p, over p.

    If the posteriors are right, the curve follows the diagonal. It is flat in the middle and steep at the ends if
    the posteriors are too narrow. It is above the diagonal if they lie too high.

    Parameters
    ----------
    posteriors : TouchPosteriors
        Posteriors of t touches, with their draws.
    truth : mapping of (t,) array_like, optional
        True values by parameter, in the units of the posteriors; NaN unknown. By default the reference values of
        location and radius from the touch table; not those of the load, which is a reading and not a true value.
        Touches whose true radius is at a limit of the prior (edge, flat) are left out of the curve of R, because the
        share of draws below it is 0 or 1 for any posterior.
    names : str or iterable of str, optional
        Parameters to plot; by default all that have true values.
    level : float
        Probability of the band, which is drawn for the parameter with the fewest touches.
    axes : matplotlib Axes, optional
        Axes to draw on; a new figure by default.

    Returns
    -------
    matplotlib Axes
        The legend states for each parameter the number of touches and the p value of the curve.

    Raises
    ------
    InputError
        If these are no posteriors, a name is not a parameter, an array has the wrong length, no touch has a known true
        value, only summaries were kept, or the level is not between 0 and 1.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> dataset = bayestouch.simulate(design, seed=3).dataset
    >>> calibration = bayestouch.calibrate(dataset, draws=200)
    >>> touches = bayestouch.infer(dataset.touches, calibration, draws=256)
    >>> axes = bayestouch.pp_plot(touches, names=["theta_c"])
    >>> axes.figure.savefig("pp.png")
    >>> axes.get_xlabel()
    'share of draws below the truth'
    """
    if not 0 < number_array("P-P plot: level", level, 0) < 1:
        raise InputError(f"P-P plot: expected a level between 0 and 1, got {level:g}")
    shares = shares_below(posteriors, truth, names)
    if axes is None:
        from matplotlib.figure import Figure

        axes = Figure(figsize=(4.6, 4.4), layout="constrained").subplots()
    symbols = {parameter.name: parameter.latex for parameter in posteriors.parameters}
    fewest = min(map(len, shares.values()))
    bands = {n: UniformBand.of(n, level) for n in {len(values) for values in shares.values()}}
    band = bands[fewest]
    axes.fill_between(
        band.place, band.low, band.high, color="0.85", lw=0, label=f"{100 * level:g} % of curves, {fewest} touches"
    )
    axes.plot([0, 1], [0, 1], color="0.6", lw=0.8)
    for i, (name, values) in enumerate(shares.items()):
        curve = np.r_[0.0, np.sort(values), 1.0]
        height = np.r_[0.0, np.arange(1, len(values) + 1) / len(values), 1.0]
        p = bands[len(values)].p_value(values)
        text = f"${symbols.get(name, name)}$: {len(values)} touches, p {'< 0.001' if p < 1e-3 else f'= {p:.2g}'}"
        axes.step(
            curve, height, where="post", color=COLOURS[i % len(COLOURS)], ls=DASHES[i % len(DASHES)], lw=1.4, label=text
        )
    axes.set(
        xlabel="share of draws below the truth", ylabel="share of touches", xlim=(0, 1), ylim=(0, 1), aspect="equal"
    )
    axes.legend(loc="upper left", fontsize="small", frameon=False)
    return axes
