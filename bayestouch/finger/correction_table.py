"""Empirical correction of the readings of a finger by element and location, as a table for a calibration file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.errors import InputError
from bayestouch.finger.correction_basis import FingerCorrectionBasis
from bayestouch.finger.felt_map import shares_of_nodes
from bayestouch.finger.model import finger_model
from bayestouch.model.correction import Correction, weights_of
from bayestouch.model.fitting import Fitted

PREFIX = "placed_"
MEAN = ("even", "wide", "loaded")
N_TERMS = len(MEAN)
SPREAD = ("terms", "slope", "covariance")
#: Names of the arrays of a correction that has errors of the E map.
FELT = ("nodes", "felt")
#: Name of the array that files up to version 0.1 have instead of `SPREAD`: a standard deviation for each element.
SD = "sd"
# Distance between the locations of a table, degree: features of the strain are about 10° wide. The uncertainty is
# stored for every second location: the sd of a correction with a length of 5° then has an error of 0.5 % between two.
STEP_DEG, SPREAD_EVERY = 0.5, 2


@dataclass(frozen=True, eq=False)
class CorrectionTable:
    """Correction over the contact location; a locations, m elements.

    The correction is ``P (even + P R wide + P loaded + felt)``, with P R in N and P in N/m; ``felt`` is a polynomial in
    P R through its values at the nodes. For given parameters of the chain, the coefficients at a location are normal
    with a mean that is linear in these parameters.

    Attributes
    ----------
    angle_deg : (a,) array
        Contact locations, equally spaced, degree.
    even, wide, loaded : (a, m) arrays
        Coefficients at the most probable parameters.
    terms : (p,) int array
        Indices of the coefficients that are uncertain; the others are zero.
    slope : (b, d, p, m) array
        Derivative of these coefficients over the d parameters of the chain, at b of the locations.
    covariance : (b, p m, p m) array
        Covariance of these coefficients, for given parameters.
    nodes : (q,) array
        Values of P R, N; none if the correction has no error of the E map.
    felt : (q, a, m) array
        Coefficients at the nodes.
    """

    angle_deg: FloatArray
    even: FloatArray
    wide: FloatArray
    loaded: FloatArray
    terms: IntArray
    slope: FloatArray
    covariance: FloatArray
    nodes: FloatArray
    felt: FloatArray

    def readings(self, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
        """Correction (n, m) of touches of composite radius R (mm), location (rad) and load (N/m), all (n,)."""
        even, wide, loaded, *felt = self._at(np.degrees(angle), self.even, self.wide, self.loaded, *self.felt)
        pressed = load * radius_mm / 1000
        share = even + pressed[:, None] * wide + load[:, None] * loaded
        for values, part in zip(felt, self._of_node(pressed), strict=True):
            share += values * part[:, None]
        return np.asarray(load[:, None] * share)

    def by_parameter(self, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
        """Derivative (d, n, m) of `readings` over the parameters of the chain; zero outside the table."""
        (slope,) = self._at(np.degrees(angle), self.slope)
        return np.asarray(np.einsum("pn,ndpm->dnm", self._of_term(radius_mm, load), slope, optimize=True))

    def covariance_at(self, radius_mm: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
        """Covariance (n, m, m) of `readings`, given the parameters of the chain; zero outside the table."""
        (covariance,) = self._at(np.degrees(angle), self.covariance)
        of_term = self._of_term(radius_mm, load)
        p, m = len(of_term), self.even.shape[1]
        blocks = covariance.reshape(-1, p, m, p, m)
        return np.asarray(np.einsum("pn,npiqj,qn->nij", of_term, blocks, of_term, optimize=True))

    def _of_term(self, radius_mm: FloatArray, load: FloatArray) -> FloatArray:
        """Factors of the uncertain coefficients, (p, n)."""
        pressed = load * radius_mm / 1000
        factors = np.concatenate([np.stack([np.ones_like(load), pressed, load]), self._of_node(pressed)])
        return np.asarray(load * factors[self.terms])

    def _of_node(self, pressed: FloatArray) -> FloatArray:
        """Interpolation weight of the value at each node, (q, n), for touches with P R (n,) in N."""
        return shares_of_nodes(self.nodes, pressed).T if len(self.nodes) else np.zeros((0, len(pressed)))

    def _at(self, angle_deg: FloatArray, *tables: FloatArray) -> list[FloatArray]:
        """Tables (a, ...) or (b, ...) interpolated at locations (n,), each (n, ...); zero outside the table."""
        low, high = self.angle_deg[0], self.angle_deg[-1]
        inside = (angle_deg >= low) & (angle_deg <= high)
        out = []
        for table in tables:
            last = len(table) - 1
            place = (np.asarray(angle_deg) - low) / (high - low) * last
            row = np.clip(np.floor(place), 0, last - 1).astype(np.int64)
            share, kept = (
                each.reshape(-1, *[1] * (table.ndim - 1)) for each in (np.where(inside, place - row, 0.0), inside)
            )
            out.append(np.where(kept, table[row] + share * (table[row + 1] - table[row]), 0.0))
        return out

    def arrays(self) -> dict[str, FloatArray]:
        """Arrays by name, for a file."""
        felt = FELT if len(self.nodes) else ()
        return {PREFIX + name: getattr(self, name) for name in ("angle_deg", *MEAN, *SPREAD, *felt)}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, FloatArray]) -> CorrectionTable | None:
        """Table from the arrays of a file; None if they have no correction.

        Raises
        ------
        InputError
            If the correction is incomplete.
        """
        spread = (SD,) if PREFIX + SD in arrays else SPREAD
        names = ("angle_deg", *MEAN, *spread, *(FELT if any(PREFIX + name in arrays for name in FELT) else ()))
        missing = [PREFIX + name for name in names if PREFIX + name not in arrays]
        if not any(PREFIX + name in arrays for name in ("angle_deg", *MEAN, SD, *SPREAD)):
            return None
        if missing:
            raise InputError("missing in the correction: made by another version, calibrate again", column=missing[0])
        found = {name: np.asarray(arrays[PREFIX + name]) for name in names}
        spreads = _of_each_element(found[SD]) if SD in found else tuple(found[name] for name in SPREAD)
        terms, slope, covariance = spreads
        angle_deg, even, wide, loaded = (found[name] for name in ("angle_deg", *MEAN))
        return cls(
            angle_deg,
            even,
            wide,
            loaded,
            terms=terms.astype(np.int64),
            slope=slope,
            covariance=covariance,
            nodes=found.get("nodes", np.zeros(0)),
            felt=found.get("felt", np.zeros((0, *even.shape))),
        )


def _of_each_element(sd: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Arrays `SPREAD` from a standard deviation (a, m) of each element, independent of the parameters."""
    a, m = sd.shape
    return np.zeros(1), np.zeros((a, 1, 1, m)), sd[:, :, None] ** 2 * np.eye(m)


