"""Content of the file of a diagnosis: which numbers can be given."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from bayestouch.diagnosis import numbers
from bayestouch.diagnosis.numbers import _has_repeats, _in_place, _named, _not_distinguishable, _place_or_time
from bayestouch.diagnosis.place_or_time import PlaceOrTime


@pytest.mark.parametrize(
    ("held_out", "freedom", "known"),
    [
        (SimpleNamespace(repeated=True), [8.0, np.nan], True),
        # one sample of each held-out touch tells nothing of the noise, whatever the other touches tell
        (SimpleNamespace(repeated=False), [8.0, np.nan], False),
        (SimpleNamespace(repeated=True), [0.0, np.nan], False),
        # without held-out touches those of the fit decide alone
        (None, [8.0, np.nan], True),
        (None, [0.0, np.nan], False),
    ],
)
def test_noise_is_known_where_touches_have_several_samples(
    held_out: SimpleNamespace | None, freedom: list[float], known: bool
) -> None:
    """Of the touches of the fit, and of those that are held out if there are any."""
    means = SimpleNamespace(pure_error_dof=np.array(freedom))
    fitted = SimpleNamespace(model=SimpleNamespace(known=SimpleNamespace(means=means)))
    traced = SimpleNamespace(before=SimpleNamespace(held_out=held_out, fitted=fitted))
    assert _has_repeats(traced) is known  # type: ignore[arg-type]


def test_pairs_that_are_not_distinguishable() -> None:
    """Effects that were added and those like them, and drifts that functions of place equal in the last round."""
    like = SimpleNamespace(effect=SimpleNamespace(name="crosstalk"), indistinguishable=("aperture", "proximity"))
    tie, drift, place = (PlaceOrTime(name, {"times": (gain, 1.0)}) for name, gain in (("a", 1), ("b", 5), ("c", -5)))
    first = SimpleNamespace(added=like, place_or_time=(tie,))
    last = SimpleNamespace(added=None, place_or_time=(drift, tie, place))
    traced: Any = SimpleNamespace(rounds=(first, last))
    pairs = [["crosstalk", "aperture"], ["crosstalk", "proximity"], ["a", "something in place"]]
    assert _not_distinguishable(traced) == pairs


def test_a_drift_against_functions_of_place() -> None:
    found = _place_or_time(PlaceOrTime("gain_drift", {"times": (3.0, 2.0), "places": (-4.0, 2.0)}))
    assert found["drift"] == "gain_drift" and list(found["across"]) == ["times", "places"]
    assert found["across"]["times"] == pytest.approx({"elpd_gain": 3, "elpd_gain_se": 2, "probability": 0.9331928})
    assert found["across"]["places"]["probability"] == pytest.approx(0.0227501, rel=1e-5)


@pytest.mark.parametrize("there", [True, False])
def test_something_in_place_is_said_where_a_misfit_remains(monkeypatch: pytest.MonkeyPatch, there: bool) -> None:
    monkeypatch.setattr(numbers, "in_place", lambda fitted, before, after: {after: (3.0, 1.0)})
    last = SimpleNamespace(before=None, held_out=None, held_out_in_place="times")
    remaining = SimpleNamespace(after=SimpleNamespace(there=there))
    traced: Any = SimpleNamespace(rounds=(last,), remaining=remaining)
    assert _in_place(traced) == ({"times": {"elpd_gain": 3.0, "elpd_gain_se": 1.0}} if there else None)


@pytest.mark.parametrize(("there", "chance"), [(True, 3 / 7), (False, 1.0)])
def test_nothing_keeps_what_the_lack_of_fit_without_effects_leaves_it(there: bool, chance: float) -> None:
    """Written out: of three causes that were tried, and a p-value with the bound 1/4, the odds are 3 to 4."""
    p_value = brentq(lambda p: -np.e * p * np.log(p) - 0.25, 1e-9, 1 / np.e)
    tried = [SimpleNamespace(effect=SimpleNamespace(name=name, random=False)) for name in ("creep", "memory")]
    one = SimpleNamespace(tried=tried, added=None, place_or_time=(), before=SimpleNamespace(names=()))
    remaining = SimpleNamespace(before=SimpleNamespace(p_value=p_value, there=there))
    traced: Any = SimpleNamespace(rounds=(one,), added=(), remaining=remaining)
    for said in ("unattributed", "explained"):
        assert _named(traced, said).chance == pytest.approx(chance)
