"""What each cause of scatter does to θ_c, P and R of single samples: Table 4's noise rows by first-order propagation.

A fit by least squares turns small errors of the strains into errors of its estimates by the pseudo-inverse of its
derivatives. Each cause of scatter has a covariance of strains, or an error of the estimates themselves, and covariances
of independent causes add up. Six indenters and ten locations, four degrees apart, stand for the 40: modulo the
elements' spacing they are spread evenly. Fingers are those of all the paper's simulated tables (`paper_run`); the noise
levels of their elements are drawn so that Table 1's smallest, mean and largest level come out.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from bayestouch.contact import HertzContact, composite_radius
from bayestouch.paper.published import TABLE_1, number
from bayestouch.paper.simplex import TouchPredictor
from nicolson_fearing.paper_finger import CALIBRATIONS, DESIGN, LARGEST_LOAD, LOCATIONS_DEG
from nicolson_fearing.paper_run import paper_run
from nicolson_fearing.simulated_fits import HERTZ
from nicolson_fearing.squeezed_hertz import SqueezedHertz
from nicolson_fearing.table_3_effects import LAYER

FloatArray = NDArray[np.float64]
Cause = Literal["independent", "even", "common_readings", "common_strain", "load", "gain", "ridge"]

CAUSES: tuple[Cause, ...] = ("independent", "even", "common_readings", "common_strain", "load", "gain", "ridge")
NAMES = ("theta_c", "P", "R")
TIPS_MM = np.array([0.5, 3.9, 6.01, 9.3, 12.3, np.inf])
"""Figure 13's five indenters and a flat: "6 different indenter radii ranging from edge to flat"."""
PLACES_DEG = LOCATIONS_DEG[::4]
MODULI_MPA = np.geomspace(0.03, 0.2, 8)
SQUEEZE_MM, SQUEEZE_AT_MPA = 0.33, 0.057
"""As `table_3_residual.py` infers them together. At other moduli all widths go with the root of 1/μ."""
FINGERS, LEVELS = 8, 8
SAMPLES = int(number("touches.n_samples").value)
R_B = DESIGN.outer_radius_mm
LOAD = number("touches.load").value
LEVEL_SPREAD = 0.35
"""Of the logarithms of noise levels: 16 of them then range about as far as Table 1's, from 0.55 to 1.67 of the mean."""
NEAR_DEG = 25.0
"""Half of the 50° over which the paper took errors of model-based fits, since "model errors are most significant in the
tails": elements that far from the contact may have been left out of fits to touches, too. It does not say so."""
STEPS = (np.radians(0.05), 1.0, 0.05)  # of θ_c, P and R in derivatives


@dataclass(frozen=True)
class Reader:
    """How touches may have been fitted.

    Attributes
    ----------
    squeezed : bool
        By Hertz squeezed as Table 3 implies; else by the contact on the layer.
    held : bool
        With R held between edge and flat.
    near : bool
        To elements near the contact (`NEAR_DEG`) alone.
    """

    squeezed: bool = False
    held: bool = False
    near: bool = False


READERS = {
    f"{name}, {elements}": Reader(squeezed, held, near)
    for elements, near in (("all elements", False), ("near ones", True))
    for name, squeezed, held in (("layer, R held", False, True), ("layer", False, False), ("squeezed", True, False))
}
"""The squeezed contact reads a flat as R of 10 mm, so that no limit holds it."""


def noise_levels(rng: np.random.Generator, count: int = DESIGN.n_elements) -> FloatArray:
    """Noise of each element, % of its peak, in random order: smallest, mean and largest are those of Table 1."""
    row = TABLE_1[3]
    wanted = (count * row.average - row.minimum - row.maximum) / (count - 2)
    while True:
        drawn = row.average * np.exp(LEVEL_SPREAD * rng.standard_normal(count - 2))
        drawn *= wanted / drawn.mean()
        if row.minimum <= drawn.min() and drawn.max() <= row.maximum:
            return rng.permutation(np.concatenate([[row.minimum, row.maximum], drawn]))


