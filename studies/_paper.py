"""The paper's finger as the studies of its tables and figures simulate it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.reliability.paper_finger import DESIGN
from bayestouch.simulation import FingerDesign

#: MPa: posterior mean and 90 % interval that `table_3_modulus.py` prints; the paper prints no modulus.
SHEAR_MODULUS = 0.054
MODULUS_INTERVAL = (0.045, 0.065)


def paper_design(**changes: object) -> FingerDesign:
    """Sizes and noise as printed, elements as deep as Table 1 fitted them, rubber as Table 3 wants it."""
    return replace(DESIGN, **{"shear_modulus_MPa": SHEAR_MODULUS, **changes})  # type: ignore[arg-type]


def indenter(radius_mm: float) -> str:
    """What a tip is called."""
    if radius_mm == 0:
        return "edge"
    return "flat" if np.isinf(radius_mm) else f"{radius_mm:g} mm"
