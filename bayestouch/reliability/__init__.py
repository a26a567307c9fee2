"""How far a finger's readings can be trusted, and where: thresholds, sweet spots, and questions of design.

Everything is imported when it is used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

# Public name: module that defines it.
_PUBLIC = {
    "Annulus": "paper_criterion",
    "KnownFinger": "known_finger",
    "Optimism": "distinguishability",
    "RadiusScale": "information",
    "TouchPlaces": "known_finger",
    "Trial": "distinguishability",
    "expected_finger": "expected_calibration",
    "log_evidence": "evidence",
    "optimism": "distinguishability",
    "smallest_radius": "paper_criterion",
    "strain_difference": "paper_criterion",
    "threshold_radii": "distinguishability",
    "told_apart": "distinguishability",
    "tolerable_noise": "paper_criterion",
    "touch_information": "information",
    "trial": "distinguishability",
}

__all__ = sorted(_PUBLIC)

if TYPE_CHECKING:
    from bayestouch.reliability.distinguishability import Optimism as Optimism
    from bayestouch.reliability.distinguishability import Trial as Trial
    from bayestouch.reliability.distinguishability import optimism as optimism
    from bayestouch.reliability.distinguishability import threshold_radii as threshold_radii
    from bayestouch.reliability.distinguishability import told_apart as told_apart
    from bayestouch.reliability.distinguishability import trial as trial
    from bayestouch.reliability.evidence import log_evidence as log_evidence
    from bayestouch.reliability.expected_calibration import expected_finger as expected_finger
    from bayestouch.reliability.information import RadiusScale as RadiusScale
    from bayestouch.reliability.information import touch_information as touch_information
    from bayestouch.reliability.known_finger import KnownFinger as KnownFinger
    from bayestouch.reliability.known_finger import TouchPlaces as TouchPlaces
    from bayestouch.reliability.paper_criterion import Annulus as Annulus
    from bayestouch.reliability.paper_criterion import smallest_radius as smallest_radius
    from bayestouch.reliability.paper_criterion import strain_difference as strain_difference
    from bayestouch.reliability.paper_criterion import tolerable_noise as tolerable_noise


def __getattr__(name: str) -> Any:
    if name in _PUBLIC:
        return getattr(import_module(f"bayestouch.reliability.{_PUBLIC[name]}"), name)
    raise AttributeError(f"module 'bayestouch.reliability' has no attribute {name!r}")


def __dir__() -> list[str]:
    return list(__all__)
