"""The forms of the blind studies: each changes readings, has the sizes that are asked for, and is none of today's."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from functools import cache
from itertools import pairwise
from typing import cast

import numpy as np
import pytest
from independent import blind_forms, dataset, fifth_forms, fourth_forms, second_forms, shape, third_forms
from independent.blind_fingers import LADDER, RUBBERS, design, planned, simulate, within_reach
from independent.catalogue_finger import finite_strain
from independent.effects import Effect, forms_of
from independent.finger import Recording
from independent.sizes import OutOfReach, applied, left_over, size, value_of_size
from study_modules import study

from bayestouch.effects import catalogue
from bayestouch.effects.listing import FINGER

SEED = 8700
#: What a multiple of a form of today leaves of a new one, rms over rms, at the least.
APART = 0.1
#: Registries by name, each with those whose forms it must not repeat.
REGISTRIES = {
    "first": blind_forms,
    "second": second_forms,
    "third": third_forms,
    "fourth": fourth_forms,
    "fifth": fifth_forms,
}
EARLIER = {
    "first": (dataset,),
    "second": (dataset, blind_forms),
    "third": (dataset, blind_forms, second_forms),
    "fourth": (dataset, blind_forms, second_forms, third_forms),
    "fifth": (dataset, blind_forms, second_forms, third_forms, fourth_forms),
}
OLDER = {name: {key: e for each in some for key, e in each.EFFECTS.items()} for name, some in EARLIER.items()}
STRUCTURE = [(name, e) for name, each in REGISTRIES.items() for e in each.LISTED if e.when != "error"]
ALL = {key: effect for each in REGISTRIES.values() for key, effect in each.EFFECTS.items()}


@cache
def plain(rubber: str = "stiff", order: str = "scan") -> Recording:
    return planned(design("small", rubber), order, SEED)


#: Effects of fingers that are younger than the five studies.
LATER = {"rest_offset"}


def largest_in_reach(of: Recording, effect: Effect) -> float:
    """The value at size 2, or at the largest size below that it reaches."""
    for wanted in LADDER:
        if wanted <= 2:
            try:
                return value_of_size(of, effect, wanted, SEED)
            except OutOfReach:
                continue
    raise AssertionError(f"{effect.key} reaches no size")


@pytest.mark.parametrize("name", REGISTRIES)
def test_every_effect_of_a_finger_has_new_forms_and_nothing_else(name: str) -> None:
    setting = replace(FINGER, n_elements=8, span_s=1000.0, gap_s=4.25)
    count = Counter(effect.name for effect in REGISTRIES[name].LISTED)
    assert count == {effect.name: 2 for effect in catalogue(setting) if effect.name not in LATER}


@pytest.mark.parametrize("name", REGISTRIES)
def test_no_form_is_one_of_today(name: str) -> None:
    older, new = OLDER[name], REGISTRIES[name]
    assert not set(older) & set(new.EFFECTS)
    assert not {effect.apply for effect in older.values()} & {e.apply for e in new.EFFECTS.values()}
    made_by_hand = {effect.name for effect in shape.MADE_BY_HAND}
    assert not {effect.name for effect in new.UNLISTED} & ({effect.name for effect in older.values()} | made_by_hand)
    assert len({effect.name for effect in new.UNLISTED}) >= 8
    assert all(effect.listed for effect in new.LISTED)
    assert not any(effect.listed for effect in new.UNLISTED)


def test_every_form_says_what_it_is() -> None:
    for effect in ALL.values():
        assert effect.apply.__doc__ and len(effect.apply.__doc__) > 80, effect.key


@pytest.mark.slow
@pytest.mark.parametrize("rubber", RUBBERS)
@pytest.mark.parametrize("key", ALL)
def test_a_form_changes_readings_and_has_the_size_asked_for(key: str, rubber: str) -> None:
    """The smallest size of all is reached by every form, on both rubbers; nothing happens at a value of zero."""
    effect, of = ALL[key], plain(rubber, "random")
    value = value_of_size(of, effect, LADDER[-1], SEED)
    changed = applied(of, [(effect, value)], SEED)
    assert size(changed) == pytest.approx(LADDER[-1], rel=0.01)
    assert size(applied(of, [(effect, 0.0)], SEED)) < 1e-9
    assert np.all(np.isfinite(changed.signal)) and np.all(np.isfinite(changed.error))


@cache
def course(effect: Effect) -> np.ndarray:
    """What base parameters leave of a form, at the size that it is compared at."""
    of = plain()
    # the search for a size would go through hollows, in which the contact of the development study is not defined
    value = effect.start if effect in shape.EFFECTS else largest_in_reach(of, effect)
    return left_over(applied(of, [(effect, value)], SEED)).ravel()


@pytest.mark.slow
@pytest.mark.parametrize(("name", "effect"), STRUCTURE, ids=lambda each: getattr(each, "key", each))
def test_a_form_is_no_multiple_of_an_earlier_one(name: str, effect: Effect) -> None:
    """Of what base parameters leave. Errors have no fixed course: their formulas were compared by reading them."""
    new = course(effect)
    olds = [course(each) for each in OLDER[name].values() if each.name == effect.name]
    if effect.name == "finite_strain":
        base = plain().pressed()
        table = replace(base, signal=base.signal + finite_strain(base.finger, base.press, 1.0)[base.touch])
        olds.append(left_over(table).ravel())
    assert olds
    for old in olds:
        rest = new - (new @ old) / (old @ old) * old
        assert np.linalg.norm(rest) > APART * np.linalg.norm(new), effect.key


def test_what_elements_feel_is_the_mean_of_the_signals_where_they_feel() -> None:
    """A tapered element beside elements at each of its places, by the finger's own signals."""
    of, length = plain().pressed(), 3.0
    (tapered,) = (effect for effect in forms_of(blind_forms.EFFECTS, "aperture") if effect.form == "tapered")
    got = tapered.apply(of, length, np.random.default_rng(1)).signal
    side = np.random.default_rng(1).choice([-1, 1])
    s = (np.arange(24) + 0.5) / 24
    share = s / s.sum()
    places = side * length * (s - share @ s)
    moved = [replace(of.finger, angle=of.finger.angle + np.degrees(x / of.finger.depth)) for x in places]
    wanted = sum(w * each.signal(of.press) for w, each in zip(share, moved, strict=True))
    np.testing.assert_allclose(of.by_touch(got), wanted, atol=1e-6 * of.peak.max())


