"""Errors of rest readings that touches share: found from the touches, left where there are none or another cause."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rest_rows import DESIGN, dataset

import bayestouch
from bayestouch.model.body import body_of
from bayestouch.model.fitting import Fitted
from bayestouch.model.rest_errors import begun_with_rest, rest_errors
from bayestouch.model.split_data import CORRECTED_REST, SplitData


def begun(data: bayestouch.DataSet) -> tuple[SplitData, Fitted]:
    split, body = SplitData.of(data), body_of(data.sensor)
    options = body.own({"contact": None, "kernel": None})
    return split, body.begin(split, draws=8, seed=0, **options).fitted


@pytest.mark.slow
def test_the_touches_show_the_errors_of_their_rest_readings() -> None:
    """What is left of the errors is small, and as large as its sd: a hundred touches know an offset well."""
    left = []
    for seed in range(4):
        data, errors = dataset(seed)
        found = rest_errors(begun(data)[1], begun(data)[0])
        assert found is not None
        # The mean is subtracted: its error is in the readings with the other sign.
        left.append(found + errors)
    scatter = float(np.sqrt(np.mean(np.square(left))))
    # The means of the rest rows have errors of NOISE/√ROWS = 10. Seventy touches of eight samples alone tell an offset
    # to NOISE/√560 = 0.85 if nothing else is unknown; gains, depths, angles and the rubber share what they tell.
    assert 0.7 < scatter < 2.0


def test_nothing_is_changed_where_nothing_is_shared_or_another_cause_is_there() -> None:
    plain = bayestouch.simulate(DESIGN, seed=1).dataset
    split, fitted = begun(plain)
    assert rest_errors(fitted, split) is None and split.rest_offsets(fitted.model.known.means.touch) is None
    data, _ = dataset(1, effect=0.2)
    split, fitted = begun(data)
    # An effect that is larger than its scatter allows by chance: its offsets are not those of rest readings.
    few = replace(split, shared_reads=np.full((2, 5), 1e6))
    assert rest_errors(fitted, few) is None


def test_readings_and_rest_reading_are_corrected_together() -> None:
    data, errors = dataset(2)
    body = body_of(data.sensor)
    options = body.own({"contact": None, "kernel": None})
    before = SplitData.of(data)
    after, start = begun_with_rest(body, before, draws=8, seed=0, **options)
    assert after.removed is not None and CORRECTED_REST in after.notes and before.rest is not None
    np.testing.assert_allclose(after.rest, before.rest + after.removed[0])
    # Rows without contact have a mean of zero before and after: whoever subtracts it again changes nothing.
    moved = np.where(before.table.in_contact[:, None], after.removed[before.session], 0.0)
    np.testing.assert_allclose(after.table.readings, before.table.readings - moved)
    assert np.abs(after.removed + errors).max() < 4.0 < np.abs(errors).max()
    assert start.fitted.linear.cost() < body.begin(before, draws=8, seed=0, **options).fitted.linear.cost()
