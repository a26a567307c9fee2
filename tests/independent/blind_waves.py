"""What blind forms of contact and elements need: signals with waves weighted anew, by the finger of `finger`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .body import solve
from .contact import contact_table
from .finger import MODES, Finger, Press, Recording, _response


def kappa(finger: Finger, press: Press) -> np.ndarray:
    """P R/μ of each touch, mm², 0 for an edge."""
    curvature = np.maximum(1 / finger.body.outer + press.hump, 0) + 1 / np.maximum(press.tip, 1e-9)
    return np.asarray(np.where(press.tip == 0, 0.0, press.load / 1000 / finger.modulus / curvature))


def spectrum(finger: Finger, press: Press) -> np.ndarray:
    """q_k of each touch, (t, MODES)."""
    return contact_table(finger.body, MODES).spectrum(kappa(finger, press))


def half_width(finger: Finger, press: Press) -> np.ndarray:
    """Half-width of each contact, mm, 0 for an edge."""
    at = kappa(finger, press)
    return np.asarray(np.where(at == 0, 0.0, contact_table(finger.body, MODES).width(np.maximum(at, 1e-4))))


def waves(
    finger: Finger,
    press: Press,
    shares: np.ndarray,
    weight: np.ndarray | float = 1.0,
    turned: np.ndarray | float = 0.0,
) -> np.ndarray:
    """Signal (t, m) of pressures with spectra `shares` (t, MODES).

    `weight` and `turned` (MODES, m) are means of cos kφ and sin kφ over the angles from an element's middle to where it
    feels: it feels Σ q_k E_k (weight cos k(θ_c - θ) + turned sin k(θ_c - θ)).
    """
    k = np.arange(MODES)
    touch, element = np.radians(press.angle)[:, None] * k, np.radians(finger.angle) * k[:, None]
    normal = np.where(k == 0, 1.0, 2.0)[:, None] * _response(finger.body, "normal").strain_at(finger.depth)
    cosine, sine = shares * np.cos(touch), shares * np.sin(touch)
    strain = cosine @ (normal * (weight * np.cos(element) - turned * np.sin(element)))
    strain += sine @ (normal * (weight * np.sin(element) + turned * np.cos(element)))
    scale = press.load / 1000 / finger.modulus / (2 * np.pi * finger.body.outer)
    return np.asarray(finger.gain * scale[:, None] * strain)


def edges_with(r: Recording, shares: np.ndarray) -> Recording:
    """Edges press with other spectra; what else acts on them stays."""
    edge = (r.tip == 0)[:, None]
    change = np.where(edge, waves(r.finger, r.press, shares - 1.0), 0.0)
    return replace(r, signal=r.signal + change[r.touch])


def felt_by(r: Recording, weight: np.ndarray, turned: np.ndarray | float = 0.0) -> Recording:
    """Elements weigh the waves with `weight` and `turned` (MODES, m), as in `waves`, in place of 1 and 0."""
    change = waves(r.finger, r.press, spectrum(r.finger, r.press), weight - 1.0, turned)
    return replace(r, signal=r.signal + change[r.touch])


def indentation(finger: Finger, press: Press) -> np.ndarray:
    """Mean displacement of the surface over the pressure, mm: Σ w_k U_k q_k² P/(2π r_b μ).

    Modes end at MODES, so that an edge has a finite one: of a width of some 0.2 mm.
    """
    surface = solve(finger.body, np.arange(MODES)).surface
    weight = np.where(np.arange(MODES) == 0, 1.0, 2.0)
    load = press.load / 1000 / finger.modulus / (2 * np.pi * finger.body.outer)
    return np.asarray(load * (spectrum(finger, press) ** 2 @ (weight * surface)))


def thinner(finger: Finger, press: Press, less: np.ndarray) -> np.ndarray:
    """Change of the signal (t, m) where the layer is `less` (t,) mm thinner, interpolated between three thicknesses."""
    body, nodes = finger.body, np.array([0.0, 0.5, 1.0])
    signals = []
    for node in nodes:
        thin = replace(body, outer=body.outer - node)
        scale = (thin.outer - body.core) / (body.outer - body.core)
        depth = body.core + (finger.depth - body.core) * scale
        signals.append(replace(finger, body=thin, depth=depth).signal(press))
    total = np.zeros_like(signals[0])
    for i, node in enumerate(nodes):
        others = np.delete(nodes, i)
        total += np.prod((less[:, None] - others) / (node - others), axis=1)[:, None] * signals[i]
    return np.asarray(total - signals[0])
