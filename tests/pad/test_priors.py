"""What a pad's calibration assumes and needs: as many touches as there is to find."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch.chain.kernels import GaussianKernel
from bayestouch.data.averages import TouchMeans
from bayestouch.errors import InputError
from bayestouch.pad.priors import check_identifiable


def line_of_touches(read: tuple[int, ...]) -> TouchMeans:
    """Eight places on a line; of each element the first few touches have a reading."""
    t, m = 8, len(read)
    readings = np.where(np.arange(t)[:, None] < np.array(read), 1.0, np.nan)
    unknown = np.full(t, np.nan)
    return TouchMeans(
        np.arange(t), readings, np.isfinite(readings).astype(np.int64), np.full(m, np.nan), np.zeros(m),
        np.ones(t), unknown, unknown, unknown, None, np.linspace(0, 7, t), None,
    )  # fmt: skip


def test_every_element_needs_a_reading_more_than_it_has_unknowns() -> None:
    """Gain, offset and one coordinate: four readings are enough, three are not, unless the element is not used."""
    kernel, both = GaussianKernel(6.0), np.array([True, True])
    check_identifiable(line_of_touches((8, 4)), kernel, both)
    few = line_of_touches((8, 3))
    with pytest.raises(InputError, match=r"3 calibration touches have a reading.*at least 4") as caught:
        check_identifiable(few, kernel, both)
    assert caught.value.column == "e02"
    check_identifiable(few, kernel, np.array([True, False]))
