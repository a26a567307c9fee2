"""Which of the real candidates of a round is added, and which cannot be told apart from it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from search_cases import DRIFT, paired, priced, tried

from bayestouch.diagnosis import choice


def test_as_good_is_within_two_standard_errors() -> None:
    """Differences of 1 ± 1 over 9 touches: a sum of 9 with a standard error of 3 sqrt(9/8) = 3.18, 2.8 of them."""
    best = tried(**paired(*np.zeros(9)))
    shape = np.array([1.0, -1, 1, -1, 1, -1, 1, -1, 0])  # sum 0, sample variance 1: standard error 3
    assert choice.as_good(tried(**paired(*(shape - 5.99 / 9))), best)
    assert not choice.as_good(tried(**paired(*(shape - 6.01 / 9))), best)
    assert choice.as_good(tried(**paired(*(shape + 50))), best)
    assert not choice.as_good(tried(), best) and not choice.as_good(best, tried())


def test_names_of_what_cannot_be_told_apart() -> None:
    shape = np.array([1.0, -1, 1, -1, 1, -1, 1, -1, 0])
    added = tried("added", **paired(*np.zeros(9)))
    others = [tried("like", **paired(*shape)), tried("worse", **paired(*(shape - 1))), added]
    noise = tried("noise", noise=SimpleNamespace(), **paired(*shape))
    assert choice.indistinguishable_from(added, [*others, noise]) == ("like",)
    assert choice.indistinguishable_from(noise, others) == ()


def test_price_is_schwarz_criterion() -> None:
    assert choice.schwarz_criterion(priced("a", 12.0, 3)) == pytest.approx(12 + 1.5 * np.log(100))


def test_the_plainest_of_those_as_good() -> None:
    """Two parameters more cost log 100 = 4.6."""
    best, plain = priced("best", 10.0, 3), priced("plain", 14.5, 1, sign=-1.0)
    assert choice.most_probable([best, plain]) is plain
    dear = priced("dear", 14.7, 1, sign=-1.0)
    assert choice.most_probable([best, dear]) is best
    far = priced("far", 1.0, difference=np.zeros(9) - np.array([9.0, 8, 9, 8, 9, 8, 9, 8, 9]))
    assert choice.most_probable([best, far]) is best
    noise = tried("noise", noise=SimpleNamespace())
    assert choice.most_probable([noise, plain]) is noise
    assert choice.most_probable([best, noise]) is best


@pytest.mark.parametrize(("of_means", "cause"), [(45.0, False), (45.1, True)])
def test_a_cause_goes_before_a_random_function(of_means: float, cause: bool) -> None:
    """Where it does more than nine tenths of what that does, though it gains less density."""
    drift = tried(effect=DRIFT, **paired(*np.full(9, 9.0)))
    far = tried("far", of_means=of_means, **paired(*np.arange(9.0) / 10))
    less = tried("less", of_means=20.0, **paired(*np.arange(9.0) / 10))
    assert choice.most_probable([drift, less, far]) is (far if cause else drift)
    assert choice.most_probable([drift]) is drift
    # A cause that changes with time can follow what the function is.
    far.effect.follows_time = True
    assert choice.most_probable([drift, less, far]) is drift
