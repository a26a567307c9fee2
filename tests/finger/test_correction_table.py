"""The table of a finger's correction: where its locations are, and what each of its columns holds."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayestouch.finger import correction_table as module


def test_table_of_a_correction_that_is_known_in_closed_form(monkeypatch: pytest.MonkeyPatch) -> None:
    """Touched from -1.5 to 2.2 degree: half degrees from 5 degree below -2 to 5 degree above 3.

    Readings of 2 P + 3 P² + 5 P (P R). The sd is that of an edge under 10 N/m, where the third does nothing and the
    second, P² over P, is ten times the first: a variance of 0.25 + 100 0.01.
    """

    def columns(radius: np.ndarray, angle: np.ndarray, load: np.ndarray) -> np.ndarray:
        return np.stack([load, load**2, load**2 * radius / 1000])[..., None]

    model = SimpleNamespace(
        correction_inputs=lambda vector: (None, np.array([-1.5, 0.0, 2.2]), None),
        finger=SimpleNamespace(outer_radius_mm=16.0),
        reference_load=10.0,
    )
    monkeypatch.setattr(module, "finger_model", lambda model: model)
    monkeypatch.setattr(module, "weights_of", lambda fitted: (np.array([2.0, 3.0, 5.0]), np.diag([0.25, 0.01, 7.0])))
    fitted: Any = SimpleNamespace(model=model, vector=None)
    chosen: Any = SimpleNamespace(columns=columns)
    table = module.table_of(fitted, chosen)
    np.testing.assert_allclose(table.angle_deg, np.linspace(-7.0, 8.0, 31))
    for found, value in ((table.even, 2.0), (table.loaded, 3.0), (table.wide, 5.0), (table.sd, np.sqrt(1.25))):
        np.testing.assert_allclose(found, np.full((31, 1), value), rtol=1e-9)
