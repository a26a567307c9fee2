"""Advice on what to measure to decide between two effects that are indistinguishable with the data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.diagnosis.comparison import ERRORS
from bayestouch.diagnosis.one_round import is_near
from bayestouch.diagnosis.place_or_time import IN_PLACE
from bayestouch.diagnosis.rounds import SearchRound, Tried
from bayestouch.model.base import PossibleTouches, SensorModel
from bayestouch.model.fitting import Fitted
from bayestouch.model.observations import Observations
from bayestouch.model.whitening import Whitening

# Numbers of touches that may be advised.
NUMBERS = (3, 5, 10, 20, 30, 50, 75, 100, 150, 200, 300, 500)
# Squared whitened difference that is needed for a decision.
ENOUGH = (2 * ERRORS) ** 2
UNDECIDED = "no 500 touches with the tips, locations and loads that were used distinguish them"


@dataclass(frozen=True)
class Advice:
    """Touches that would decide between two effects.

    Attributes
    ----------
    between : (str, str)
        Names of the two effects.
    number : int or None
        Approximate number of touches; None if no reasonable number is sufficient.
    touches : str
        Description of the touches.
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
    """Advice if an effect was added that another one equals, or if none was added although some were near.

    None if the body has no possible touches that could decide.
    """
    undecided = [one for one in rounds[-1].place_or_time if one.undecided]
    if undecided:
        return _place_or_time_advice(rounds[-1], undecided[0].drift)
    for each in rounds:
        pair = _indistinguishable_pair(each)
        possible = None if pair is None else each.before.model.possible_touches()
        if pair is not None and possible is not None:
            return _advice(each.before, possible, *pair)
    return None


def _indistinguishable_pair(each: SearchRound) -> tuple[Tried, Tried] | None:
    refitted = [tried for tried in each.tried if tried.fitted is not None and tried.noise is None]
    if each.added is not None:
        others = [tried for tried in refitted if tried.effect.name in each.added.indistinguishable]
        return (each.added, others[0]) if others and each.added.fitted is not None else None
    # An effect that is certain but explains little would not be confirmed by more touches.
    near = [tried for tried in refitted if is_near(tried)]
    return (near[0], near[1]) if len(near) > 1 else None


def _advice(before: Fitted, possible: PossibleTouches, one: Tried, two: Tried) -> Advice:
    """Series of touches on which two models differ most, relative to the noise and the uncertainty of the models.

    With D the whitened difference of the predictions for a series of touches, the mean log likelihood ratio in favour
    of the right model is ``D²/2``, with a standard deviation of D. It decides if the mean is `ERRORS` of these.
    """
    assert one.fitted is not None and two.fitted is not None
    names = (one.effect.name, two.effect.name)
    in_time = any(tried.effect.random for tried in (one, two))
    if in_time:
        difference, _ = separation(one.fitted, two.fitted, before.model.known)
        square = float((difference**2).sum(axis=1).mean())
        number = int(np.ceil(ENOUGH / max(square, 1e-9)))
        if number <= NUMBERS[-1]:
            return Advice(names, number, "of one kind (tip, location, load), spread evenly over the whole time")
        return Advice(names, None, UNDECIDED)
    difference, spread = separation(one.fitted, two.fitted, possible.observed)
    table = np.array([_decides(difference[rows], spread[:, rows]) for _, rows in possible.series])
    for number, squares in zip(NUMBERS, table.T, strict=True):
        best = int(np.argmax(squares))
        if squares[best] >= ENOUGH:
            return Advice(names, number, possible.series[best][0])
    return Advice(names, None, UNDECIDED)


def _place_or_time_advice(last: SearchRound, drift: str) -> Advice:
    """The first places again, at the end: functions of place say what is read there, a drift has long moved on.

    There the drift is unknown: each element's reading varies by the drift's standard deviation about the model, while
    by place the error f that the touches had would be there again. With both in units of the noise, the squared
    difference of a touch is the sum over elements of ``f² / (1 + sd²)``.
    """
    (found,) = (each.fitted for each in last.tried if each.effect.name == drift)
    assert found is not None
    error = found.whitening.touches(found.last_drifted)
    square = float((error**2 / (1 + (error**2).mean(axis=0))).sum(axis=1).mean())
    number = next((each for each in NUMBERS if each * square >= ENOUGH), None)
    what = "at the first places again, at the end, or as many as before in a random order"
    return Advice((drift, IN_PLACE), number, what if number is not None else UNDECIDED)


def _decides(difference: FloatArray, spread: FloatArray) -> FloatArray:
    """Squared whitened difference for each of `NUMBERS` touches spread over a series; (t, m) and (d, t, m)."""
    d, a = difference.ravel(), spread.reshape(len(spread), -1)
    inside, gram = a @ d, a @ a.T
    out = []
    for number in NUMBERS:
        n = number / len(difference)
        absorbed = inside @ np.linalg.solve(np.eye(len(gram)) + n * gram, inside)
        out.append(n * float(d @ d) - n * n * float(absorbed))
    return np.array(out)


def separation(one: Fitted, two: Fitted, observed: Observations) -> tuple[FloatArray, FloatArray]:
    """Whitened difference of two models' predictions (t, m), and its uncertainty from the models (d, t, m)."""
    models = [(each.model.observing(observed), each.vector) for each in (one, two)]
    first, second = (model.predict(vector).touches for model, vector in models)
    if observed is one.model.known:
        first, second = first + one.drifted, second + two.drifted
    model, vector = models[0]
    load_sd = np.full(observed.n_touches, float(np.median(one.noise.load_sd)))
    whitening = Whitening.of(observed, one.noise.with_(load_sd=load_sd), first, model.by_load(vector))
    spread = [_uncertainty(whitening, each, pair) for each, pair in zip((one, two), models, strict=True)]
    return whitening.touches(first - second), np.concatenate(spread)


def _uncertainty(whitening: Whitening, fitted: Fitted, pair: tuple[SensorModel, FloatArray]) -> FloatArray:
    """Whitened change of the predictions by one standard deviation in each direction of the parameters, (d, t, m)."""
    slopes = whitening.touches(pair[0].derivatives(pair[1])[0])
    root = np.linalg.cholesky(fitted.linear.covariance())
    return np.asarray(np.tensordot(root.T, slopes, axes=1))
