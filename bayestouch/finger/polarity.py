"""A note on elements whose readings fall under a touch where those of the others rise."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.arrays import responding


def other_polarity(response: FloatArray, observed: FloatArray) -> Iterator[str]:
    """Yield a line if a minority of the elements has responses of the other sign.

    Parameters
    ----------
    response : (m,) array
        Reading per N/m of a knife edge above each element.
    observed : (t, m) array
        Readings of the touches; elements that do not respond do not count.
    """
    rises, falls = (responding(observed) & (sign * response > 0) for sign in (1, -1))
    few, most = sorted((rises, falls), key=lambda each: int(each.sum()))
    if not 0 < few.sum() < most.sum():
        return
    names = ", ".join(f"e{e + 1:02d}" for e in np.flatnonzero(few))
    yield (
        f"The gain of {names} has the other sign than those of most elements: readings fall under a touch where those "
        "of the others rise, or rise where they fall. If it is not built so, look at wires and signs of the tables."
    )
