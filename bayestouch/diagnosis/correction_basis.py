"""A correction without a cause: smooth functions of where the touch is from each element, and of the load.

Random functions are added up: one of the angle from element to touch that all elements share and one of each element's
own, in proportion to the load; one that all share and that grows with P R, as the width of contacts does; and one of
each element's own for what is not in proportion to the load. Their sizes are chosen by the marginal likelihood, so that
none stays where there is nothing to correct.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from bayestouch.array_types import FloatArray
from bayestouch.chain.smooth import SmoothBasis
from bayestouch.contact import composite_radius
from bayestouch.diagnosis.pad_correction_basis import PadCorrectionBasis
from bayestouch.finger.model import finger_model
from bayestouch.model.fitting import Fitted, functions_of, spread_over_elements
from bayestouch.model.linear import Linearised, Score, Scorer, with_functions
from bayestouch.pad.model import PadModel

# Lengths of the functions, degree: features of the strain are some 10° wide.
SHARED_LENGTH, OWN_LENGTH, WIDE_LENGTH = 5.0, 9.0, 7.0
SIZES = (0.0, 0.003, 0.01, 0.03, 0.1)
# How far from an element, degree, its answer is looked at for what is not in proportion to the load.
LOADED_REACH = 30.0
# Loads that scatter by less than this share say nothing about that.
LOADS_VARY = 0.02


@dataclass(frozen=True, eq=False)
class FingerCorrectionBasis:
    """Basis of the correction for one finger.

    Attributes
    ----------
    element_deg : (m,) array
        Angles of the elements.
    peak : (m,) array
        Size of each element's reading under the reference load.
    reference_load : float
        N/m.
    widest : float
        R of a flat, mm: its contact under the reference load counts as wide, and others as P R does.
    load_mean, load_sd : float
        Of the loads over the reference load. What is not in proportion to the load is nothing under the mean load.
    shared, wide, loaded : SmoothBasis
        Of the angle from element to touch, degree.
    own : tuple of SmoothBasis
        The same for each element, over what it has seen.
    """

    element_deg: FloatArray
    peak: FloatArray
    reference_load: float
    widest: float
    load_mean: float
    load_sd: float
    shared: SmoothBasis
    wide: SmoothBasis
    loaded: SmoothBasis
    own: tuple[SmoothBasis, ...]

    @classmethod
    def of(cls, fitted: Fitted) -> FingerCorrectionBasis:
        """Basis over the angles that the touches of a fit cover."""
        model = finger_model(fitted.model)
        element = np.degrees(fitted.vector[model.layout.angle])
        recording = model.poses(fitted.vector)
        angle, share = recording.place[0], recording.load / model.reference_load
        low, high = float(angle.min()), float(angle.max())
        return cls(
            element_deg=element,
            peak=model.peak,
            reference_load=model.reference_load,
            widest=model.finger.outer_radius_mm,
            load_mean=float(share.mean()),
            load_sd=float(share.std()),
            shared=SmoothBasis.of(low - element.max(), high - element.min(), SHARED_LENGTH, most=90),
            wide=SmoothBasis.of(low - element.max(), high - element.min(), WIDE_LENGTH, most=60),
            loaded=SmoothBasis.of(-LOADED_REACH, LOADED_REACH, OWN_LENGTH),
            own=tuple(SmoothBasis.of(low - e, high - e, OWN_LENGTH) for e in element),
        )

    def columns(self, *where: FloatArray) -> dict[str, FloatArray]:
        """Readings per unit weight for touches of composite radius (mm), location (degree) and load, all (t,).

        Each part is (k, t, m), at size one.
        """
        radius, angle, load = where
        away, share = angle[:, None] - self.element_deg, load / self.reference_load
        scale = share[:, None] * self.peak
        own = np.stack([basis(away[:, e]) for e, basis in enumerate(self.own)], axis=-1)
        parts = {
            "shared": spread_over_elements(np.moveaxis(self.shared(away), -1, 0), scale, own=False),
            "own": spread_over_elements(np.moveaxis(own, 1, 0), scale, own=True),
            "wide": spread_over_elements(
                np.moveaxis(self.wide(away), -1, 0), scale * (radius / self.widest * share)[:, None], own=False
            ),
        }
        if self.load_sd > LOADS_VARY:
            more = ((share - self.load_mean) / self.load_sd)[:, None]
            parts["loaded"] = spread_over_elements(np.moveaxis(self.loaded(away), -1, 0), scale * more, own=True)
        return parts


@dataclass(frozen=True, eq=False)
class Correction:
    """A correction whose sizes are chosen.

    Attributes
    ----------
    placed : Placed or PadPlaced
        Basis.
    sizes : dict of str to float
        Standard deviation of each part, over the peak reading.
    gain : float
        Log marginal likelihood gained over the model without.
    linear : Linearised
        The model that it was chosen for, with the correction among its random functions.
    """

    basis: FingerCorrectionBasis | PadCorrectionBasis
    sizes: dict[str, float]
    gain: float
    linear: Linearised

    def columns(self, *where: FloatArray) -> FloatArray:
        """What each weight, standard normal, adds to the readings of touches as `where_of` has them; (k, t, m)."""
        parts = self.basis.columns(*where)
        return np.concatenate([self.sizes[name] * part for name, part in parts.items() if self.sizes[name] > 0])


def fit_correction(fitted: Fitted) -> Correction | None:
    """Choose a correction on top of a fitted model; None where its marginal likelihood gains nothing."""
    model = fitted.model
    basis = (
        PadCorrectionBasis.of(model, fitted.vector) if isinstance(model, PadModel) else FingerCorrectionBasis.of(fitted)
    )
    where = where_of(fitted)
    parts = basis.columns(*where)
    raw = np.concatenate(list(parts.values()))
    part = np.repeat(np.arange(len(parts)), [len(each) for each in parts.values()])
    score = Scorer(fitted.linear).of_columns(fitted.whitening.columns(raw))
    sizes, gain = _best_sizes(score, part, len(parts))
    if gain <= 0 or not sizes.any():
        return None
    chosen = Correction(basis, dict(zip(parts, sizes.tolist(), strict=True)), gain, fitted.linear)
    functions = functions_of(model, fitted.vector, fitted.whitening, fitted.drifts, chosen.columns(*where))
    return replace(chosen, linear=with_functions(fitted.linear, functions))


def where_of(fitted: Fitted) -> tuple[FloatArray, ...]:
    """Composite radius (mm), location (degree) and load of the touches of a fit; on a pad location (t, D) and load."""
    recording = fitted.model.poses(fitted.vector)
    if isinstance(fitted.model, PadModel):
        return np.stack(recording.place, axis=1), recording.load
    radius = composite_radius(recording.indenter_radius_mm, finger_model(fitted.model).finger.outer_radius_mm)
    return radius, recording.place[0], recording.load


def _best_sizes(score: Score, part: NDArray[np.int64], n_parts: int) -> tuple[FloatArray, float]:
    """Sizes of the parts with the highest marginal likelihood: one after the other, twice around."""
    sizes, best = np.zeros(n_parts), 0.0
    for _ in range(2):
        changed = False
        for k in range(n_parts):
            for size in SIZES:
                trial = sizes.copy()
                trial[k] = size
                gain = _gain(score, trial[part]) if size != sizes[k] else best
                if gain > best + 1e-9:
                    sizes, best, changed = trial, gain, True
        if not changed:
            break
    return sizes, best


def _gain(score: Score, size: FloatArray) -> float:
    """Log marginal likelihood of random functions of given sizes over none."""
    used = size > 0
    if not used.any():
        return 0.0
    scale = size[used]
    matrix = np.eye(int(used.sum())) + scale[:, None] * score.information[np.ix_(used, used)] * scale
    root = np.linalg.cholesky(matrix)
    white = solve_triangular(root, scale * score.slope[used], lower=True)
    return 0.5 * float(white @ white) - float(np.log(np.diag(root)).sum())
