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
    "Calibration": "results.objects",
    "Comparison": "reporting.comparison",
    "DataCheck": "checking",
    "DataSet": "data.dataset",
    "Diagnosis": "diagnosis.result",
    "EdgeOrRound": "priors.indenters",
    "Finger": "data.sensor",
    "FingerDesign": "simulation",
    "IndenterDistribution": "priors.indenters",
    "InputError": "errors",
    "KnownTips": "priors.indenters",
    "Pad": "data.sensor",
    "PadDesign": "simulation",
    "RankStatistics": "checks.ranks",
    "Report": "reporting",
    "Rubber": "data.sensor",
    "Sensor": "data.sensor",
    "SimulatedDataSet": "simulation",
    "TouchPosteriors": "results.objects",
    "Touches": "data.touches",
    "UniformCurvature": "priors.indenters",
    "UniformRadius": "priors.indenters",
    "calibrate": "calibration",
    "compare": "reporting.comparison",
    "diagnose": "diagnosis",
    "check": "checking",
    "infer": "inference",
    "load": "results.reading",
    "load_dataset": "data.dataset",
    "new_dataset": "data.template",
    "pp_plot": "results.probability_plot",
    "report": "reporting",
    "save_dataset": "data.dataset",
    "sbc": "checks.touches",
    "simulate": "simulation",
}

__all__ = sorted(_PUBLIC)

if TYPE_CHECKING:
    from bayestouch.calibration import calibrate as calibrate
    from bayestouch.checking import DataCheck as DataCheck
    from bayestouch.checking import check as check
    from bayestouch.checks.ranks import RankStatistics as RankStatistics
    from bayestouch.checks.touches import sbc as sbc
    from bayestouch.data.dataset import DataSet as DataSet
    from bayestouch.data.dataset import load_dataset as load_dataset
    from bayestouch.data.dataset import save_dataset as save_dataset
    from bayestouch.data.sensor import Finger as Finger
    from bayestouch.data.sensor import Pad as Pad
    from bayestouch.data.sensor import Rubber as Rubber
    from bayestouch.data.sensor import Sensor as Sensor
    from bayestouch.data.template import new_dataset as new_dataset
    from bayestouch.data.touches import Touches as Touches
    from bayestouch.diagnosis import diagnose as diagnose
    from bayestouch.diagnosis.result import Diagnosis as Diagnosis
    from bayestouch.errors import InputError as InputError
    from bayestouch.inference import infer as infer
    from bayestouch.priors.indenters import EdgeOrRound as EdgeOrRound
    from bayestouch.priors.indenters import IndenterDistribution as IndenterDistribution
    from bayestouch.priors.indenters import KnownTips as KnownTips
    from bayestouch.priors.indenters import UniformCurvature as UniformCurvature
    from bayestouch.priors.indenters import UniformRadius as UniformRadius
    from bayestouch.reporting import Report as Report
    from bayestouch.reporting import report as report
    from bayestouch.reporting.comparison import Comparison as Comparison
    from bayestouch.reporting.comparison import compare as compare
    from bayestouch.results.objects import Calibration as Calibration
    from bayestouch.results.objects import TouchPosteriors as TouchPosteriors
    from bayestouch.results.probability_plot import pp_plot as pp_plot
    from bayestouch.results.reading import load as load
    from bayestouch.simulation import FingerDesign as FingerDesign
    from bayestouch.simulation import PadDesign as PadDesign
    from bayestouch.simulation import SimulatedDataSet as SimulatedDataSet
    from bayestouch.simulation import simulate as simulate


def __getattr__(name: str) -> Any:
    if name in _PUBLIC:
        return getattr(import_module(f"bayestouch.{_PUBLIC[name]}"), name)
    raise AttributeError(f"module 'bayestouch' has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
