"""Fixtures for every test."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

# Posterior files say when they were made; tests compare files to the last byte.
os.environ.setdefault("SOURCE_DATE_EPOCH", "1795000000")

ROOT = Path(__file__).resolve().parent.parent


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the slow tests, if any are chosen: one that begins last is waited for by every other core."""
    items.sort(key=lambda item: item.get_closest_marker("slow") is None)


@pytest.fixture(scope="session")
def workers_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that all workers of a run share, so that nothing long is computed twice."""
    own = tmp_path_factory.getbasetemp()
    shared = (own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "of_all_workers"
    shared.mkdir(exist_ok=True)
    return shared


@pytest.fixture(scope="session")
def made_once(workers_folder: Path) -> Callable[[str, Callable[[Path], object]], Path]:
    """The folder of this name, after a function has written it: once for all workers of a run."""

    def folder(name: str, write: Callable[[Path], object]) -> Path:
        done = workers_folder / name
        if not done.exists():
            partial = workers_folder / f"{name}.{os.getpid()}"
            write(partial)
            if not done.exists():  # another worker may have been as quick
                partial.rename(done)
        return done

    return folder


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
