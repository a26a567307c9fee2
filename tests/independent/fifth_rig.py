"""Forms of the rig and of the contact in the fifth blind study. None is in an earlier registry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .blind_readout import _relaxing
from .blind_rig import _no_hollow
from .blind_waves import edges_with, half_width, indentation, spectrum, waves
from .catalogue_finger import finite_strain
from .effects import Effect
from .finger import MODES, Recording


def worm_drive(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A worm turns the finger by a wheel of 36 teeth: the wheel runs out of true, and so does the worm.

    The error is value (sin(θ - φ) + 0.08 sin(36 θ - ψ)), degree: the worm goes round once a tooth. Periodic error of
    worm drives, which telescopes are corrected for.
    """
    turn, phase = np.radians(r.commanded), rng.uniform(-np.pi, np.pi, 2)
    error = np.sin(turn - phase[0]) + 0.08 * np.sin(36 * turn - phase[1])
    return replace(r, press=replace(r.press, angle=r.press.angle + value * error))


def slipping_belt(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """A belt drives the table by a pulley that runs out of true, and slips on it little by little.

    The error is value sin(θ - φ - 2.5 t/T), degree, t the time and T the whole time: its phase walks on. Creep of a
    belt under load.
    """
    time = r.time[:: r.n_samples] / r.time[-1]
    walked = rng.choice([-1, 1]) * 2.5 * time
    error = np.sin(np.radians(r.commanded) - rng.uniform(-np.pi, np.pi) - walked)
    return replace(r, press=replace(r.press, angle=r.press.angle + value * error))


def cold_and_warm(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The force sensor has a wrong zero, and air that is cold and warm by turns moves it about.

    It reads P + value (1 + 0.15 f(t)), f a random course of unit variance and a correlation time of 4 min. Data sheets
    of load cells give a shift of the zero with temperature.
    """
    course = _relaxing(r.time, 240.0, 1, rng)[:, 0]
    return replace(r, read_load=r.read_load + value * rng.choice([-1, 1]) * (1 + 0.15 * course))


def zero_return(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The zero of the force sensor is wrong, and does not come back quite: it keeps some of the last loads.

    It reads P + value (1 + 0.3 m), m the mean of (P - 200)/40 over the touches before with weights 0.7^n. Return to
    zero of load cells (OIML R 60).
    """
    kept, zero = 0.0, np.zeros(len(r.tip))
    for i, load in enumerate(r.press.load):
        zero[i] = value * (1 + 0.3 * kept)
        kept = 0.7 * kept + 0.3 * (load - 200) / 40
    return replace(r, read_load=r.read_load + zero[r.touch])


def sinking_feet(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The rig stands on rubber feet that sink on one side: its tilt grows all the time, and the sensor tilts with it.

    It reads P (1 + v (0.3 + 0.7 t/T) sin(θ - φ)), v = `value`, φ within 30°, t the time and T the whole time. Side
    sensitivity of load cells.
    """
    tilt = 0.3 + 0.7 * r.time / r.time[-1]
    side = np.sin(np.radians(r.commanded - rng.uniform(-30, 30)))[r.touch]
    return replace(r, read_load=r.read_load * (1 + value * rng.choice([-1, 1]) * tilt * side))


def stop_screw(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Beyond an angle the arm leans on a stop screw, which takes more and more of the load past the sensor.

    It reads P (1 - v w ln(1 + exp((θ - θ_0)/w))/60°), v = `value`, w = 5°, θ_0 from -25° to 5°, or the same on the
    other side. Two springs side by side, the one with play.
    """
    over = (rng.choice([-1, 1]) * r.commanded - rng.uniform(-25, 5)) / 5
    share = value * 5 * np.logaddexp(0, over) / 60
    return replace(r, read_load=r.read_load * (1 - share)[r.touch])


def bowed_blade(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The blade is bowed sideways along its length, and elements feel the mean of the touches along it.

    Beside the mean it lies at value (s² - 1/3), s from -1 to 1 along the blade, `value` the height of the bow in mm;
    the side is drawn. Sampled at 12 places. A thin blade in a clamp with two screws.
    """
    finger, edge, side = r.finger, (r.tip == 0)[:, None], rng.choice([-1, 1])
    signal = np.zeros((len(r.tip), len(r.peak)))
    for s in (np.arange(12) + 0.5) / 12:
        beside = side * np.degrees(value * (s**2 - 1 / 3) / finger.body.outer)
        signal += finger.signal(replace(r.press, angle=r.press.angle + beside)) / 12
    return replace(r, signal=r.signal + np.where(edge, signal - finger.signal(r.press), 0.0)[r.touch])


def folding_burr(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The edge has a thin burr that stands under light loads and folds over under heavy ones: then it is blunt.

    Its pressure is even over value/(1 + exp(-(P - 195)/10)) mm, P in N/m: each wave is weighed with sin(q)/q, q = k
    times the width over 2 r_b. Burrs of a ground blade.
    """
    width = value / (1 + np.exp(-(r.press.load - 195) / 10))
    q = np.arange(MODES) * (width / (2 * r.finger.body.outer))[:, None]
    return edges_with(r, np.sinc(q / np.pi))


def stick_slip(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Tips stick and slip as they come down, and stop anywhere between the two: the shear load differs every time.

    Its share is value (0.2 + 0.8 U), U uniform from 0 to 1, anew for each touch; the side is drawn. Friction at rest
    and sliding (Rabinowicz, Friction and Wear of Materials, 1965).
    """
    share = value * rng.choice([-1, 1]) * (0.2 + 0.8 * rng.uniform(0, 1, len(r.tip)))
    return replace(r, press=replace(r.press, tangential=r.press.tangential + share))


def oily_rubber(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Oil bleeds from the rubber: sharp tips squeeze it out and drag, blunt ones float on it.

    The share of shear load is value/(1 + (a/1.5 mm)²), a the half-width of the contact; the side is drawn. A film of
    liquid takes the longer to squeeze out, the wider it is (Reynolds, 1886).
    """
    share = value * rng.choice([-1, 1]) / (1 + (half_width(r.finger, r.press) / 1.5) ** 2)
    return replace(r, press=replace(r.press, tangential=r.press.tangential + share))


def milling_steps(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The mould was milled in steps of equal depth, 1 mm: far apart at the top of the round, near at its sides.

    δκ = value cos(2π r_b cos(θ - θ_0)/1 mm - φ), 1/mm, θ_0 within 10° and φ any. Cusps of a ball-nosed cutter.
    """
    height = r.finger.body.outer * np.cos(np.radians(r.press.angle - rng.uniform(-10, 10)))
    course = np.cos(2 * np.pi * height - rng.uniform(-np.pi, np.pi))
    return replace(r, press=replace(r.press, hump=_no_hollow(r, value * course)))


def brush_marks(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The last coat of rubber was laid on with a brush: its hairs left waves of many lengths.

    δκ = value Σ N_k cos(kθ - φ_k)/√12, 1/mm, k from 8 to 31, N_k normal and φ_k any. Levelling of paint takes short
    waves away first (Orchard, 1962), and longer ones are no marks of hairs.
    """
    k = np.arange(8, 32)
    phase = rng.uniform(-np.pi, np.pi, len(k))
    course = np.cos(np.radians(r.press.angle)[:, None] * k - phase) @ rng.standard_normal(len(k)) / np.sqrt(12)
    return replace(r, press=replace(r.press, hump=_no_hollow(r, value * course)))


def turned_pressure(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """Pressure stays normal to the surface, which turns as it takes the shape of the tip: it pushes the rubber aside.

    Each half of the load lies a/2 beside the middle and is turned by a/(2 R), away from it, a the half-width and R the
    radius of the contact. The share `value` of that, and of the finite-element table. Follower loads (Bathe, Finite
    Element Procedures, 1996).
    """
    finger, press = r.finger, r.press
    half = half_width(finger, press)
    turned = half / 2 * (1 / finger.body.outer + 1 / np.maximum(press.tip, 0.05))
    change = finite_strain(finger, press, value)
    for side in (-1, 1):
        there = replace(
            press, tip=np.zeros(len(r.tip)), angle=press.angle + side * np.degrees(half / 2 / finger.body.outer)
        )
        dragged = finger.signal(replace(there, tangential=side * turned)) - finger.signal(
            replace(there, tangential=0.0)
        )
        change += value * dragged / 2
    return replace(r, signal=r.signal + change[r.touch])


def tight_skin(r: Recording, value: float, rng: np.random.Generator) -> Recording:
    """The surface is stretched as it sinks in, and its tension carries a part of the load to the sides.

    Each wave is weighed with 1/(1 + 0.3 v e² q²), v = `value`, e the indentation over the thickness h, q = k h/r_b: a
    membrane, a third as thick as the layer, whose tension goes with e². The rubber follows the finite-element table by
    the share `value`, too.
    """
    finger, thick = r.finger, r.finger.body.outer - r.finger.body.core
    strain = indentation(finger, r.press) / thick
    q = np.arange(MODES) * thick / finger.body.outer
    shares = spectrum(finger, r.press) * (1 / (1 + 0.3 * value * np.outer(strain**2, q**2)) - 1)
    change = waves(finger, r.press, shares) + finite_strain(finger, r.press, value)
    return replace(r, signal=r.signal + change[r.touch])


EFFECTS = (
    Effect("prober_eccentricity", "worm drive", "before", 0.3, 5.0, worm_drive),
    Effect("prober_eccentricity", "slipping belt", "before", 0.3, 5.0, slipping_belt),
    Effect("load_offset", "cold and warm", "before", 5.0, 80.0, cold_and_warm),
    Effect("load_offset", "zero return", "before", 5.0, 80.0, zero_return),
    Effect("load_misalignment", "sinking feet", "before", 0.1, 0.6, sinking_feet),
    Effect("load_misalignment", "stop screw", "before", 0.1, 0.5, stop_screw),
    Effect("blunt_edge", "bowed blade", "after", 0.5, 4.0, bowed_blade),
    Effect("blunt_edge", "folding burr", "after", 0.5, 4.0, folding_burr),
    Effect("tangential_load", "stick-slip", "before", 0.1, 1.0, stick_slip),
    Effect("tangential_load", "oily rubber", "before", 0.1, 1.0, oily_rubber),
    Effect("surface_profile", "milling steps", "before", 0.01, 0.05, milling_steps),
    Effect("surface_profile", "brush marks", "before", 0.01, 0.05, brush_marks),
    Effect("finite_strain", "turned pressure", "after", 0.3, 1.5, turned_pressure),
    Effect("finite_strain", "tight skin", "after", 0.3, 1.5, tight_skin),
)
