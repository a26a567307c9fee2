"""Which forms of the independent simulator the catalogue's own formulas can take on: `Effect.in_catalogue`, checked.

A form is a member where some plausible values of the catalogue's formula do the same, to 1 % of what the form changes
in the readings. The catalogue's formula is fitted to the form's signals by least squares, with a gain for each element
left free, because every calibration fits one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from independent import finger as independent_finger
from independent.dataset import EFFECTS, LISTED, UNLISTED
from independent.effects import Effect
from independent.finger import SMALL, Recording, build, record
from independent.sizes import applied, value_of_size
from scipy.optimize import least_squares, minimize_scalar

from bayestouch.chain.recording import History
from bayestouch.chain.recording import Recording as Ours
from bayestouch.effects import catalogue
from bayestouch.effects.effect import Effect as Catalogued
from bayestouch.effects.effect import EffectParameter
from bayestouch.effects.listing import FINGER
from bayestouch.effects.random import RandomEffect

#: A form that leaves no more than this share of what it does is one that the catalogue's formula can be.
MEMBER = 0.01
#: A value is plausible within so many standard deviations of its prior.
PLAUSIBLE_SD = 3.0
SEED = 3
# In the middle of the study's sizes; values of larger ones are often beyond what is plausible.
SIZE = 2.0

READOUT = [effect for effect in LISTED if effect.when == "after"]


@pytest.fixture(scope="module")
def plain() -> Recording:
    of_finger, of_plan = (np.random.default_rng([SEED, stream]) for stream in range(2))
    return record(SMALL, build(SMALL, of_finger), of_plan)


def as_ours(r: Recording) -> Ours:
    """The same touches as the catalogue's formulas take them."""
    first, last = r.time[:: r.n_samples], r.time[r.n_samples - 1 :: r.n_samples]
    return Ours(
        indenter_radius_mm=r.tip[r.touch],
        place=(r.commanded[r.touch],),
        load=r.read_load,
        time_s=r.time,
        held_s=r.time - first[r.touch],
        element_place=(r.finger.angle,),
        peak=r.peak,
        reference_load=independent_finger.REFERENCE_LOAD,
        signal=r.signal,
        history=History(last, r.by_touch(r.signal)),
    )


def catalogued(name: str, r: Recording) -> Catalogued:
    """The catalogue's effect as it suits these touches."""
    span = float(r.time[-1] - r.time[0])
    gap = SMALL.touch_interval - (SMALL.samples - 1) * SMALL.sample_interval
    setting = replace(FINGER, n_elements=8, element_place=(SMALL.angles,), span_s=span, gap_s=gap)
    return next(effect for effect in catalogue(setting) if effect.name == name)


def without_gains(signal: np.ndarray, model: np.ndarray) -> np.ndarray:
    """What is left of `signal` (n, m) when `model` is scaled for each element."""
    return signal - (signal * model).sum(axis=0) / (model * model).sum(axis=0) * model


def plausible(parameter: EffectParameter) -> tuple[float, float]:
    """Lowest and highest coordinate of a fit: within three sd of the prior, and where the prior is."""
    mean, sd, low, high = parameter.normal_prior
    if np.isfinite([low, high]).all():
        return low, high
    return max(low, mean - PLAUSIBLE_SD * sd), min(high, mean + PLAUSIBLE_SD * sd)


def share_left(form: np.ndarray, base: Ours, effect: Catalogued, rows: np.ndarray) -> float:
    """What the catalogue's best plausible values leave of what the form does, rms over rms."""
    size = np.linalg.norm(without_gains(form, base.signal)[rows])
    if isinstance(effect, RandomEffect):
        shortest = min(effect.parameters[1].probes)
        time = (float(base.time_s[0]), float(base.time_s[-1]))
        basis = effect.basis(base.time_s, (1.0, shortest, 1.0), *time)
        rest = np.empty_like(form)
        for element, scale in enumerate(effect.scale(base).T):
            columns = np.column_stack([basis * scale[:, None], base.signal[:, element]])
            rest[:, element] = form[:, element] - columns @ np.linalg.lstsq(columns, form[:, element], rcond=None)[0]
        return float(np.linalg.norm(rest[rows]) / size)
    low, high = np.array([plausible(each) for each in effect.parameters]).T

    def rest_of(coordinates: np.ndarray) -> np.ndarray:
        values = tuple(each.from_unconstrained(x) for each, x in zip(effect.parameters, coordinates, strict=True))
        return np.asarray(without_gains(form, effect.signal(base, values))[rows].ravel() / size)

    found = []
    for probe in effect.probes:
        start = [each.to_unconstrained(value) for each, value in zip(effect.parameters, probe, strict=True)]
        inside = np.clip(start, low + 1e-3 * (high - low), high - 1e-3 * (high - low))
        fit = least_squares(rest_of, inside, bounds=(low, high), x_scale=0.1 * (high - low), max_nfev=60)
        found.append(np.sqrt(2 * fit.cost))
        if found[-1] < 0.1 * MEMBER:
            break
    return float(min(found))


