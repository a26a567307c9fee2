"""Figure of the effects that were tried, and how much each explains."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from bayestouch.diagnosis.rounds import SearchRound, Tried
from bayestouch.diagnosis.traced import Traced
from bayestouch.output.pictures import BLUE, GREY, ORANGE, Picture, canvas, drawing, rendered

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def search_picture(traced: Traced) -> Picture:
    """Figure of the share that each candidate explains of what can be explained, one panel a round."""
    rounds = traced.rounds
    names = [tried.effect.name for tried in rounds[0].tried]
    with drawing():
        figure, axes = canvas(0.9 + 0.2 * len(names), 1, len(rounds), sharey=True)
        for number, (axis, each) in enumerate(zip(axes[0], rounds, strict=True), start=1):
            draw_round(axis, number, each, names)
        axes[0][0].invert_yaxis()
        content = rendered(figure, "png")
    added = [each.added.effect.name for each in rounds if each.added is not None]
    return Picture(
        "search",
        "search",
        "Which effects were tried",
        "What each effect of the catalogue explains, if it is added alone, of the residual that can be explained. Blue "
        "was added; these data cannot distinguish orange from it.",
        f"Rounds of the search; added: {', '.join(added) or 'nothing'}.",
        content,
        "png",
    )


def draw_round(axes: Axes, number: int, each: SearchRound, names: Sequence[str]) -> None:
    """Draw the bars of one round: the added effect is blue, those indistinguishable from it are orange."""
    tried = {one.effect.name: one for one in each.tried}
    place = np.arange(len(names))
    colours = [_colour(each, name) for name in names]
    axes.barh(place, [_share(tried.get(name)) for name in names], color=colours, height=0.75)
    axes.set(xlim=(0, 100), xlabel="explains (%)", title=f"round {number}: {_outcome(each)}")
    axes.set_yticks(place, names)


def _share(tried: Tried | None) -> float:
    return 0.0 if tried is None or not np.isfinite(tried.share) else 100 * tried.share


def _colour(each: SearchRound, name: str) -> str:
    if each.added is None:
        return GREY
    if name == each.added.effect.name:
        return BLUE
    return ORANGE if name in each.added.indistinguishable else GREY


def _outcome(each: SearchRound) -> str:
    return "nothing added" if each.added is None else f"{each.added.effect.name} added"
