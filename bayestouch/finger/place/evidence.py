"""Marginal likelihood of sizes and lengths of functions of place, about a fitted finger."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp

from bayestouch.array_types import FloatArray
from bayestouch.finger.place.functions import PlaceFunctions, Process, process_modes, spectrum
from bayestouch.finger.place.linear import LinearElement, LinearPosterior

# Lengths of functions of time that are tried, degree: all touches together are 180°.
TIME_LENGTHS = (8.0, 16.0, 32.0, 64.0)
# Lengths that are tried, degree, and sizes: as a share of the peak, or in the logarithm of the surface's curvature.
OWN_LENGTHS, OWN_SIZES = (4.0, 6.0, 9.0, 14.0), np.geomspace(5e-4, 0.2, 19)
SURFACE_LENGTHS, SURFACE_SIZES = (6.0, 10.0, 16.0, 26.0), np.geomspace(1e-3, 0.6, 19)


@dataclass(frozen=True, eq=False)
class Scored:
    """Functions of place with their marginal likelihood.

    Attributes
    ----------
    functions : PlaceFunctions
        The functions.
    log_evidence : float
        Log marginal likelihood, up to a constant that is the same for all functions.
    factor : (elements,) array
        Most probable variance of the independent errors of each element, over that of noise and load.
    """

    functions: PlaceFunctions
    log_evidence: float
    factor: FloatArray


@dataclass(frozen=True, eq=False)
class Spectral:
    """Likelihood of the readings of an element for functions of one length, in a basis of independent weights."""

    values: FloatArray  # (k,): information about each weight, at size one and a factor of one
    slopes: FloatArray  # (k,)
    squares: float
    n: int

    @classmethod
    def of(cls, columns: FloatArray, left: FloatArray) -> Spectral:
        """Likelihood from whitened columns (n, k) for size one and whitened readings (n,)."""
        values, turn = np.linalg.eigh(columns.T @ columns)
        return cls(np.maximum(values, 0.0), turn.T @ (columns.T @ left), float(left @ left), len(left))

    def log_evidence(self, sizes: FloatArray, factors: FloatArray) -> FloatArray:
        """Log marginal likelihood (s, c) for sizes (s,) and variance factors (c,) of the independent errors."""
        share = (sizes**2)[:, None, None] / factors[:, None]
        grown = 1 + share * self.values
        explained = (share / factors[:, None] * self.slopes**2 / grown).sum(axis=-1)
        return np.asarray(
            -0.5 * (self.squares / factors - explained + self.n * np.log(factors) + np.log(grown).sum(axis=-1))
        )


def without_functions(elements: Sequence[LinearElement]) -> Scored:
    """Marginal likelihood without functions: model errors are independent from touch to touch."""
    total, factors = 0.0, []
    for element in elements:
        white = element.without_model(element.left[:, None])[:, 0]
        value = -0.5 * (white @ white / element.factors + len(white) * np.log(element.factors))
        total += float(_averaged(value))
        factors.append(element.factors[int(value.argmax())])
    return Scored(PlaceFunctions(), total, np.array(factors))


def with_own(
    elements: Sequence[LinearElement], kind: str, columns: FloatArray, lengths: Sequence[float] = OWN_LENGTHS
) -> Scored:
    """Own functions of one kind, with the most probable size and length.

    `columns` (t, m, k) are the change of the readings for weights of variance one, at the shortest of the `lengths`
    (degree).
    """
    left = [element.without_model(element.left[:, None])[:, 0] for element in elements]
    white = [element.whiten(columns[:, element.index]) for element in elements]
    factors = elements[0].factors
    best: Scored | None = None
    for length in lengths:
        scale = np.sqrt(spectrum(length))
        tables = np.stack(
            [
                Spectral.of(each[:, : len(scale)] * scale, rest).log_evidence(OWN_SIZES, factors)
                for each, rest in zip(white, left, strict=True)
            ]
        )
        by_size = _averaged(tables).sum(axis=0)
        i = int(by_size.argmax())
        if best is None or by_size[i] > best.log_evidence:
            functions = PlaceFunctions(kind, Process(length, float(OWN_SIZES[i])))
            best = Scored(functions, float(by_size[i]), factors[tables[:, i].argmax(axis=1)])
    assert best is not None
    return best


def with_surface(elements: Sequence[LinearElement], before: Scored, own: FloatArray, common: FloatArray) -> Scored:
    """Own functions together with a curvature of the surface of the most probable size and length.

    Parameters
    ----------
    elements : sequence of LinearElement
        The elements.
    before : Scored
        Own functions, or none.
    own : (t, m, k) array
        Columns of the own functions.
    common : (t, m, q) array
        Columns of the surface, for weights of variance one at the shortest length.
    """
    linear = LinearPosterior.of(elements, before.factor, own, common)
    information, slope = linear.information()
    # The surface explains a part of the independent errors: without own functions a common reduction of their variance
    # is fitted too.
    ease = np.ones(1) if before.functions.own is not None else 1 / elements[0].factors
    n = sum(len(element.rows) for element in elements)
    best: Scored | None = None
    for length in SURFACE_LENGTHS:
        k = 2 * process_modes(length) + 1
        scale = np.sqrt(spectrum(length))
        values, turn = np.linalg.eigh(information[:k, :k] * np.outer(scale, scale))
        part = Spectral(np.maximum(values, 0.0), turn.T @ (slope[:k] * scale), linear.squares, n)
        table = part.log_evidence(SURFACE_SIZES, ease)
        size = int(table.max(axis=1).argmax())
        gain = float(table.max()) + 0.5 * linear.squares
        if best is None or before.log_evidence + gain > best.log_evidence:
            functions = replace(before.functions, surface=Process(length, float(SURFACE_SIZES[size])))
            best = Scored(functions, before.log_evidence + gain, before.factor * ease[int(table[size].argmax())])
    assert best is not None
    return best


def _averaged(values: FloatArray) -> FloatArray:
    """Log of the mean of the evidence over the grid of the factor, (...), from log evidence (..., c)."""
    return np.asarray(logsumexp(values, axis=-1) - np.log(values.shape[-1]))
