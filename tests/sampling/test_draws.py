"""Draws of which fewer are kept."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.sampling.draws import empty_draws, thinned


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
