"""Figures of a diagnosis."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

from bayestouch.diagnosis.pictures.effects import effect_pictures
from bayestouch.diagnosis.pictures.profile import profile_pictures
from bayestouch.diagnosis.pictures.search import search_picture
from bayestouch.diagnosis.pictures.touches import touch_picture
from bayestouch.diagnosis.pictures.views import pair_picture, view_picture
from bayestouch.diagnosis.traced import Traced
from bayestouch.output.pictures import Picture

__all__ = ["diagnosis_pictures"]


def diagnosis_pictures(traced: Traced, most: int | None = None) -> tuple[Picture, ...]:
    """The figures that are possible with the data, the most important first; at most so many are drawn."""
    return tuple(islice(_each(traced), most))


def _each(traced: Traced) -> Iterator[Picture]:
    yield from effect_pictures(traced)
    yield from profile_pictures(traced)
    before, after = traced.before.held_out, traced.after.held_out
    if before is not None and after is not None:
        yield view_picture(before, after)
        if before.present.any(axis=0).sum() > 1:
            yield pair_picture(before, after)
    yield search_picture(traced)
    if before is None or after is None or "R" not in before.reference:
        return
    if traced.before.read is not None and traced.after.read is not None:
        yield touch_picture(traced.before.read, traced.after.read, before, after)
