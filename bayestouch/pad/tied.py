"""Kernels of a pad that predict left-out readings equally well, and readings elsewhere differently."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bayestouch.output.text import listed
from bayestouch.pad.candidates import PadCandidate, percent_of_peak
from bayestouch.pad.choice import CLEARLY_BETTER

# Points of the grid along each coordinate: a twentieth of the touched area is less than a kernel is wide.
_POINTS = 21


def note_on_tie(name: str, model: PadCandidate, rivals: Mapping[str, PadCandidate]) -> str:
    """One sentence if the choice of the kernel is uncertain and matters; empty otherwise.

    It matters if the kernels differ by more than the errors of left-out readings, over the area that was touched. A map
    corrects the kernel, so that a model with a map has no such sentence.
    """
    if model.has_map or not model.kernel.parameters:
        return ""
    location = model.fit.known.location
    axes = np.linspace(location.min(axis=0), location.max(axis=0), _POINTS).T
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
    own = model.sensitivity(points)
    apart = {
        other: percent_of_peak(rival.sensitivity(points) - own, own)
        for other, rival in rivals.items()
        if other != name
        and rival.kernel.parameters
        and not rival.has_map
        and abs(rival.score - model.score) <= CLEARLY_BETTER
    }
    tied = {other: percent for other, percent in apart.items() if percent > model.error_percent}
    if not tied:
        return ""
    return (
        f"left-out readings do not decide between the kernels {listed([name, *tied])}, which differ by up to "
        f"{max(tied.values()):.1f} % of the peak (rms) over the touched area: touch the pad at more places"
    )
