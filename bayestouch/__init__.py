"""How far a tactile sensor's readings can be trusted.

The verbs ``calibrate``, ``infer``, ``diagnose``, ``report`` and ``simulate``, and what they work on. Everything is
imported when it is used, so that ``import bayestouch`` stays quick.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from bayestouch.version import __version__ as __version__

# Public name: module that defines it.
_PUBLIC = {
    "Calibration": "results",
    "Comparison": "comparison",
    "DataCheck": "checking",
    "DataSet": "dataset",
    "Diagnosis": "diagnosis.result",
    "EdgeOrRound": "indenter_priors",
    "Finger": "sensor",
    "FingerDesign": "simulation",
    "IndenterDistribution": "indenter_priors",
    "InputError": "errors",
    "KnownTips": "indenter_priors",
    "Pad": "sensor",
    "PadDesign": "simulation",
    "RankStatistics": "ranks",
    "Report": "reporting",
    "Rubber": "sensor",
    "Sensor": "sensor",
    "SimulatedDataSet": "simulation",
    "TouchPosteriors": "results",
    "Touches": "touches",
    "UniformCurvature": "indenter_priors",
    "UniformRadius": "indenter_priors",
    "calibrate": "calibration",
    "compare": "comparison",
    "diagnose": "diagnosis",
    "check": "checking",
    "infer": "inference",
    "load": "posterior_reading",
    "load_dataset": "dataset",
    "new_dataset": "dataset_template",
    "pp_plot": "probability_plot",
    "report": "reporting",
    "save_dataset": "dataset",
    "sbc": "simulation_checks",
    "simulate": "simulation",
}

__all__ = sorted(_PUBLIC)

if TYPE_CHECKING:
    from bayestouch.calibration import calibrate as calibrate
    from bayestouch.checking import DataCheck as DataCheck
    from bayestouch.checking import check as check
    from bayestouch.comparison import Comparison as Comparison
    from bayestouch.comparison import compare as compare
    from bayestouch.dataset import DataSet as DataSet
    from bayestouch.dataset import load_dataset as load_dataset
    from bayestouch.dataset import save_dataset as save_dataset
    from bayestouch.dataset_template import new_dataset as new_dataset
    from bayestouch.diagnosis import diagnose as diagnose
    from bayestouch.diagnosis.result import Diagnosis as Diagnosis
    from bayestouch.errors import InputError as InputError
    from bayestouch.indenter_priors import EdgeOrRound as EdgeOrRound
    from bayestouch.indenter_priors import IndenterDistribution as IndenterDistribution
    from bayestouch.indenter_priors import KnownTips as KnownTips
    from bayestouch.indenter_priors import UniformCurvature as UniformCurvature
    from bayestouch.indenter_priors import UniformRadius as UniformRadius
    from bayestouch.inference import infer as infer
    from bayestouch.posterior_reading import load as load
    from bayestouch.probability_plot import pp_plot as pp_plot
    from bayestouch.ranks import RankStatistics as RankStatistics
    from bayestouch.reporting import Report as Report
    from bayestouch.reporting import report as report
    from bayestouch.results import Calibration as Calibration
    from bayestouch.results import TouchPosteriors as TouchPosteriors
    from bayestouch.sensor import Finger as Finger
    from bayestouch.sensor import Pad as Pad
    from bayestouch.sensor import Rubber as Rubber
    from bayestouch.sensor import Sensor as Sensor
    from bayestouch.simulation import FingerDesign as FingerDesign
    from bayestouch.simulation import PadDesign as PadDesign
    from bayestouch.simulation import SimulatedDataSet as SimulatedDataSet
    from bayestouch.simulation import simulate as simulate
    from bayestouch.simulation_checks import sbc as sbc
    from bayestouch.touches import Touches as Touches


def __getattr__(name: str) -> Any:
    if name in _PUBLIC:
        return getattr(import_module(f"bayestouch.{_PUBLIC[name]}"), name)
    raise AttributeError(f"module 'bayestouch' has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
