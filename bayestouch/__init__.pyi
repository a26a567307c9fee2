"""Public names and the modules that define them, for type checkers, editors and lazy_loader."""

from .calibration import calibrate as calibrate
from .calibration.log_density import LogDensity as LogDensity
from .calibration.log_density import log_density as log_density
from .checking import DataCheck as DataCheck
from .checking import check as check
from .data.dataset import DataSet as DataSet
from .data.dataset import load_dataset as load_dataset
from .data.dataset import save_dataset as save_dataset
from .data.sensor import Finger as Finger
from .data.sensor import Pad as Pad
from .data.sensor import Rubber as Rubber
from .data.sensor import Sensor as Sensor
from .data.template import new_dataset as new_dataset
from .data.touches import Touches as Touches
from .data.touches import touches_from as touches_from
from .diagnosis import diagnose as diagnose
from .diagnosis.result import Diagnosis as Diagnosis
from .errors import InputError as InputError
from .inference import infer as infer
from .live import Reader as Reader
from .priors.indenters import EdgeOrRound as EdgeOrRound
from .priors.indenters import IndenterDistribution as IndenterDistribution
from .priors.indenters import KnownTips as KnownTips
from .priors.indenters import UniformCurvature as UniformCurvature
from .priors.indenters import UniformRadius as UniformRadius
from .reading.live import LiveTouch as LiveTouch
from .reliability.candidate_touches import candidate_touches as candidate_touches
from .reliability.next_touches import NextTouches as NextTouches
from .reliability.next_touches import next_touches as next_touches
from .reporting import Report as Report
from .reporting import report as report
from .reporting.comparison import Comparison as Comparison
from .reporting.comparison import compare as compare
from .results.objects import Calibration as Calibration
from .results.objects import TouchPosteriors as TouchPosteriors
from .results.probability_plot import pp_plot as pp_plot
from .results.reading import load as load
from .simulation import FingerDesign as FingerDesign
from .simulation import PadDesign as PadDesign
from .simulation import SimulatedDataSet as SimulatedDataSet
from .simulation import simulate as simulate
from .simulation_based_calibration.ranks import RankStatistics as RankStatistics
from .simulation_based_calibration.touches import sbc as sbc

__version__: str
