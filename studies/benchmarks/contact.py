"""What the exact contact on the bonded layer costs; Hertz in closed form is the bound.

python studies/benchmarks/contact.py
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import time
from collections.abc import Callable

import numpy as np

from bayestouch.contact import LayerContact, contact_model

RADII, POISSON_RATIO = (9.4, 12.7), 0.46
MODES = np.arange(151)
# 120 loads, from contacts of 0.3 mm to those of a flat
KAPPA = np.geomspace(1e-2, 60, 120)


def seconds(call: Callable[[], object], repeats: int = 20) -> float:
    """Least wall time of a call, which a busy machine disturbs least."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return min(times)


def main() -> dict[str, float]:
    """Print milliseconds and ratios to Hertz; returns the seconds."""
    layer, hertz = LayerContact.for_body(*RADII, POISSON_RATIO), contact_model("hertz", RADII, POISSON_RATIO)
    found = {
        "Hertz": seconds(lambda: hertz.spectrum(KAPPA, MODES)),
        "layer, from solutions at hand": seconds(lambda: layer.spectrum(KAPPA, MODES)),
        "layer, solved for a new body": seconds(
            lambda: LayerContact.for_body(*RADII, POISSON_RATIO).spectrum(KAPPA, MODES), 5
        ),
    }
    print(f"{len(KAPPA)} contacts, {len(MODES)} modes each")
    for name, value in found.items():
        print(f"{name:32s}{1e3 * value:9.2f} ms{value / found['Hertz']:9.2f} times Hertz")
    return found


if __name__ == "__main__":
    main()
