"""What to measure to decide between two effects that the data cannot tell apart."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.data.touches import Touches
from bayestouch.diagnosis.rounds import SearchRound, Tried
from bayestouch.diagnosis.search import ERRORS, is_near
from bayestouch.effects.random import RandomEffect
from bayestouch.finger.model import finger_model
from bayestouch.model.base import SensorModel
from bayestouch.model.fitting import Fitted
from bayestouch.model.observations import Observations
from bayestouch.model.whitening import Whitening

# Locations that are considered, over the range that was touched, and numbers of touches worth asking for.
LOCATIONS = 11
NUMBERS = (3, 5, 10, 20, 30, 50, 75, 100, 150, 200, 300, 500)
# Square of the whitened difference that decides.
ENOUGH = (2 * ERRORS) ** 2
NOTHING = "no 500 touches with the tips, locations and loads that were used tell them apart"


@dataclass(frozen=True)
class Advice:
    """Touches that would decide.

    Attributes
    ----------
    between : (str, str)
        The two effects.
    number : int or None
        How many touches, about; None where no number worth making decides.
    touches : str
        Which, in words.
    """

    between: tuple[str, str]
    number: int | None
    touches: str

    def __str__(self) -> str:
        one, two = self.between
        if self.number is None:
            return f"To decide between {one} and {two}: {self.touches}."
        return f"To decide between {one} and {two}: about {self.number} more touches {self.touches}."


def advice(rounds: tuple[SearchRound, ...]) -> Advice | None:
    """Advice where an effect was added that another equals, or where none was added though some came near."""
    for each in rounds:
        pair = _undecided(each)
        if pair is not None:
            return _advice(each.before, *pair)
    return None


def _undecided(each: SearchRound) -> tuple[Tried, Tried] | None:
    refitted = [tried for tried in each.tried if tried.fitted is not None and tried.noise is None]
    if each.added is not None:
        others = [tried for tried in refitted if tried.effect.name in each.added.indistinguishable]
        return (each.added, others[0]) if others and each.added.fitted is not None else None
    # What is sure and yet explains little is no explanation that more touches could confirm.
    near = [tried for tried in refitted if is_near(tried)]
    return (near[0], near[1]) if len(near) > 1 else None


def _advice(before: Fitted, one: Tried, two: Tried) -> Advice:
    """The series of touches on which the two models differ most, by the noise and by what the models leave open.

    With D the whitened difference of the predictions for a series of touches, their log likelihood favours the right
    model by ``D²/2`` on the mean with a standard deviation of D: it decides where that is `ERRORS` of them.
    """
    assert one.fitted is not None and two.fitted is not None
    names = (one.effect.name, two.effect.name)
    in_time = any(isinstance(tried.effect, RandomEffect) for tried in (one, two))
    if in_time:
        apart, _ = separation(one.fitted, two.fitted, before.model.known)
        square = float((apart**2).sum(axis=1).mean())
        number = int(np.ceil(ENOUGH / max(square, 1e-9)))
        if number <= NUMBERS[-1]:
            return Advice(names, number, "of one kind (tip, location, load), spread evenly over the whole time")
        return Advice(names, None, NOTHING)
    observed = hypothetical(before)
    apart, spread = separation(one.fitted, two.fitted, observed)
    kinds = list(_kinds(observed))
    table = np.array([_decides(apart[rows], spread[:, rows]) for _, rows in kinds])
    for number, squares in zip(NUMBERS, table.T, strict=True):
        best = int(np.argmax(squares))
        if squares[best] >= ENOUGH:
            return Advice(names, number, kinds[best][0])
    return Advice(names, None, NOTHING)


def _kinds(observed: Observations) -> Iterator[tuple[str, IntArray]]:
    """Series of touches over all locations, in words: one tip under one load, or all tips under one."""
    means = observed.means
    assert means.angle_deg is not None
    over = f"evenly from {means.angle_deg.min():.3g} to {means.angle_deg.max():.3g} degree"
    for load in np.unique(means.load):
        under = f"under {load:.3g} N/m"
        for tip in np.unique(means.indenter_radius_mm):
            with_what = "an edge" if tip == 0 else "a flat" if np.isinf(tip) else f"a tip of {tip:g} mm"
            rows = np.flatnonzero((means.load == load) & (means.indenter_radius_mm == tip))
            yield f"with {with_what}, {over}, {under}", rows
        yield f"with all the tips in turn, {over}, {under}", np.flatnonzero(means.load == load)


def _decides(apart: FloatArray, spread: FloatArray) -> FloatArray:
    """Squared whitened difference for each of `NUMBERS` touches spread over a series; (t, m) and (d, t, m)."""
    d, a = apart.ravel(), spread.reshape(len(spread), -1)
    inside, gram = a @ d, a @ a.T
    out = []
    for number in NUMBERS:
        n = number / len(apart)
        absorbed = inside @ np.linalg.solve(np.eye(len(gram)) + n * gram, inside)
        out.append(n * float(d @ d) - n * n * float(absorbed))
    return np.array(out)


def hypothetical(before: Fitted) -> Observations:
    """Touches on a grid of the tips that were used, the locations that were touched, and three loads."""
    known = before.model.known
    table, means = known.table, known.means
    assert means.angle_deg is not None
    tips = np.unique(means.indenter_radius_mm)
    places = np.linspace(means.angle_deg.min(), means.angle_deg.max(), LOCATIONS)
    load = finger_model(before.model).load
    loads = np.array([load.min(), np.median(load), load.max()])
    tip, place, force = (axis.ravel() for axis in np.meshgrid(tips, places, loads, indexing="ij"))
    n, reads = len(tip), float(np.median(means.counts.max(axis=1)))
    rows = table.select(np.zeros(n, dtype=np.int64))
    rows = rows.with_(
        touch=np.arange(n),
        sample=np.zeros(n, dtype=np.int64),
        indenter_radius_mm=tip,
        angle_deg=place,
        load=force,
        time_s=np.full(n, np.nan),
        contact=np.ones(n),
        reads=np.full(n, reads),
        readings=_some_readings(table, n),
        readings_sd=None,
    )
    time = np.full(n, known.span[1])
    return Observations.of(rows, time, np.zeros(n), known.unit, known.history, known.span, known.sessions)


def _some_readings(table: Touches, n: int) -> FloatArray:
    """Zeros for elements that are read, NaN for those that are not: only predictions are compared."""
    alive = np.isfinite(table.readings).any(axis=0)
    return np.tile(np.where(alive, 0.0, np.nan), (n, 1))


def separation(one: Fitted, two: Fitted, observed: Observations) -> tuple[FloatArray, FloatArray]:
    """Whitened difference of two models' predictions (t, m), and what the models leave open of it (d, t, m)."""
    models = [(each.model.observing(observed), each.vector) for each in (one, two)]
    first, second = (model.predict(vector).touches for model, vector in models)
    if observed is one.model.known:
        first, second = first + one.drifted, second + two.drifted
    model, vector = models[0]
    load_sd = np.full(observed.n_touches, float(np.median(one.noise.load_sd)))
    whitening = Whitening.of(observed, one.noise.with_(load_sd=load_sd), first, model.by_load(vector))
    spread = [_open(whitening, each, pair) for each, pair in zip((one, two), models, strict=True)]
    return whitening.touches(first - second), np.concatenate(spread)


def _open(whitening: Whitening, fitted: Fitted, pair: tuple[SensorModel, FloatArray]) -> FloatArray:
    """What one standard deviation of each direction of a model's parameters does, whitened, (d, t, m)."""
    slopes = whitening.touches(pair[0].derivatives(pair[1])[0])
    root = np.linalg.cholesky(fitted.linear.covariance())
    return np.asarray(np.tensordot(root.T, slopes, axes=1))
