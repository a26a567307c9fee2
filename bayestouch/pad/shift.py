"""Shift of the elements of a pad between the sensor's coordinates and the stage's, before any fit."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.chain.pad import element_pitch
from bayestouch.data.averages import TouchMeans
from bayestouch.pad.known_touches import highest_reading_location, readings_without_load

# Widths of the Gaussian that are tried, over the pitch: from much narrower than it to wider than any kernel that can
# still distinguish neighbours.
_WIDTHS = (0.25, 0.5, 1.0, 2.0)
# Steps of the search over the pitch: as the narrowest width, then an eighth of it. With 6 mm it ends within 0.2 mm.
_STEPS = (0.25, 0.03125)
# The search goes this many steps to either side: two pitches, then one former step.
_SIDE = 8
# Touches that are used at most; the shift of so many is known far better than the places of the elements.
_TOUCHES = 200
# Residuals of a Gaussian are mostly errors of its shape, and a shift may follow such an error. On eleven measured pads
# the squares fell by less than a third; where the largest readings of simulated pads were more than a millimetre beside
# the elements, they fell by more than half. Less than a millimetre does not matter: the priors are 3 mm wide.
_BETTER = 0.5


def shift_of_elements(
    known: TouchMeans, nominal: FloatArray, usable: BoolArray, *, rest_subtracted: bool
) -> tuple[FloatArray, FloatArray]:
    """Difference (m, D) of each element's largest reading from its nominal place, and `common_shift` (D,), mm."""
    # Without touch a reading is the offset, whatever the load: divided by loads that vary, it would be a signal.
    at_rest = np.zeros(len(nominal)) if rest_subtracted else readings_without_load(known)
    peaks = highest_reading_location(replace(known, readings=known.readings - at_rest)) - nominal
    largest = np.median(peaks[usable], axis=0)
    return peaks, common_shift(known, nominal, largest, usable, rest_subtracted=rest_subtracted)


def common_shift(
    known: TouchMeans, nominal: FloatArray, largest: FloatArray, usable: BoolArray, *, rest_subtracted: bool
) -> FloatArray:
    """Shift (D,) from the nominal places, mm: `largest`, or that of a Gaussian that fits better.

    The largest readings of few touches are at the next touch, or where the load was largest if the offset is not known.
    Here each element reads an offset, and the load times a Gaussian about its shifted place. Gains and offsets are
    fitted by least squares; shift and width are those with the least residuals of all elements together. They must
    leave less than half of the squares that `largest` leaves.

    Parameters
    ----------
    known : TouchMeans
        Touches with location and load.
    nominal : (m, D) array
        Nominal places, mm.
    largest : (D,) array
        Median shift of the largest readings, mm.
    usable : (m,) bool array
        Elements that respond.
    rest_subtracted : bool
        Whether readings have no offset.
    """
    some = np.random.default_rng(0).permutation(known.n_touches)[:_TOUCHES]
    readings, load, location = known.readings[some][:, usable], known.load[some, None], known.location[some]
    here = np.isfinite(readings)
    number = here.sum(axis=0)
    pitch = element_pitch(nominal, float(np.ptp(known.location, axis=0).max()))

    def without_offset(columns: FloatArray) -> FloatArray:
        filled = np.where(here, columns, 0.0)
        return filled if rest_subtracted else np.where(here, filled - filled.sum(axis=0) / np.maximum(number, 1), 0.0)

    signal = without_offset(readings)
    total = np.maximum((signal**2).sum(axis=0), 1e-300)

    def misfit(shift: FloatArray, width: float) -> float:
        """Mean logarithm of the share of the squares that is left."""
        square = ((location[:, None] - nominal[usable] - shift) ** 2).sum(axis=2)
        shape = without_offset(load * np.exp(-0.5 * square / (width * pitch) ** 2))
        size = np.maximum((shape**2).sum(axis=0), 1e-300)
        left = 1 - (shape * signal).sum(axis=0) ** 2 / (size * total)
        # Rounding must not decide.
        return float(number @ np.log(np.maximum(left, 1e-6)) / number.sum())

    start = min(misfit(largest, width) for width in _WIDTHS)
    best, least = largest, start
    for step in _STEPS:
        centre = best
        for moves in product(range(-_SIDE, _SIDE + 1), repeat=len(centre)):
            shift = centre + step * pitch * np.array(moves)
            found = min(misfit(shift, width) for width in _WIDTHS)
            if found < least:
                best, least = shift, found
    return best if least < start + np.log(_BETTER) else largest
