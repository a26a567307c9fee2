"""Fixtures for every test."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

# Posterior files say when they were made; tests compare files to the last byte.
os.environ.setdefault("SOURCE_DATE_EPOCH", "1795000000")

ROOT = Path(__file__).resolve().parent.parent


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the slow tests, if any are chosen: one that begins last is waited for by every other core."""
    items.sort(key=lambda item: item.get_closest_marker("slow") is None)


@pytest.fixture(scope="session")
def shared_folder() -> Path:
    """Folder of measured and practice data: `$BAYESTOUCH_SHARED` or else `../shared` beside the checkout."""
    named = os.environ.get("BAYESTOUCH_SHARED")
    folder = Path(named) if named else ROOT.parent / "shared"
    if folder.is_dir():
        return folder
    if named:
        pytest.fail(f"$BAYESTOUCH_SHARED names {named}, which is no folder")
    pytest.skip("no shared data: set $BAYESTOUCH_SHARED, or put the folder `shared` beside the checkout")
