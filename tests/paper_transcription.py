"""The numbers that the paper printed, typed from its pages and compared with `bayestouch.paper.published`.

A second typing, which imports nothing of the package: a slip of the pen would have to be made twice. Of the paper it
holds the numbers alone, each in brackets between the few words that say which number it is.

Source: E. J. Nicolson and R. S. Fearing, "The Reliability of Curvature Estimates from Linear Elastic Tactile
Sensors", 1995.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

# place | key of `published` | unit | words, with the number in brackets; several keys: several numbers
_TEXT = """
Section 2.1 | rolloff.displacement | dB/decade | low pass filter at [20] dB/decade
Section 2.1 | rolloff.strain_at_least | dB/decade | than [100] dB/decade
Section 2.1 | alpha.deep | 1 | deep, α = r_a/r_b = [0.70]
Section 2.1 | alpha.shallow | 1 | and shallow, α = [0.90]
Section 2.1 | cutoff.level | dB | deep sensors have a [-40] dB cut-off
Section 2.1 | cutoff.deep | cycles/radian | dB cut-off at [4.5] cycles/radian
Section 2.1 | cutoff.shallow | cycles/radian | shallow sensors have their cut-off at [25] cycles/radian
Section 2.1 | figure_3.load | N/m | Holding the load constant at [200] N/m
Figure 3, caption | figure_3.load | N/m | a fixed load ([200] N/m)
Figure 3, caption | figure_3.r_c[] | mm | varying r_c ∈ {[0.5], [1.6], [3.9], [12.3], [25.3]} mm
Section 2.1 | figure_3.n_radii | 1 | for [5] different indenter radii
Section 2.1 | figure_3.distinct_at | cycles/radian | At [3] cycles/radian the frequency responses
Section 2.1 | alpha.deep | 1 | with α = [0.70] and a noise level
Section 2.1 | figure_3.noise_level | dB | a noise level at [-40] dB
Section 2.1 | figure_4.level | % | distinguished at a [95] % level
Section 2.1 | figure_4.threshold | noise sd | mean square error exceeds [2] standard deviations of the noise
Section 2.1 | figure_4.noise_plane | noise sd | also shown at [2] standard deviations of the typical noise
Section 2.1 | alpha.deep | 1 | For deep sensors with α = [0.70], flat and edge
Section 2.1 | figure_4.flat_from_edge_noise | % peak strain | as high as [3.7] % of the peak strain
Section 2.1 | figure_4.low_noise | % peak strain | the noise is as low as [1] %
Section 2.1 | figure_4.r_c_over_r_b | 1 | an indenter with r_c/r_b = [0.16]
Figure 6, caption | figure_6.narrow_width | mm | flat frictionless indenters with [2] mm
Figure 6, caption | figure_6.wide_width | mm | and [4] mm contact widths
Figure 7, caption | core_radius | mm | r_a = [9.4] mm
Figure 7, caption | sensing_radius | mm | r_s = [9.9] mm
Figure 7, caption | outer_radius | mm | r_b = [12.7] mm
Figure 7, caption | dielectric_thickness | mm | Dielectric thickness [0.4] mm
Figure 7, caption | spacing | mm | Sensor spacing [1.52] mm
Section 3 | tips.smallest | mm | r_c varying from [1.59] mm
Section 3 | tips.largest | mm | to [25.25] mm
Section 3 | tips.corner_angle | degree | a [90]° corner
Section 3 | tips.length | mm | All indenters had a length of [4] mm
Section 3 | tips.length_again | mm | so that the [4] mm length
Section 3 | touches.interval | degree | at [1]° intervals
Section 3 | touches.load | N/m | with a load of [200] N/m
Section 3 | touches.n_samples | 1 | were sampled [20] times at each point
Section 3.1 | table_1.n_elements_text | 1 | over [14] sensor elements
Table 1, caption | table_1.n_elements_caption | 1 | over the [16] elements
Section 3.1 | noise.force_sensor | % peak strain | force sensor has a noise level equivalent to [0.5] % peak strain
Section 3.1 | noise.averaged_readings | % peak strain | a standard deviation of [0.4] % peak strain
Section 3.1 | noise.expected_fit | % peak strain | a fitting error of [0.9] % peak strain
Section 3.1 | noise.error_over_noise | 1 | the error is [twice] the noise level
Section 3.1 | flat_fit.hertz | % strain | Hertz model resulted in an average error of [4.2] % strain
Section 3.1 | flat_fit.frictionless | % strain | described in [11] resulted in an average error of [2.2] % strain
Section 3.2 | fit_range.model | degree | over a [50]° range
Section 3.2 | fit_range.empirical | degree | over the full [180]°
Section 3.2 | fit_error.empirical | % peak strain | is now [1.41] % of the peak strain
Section 3.2 | fit_error.model | % peak strain | less than the [2.16] % for the model-based fit
Section 3.2 | condition_number.model | 1 | model fitted E has a condition number of [2.7]
Section 3.2 | condition_number.empirical | 1 | empirical E has a condition number of [3.3]
Section 4 | fit_time.without_load | s | execution time of [0.1] second
Section 4 | fit_time.with_load | s | reduced to [0.04] second when total load
Section 4 | table_3.range | degree | mean estimate of r_c over [40] degrees
Section 4 | table_3.n_indenters | 1 | for [9] different indenters
Section 4 | table_3.unbiased_to | mm | indenters of radius [13] mm and less
Section 4 | table_4.n_samples | 1 | over [20] samples each
Section 4 | table_4.n_touches | 1 | samples each of [40] touches
Section 4 | table_4.n_radii | 1 | using [6] different indenter radii
Table 4, caption | table_4.n_touches_caption | 1 | fitted for [40] touches
Table 4, caption | table_4.interval_caption | degree | at [1] degree intervals
Table 4, caption | table_4.n_radii_caption | 1 | of [6] different indenter radii
Section 4 | table_4.n_averaged | 1 | errors in parameters fitted to [20] times averaged data
Section 4 | location_error.over_spacing | 1 | error is very small, [1/25] th of the sensor spacing
Section 4 | location_error.noise_part | 1 | the standard deviation is [halved]
Section 4 | load_error.over_load | % of load | a standard deviation of [5] % of the applied load
Section 4 | radius_error.r_c_over_R | 1 | the standard deviation in r_c will be [twice] that for R
Section 4 | radius_error.noise | mm | standard deviation in R due to noise is [0.77] mm
Section 4 | radius_error.distinguishable | mm | radii differences of [1.5] mm
Section 4 | radius_error.level | % | distinguishable at a [95] % level at a fixed location
Figure 12, caption | figure_12.r_c | mm | for a [12.3] mm radius indenter
Figure 12, caption | figure_12.n_averaged | 1 | the fitted r_c to [20] times averaged data
Figure 13, caption | figure_13.n_averaged | 1 | calibration on [20] times averaged data
Figure 13, caption | figure_13.r_c[] | mm | upper trace r_c = {[0.5], [3.90], [6.01], [9.30], [12.30]} mm
Section 4 | figure_13.n_radii | 1 | r_c estimates for [5] different indenters
Section 5 | location_error.over_spacing_conclusion | 1 | a precision of [1/25] th of the sensor spacing
Section 5 | radius_error.n_averaged | 1 | Using [20] times averaging
Section 5 | radius_error.averaged | mm | with a standard deviation of [0.60] mm
"""

# row as `published` names it | unit | row as printed; the cells are its last three
_TABLE_1 = """
sigma | 1 | σ 0.41 0.46 0.48
r_s | mm | r_s (mm) 9.8 10.3 10.7
error | % peak strain | Error (% Peak) 1.28 2.16 3.95
noise_level | % peak strain | Noise Level (% Peak) 0.95 1.72 2.87
"""
_TABLE_2 = "error | % peak strain | 0.93 1.41 1.76"
_TABLE_3 = """
0.50 0.41 0.52 0.95 0.99
1.59 1.34 1.77 2.39 2.53
3.90 2.09 2.46 3.37 3.33
6.01 3.71 4.28 5.84 6.01
7.55 5.22 5.58 8.17 7.92
9.30 5.85 6.23 9.41 9.03
12.30 7.60 7.81 12.94 11.89
18.71 8.58 8.64 15.51 13.77
25.25 9.90 9.91 19.36 16.50
"""
_TABLE_4 = """
Model Total 0.24 13.1 1.26
Model Location 0.20 9.1 1.00
Model Noise 0.14 9.6 0.79
Empirical Total 0.24 11.7 0.96
Empirical Location 0.19 6.4 0.60
Empirical Noise 0.14 9.8 0.77
"""
_TABLE_3_COLUMNS = {
    "r_c": "Actual r_c",
    "hertz_model": "Hertz contact model, Model calibration",
    "hertz_empirical": "Hertz contact model, Empirical calibration",
    "frictionless_model": "Approximate frictionless contact model, Model calibration",
    "frictionless_empirical": "Approximate frictionless contact model, Empirical calibration",
}
_WORDS = {"twice": 2.0, "halved": 0.5, "1/25": 0.04}


@dataclass(frozen=True)
class Typed:
    """A number of the paper: key in `published`, place, unit, the words about it, the number as printed."""

    key: str
    where: str
    unit: str
    words: str
    printed: str

    @property
    def value(self) -> float:
        return _WORDS[self.printed] if self.printed in _WORDS else float(self.printed)


def _of_text() -> list[Typed]:
    found = []
    for line in _TEXT.strip().splitlines():
        where, key, unit, words = line.split(" | ")
        numbers = re.findall(r"(?<!described in )\[([^]]+)\]", words)  # "described in [11]" names a reference
        plain = re.sub(r"(?<!described in )\[([^]]+)\]", r"\1", words)
        found += [Typed(key.replace("[]", f"[{number}]"), where, unit, plain, number) for number in numbers]
    return found


def _of_tables() -> list[Typed]:
    found = []
    for table, text in (("1", _TABLE_1), ("2", _TABLE_2)):
        for line in text.strip().splitlines():
            name, unit, row = line.split(" | ")
            for column, cell in zip(("Min", "Avg", "Max"), row.split()[-3:], strict=True):
                where = f"Table {table}, row {name}, column {column}"
                found.append(Typed(f"table_{table}.{name}.{column.lower()}", where, unit, row, cell))
    for row in _TABLE_3.strip().splitlines():
        radius = row.split()[0]
        for (name, title), cell in zip(_TABLE_3_COLUMNS.items(), row.split(), strict=True):
            found.append(Typed(f"table_3[{radius}].{name}", f"Table 3, row {radius}, column {title}", "mm", row, cell))
    for line in _TABLE_4.strip().splitlines():
        calibration, row = line.split(maxsplit=1)
        part, *cells = row.split()
        for (name, title, unit), cell in zip(
            (("theta_c", "θ_c", "degree"), ("P", "P", "N/m"), ("R", "R", "mm")), cells, strict=True
        ):
            where = f"Table 4, rows {calibration} based, row {part}, column {title}"
            found.append(Typed(f"table_4.{calibration.lower()}.{part.lower()}.{name}", where, unit, row, cell))
    return found


TRANSCRIPTION = (*_of_tables(), *_of_text())
