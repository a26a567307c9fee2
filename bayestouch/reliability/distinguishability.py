"""Which indenters one touch can distinguish: posterior odds with location, load and calibration unknown.

`distinguished` and `threshold_radii` integrate the Fisher information (`RadiusScale`). Where readings are not linear in
the location, as where one shallow element reads a touch almost alone, they are quadratures over the location
(`bayestouch.reliability.pairs`). `trial` simulates touches and computes the evidence; it needs only the likelihood, and
gives error rates and ROC curves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.contact import composite_radius
from bayestouch.errors import InputError
from bayestouch.output.summary import Summarised
from bayestouch.reliability.evidence import log_evidence
from bayestouch.reliability.information import RadiusScale
from bayestouch.reliability.known_finger import KnownFinger, TouchPlaces, require_touches
from bayestouch.reliability.pairs import right_shares, thresholds
from bayestouch.reliability.paper_criterion import Annulus, smallest_radius


def distinguished(
    known: KnownFinger, indenters_mm: ArrayLike, angle_deg: ArrayLike, *, samples: int = 1, use_load: bool = True
) -> FloatArray:
    """Probability of identifying the right one of each pair of indenters, with even prior odds.

    Parameters
    ----------
    known : KnownFinger
        The calibrated finger.
    indenters_mm : (k,) array_like
        Indenter radii r_c: 0 knife edge, inf flat.
    angle_deg : (n,) array_like
        Locations.
    samples, use_load
        As in `touch_information`.

    Returns
    -------
    (n, k, k) array
        Probabilities; 0.5 on the diagonal, which is chance.

    Raises
    ------
    InputError
        If there are no indenters, or as in `RadiusScale.of`.
    """
    radii = np.atleast_1d(np.asarray(indenters_mm, dtype=float))
    where = np.radians(np.atleast_1d(np.asarray(angle_deg, dtype=float)))
    require_touches(radii, where)
    scale = RadiusScale.of(known, where, samples=samples, use_load=use_load)
    first, second = (grid.ravel() for grid in np.meshgrid(radii, radii, indexing="ij"))
    expected = scale.distinguished(first, second).reshape(-1, len(radii), len(radii))
    composite = np.asarray(composite_radius(radii, known.outer_radius_mm))
    return right_shares(known, composite, where, expected, samples, use_load)


def threshold_radii(
    known: KnownFinger,
    angle_deg: ArrayLike,
    *,
    from_r_c: float = 0.0,
    probability: float = 0.95,
    samples: int = 1,
    use_load: bool = True,
) -> FloatArray:
    """r_c (mm) of the sharpest round indenter that is distinguished from `from_r_c` at each location, (n,).

    NaN if not even a flat is distinguished. See `RadiusScale.threshold` and `distinguished`.

    Raises
    ------
    InputError
        As in `RadiusScale.of`, or if `probability` is not between 0.5 and 1.
    """
    scale = RadiusScale.of(known, np.radians(angle_deg), samples=samples, use_load=use_load)
    return thresholds(known, scale, from_r_c, probability, samples, use_load)


@dataclass(frozen=True, eq=False, repr=False)
class Trial(Summarised):
    """Simulated touches by k indenters, n each, with the evidence for each indenter.

    Attributes
    ----------
    indenters_mm : (k,) array
        Indenter radii r_c.
    log_evidence : (k, n, k) array
        Log evidence by true indenter, touch and assumed indenter.
    """

    indenters_mm: FloatArray
    log_evidence: FloatArray

    def log_odds(self, i: int, j: int) -> tuple[FloatArray, FloatArray]:
        """Log posterior odds of j against i with even prior odds: of touches by i, and of touches by j; (n,) each."""
        difference = self.log_evidence[..., j] - self.log_evidence[..., i]
        return difference[i], difference[j]

    @property
    def distinguished(self) -> FloatArray:
        """Share of touches for which the right one of two indenters is identified, (k, k); ties count half."""
        k = len(self.indenters_mm)
        out = np.full((k, k), 0.5)
        for i in range(k):
            for j in range(k):
                if i != j:
                    by_i, by_j = self.log_odds(i, j)
                    out[i, j] = 0.5 * (_share_above(-by_i) + _share_above(by_j))
        return out

    @property
    def named(self) -> FloatArray:
        """Share of touches by each indenter (row) that are identified as each of the k indenters (column), (k, k)."""
        k = len(self.indenters_mm)
        best = self.log_evidence.argmax(axis=-1)
        return np.stack([(best == j).mean(axis=1) for j in range(k)], axis=1)

    @property
    def probability(self) -> FloatArray:
        """Posterior probability of each of the k indenters with even prior odds, (k, n, k)."""
        share = np.exp(self.log_evidence - self.log_evidence.max(axis=-1, keepdims=True))
        return np.asarray(share / share.sum(axis=-1, keepdims=True))

    def roc(self, i: int, j: int) -> tuple[FloatArray, FloatArray]:
        """ROC curve: rates of false alarms (by i, called j) and hits (by j, called j) as the required odds decrease."""
        by_i, by_j = self.log_odds(i, j)
        level = np.sort(np.concatenate([by_i, by_j]))[::-1]
        alarms = np.searchsorted(np.sort(-by_i), -level, side="right") / len(by_i)
        hits = np.searchsorted(np.sort(-by_j), -level, side="right") / len(by_j)
        return np.concatenate([[0.0], alarms]), np.concatenate([[0.0], hits])

    def area(self, i: int, j: int) -> float:
        """Area under the ROC curve: probability that a touch by j has higher odds of j than a touch by i."""
        alarms, hits = self.roc(i, j)
        return float(np.diff(alarms) @ (hits[1:] + hits[:-1]) / 2)


def _share_above(values: FloatArray) -> float:
    return float((values > 0).mean() + 0.5 * (values == 0).mean())


def trial(
    known: KnownFinger,
    indenters_mm: ArrayLike,
    angle_deg: ArrayLike,
    *,
    touches: int = 200,
    samples: int = 1,
    use_load: bool = True,
    seed: int = 0,
) -> Trial:
    """Simulated touches by every indenter at random locations, with the evidence for all indenters.

    Each touch is on a finger drawn from the calibration's posterior, so the calibration is really unknown.

    Parameters
    ----------
    known : KnownFinger
        The calibrated finger.
    indenters_mm : (k,) array_like
        Indenter radii r_c.
    angle_deg : (n,) array_like
        Locations, from which one is drawn for each touch.
    touches : int
        Number of touches by each indenter.
    samples : int
        Samples averaged in each touch.
    use_load : bool
        Whether the force sensor is read.
    seed : int
        Seed of all random numbers.

    Raises
    ------
    InputError
        If there are no indenters, locations, touches or samples, or a location is not finite.
    """
    if touches < 1 or samples < 1:
        raise InputError("a trial needs at least one touch by each indenter, and one sample a touch")
    rng = np.random.default_rng(seed)
    radii = np.atleast_1d(np.asarray(indenters_mm, dtype=float))
    composite = np.asarray(composite_radius(radii, known.outer_radius_mm))
    choice = np.radians(np.atleast_1d(np.asarray(angle_deg, dtype=float)))
    require_touches(composite, choice)
    noise = np.sqrt(known.noise_variance(samples))
    load_sd = known.load_sd(samples, use_load)
    rows = []
    for radius in composite:
        angle = choice[rng.integers(len(choice), size=touches)]
        places = TouchPlaces(np.full(touches, radius), angle, np.full(touches, known.typical_load))
        readings = known.predict(places) + noise * rng.standard_normal((touches, known.n_elements))
        if known.errors is not None:
            readings += _own_errors(known, places, rng)
        load = places.load + load_sd * rng.standard_normal(touches) if np.isfinite(load_sd) else None
        rows.append(log_evidence(known, readings, composite, load=load, samples=samples))
    return Trial(radii, np.stack(rows))


def _own_errors(known: KnownFinger, touches: TouchPlaces, rng: np.random.Generator) -> FloatArray:
    """Errors of the predicted readings, with another calibration drawn for each touch, (t, m)."""
    assert known.errors is not None
    covariance = known.errors.covariance(touches)
    values, vectors = np.linalg.eigh(covariance)
    drawn = np.sqrt(np.maximum(values, 0.0)) * rng.standard_normal(values.shape)
    return np.asarray((vectors @ drawn[..., None])[..., 0])


@dataclass(frozen=True, repr=False)
class Optimism(Summarised):
    """Threshold of the paper and threshold with everything unknown, at one location; radii r_c in mm.

    Attributes
    ----------
    paper_mm : float
        Sharpest indenter that the paper's criterion distinguishes from a knife edge.
    distinguished_there : float
        Probability with which one touch distinguishes that indenter from an edge.
    honest_mm : float
        Sharpest indenter distinguished with 95 % if location, load and calibration are unknown; NaN if not even a flat
        is.
    """

    paper_mm: float
    distinguished_there: float
    honest_mm: float

    @property
    def factor(self) -> float:
        """Ratio of our threshold to the paper's; above 1 the paper is optimistic."""
        return self.honest_mm / self.paper_mm


