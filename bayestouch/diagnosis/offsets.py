"""Effects that add the same to all touches, as an offset of the readings does that nobody subtracted."""

from __future__ import annotations

from collections.abc import Iterator

from bayestouch.array_types import FloatArray
from bayestouch.model.base import without_effects
from bayestouch.model.fitting import Fitted
from bayestouch.model.split_data import SplitData

#: Smallest share of the mean over touches in the mean square of what an effect adds. Offsets of 2 to 100 % of the peak
#: on ten simulated fingers gave 0.9987 or more, proximity that was there 0.73 and 0.89.
SAME = 0.99


def like_an_offset(data: SplitData, fitted: Fitted) -> Iterator[str]:
    """Yield a note for each effect that adds the same to all touches, where no reading without touch was subtracted."""
    if not data.table.in_contact.all():
        return
    for name, added in _added(fitted):
        scaled = added / fitted.model.peak
        square = float((scaled**2).mean(axis=0).sum())
        if square > 0 and float((scaled.mean(axis=0) ** 2).sum()) > SAME * square:
            yield (
                f"what {name} adds to the readings of an element is the same in all touches, and the tables have no "
                "reading without touch: an offset that was not subtracted looks like this. Add rows without touch "
                "(contact 0), and diagnose again"
            )


def _added(fitted: Fitted) -> Iterator[tuple[str, FloatArray]]:
    """What each effect of the chain, and the drifts together, add to the mean readings of touches, (t, m)."""
    model, vector = fitted.model, fitted.vector
    whole = model.predict(vector).touches
    for effect in model.effects:
        plain, rest = without_effects(model, vector, {effect.name})
        yield effect.name, whole - plain.predict(rest).touches
    if fitted.drifts:
        yield " and ".join(drift.name for drift, _ in fitted.drifts), fitted.drifted
