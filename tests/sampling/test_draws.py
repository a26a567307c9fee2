"""Draws of which fewer are kept."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.sampling.draws import Demands, empty_draws, grade, thinned


def test_draws_that_are_kept_are_evenly_spaced() -> None:
    """Of 4 chains of 10 draws, 9 draws in all are 3 of each chain: numbers 0, 3 and 6; 40 and more are all draws."""
    made = empty_draws(4, 10, 1, 2, 1)
    numbers = np.arange(40.0).reshape(4, 10, 1)
    made = replace(made, draws=np.stack([numbers, -numbers], axis=-1), log_density=numbers)
    kept = thinned(made, 9)
    assert kept.draws[1, :, 0, 0].tolist() == kept.log_density[1, :, 0].tolist() == [10.0, 13.0, 16.0]
    assert kept.ess_bulk.shape == kept.rhat.shape == (1, 2)
    assert thinned(made, 40) is made
    assert thinned(made, 21).draws.shape == (4, 6, 1, 2)


def test_chains_that_stay_where_they_began_have_an_infinite_rhat() -> None:
    """Between chains the draws differ, within them they do not: the ratio of the variances is infinite."""
    made = empty_draws(4, 8, 2, 1, 1)
    made.draws[..., 0, 0] = np.arange(4.0)[:, None]
    made.draws[..., 1, 0] = 7.0
    grade(made, slice(None), Demands())
    assert made.worst_rhat.tolist() == [np.inf, np.inf]
    assert not made.grade.any()
