"""Content of the file of a diagnosis: which numbers can be given."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from bayestouch.diagnosis.numbers import _has_repeats


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
