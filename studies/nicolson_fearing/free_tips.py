"""Posterior of the radii of some tips of Table 3, beside the modulus, the authors' squeeze and the tips' own errors.

As `published_fits.infer_from_table_3`, with the radius of one or two tips unknown: printed and simulated columns are
compared as composite radii, with the covariance of simulated tables and a further error of unknown size τ, for the most
part shared by the columns of a tip. All unknowns are on grids, so that evidences are sums.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayestouch.contact import composite_radius, indenter_radius
from nicolson_fearing.modulus import TAU_SCALE_MM
from nicolson_fearing.paper_finger import TIPS_MM
from nicolson_fearing.paper_physics import LINEAR
from nicolson_fearing.published_fits import FLOOR_MM, TIP_SHARE, BiasCurves, columns
from nicolson_fearing.simulated_fits import HERTZ, R_B, SimulatedFits, WidthModel, simulate_fits
from nicolson_fearing.table_3_effects import MODULI_MPA, table_3
from nicolson_fearing.width_laws import CONSTANT, WidthLaw

FloatArray = NDArray[np.float64]
Span = tuple[float, float, float]

BETWEEN_MM = (0.25, 1.0, 2.0, 2.4, 2.8, 3.2, 4.5, 5.2, 6.8, 8.4, 10.7, 15.0, 21.5, 30.0, 40.0)
"""Further tips that are simulated; those of Table 3 lie among them."""
LARGEST_MM = 40.0  # of the bluntest tip, if it is free
CANDIDATES = 48
MODULI, TAUS = 100, 24
PAIRS = ((0, 0), (0, 1), (1, 0), (1, 1))  # contact and calibration, in the order of `columns`


@dataclass(frozen=True, eq=False)
class TipPosterior:
    """What Table 3 says with some radii free.

    Attributes
    ----------
    choices : tuple of (n,) arrays
        Composite radii (mm) of each free tip that are tried, each as probable as any other.
    weight : (n, …) array
        Their posterior probability.
    log_evidence : float
        Of the 36 numbers.
    modulus_MPa : (mean, low, high)
        Posterior mean and 90 % interval.
    of_law : tuple of (mean, low, high)
        The same of the parameters of the width law.
    extra_sd_mm : float
        Posterior mean of τ.
    residual_mm : (2, 2, tips) array
        Printed less predicted R at the posterior means: contact, calibration, tip.
    """

    choices: tuple[FloatArray, ...]
    weight: FloatArray
    log_evidence: float
    modulus_MPa: Span
    of_law: tuple[Span, ...]
    extra_sd_mm: float
    residual_mm: FloatArray

    def radius_mm(self, which: int) -> Span:
        """Radius r_c (mm) of one of the free tips: mean and 90 % interval."""
        others = tuple(axis for axis in range(self.weight.ndim) if axis != which)
        return span(indenter_radius(self.choices[which], R_B), self.weight.sum(axis=others))


@dataclass(frozen=True, eq=False)
class FreeTips:
    """Simulated tables of many tips, and of those of Table 3 for the covariance of its errors.

    Attributes
    ----------
    tips_mm : (n,) array
        Of the first, in order.
    many, base : SimulatedFits
        The tables.
    law : WidthLaw
        Of the second contact model.
    """

    tips_mm: FloatArray
    many: SimulatedFits
    base: SimulatedFits
    law: WidthLaw = CONSTANT

    @classmethod
    def simulated(cls, small: bool = False) -> FreeTips:
        """Simulate the tables."""
        moduli = MODULI_MPA[::2] if small else MODULI_MPA
        tips = np.array(sorted([*TIPS_MM, *(BETWEEN_MM[::3] if small else BETWEEN_MM)]))
        fingers, errors = (1, 3) if small else (2, 4)
        many = simulate_fits(moduli, LINEAR, fingers=fingers, errors=errors, tips_mm=tips)
        base = simulate_fits(moduli, LINEAR, fingers=1 if small else 4, errors=8 if small else 10)
        return cls(tips, many, base)

    def between(self, tip: int, count: int = CANDIDATES) -> FloatArray:
        """Composite radii (mm) between those of the neighbours, evenly spread."""
        ends = composite_radius(np.array([0.0, *TIPS_MM, LARGEST_MM]), R_B)[[tip, tip + 2]]
        return np.asarray(ends[0] + (ends[1] - ends[0]) * (np.arange(count) + 0.5) / count)

    def posterior(self, tips: Sequence[int] = (), choices: Sequence[FloatArray] = ()) -> TipPosterior:
        """Posterior with these tips (by row of Table 3) free among these composite radii (mm)."""
        moduli = np.geomspace(*self.many.moduli_MPa[[0, -1]], MODULI)
        taus = (np.arange(TAUS) + 0.5) / TAUS * 3 * TAU_SCALE_MM
        models, values = self.law.models(), self.law.values
        log = np.array([self._log_likelihood(each, moduli, taus, tips, choices) for each in models])
        log_prior = -0.5 * (taus / TAU_SCALE_MM) ** 2
        log += (log_prior - np.logaddexp.reduce(log_prior))[:, None]
        top = float(log.max())
        mass = np.exp(log - top)  # law, modulus, τ, radii
        equally = len(models) * MODULI * mass.shape[-1]
        log_evidence = top + float(np.log(mass.sum() / equally))
        mass /= mass.sum()
        modulus = span(moduli, mass.sum(axis=(0, 2, 3)))
        of_law = tuple(span(each, mass.sum(axis=(1, 2, 3))) for each in values.T)
        weight = mass.sum(axis=(0, 1, 2)).reshape([len(each) for each in choices])
        mean = [
            float(each @ weight.sum(axis=tuple(a for a in range(weight.ndim) if a != i)))
            for i, each in enumerate(choices)
        ]
        at_mean = self.law.model(*(each[0] for each in of_law))
        predicted = self._predicted(at_mean, np.array([modulus[0]]), tips, [np.array([m]) for m in mean])[0, :, 0]
        return TipPosterior(
            tuple(choices),
            weight,
            log_evidence,
            modulus,
            of_law,
            float(taus @ mass.sum(axis=(0, 1, 3))),
            table_3() - predicted.reshape(2, 2, -1),
        )

    def wanted_mm(self, tip: int, given: TipPosterior) -> FloatArray:
        """Radius r_c (mm) of a tip that each column alone wants, (2, 2), all else as given."""
        radii = self.between(tip, 400)
        at_mean = self.law.model(*(each[0] for each in given.of_law))
        predicted = self._predicted(at_mean, np.array([given.modulus_MPa[0]]), (tip,), [radii])[0]
        by_column = predicted.reshape(len(PAIRS), len(TIPS_MM), -1)[:, tip]
        printed = table_3().reshape(len(PAIRS), -1)[:, tip]
        found = [np.interp(value, curve, radii) for value, curve in zip(printed, by_column, strict=True)]
        return np.asarray(indenter_radius(np.array(found), R_B)).reshape(2, 2)

    def _predicted(
        self, reader: WidthModel, moduli: FloatArray, tips: Sequence[int], choices: Sequence[FloatArray]
    ) -> FloatArray:
        """Expected columns, (moduli, 36, combinations of the radii)."""
        from scipy.interpolate import CubicSpline

        curves = BiasCurves.of(self.many, (HERTZ, reader))
        by_radius = CubicSpline(composite_radius(self.tips_mm, R_B), curves.means(moduli), axis=-1)
        printed = columns(by_radius(composite_radius(TIPS_MM, R_B)), (0, 1), (0, 1))
        grids = [grid.ravel() for grid in np.meshgrid(*choices, indexing="ij")] if choices else []
        out = np.repeat(printed[..., None], len(grids[0]) if grids else 1, axis=2)
        for tip, radii in zip(tips, grids, strict=True):
            out.reshape(len(moduli), len(PAIRS), len(TIPS_MM), -1)[:, :, tip] = by_radius(radii).reshape(
                len(moduli), len(PAIRS), -1
            )
        return out

    def _log_likelihood(
        self,
        reader: WidthModel,
        moduli: FloatArray,
        taus: FloatArray,
        tips: Sequence[int],
        choices: Sequence[FloatArray],
    ) -> FloatArray:
        """Of the 36 numbers, (moduli, taus, combinations)."""
        data = columns(table_3(), (0, 1), (0, 1))
        off = data[:, None] - self._predicted(reader, moduli, tips, choices)
        base = BiasCurves.of(self.base, (HERTZ, reader))
        covariance = base.covariance(moduli, (0, 1), (0, 1)) + FLOOR_MM**2 * np.eye(len(data))
        tip = np.tile(np.arange(len(TIPS_MM)), len(PAIRS))
        shared = TIP_SHARE * (tip[:, None] == tip) + (1 - TIP_SHARE) * np.eye(len(data))
        out = np.empty((len(moduli), len(taus), off.shape[-1]))
        for i, tau in enumerate(taus):
            factor = np.linalg.cholesky(covariance + tau**2 * shared)
            white = np.linalg.solve(factor, off)
            log_determinant = 2 * np.log(np.diagonal(factor, axis1=-2, axis2=-1)).sum(axis=-1)
            out[:, i] = -0.5 * ((white**2).sum(axis=1) + log_determinant[:, None] + len(data) * np.log(2 * np.pi))
        return out


def span(values: FloatArray, weight: FloatArray) -> Span:
    """Mean and 90 % interval of values with weights."""
    order = np.argsort(values)
    below = np.cumsum(weight[order]) - weight[order] / 2
    low, high = np.interp([0.05, 0.95], below, values[order])
    return float(values @ weight), float(low), float(high)