def optimism(
    known: KnownFinger,
    finger: Annulus,
    angle_deg: ArrayLike,
    *,
    span_deg: float = 360.0,
    samples: int = 1,
) -> tuple[Optimism, ...]:
    """Comparison of the paper's threshold with ours at each location; the force sensor is not read.

    Parameters
    ----------
    known : KnownFinger
        The calibrated finger, with elements.
    finger : Annulus
        The same finger for the paper's criterion. Its noise is that of the mean of `samples` over the typical peak.
    angle_deg : (n,) array_like
        Locations.
    span_deg : float
        Arc of the "mean square", see `strain_difference`.
    samples
        As in `touch_information`.
    """
    places = np.atleast_1d(np.asarray(angle_deg, dtype=float))
    place = known.chain.angle
    above = TouchPlaces(np.zeros(len(place)), place, np.full(len(place), known.typical_load))
    peak = np.abs(np.diagonal(known.predict(above)))
    noise = float(np.median((np.sqrt(known.noise_variance(samples)) / peak)[known.read_elements]))
    paper = smallest_radius(finger, noise, span_deg=span_deg)
    right = distinguished(known, [0.0, paper], places, samples=samples, use_load=False)[:, 0, 1]
    honest = threshold_radii(known, places, samples=samples, use_load=False)
    return tuple(Optimism(paper, float(p), float(r)) for p, r in zip(right, honest, strict=True))
