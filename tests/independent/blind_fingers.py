"""Fingers of the blind study: two rubbers, two orders of touches, and effects of `blind_forms`."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from .dataset import Simulated
from .effects import Effect
from .finger import SMALL, Design, Recording, build, record
from .sizes import OutOfReach, applied, size, value_of_size

#: Shear modulus (MPa) and depth of the elements (mm): the paper's finger, and a stiff one with deeper elements.
RUBBERS = {"soft": (0.054, 10.3), "stiff": (0.15, 9.9)}
#: "scan": by tip and angle, as on a rig; "random": shuffled within calibration, within touches and within the exam.
ORDERS = ("scan", "random")
#: Touches of the exam are for scoring alone: 6 tips at 13 places are enough for a standard error.
SIZES = {"small": replace(SMALL, exam_step=3.0), "whole": Design(exam_step=3.0)}
#: A size that no value up to the effect's largest reaches is replaced by the next of these that one does.
LADDER = (5.0, 3.0, 2.0, 1.5, 1.0, 0.7, 0.5)


def design(kind: str, rubber: str) -> Design:
    """A small finger (8 elements) or a whole one (16, as the practice fingers) of a rubber."""
    modulus, depth = RUBBERS[rubber]
    return replace(SIZES[kind], modulus=modulus, depth=depth)


def in_order(recording: Recording, order: str, rng: np.random.Generator) -> Recording:
    """The plan in another order if it is "random": tips and angles change places within each table, times stay."""
    if order == "scan":
        return recording
    ends = np.cumsum((0, *recording.parts))
    place = np.concatenate([rng.permutation(np.arange(a, b)) for a, b in pairwise(ends)])
    tip, angle = recording.tip[place], recording.commanded[place]
    return replace(recording, tip=tip, commanded=angle, press=replace(recording.press, tip=tip, angle=angle))


def planned(of: Design, order: str, seed: int) -> Recording:
    """A finger and its touches, before any effect."""
    of_finger, of_plan, of_order = (np.random.default_rng([seed, stream]) for stream in (0, 1, 3))
    return in_order(record(of, build(of, of_finger), of_plan), order, of_order)


def within_reach(plain: Recording, effect: Effect, wanted: float, seed: int, index: int = 0) -> tuple[float, float]:
    """The largest size of the ladder, `wanted` or below, that the effect reaches, and its value.

    `index` is its place among the effects of the finger.

    Raises
    ------
    OutOfReach
        It reaches not even the smallest.
    """
    for each in LADDER:
        if each <= wanted:
            try:
                return each, value_of_size(plain, effect, each, seed, index)
            except OutOfReach:
                continue
    raise OutOfReach(f"{effect.key}: no value up to {effect.largest:g} leaves {LADDER[-1]:g} times the noise")


def simulate(of: Design, order: str, wanted: list[tuple[Effect, float]], seed: int) -> Simulated:
    """A finger and its touches under effects of the `wanted` sizes or those next in reach, with `truth` of both.

    Raises
    ------
    OutOfReach
        An effect reaches no size of the ladder.
    """
    plain = planned(of, order, seed)
    found = [(effect, *within_reach(plain, effect, each, seed, i)) for i, (effect, each) in enumerate(wanted)]
    recording = applied(plain, [(effect, value) for effect, _, value in found], seed)
    of_noise = np.random.default_rng([seed, 2])
    readings = recording.signal + recording.error + of.noise_sd * of_noise.standard_normal(recording.signal.shape)
    loads = recording.read_load + of.force_sd * of_noise.standard_normal(len(recording.time))
    truth: dict[str, object] = {
        "seed": seed,
        "effects": {effect.key: value for effect, _, value in found},
        "sizes": {effect.key: each for effect, each, _ in found},
        "size": size(recording),
    }
    return Simulated(of, recording, readings, loads, truth)
