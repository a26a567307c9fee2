"""What all tests of studies share."""

from __future__ import annotations

from collections.abc import Iterator

import pytest


@pytest.fixture(autouse=True)
def look() -> Iterator[None]:
    """The look of the studies' pictures stays theirs."""
    import matplotlib

    with matplotlib.rc_context():
        yield
