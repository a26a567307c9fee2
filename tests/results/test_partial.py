"""The lock of the files of a run excludes other runs, also when the run that had it is complete."""

from __future__ import annotations

from pathlib import Path

import pytest

from bayestouch.errors import InputError
from bayestouch.results import partial
from bayestouch.results.partial import partial_folder


def test_the_lock_of_a_removed_file_is_no_lock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A second run waits for the lock of a first; the first is complete and removes the folder with the lock file."""
    pytest.importorskip("fcntl")
    target, waits, locked = tmp_path / "p.nc", [], partial._locked

    def after_the_first_run(stream: object, until: float) -> bool:
        if not waits:
            waits.append(stream)
            with monkeypatch.context() as first:
                first.setattr(partial, "_locked", lambda *_: True)
                with partial_folder(target, "first") as run:
                    run.file.write_text("first")
                    run.deliver()
            assert not run.folder.exists()
        return locked(stream, until)  # type: ignore[arg-type]

    monkeypatch.setattr(partial, "PATIENCE", 0.2)
    monkeypatch.setattr(partial, "_locked", after_the_first_run)
    with partial_folder(target, "second") as run:
        assert target.read_text() == "first" and run.layout() is None
        assert run.folder.is_dir()
        with pytest.raises(InputError, match="another run is writing"), partial_folder(target, "third"):
            pass
        run.file.write_text("second")
        run.deliver()
    assert target.read_text() == "second" and list(tmp_path.iterdir()) == [target]


def test_the_lock_is_removed_last(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another run may begin as soon as it is gone, and its files must not be removed."""
    with partial_folder(tmp_path / "p.nc", "x") as run:
        run.file.touch()
        run.begin("")
        run.add(0)
        seen: list[list[str]] = []
        monkeypatch.setattr(
            partial.shutil, "rmtree", lambda folder, **_: seen.append([file.name for file in folder.iterdir()])
        )
        run.deliver()
    assert seen == [["lock"]]


@pytest.mark.parametrize("written", [False, True])
def test_a_run_that_wrote_nothing_leaves_nothing(tmp_path: Path, written: bool) -> None:
    """As where no scheduler answers; what was written is kept for the run that goes on from it."""
    with pytest.raises(InputError, match="no scheduler"), partial_folder(tmp_path / "p.nc", "x") as run:
        if written:
            run.file.touch()
        raise InputError("no scheduler answers")
    assert run.folder.exists() == written


def test_an_error_after_the_file_is_delivered_is_that_error(tmp_path: Path) -> None:
    """The folder is gone by then; the file stays."""
    with pytest.raises(InputError, match="later"), partial_folder(tmp_path / "p.nc", "x") as run:
        run.file.touch()
        run.deliver()
        raise InputError("later")
    assert [file.name for file in tmp_path.iterdir()] == ["p.nc"]
