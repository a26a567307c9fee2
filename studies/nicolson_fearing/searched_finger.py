"""One finger of the paper with every fit searched for: what `linear_finger` has to first order, from the same draws.

Readings of every edge and touch come from the exact contact, at the places where they really are. Elements are fitted
by the simplex (Table 1), E maps identified (Table 2), and averages and samples of touches fitted by least squares.
Strains are in % of each element's peak under an edge.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayestouch.contact import composite_radius, indenter_radius
from bayestouch.data.averages import TouchMeans
from bayestouch.paper.simplex import table_1, table_2
from bayestouch.simulation.finger import BuiltFinger
from nicolson_fearing.finger_errors import (
    AT,
    EDGES_DEG,
    OF_TABLE_3,
    OF_TABLE_4,
    SAMPLES,
    EdgeErrors,
    FloatArray,
    Tables,
    TouchErrors,
    table_4_rows,
)
from nicolson_fearing.linear_finger import BLUNTEST, LinearFinger
from nicolson_fearing.linear_touches import LOAD, MODES, R_B, felt
from nicolson_fearing.many_fits import ContactEstimates, fit_many_touches
from nicolson_fearing.paper_finger import CALIBRATIONS, DESIGN, LOCATIONS_DEG, PaperCalibration, PaperFinger
from nicolson_fearing.paper_physics import Physics, contact_of
from nicolson_fearing.paper_run import TIPS_MM
from nicolson_fearing.simulated_fits import HERTZ
from nicolson_fearing.squeezed_hertz import SqueezedHertz
from nicolson_fearing.unknowns import Unknowns

COUNTS = DESIGN.peak_reading / 100  # of one per cent of the peak
_TRUE_MM = composite_radius(np.array(TIPS_MM), R_B)


@dataclass(frozen=True, eq=False)
class SearchedFinger:
    """A finger with all that goes wrong on it.

    Attributes
    ----------
    elements : LinearFinger
        As they came out.
    unknowns : Unknowns
        What is true.
    edges : EdgeErrors
        Of the calibration.
    radii_mm : (tips,) array
        True composite radii.
    touches : TouchErrors
        Noise of the touches.
    """

    elements: LinearFinger
    unknowns: Unknowns
    edges: EdgeErrors
    radii_mm: FloatArray
    touches: TouchErrors

    @classmethod
    def of(cls, seed: int, unknowns: Unknowns, draw: int = 0) -> SearchedFinger:
        """Draw it: the same random numbers as those of `LinearFinger.tables`."""
        elements = LinearFinger.of(seed)
        return cls(elements, unknowns, *elements.drawn(unknowns, draw))

    def strains(self, angle_deg: FloatArray, spectrum: FloatArray) -> FloatArray:
        """Strains in % of the peak, (tips, places, m), of pressures (tips, modes) at these places."""
        curves = self.edges.curves
        turn = np.radians(angle_deg[:, None] - self.elements.angle_deg)[..., None] * MODES
        by_mode = np.cos(turn) * (100 * self.elements.weights + curves[0]) + np.sin(turn) * curves[1]
        return felt(by_mode, spectrum)

    @cached_property
    def calibrated(self) -> PaperFinger:
        """Both calibrations by the edges."""
        wrong, m = self.edges, DESIGN.n_elements
        strain = self.strains(EDGES_DEG + wrong.prober, np.ones((1, len(MODES))))[0] + wrong.place
        n, blank = len(EDGES_DEG), np.full(len(EDGES_DEG), np.nan)
        means = TouchMeans(
            touch=np.arange(n),
            readings=COUNTS * (strain * (1 + wrong.drift[:, None] / 100) + wrong.noise),
            counts=np.full((n, m), SAMPLES),
            pure_error_variance=(COUNTS * self.elements.levels) ** 2,
            pure_error_dof=np.full(m, float(n * (SAMPLES - 1))),
            load=LOAD * (1 + wrong.force / 100),
            indenter_radius_mm=np.zeros(n),
            depth_mm=blank,
            time_s=blank,
            angle_deg=EDGES_DEG,
            x_mm=None,
            y_mm=None,
        )
        of_elements = (self.elements.sensing_radius_mm, self.elements.angle_deg, np.ones(m))
        sensor = BuiltFinger(DESIGN, *of_elements).sensor({})
        modulus = self.unknowns.modulus_MPa
        return PaperFinger(sensor, table_1(means, sensor, modulus), table_2(means, sensor), modulus)

    @cached_property
    def touched(self) -> FloatArray:
        """Strains without noise, (tips, places, m), by the exact pressures."""
        u = self.unknowns
        contact = contact_of(DESIGN, Physics(poisson_ratio=u.poisson_ratio, length_mm=u.length_mm))
        spectrum = contact.spectrum(LOAD / 1000 * self.radii_mm / u.modulus_MPa, MODES)
        return self.strains(LOCATIONS_DEG + self.edges.prober[AT], spectrum) + self.edges.place[AT]

    def search(self, calibration: PaperCalibration, squeeze_mm: float, strains: FloatArray) -> ContactEstimates:
        """Fits to strains (n, m) by Hertz, narrower by a squeeze."""
        contact = SqueezedHertz(HERTZ, squeeze_mm) if squeeze_mm else "hertz"
        reader = self.calibrated.reader(calibration, contact, self.unknowns.modulus_MPa)
        return fit_many_touches(reader, COUNTS * strains.reshape(-1, strains.shape[-1]))

    def averaged(self, calibration: PaperCalibration, squeeze_mm: float) -> ContactEstimates:
        """Fits to the averages of all touches."""
        factor = 1 + self.touches.mean_jitter + self.touches.drift
        return self.search(calibration, squeeze_mm, self.touched * factor[..., None] + self.touches.mean_noise)

    def single(self, calibration: PaperCalibration) -> ContactEstimates:
        """Fits to the samples of Table 4, by the squeezed contact."""
        wrong = self.touches
        factor = 1 + wrong.jitter + wrong.drift[OF_TABLE_4, :, None]
        strain = self.touched[OF_TABLE_4][:, :, None] * factor[..., None] + wrong.noise
        return self.search(calibration, self.unknowns.squeeze_mm, strain)

    def tables(self) -> Tables:
        """Tables 1 to 4."""
        shape = (len(TIPS_MM), len(LOCATIONS_DEG))
        radii = np.empty((2, 2, *shape))
        means, samples = [[], [], []], [[], [], []]
        for c, calibration in enumerate(CALIBRATIONS):
            radii[0, c] = self.averaged(calibration, 0.0).composite_radius_mm.reshape(shape)
            found = self.averaged(calibration, self.unknowns.squeeze_mm)
            radii[1, c] = found.composite_radius_mm.reshape(shape)
            one = self.single(calibration)
            for i, each in enumerate(errors(found, shape)):
                means[i].append(each[OF_TABLE_4])
            for i, each in enumerate(errors(one, self.touches.jitter.shape, OF_TABLE_4)):
                samples[i].append(each)
        blunt = np.minimum(radii, BLUNTEST * R_B)[:, :, OF_TABLE_3]
        return Tables(
            np.array([fit.error_percent_peak for fit in self.calibrated.elements.fits]),
            self.calibrated.identified.error_percent_peak,
            composite_radius(indenter_radius(blunt, R_B).mean(axis=-1), R_B),
            table_4_rows([np.array(each) for each in means], [np.array(each) for each in samples]),
            radii[1] - _TRUE_MM[:, None],
        )


def errors(found: ContactEstimates, shape: tuple[int, ...], tips: FloatArray | slice = slice(None)) -> list[FloatArray]:
    """Errors of θ_c (degree), P (N/m) and R (mm), in the shape of (tips, places, …)."""
    more = (1,) * (len(shape) - 2)
    return [
        found.angle_deg.reshape(shape) - LOCATIONS_DEG.reshape(-1, *more),
        found.load.reshape(shape) - LOAD,
        found.composite_radius_mm.reshape(shape) - _TRUE_MM[tips].reshape(-1, 1, *more),
    ]
