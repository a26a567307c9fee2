"""Common shift of the elements of a pad, by readings at few places under loads that differ."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pad_simulation import SimulatedPad, line, square

from bayestouch.chain.kernels import LayerKernel
from bayestouch.data.averages import TouchMeans
from bayestouch.pad.priors import pad_priors
from bayestouch.pad.shift import common_shift
from bayestouch.priors.parameters import LogNormal


def few_touches(pad: SimulatedPad, seed: int, number: int) -> TouchMeans:
    """At random places over the elements, loads from 1 to 3 N."""
    rng, true = np.random.default_rng(seed), pad.chain.position
    places = rng.uniform(true.min(axis=0) - 3, true.max(axis=0) + 3, (number, true.shape[1]))
    return pad.touch(places, rng, load=rng.uniform(1.0, 3.0, number), measured=True).averaged()


def soft_layer(make: object) -> SimulatedPad:
    """A layer of 6 mm: every element reads a part of each touch, so that no reading is the offset."""
    layer = LayerKernel(6.0, *[LogNormal(6.0, 0.1)] * 3)
    pad = line(layer, (6.0, 1.0, 0.48, 1.0)) if make is line else square(layer, (6.0, 1.0, 0.48, 1.0))
    return replace(pad, chain=replace(pad.chain, offset=pad.chain.offset + 5.0))


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize(("make", "number"), [(line, 6), (line, 10), (square, 20)])
def test_priors_of_few_touches_are_centred_on_the_elements(make: object, number: int, seed: int) -> None:
    """Elements are 0.2 mm from the mean shift (rms), and the search ends in steps of 0.2 mm: together 0.3 mm."""
    pad = soft_layer(make)
    known, m = few_touches(pad, seed, number), len(pad.nominal)
    priors, _ = pad_priors(pad.sensor, known, rest_subtracted=False, usable=np.ones(m, dtype=bool))
    away = (priors.position - pad.chain.position).mean(axis=0)
    assert np.abs(away).max() < 2 * 0.3


@pytest.mark.parametrize("rest_subtracted", [True, False])
def test_the_shift_has_the_least_squares_of_all_shifts(rest_subtracted: bool) -> None:
    """Against least squares of each element at shifts 0.01 mm apart, with the widths 1.5, 3, 6 and 12 mm."""
    pad = soft_layer(line)
    known = few_touches(pad, 3, 12)
    known = replace(known, readings=known.readings - pad.chain.offset) if rest_subtracted else known
    shifts = np.arange(6.0, 14.0, 0.01)
    left = np.full((len(shifts), 4), np.nan)
    for i, shift in enumerate(shifts):
        for j, width in enumerate((1.5, 3.0, 6.0, 12.0)):
            total = 0.0
            for e in range(4):
                shape = known.load * np.exp(-0.5 * ((known.location[:, 0] - pad.nominal[e, 0] - shift) / width) ** 2)
                design = shape[:, None] if rest_subtracted else np.stack([shape, np.ones(12)], axis=1)
                rest = known.readings[:, e] - design @ np.linalg.lstsq(design, known.readings[:, e])[0]
                total += np.log(rest @ rest)
            left[i, j] = total
    usable = np.ones(4, dtype=bool)
    found = common_shift(known, pad.nominal, np.array([7.3]), usable, rest_subtracted=rest_subtracted)
    # The last step is 6 mm over 32.
    assert found[0] == pytest.approx(shifts[left.min(axis=1).argmin()], abs=0.5 * 6 / 32 + 0.01)


@pytest.mark.parametrize(("ripple", "moved"), [(0.2, False), (0.05, True)])
def test_a_fit_that_is_little_better_moves_nothing(ripple: float, moved: bool) -> None:
    """Gaussians and ripples: those of the shift zero leave 0.81 or 0.23 of the squares that those at 0.7 mm leave."""
    place, nominal = np.linspace(-4.0, 22.0, 105), np.array([0.0, 6.0, 12.0, 18.0])
    away = place[:, None] - nominal
    readings = np.exp(-0.5 * (away / 3.0) ** 2) + ripple * np.cos(3 * away)
    known = replace(few_touches(line(), 0, 105), readings=readings, load=np.ones(105), x_mm=place)
    found = common_shift(known, nominal[:, None], np.array([0.7]), np.ones(4, dtype=bool), rest_subtracted=True)
    # The steps of the search are 0.19 mm.
    assert found == pytest.approx(0.0 if moved else 0.7, abs=0.19 * moved)
