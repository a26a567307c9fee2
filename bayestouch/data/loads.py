"""Whether the loads of known touches differ."""

import numpy as np

from bayestouch.array_types import FloatArray

#: Loads vary if their range is above this share of their median.
LOADS_VARY = 0.2


def loads_vary(load: FloatArray) -> bool:
    """Whether loads (n,) differ enough for an error of the load, or a map that is not in proportion to it, to show.

    Loads that are NaN do not count. Where loads are equal, an error of the load acts as one of the gains. On a finger
    it also makes the contact narrower or wider, as another shear modulus does.
    """
    known = load[np.isfinite(load)]
    return bool(len(known) and np.ptp(known) > LOADS_VARY * np.median(known))
