"""How far a finger's readings can be trusted, and where: thresholds, sweet spots, and questions of design.

Everything is imported when it is used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

# Public name: module that defines it.
_PUBLIC = {
    "Annulus": "paper_criterion",
    "Beside": "comparison",
    "BiasMap": "bias_scores",
    "PublishedComparison": "comparison",
    "DesignMaps": "designs",
    "Effort": "effort",
    "Explained": "bias_scores",
    "KnownFinger": "known_finger",
    "Optimism": "distinguishability",
    "PadDesignMaps": "pad_designs",
    "PadSpots": "pad_maps",
    "RadiusScale": "information",
    "SweetSpots": "maps",
    "TouchEstimator": "location_bias",
    "TouchPlaces": "known_finger",
    "Trial": "distinguishability",
    "attainable": "bias_scores",
    "averaging_effort": "effort",
    "calibration_effort": "effort",
    "covered": "bias_scores",
    "design_maps": "designs",
    "draw_bias": "maps",
    "expected_coverage": "bias_scores",
    "expected_finger": "expected_calibration",
    "explained_sign": "bias_scores",
    "explained_size": "bias_scores",
    "known_bias": "maps",
    "log_evidence": "evidence",
    "observed_bias": "bias_scores",
    "optimism": "distinguishability",
    "pad_design_maps": "pad_designs",
    "pad_known_bias": "pad_maps",
    "pad_spots": "pad_maps",
    "place_bias": "places",
    "shared_by_indenters": "bias_scores",
    "smallest_radius": "paper_criterion",
    "strain_difference": "paper_criterion",
    "sweet_spots": "maps",
    "threshold_radii": "distinguishability",
    "distinguished": "distinguishability",
    "tolerable_noise": "paper_criterion",
    "touch_information": "information",
    "trial": "distinguishability",
    "variance_split": "bias_scores",
}

__all__ = sorted(_PUBLIC)

if TYPE_CHECKING:
    from bayestouch.reliability.bias_scores import BiasMap as BiasMap
    from bayestouch.reliability.bias_scores import Explained as Explained
    from bayestouch.reliability.bias_scores import attainable as attainable
    from bayestouch.reliability.bias_scores import covered as covered
    from bayestouch.reliability.bias_scores import expected_coverage as expected_coverage
    from bayestouch.reliability.bias_scores import explained_sign as explained_sign
    from bayestouch.reliability.bias_scores import explained_size as explained_size
    from bayestouch.reliability.bias_scores import observed_bias as observed_bias
    from bayestouch.reliability.bias_scores import shared_by_indenters as shared_by_indenters
    from bayestouch.reliability.bias_scores import variance_split as variance_split
    from bayestouch.reliability.comparison import Beside as Beside
    from bayestouch.reliability.comparison import PublishedComparison as PublishedComparison
    from bayestouch.reliability.designs import DesignMaps as DesignMaps
    from bayestouch.reliability.designs import design_maps as design_maps
    from bayestouch.reliability.distinguishability import Optimism as Optimism
    from bayestouch.reliability.distinguishability import Trial as Trial
    from bayestouch.reliability.distinguishability import distinguished as distinguished
    from bayestouch.reliability.distinguishability import optimism as optimism
    from bayestouch.reliability.distinguishability import threshold_radii as threshold_radii
    from bayestouch.reliability.distinguishability import trial as trial
    from bayestouch.reliability.effort import Effort as Effort
    from bayestouch.reliability.effort import averaging_effort as averaging_effort
    from bayestouch.reliability.effort import calibration_effort as calibration_effort
    from bayestouch.reliability.evidence import log_evidence as log_evidence
    from bayestouch.reliability.expected_calibration import expected_finger as expected_finger
    from bayestouch.reliability.information import RadiusScale as RadiusScale
    from bayestouch.reliability.information import touch_information as touch_information
    from bayestouch.reliability.known_finger import KnownFinger as KnownFinger
    from bayestouch.reliability.known_finger import TouchPlaces as TouchPlaces
    from bayestouch.reliability.location_bias import TouchEstimator as TouchEstimator
    from bayestouch.reliability.maps import SweetSpots as SweetSpots
    from bayestouch.reliability.maps import draw_bias as draw_bias
    from bayestouch.reliability.maps import known_bias as known_bias
    from bayestouch.reliability.maps import sweet_spots as sweet_spots
    from bayestouch.reliability.pad_designs import PadDesignMaps as PadDesignMaps
    from bayestouch.reliability.pad_designs import pad_design_maps as pad_design_maps
    from bayestouch.reliability.pad_maps import PadSpots as PadSpots
    from bayestouch.reliability.pad_maps import pad_known_bias as pad_known_bias
    from bayestouch.reliability.pad_maps import pad_spots as pad_spots
    from bayestouch.reliability.paper_criterion import Annulus as Annulus
    from bayestouch.reliability.paper_criterion import smallest_radius as smallest_radius
    from bayestouch.reliability.paper_criterion import strain_difference as strain_difference
    from bayestouch.reliability.paper_criterion import tolerable_noise as tolerable_noise
    from bayestouch.reliability.places import place_bias as place_bias


def __getattr__(name: str) -> Any:
    if name in _PUBLIC:
        return getattr(import_module(f"bayestouch.reliability.{_PUBLIC[name]}"), name)
    raise AttributeError(f"module 'bayestouch.reliability' has no attribute {name!r}")


def __dir__() -> list[str]:
    return list(__all__)