def test_a_random_order_keeps_tables_and_times() -> None:
    scan, shuffled = plain(), plain(order="random")
    ends = np.cumsum((0, *scan.parts))
    assert np.array_equal(scan.time, shuffled.time)
    assert not np.array_equal(scan.commanded, shuffled.commanded)
    for a, b in pairwise(ends):
        rows = [np.column_stack([each.tip, each.commanded])[a:b].tolist() for each in (scan, shuffled)]
        assert sorted(rows[0]) == sorted(rows[1])
        assert np.array_equal(shuffled.press.tip[a:b], shuffled.tip[a:b])


def test_the_rubbers_are_the_paper_s_and_a_stiff_one() -> None:
    for rubber, (modulus, depth) in study("places_and_times").RUBBERS.items():
        of = design("small", rubber)
        assert (of.modulus, of.depth) == (modulus, depth)


def test_the_same_seed_gives_the_same_finger_under_every_effect() -> None:
    crosstalk = forms_of(blind_forms.EFFECTS, "crosstalk")[0]
    one, other = (simulate(design("small", "soft"), "scan", wanted, 5) for wanted in ([], [(crosstalk, 1.0)]))
    assert np.array_equal(one.recording.finger.depth, other.recording.finger.depth)
    assert np.array_equal(one.recording.press.load, other.recording.press.load)
    assert one.truth["size"] == pytest.approx(0, abs=1e-9)
    assert other.truth["size"] == pytest.approx(1, rel=0.01)


def test_the_second_effect_of_a_pair_has_the_size_asked_for() -> None:
    """With the course that it has on this finger, which is another one than if it were the first."""
    pair = [fourth_forms.EFFECTS[key] for key in ("load_offset: return spring", "baseline_drift: charge amplifiers")]
    made = simulate(design("small", "stiff"), "scan", [(effect, 1.0) for effect in pair], SEED)
    value, stated = (cast("dict[str, float]", made.truth[key])[pair[1].key] for key in ("effects", "sizes"))
    second = pair[1].apply(plain().pressed(), value, np.random.default_rng([SEED, 101]))
    assert stated == 1.0
    assert size(second) == pytest.approx(1.0, rel=0.01)


def test_a_size_out_of_reach_is_the_next_one_of_the_ladder() -> None:
    weight = next(effect for effect in blind_forms.LISTED if effect.form == "weight of tips")
    of = plain()
    got, value = within_reach(of, weight, 5.0, SEED)
    assert got in LADDER and got < 5
    assert value <= weight.largest
    for larger in LADDER[: LADDER.index(got)]:
        with pytest.raises(OutOfReach):
            value_of_size(of, weight, larger, SEED)
