"""The paper's experiment on simulated fingers, run once for all the studies of its tables and figures.

Put in so that Tables 1 and 2 come out: how far gains and depths of the elements spread (the ranges of Table 1), an
error of every element's E map, smooth over one spacing, and an error of every place touched, which no E map can take up
(the mean errors of both tables). All else follows from sizes, noise and the modulus of Table 3, of
which every finger has a draw.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np

from bayestouch import simulate
from bayestouch.contact import composite_radius
from bayestouch.data.averages import TouchMeans, average
from bayestouch.data.touches import Touches
from bayestouch.paper import published
from bayestouch.paper.published import TABLE_3
from bayestouch.reliability import Beside
from bayestouch.simulation import SimulatedDataSet
from nicolson_fearing.many_fits import ContactEstimates, fit_many_touches
from nicolson_fearing.paper_design import drawn_modulus, paper_design, with_map_errors, with_place_errors
from nicolson_fearing.paper_finger import PaperCalibration, PaperFinger

#: % of the peak; see the module. Table 2 keeps the second, Table 1 both.
MAP_ERROR, PLACE_ERROR = 2.9, 1.57
#: Standard deviations of the logarithm of the gains and of the sensing radii.
GAIN_SPREAD, DEPTH_SPREAD_MM = 0.3, 0.2
TIPS_MM = (0.0, *(row.r_c for row in TABLE_3), np.inf)
TABLE_4_TIPS = (0.0, 3.9, 6.01, 9.3, 12.3, np.inf)
CONTACT = "approximate frictionless"  # of all the paper's results after Table 3
FINGERS = 10


@dataclass(frozen=True, eq=False)
class PaperRun:
    """One finger made, calibrated in both of the paper's ways, touched by every tip and read.

    Attributes
    ----------
    data : SimulatedDataSet
        With the errors of elements and touches in it.
    finger : PaperFinger
        Both calibrations.
    """

    data: SimulatedDataSet
    finger: PaperFinger

    @classmethod
    def of(cls, seed: int, *, repeats: bool = True) -> PaperRun:
        """Simulate and calibrate; `repeats` as in `with_place_errors`."""
        design = paper_design(
            shear_modulus_MPa=drawn_modulus(seed),
            touch_radii_mm=TIPS_MM,
            gain_spread=GAIN_SPREAD,
            depth_spread_mm=DEPTH_SPREAD_MM,
        )
        simulated = simulate(design, seed=seed)
        simulated = replace(simulated, dataset=with_map_errors(simulated, MAP_ERROR, seed))
        data = replace(simulated, dataset=with_place_errors(simulated, PLACE_ERROR, seed, repeats=repeats))
        return cls(data, PaperFinger.of(data))

    @property
    def modulus(self) -> float:
        """μ, MPa; touches are read with it too."""
        return float(self.data.truth["mu"])

    @cached_property
    def calibrating(self) -> TouchMeans:
        """Averages of the calibration touches: edges and flats all around."""
        assert self.data.dataset.calibration is not None
        return average(self.data.dataset.calibration)

    @cached_property
    def touches(self) -> Touches:
        """Touches of the 40 degrees at 1 degree: one place fewer than from -20 to 20."""
        table = self.data.dataset.touches
        assert table.angle_deg is not None
        return table.select(table.angle_deg < 19.5)

    @cached_property
    def means(self) -> TouchMeans:
        """Averages over the samples of each touch."""
        return self.touches.averaged()

    def rows(self, tips: Sequence[float]) -> np.ndarray:
        """Touches by these tips, bool."""
        return np.isin(self.means.indenter_radius_mm, tips)

    @cache  # noqa: B019 - a run lives as long as the study
    def averaged(self, calibration: PaperCalibration, contact: str = CONTACT) -> ContactEstimates:
        """Fits to the averages."""
        return fit_many_touches(self.finger.reader(calibration, contact, self.modulus), self.means.readings)

    @cache  # noqa: B019
    def single(self, calibration: PaperCalibration) -> ContactEstimates:
        """Fits to single samples."""
        return fit_many_touches(self.finger.reader(calibration, CONTACT, self.modulus), self.touches.readings)

    @property
    def of_sample(self) -> np.ndarray:
        """Place of each sample's touch among the means."""
        order = np.argsort(self.means.touch)
        return np.asarray(order[np.searchsorted(self.means.touch[order], self.touches.touch)])

    @property
    def true_radius(self) -> np.ndarray:
        """Composite radius of each touch, mm."""
        return np.asarray(
            composite_radius(self.means.indenter_radius_mm, self.data.dataset.sensor.body.outer_radius_mm)
        )

    @property
    def true_load(self) -> np.ndarray:
        """Line load of each touch, N/m."""
        return np.asarray(self.data.truth["touches"]["P"])[self.means.touch]


@cache
def paper_run(seed: int = 0) -> PaperRun:
    """One run, remembered."""
    return PaperRun.of(seed)


def runs(small: bool) -> list[PaperRun]:
    """The fingers of a study."""
    return [paper_run(seed) for seed in range(2 if small else FINGERS)]


def over_fingers(
    key: str, value: Callable[[PaperRun], float], found: Sequence[PaperRun], why: str = "", *, tuned: bool = False
) -> Beside:
    """A number of each finger: mean, and the 90 % range of single fingers (the paper made one).

    `tuned` where the simulation was set up so that it comes out.
    """
    values = np.array([value(run) for run in found])
    low, high = np.quantile(values, [0.05, 0.95]) if len(values) > 1 else (np.nan, np.nan)
    return Beside(key, float(values.mean()), float(low), float(high), why, put_in=tuned)


def put_in(key: str, value: float, why: str = "") -> Beside:
    """A setting of the simulation."""
    return Beside(key, float(value), why=why, put_in=True)


def indenter_rows(figure: str, radii: Sequence[float], settings: Mapping[str, float]) -> list[Beside]:
    """What a caption says of its indenters and their number, and other settings of a figure or table."""
    named = [n for n in published.all_numbers() if n.key.startswith(f"{figure}.r_c[")]
    rows = [put_in(n.key, min(radii, key=lambda r, n=n: abs(r - n.value))) for n in named]
    return [*rows, *(put_in(f"{figure}.{name}", value) for name, value in settings.items())]