def table_of(fitted: Fitted, chosen: Correction) -> CorrectionTable:
    """Table of the correction of a fit, over the range of its touches."""
    model = finger_model(fitted.model)
    angle = model.correction_inputs(fitted.vector)[1]
    low, high = np.floor(angle.min()) - 5, np.ceil(angle.max()) + 5
    grid = np.arange(low, high + 1e-9, STEP_DEG)
    weights, nodes = weights_of(fitted), pressure_nodes(chosen)
    terms, coefficients = correction_coefficients(
        chosen, grid, model.finger.outer_radius_mm, model.reference_load, nodes
    )
    mean = np.zeros((N_TERMS + len(nodes), *coefficients.shape[2:]))
    mean[terms] = np.tensordot(coefficients, weights.mean, axes=(1, 0))
    # (b, k, p m): derivative of the uncertain coefficients over each weight
    some = coefficients[:, :, ::SPREAD_EVERY].transpose(2, 1, 0, 3)
    b, k, p, m = some.shape
    flat = np.ascontiguousarray(some).reshape(b, k, p * m)
    slope = weights.slope.T @ flat
    covariance = np.stack([one.T @ (weights.covariance @ one) for one in flat])
    # Single precision (six digits) is enough.
    even, wide, loaded = mean[:N_TERMS]
    return CorrectionTable(
        grid,
        even,
        wide,
        loaded,
        terms=terms,
        slope=slope.reshape(b, -1, p, m).astype(np.float32),
        covariance=covariance.astype(np.float32),
        nodes=nodes,
        felt=mean[N_TERMS:],
    )


def errs_by_element(chosen: Correction) -> bool:
    """Whether a correction has errors of the elements' E maps, and no shared, wide or loaded functions."""
    return chosen.sizes.get("map", 0.0) > 0 and not any(chosen.sizes.get(name) for name in ("shared", "wide", "loaded"))


def pressure_nodes(chosen: Correction) -> FloatArray:
    """Values (q,) of P R in N at which the table needs coefficients; none without errors of the E map."""
    if not chosen.sizes.get("map"):
        return np.zeros(0)
    assert isinstance(chosen.basis, FingerCorrectionBasis)
    return chosen.basis.felt.nodes


def correction_coefficients(
    chosen: Correction, grid: FloatArray, outer_radius_mm: float, load: float, nodes: FloatArray
) -> tuple[IntArray, FloatArray]:
    """Indices (p,) of the coefficients that are not zero, and their derivatives over each weight, (p, k, a, m).

    The coefficients are even, wide, loaded, and those at the nodes, for the locations (a,) of the grid.
    """
    one = np.ones(len(grid))

    def under(radius: float, load: float) -> FloatArray:
        """Correction per unit of each weight, over the load, (k, a, m)."""
        return chosen.columns(radius * one, grid, load * one) / load

    # Columns are a sum of terms in P and P²: two loads give both; an edge and a flat give the term with P R.
    edge = under(0.0, load)
    loaded = (under(0.0, 2 * load) - edge) / load
    if len(nodes):
        # The polynomial through the nodes contains even and wide.
        found = {2: loaded, **{N_TERMS + i: under(1000 * x / load, load) - load * loaded for i, x in enumerate(nodes)}}
        unit = np.array([load, *np.ones(len(nodes))])
    else:
        wide = (under(outer_radius_mm, load) - edge) / (load * outer_radius_mm / 1000)
        found = {0: edge - load * loaded, 1: wide, 2: loaded}
        unit = np.array([1.0, load * outer_radius_mm / 1000, load])
    # Differences of equal numbers leave rounding errors, which are zero.
    size = np.array([np.abs(each).max() for each in found.values()]) * unit
    kept = [(term, each) for (term, each), one in zip(found.items(), size, strict=True) if one >= 1e-9 * size.max()]
    return np.array([term for term, _ in kept]), np.stack([each for _, each in kept])
