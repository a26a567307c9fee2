"""What each touch contributes to the errors of a diagnosis, by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.diagnosis.change import _of_lack


@pytest.mark.parametrize(("freedom", "expected"), [(4.0, [5 * 3 / 4, 9 * 3 / 4, 0.0]), (0.5, [np.nan] * 3)])
def test_contributions_of_touches_to_the_lack_of_fit(freedom: float, expected: list[float]) -> None:
    """Squares of three touches over the freedom, so that their mean is the lack of fit: 14/4; unknown with none."""
    whitened = np.array([[1.0, 2.0], [3.0, 0.0], [0.0, 0.0]])
    held: Any = SimpleNamespace(observed=SimpleNamespace(n_touches=3), whitened=whitened, freedom=freedom)
    np.testing.assert_allclose(_of_lack(held), expected)