@pytest.mark.parametrize("effect", READOUT, ids=lambda effect: effect.key)
def test_a_form_of_the_readings_is_a_member_where_the_catalogue_leaves_nothing_of_it(
    effect: Effect, plain: Recording
) -> None:
    base = plain.pressed()
    value = value_of_size(plain, effect, SIZE, SEED)
    form = applied(plain, [(effect, value)], SEED).signal
    # the scan before a touch is another touch's, which the catalogue leaves out of account
    rows = base.sample > 0 if effect.name == "channel_lag" else np.full(len(base.sample), True)
    left = share_left(form, as_ours(base), catalogued(effect.name, base), rows)
    assert (left < MEMBER) == effect.in_catalogue, f"{effect.key}: {left:.2g} of it is left"


def around(r: Recording) -> np.ndarray:
    """With a constant, which the angles of the elements or their gains absorb."""
    turn = np.radians(r.commanded)
    return np.column_stack([np.ones(len(turn)), np.sin(turn), np.cos(turn)])


#: What a form changes in the poses or loads, and what the catalogue's formula can be, linear in its values.
POSES: dict[str, tuple[Callable[[Recording], np.ndarray], Callable[[Recording], np.ndarray]]] = {
    "prober_eccentricity: two harmonics": (lambda r: r.press.angle - r.commanded, around),
    "load_offset: breathing": (
        lambda r: r.by_touch(r.read_load) - r.press.load,
        lambda r: np.ones((len(r.tip), 1)),
    ),
    "load_misalignment: cosine": (lambda r: r.by_touch(r.read_load) / r.press.load - 1, around),
    "tangential_load: sublinear": (lambda r: np.asarray(r.press.tangential), lambda r: np.ones((len(r.tip), 1))),
}


@pytest.mark.parametrize("key", POSES)
def test_a_form_of_the_pose_is_a_member_where_the_catalogue_leaves_nothing_of_it(key: str, plain: Recording) -> None:
    effect, (change, family) = EFFECTS[key], POSES[key]
    changed = effect.apply(plain, effect.start, np.random.default_rng(SEED))
    what, columns = change(changed), family(changed)
    rest = what - columns @ np.linalg.lstsq(columns, what, rcond=None)[0]
    assert (np.linalg.norm(rest) < MEMBER * np.linalg.norm(what)) == effect.in_catalogue


def left_by_best(form: np.ndarray, base: np.ndarray, model: Callable[[float], np.ndarray], most: float) -> float:
    """As `share_left`, of a catalogue's formula with one value between 0 and `most`."""
    size = np.linalg.norm(without_gains(form, base))
    best = minimize_scalar(
        lambda value: np.linalg.norm(without_gains(form, model(value))), bounds=(1e-3, most), method="bounded"
    )
    return float(best.fun / size)


@pytest.mark.parametrize("key", ["blunt_edge: flat land", "blunt_edge: round"])
def test_a_blunt_edge_is_a_member_where_a_round_one_does_the_same(key: str, plain: Recording) -> None:
    effect = EFFECTS[key]
    changed = applied(plain, [(effect, effect.start)], SEED)
    form, base = (plain.by_touch(each.signal) for each in (changed, plain.pressed()))

    def rounded(radius: float) -> np.ndarray:
        press = replace(plain.press, tip=np.where(plain.tip == 0, radius, plain.tip))
        return plain.finger.signal(press)

    assert (left_by_best(form, base, rounded, 4.0) < MEMBER) == effect.in_catalogue


def test_an_aperture_is_a_member_where_a_running_mean_does_the_same(
    plain: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    effect = EFFECTS["aperture: triangle"]
    value = value_of_size(plain, effect, SIZE, SEED)
    form, base = (plain.by_touch(each.signal) for each in (applied(plain, [(effect, value)], SEED), plain.pressed()))
    # the catalogue's window: the mean over a width of twice the half-width that `aperture` holds
    monkeypatch.setattr(independent_finger, "_window", lambda x: np.sinc(x / np.pi))

    def averaged(half_width: float) -> np.ndarray:
        return plain.finger.signal(replace(plain.press, aperture=half_width))

    assert (left_by_best(form, base, averaged, 4.0) < MEMBER) == effect.in_catalogue


def test_every_form_says_why() -> None:
    assert all(effect.reason for effect in LISTED)
    assert not any(effect.in_catalogue for effect in UNLISTED)
    checked = {*(effect.key for effect in READOUT), *POSES, "blunt_edge: flat land", "blunt_edge: round"}
    errors = {effect.key for effect in LISTED if effect.when == "error"}
    assert {effect.key for effect in LISTED} == checked | errors | {"aperture: triangle"}