@dataclass(frozen=True, eq=False)
class Propagated:
    """Covariances of estimates for a unit of each cause; R over μ (mm/MPa), so that it hardly depends on μ.

    Units: levels as drawn (independent and common to readings), 1 % of the peak (even, common to strains), 1 % (load,
    gain), and as much as independent noise of these levels (ridge).

    Attributes
    ----------
    square, with_radius : (moduli, draws, 2, tips, places, causes, 3) arrays
        Variances of θ_c (degree), P (N/m), R, and their covariances with R; draws of finger and levels, both
        calibrations.
    held : (moduli, draws, 2, tips, places, 3) array
        Change of the estimates of θ_c, P and R for a unit by which R is held back.
    radius_mm : (moduli, tips) array
        R of the silent estimate.
    limits_mm : (float, float)
        Between which R is held.
    levels : (draws, elements) array
        % of the peak.
    """

    square: FloatArray
    with_radius: FloatArray
    held: FloatArray
    radius_mm: FloatArray
    limits_mm: tuple[float, float]
    levels: FloatArray

    @classmethod
    def of(cls, reader: Reader, *, fingers: int = FINGERS, levels: int = LEVELS, seed: int = 0) -> Propagated:
        """Propagate through fits of this kind, for as many fingers and draws of levels for each."""
        rng = np.random.default_rng([seed, 9])
        drawn = np.array([noise_levels(rng) for _ in range(fingers * levels)])
        shape = (len(MODULI_MPA), fingers * levels, 2, len(TIPS_MM), len(PLACES_DEG))
        square, with_radius = np.empty((2, *shape, len(CAUSES), 3))
        held, radius = np.empty((*shape, 3)), np.empty((len(MODULI_MPA), len(TIPS_MM)))
        for k, modulus in enumerate(MODULI_MPA):
            model = reader_model(reader, modulus)
            radius[k], by_load = _read(model, modulus)
            for f in range(fingers):
                rows = slice(f * levels, (f + 1) * levels)
                for c, calibration in enumerate(CALIBRATIONS):
                    finger = paper_run(f).finger.reader(calibration, model or "layer", modulus)
                    errors = _Errors.of(finger, radius[k], by_load, modulus, NEAR_DEG if reader.near else 180.0)
                    square[k, rows, c], with_radius[k, rows, c], held[k, rows, c] = errors.covariances(drawn[rows])
        limits = (0.0, R_B) if reader.held else (-np.inf, np.inf)
        return cls(square, with_radius, held, radius, limits, drawn)

    def rows(self, modulus: float, weight: dict[Cause, float]) -> FloatArray:
        """Standard deviations of θ_c (degree), P (N/m) and R (mm) about the fit to the average: (draws, 2, 3).

        Parameters
        ----------
        modulus : float
            μ, MPa.
        weight : dict
            Variance of each cause, in its unit; "even" may be negative: what is common is no longer independent.
        """
        knot, share = self._place(modulus)
        chosen = [CAUSES.index(cause) for cause in weight]
        # the mean of 20 samples takes a twentieth of the variance with it
        size = np.array(list(weight.values())) * (1 - 1 / SAMPLES)
        scale = np.array([1.0, 1.0, modulus])
        total = np.einsum("dack,c->dak", _mixed(self._free_square, knot, share)[:, :, chosen], size)
        if np.isfinite(self.limits_mm[1]):
            square, along, held = self._ends
            variance, joint = (
                sum(_mixed(each[cause], knot, share) * amount for cause, amount in zip(chosen, size, strict=True))
                for each in (square, along)
            )
            held = _mixed(held, knot, share)
            radius = _mixed(self.radius_mm, knot, share)[[0, -1], None]
            lost, lost_square, beyond = cut_moments(
                np.sqrt(variance[..., 2]), *((limit - radius) / modulus for limit in self.limits_mm)
            )
            mean = -held * lost[..., None]
            second = variance - 2 * held * joint * beyond[..., None] + held**2 * lost_square[..., None]
            # the fit to the average is held back, too, as much less as it scatters less
            second += ((1 - SAMPLES**-0.5) ** 2 - 1) * mean**2
            total += second.mean(axis=(2, 3)) * 2 / len(TIPS_MM)
        return np.asarray(np.sqrt(np.maximum(total, 0.0)) * scale)

    @cached_property
    def _free_square(self) -> FloatArray:
        """Mean variances over tips and places, (moduli, draws, 2, causes, 3); without the tips that limits hold."""
        ends = np.isfinite(self.limits_mm[1])
        free = self.square[:, :, :, 1:-1] if ends else self.square
        return np.asarray(free.mean(axis=4).sum(axis=3) / len(TIPS_MM))

    @cached_property
    def _ends(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Variances, covariances with R and changes of edge and flat, which limits hold; the first two by cause."""
        square, along, held = (each[:, :, :, [0, -1]] for each in (self.square, self.with_radius, self.held))
        return *(np.ascontiguousarray(np.moveaxis(each, -2, 0)) for each in (square, along)), held

    @cached_property
    def sampling_sd(self) -> FloatArray:
        """Relative standard deviation of each printed number, (3,): a pooled sd of 20 samples of 240 touches."""
        variance = self.square[np.searchsorted(MODULI_MPA, SQUEEZE_AT_MPA), ..., 0, :]
        uneven = (variance**2).mean(axis=(0, 1, 2, 3)) / variance.mean(axis=(0, 1, 2, 3)) ** 2
        return np.asarray(np.sqrt(uneven / (2 * (SAMPLES - 1) * len(TIPS_MM) * len(LOCATIONS_DEG))))

    @staticmethod
    def _place(modulus: float) -> tuple[int, float]:
        place = np.interp(np.log(modulus), np.log(MODULI_MPA), np.arange(len(MODULI_MPA)))
        knot = min(int(place), len(MODULI_MPA) - 2)
        return knot, float(place - knot)


def _mixed(values: FloatArray, knot: int, share: float) -> FloatArray:
    return np.asarray((1 - share) * values[knot] + share * values[knot + 1])


def cut_moments(sd: FloatArray, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """By how much a normal deviation of mean 0 exceeds its limits: mean, mean square, and probability.

    Its covariance with the deviation itself is the probability times the variance (Stein's lemma).
    """
    sd = np.maximum(sd, 1e-9)  # where a cause does not move R
    above, below = high / sd, -low / sd
    over, under = ((np.exp(-0.5 * z**2) / np.sqrt(2 * np.pi), ndtr(-z), z) for z in (above, below))  # density, tail
    mean = sd * ((over[0] - over[2] * over[1]) - (under[0] - under[2] * under[1]))
    squares = sum((1 + z**2) * tail - z * density for density, tail, z in (over, under))
    return mean, sd**2 * squares, over[1] + under[1]


def reader_model(reader: Reader, modulus: float) -> SqueezedHertz | None:
    """Contact model of a reader; None: the layer's."""
    if not reader.squeezed:
        return None
    assert isinstance(HERTZ, HertzContact)
    return SqueezedHertz(HERTZ, SQUEEZE_MM * float(np.sqrt(SQUEEZE_AT_MPA / modulus)))


def _read(model: SqueezedHertz | None, modulus: float) -> tuple[FloatArray, FloatArray]:
    """R that a reader finds for each tip without noise (tips,), and its change by 1 % of load: the contact's width."""
    true = composite_radius(TIPS_MM, R_B)
    if model is None:
        return true, np.zeros(len(true))
    fine = np.linspace(0, np.sqrt(LARGEST_LOAD / 1000 * R_B / modulus), 20001) ** 2
    width = model.half_width(fine)
    first = np.flatnonzero(width > 0)[0] - 1

    def found(load: float) -> FloatArray:
        kappa = np.interp(LAYER.half_width(load / 1000 * true / modulus), width[first:], fine[first:])
        return np.asarray(kappa * modulus / load * 1000)

    return found(LOAD), (found(1.01 * LOAD) - found(0.99 * LOAD)) / 2


@dataclass(frozen=True, eq=False)
class _Errors:
    """First-order errors of one finger's fits: tips by places t.

    Attributes
    ----------
    weights : (t, 3, m) array
        Estimates (degree, N/m, mm/MPa) by errors of the strains in % of the peak.
    jitter : (t, 2, 3) array
        Errors by 1 % of load and of a gain that all elements have in common.
    """

    weights: FloatArray
    jitter: FloatArray

    @classmethod
    def of(
        cls, finger: TouchPredictor, radius_mm: FloatArray, by_load: FloatArray, modulus: float, reach_deg: float
    ) -> _Errors:
        radius = np.repeat(radius_mm, len(PLACES_DEG))
        angle = np.tile(np.radians(PLACES_DEG), len(radius_mm))
        at = [angle, np.full(len(radius), LOAD), radius]

        def strain(values: list[FloatArray]) -> FloatArray:
            return np.asarray(finger.predict(values[2], values[0], values[1]) / finger.gain)

        slopes = []
        for i, step in enumerate(STEPS):
            up, down = (list(at) for _ in range(2))
            up[i], down[i] = at[i] + step, np.maximum(at[i] - step, 0.0) if i == 2 else at[i] - step
            slopes.append((strain(up) - strain(down)) / (up[i] - down[i])[:, None])
        # strains are in N/m of an ideal edge
        off = (np.degrees(angle[:, None] - finger.angle) + 180) % 360 - 180
        there = (np.abs(off) <= reach_deg)[..., None]
        weights = np.linalg.pinv(there * np.stack(slopes, axis=2)) * LOAD / 100
        weights *= np.array([180 / np.pi, 1.0, 1 / modulus])[:, None]
        one = np.full(len(radius), LOAD / 100)
        none = np.zeros(len(radius))
        load = np.stack([none, one, np.repeat(by_load, len(PLACES_DEG)) / modulus], axis=1)
        gain = np.stack([none, one, -radius / 100 / modulus], axis=1)  # strains and P go up, PR/μ is as it was
        return cls(weights, np.stack([load, gain], axis=1))

    def covariances(self, levels: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Variances and covariances with R for a unit of each cause, and what holding R does; for draws of levels."""
        shape = (len(levels), len(TIPS_MM), len(PLACES_DEG))
        own = np.einsum("tki,tji,di->dtkj", self.weights, self.weights, levels**2)
        metric = np.einsum("tki,tji->tkj", self.weights, self.weights)
        by_level = np.einsum("tki,di->dtk", self.weights, levels)
        to_all = np.broadcast_to(self.weights.sum(axis=2), by_level.shape)
        ridge = own[..., 2] / np.sqrt(own[..., 2, 2])[..., None]
        vectors = [by_level, to_all, *(np.broadcast_to(self.jitter[:, i], by_level.shape) for i in (0, 1)), ridge]
        matrices = [own, np.broadcast_to(metric, own.shape), *(v[..., :, None] * v[..., None, :] for v in vectors)]
        square = np.stack([np.einsum("dtkk->dtk", each) for each in matrices], axis=2)
        along = np.stack([each[..., 2] for each in matrices], axis=2)
        held = np.broadcast_to(metric[..., 2] / metric[..., 2, 2, None], by_level.shape)
        return square.reshape(*shape, -1, 3), along.reshape(*shape, -1, 3), held.reshape(*shape, 3)
