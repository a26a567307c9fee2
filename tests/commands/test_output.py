"""An output that cannot be written, or that is an input, is refused before anything is computed."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from known_fingers import dataset, known_touches

import bayestouch
from bayestouch.commands.cli import main
from bayestouch.commands.output import check_folder, check_output
from bayestouch.errors import InputError


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A data set, and files that are as good as others until they are read; computing is refused."""
    bayestouch.save_dataset(dataset(known_touches(1, step=30.0)), tmp_path / "fing")
    for name in ("t.csv", "cal.nc", "model.toml", "earlier.nc"):
        (tmp_path / name).write_text(name)
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "lost.nc").symlink_to(Path("new") / "lost.nc")
    monkeypatch.chdir(tmp_path)

    def computed(*_: object, **__: object) -> None:
        raise AssertionError("computed")

    for name in ("calibrate", "diagnose", "report", "check"):
        monkeypatch.setattr(bayestouch, name, computed)
    return tmp_path


@pytest.mark.parametrize(
    "command",
    [
        "infer t.csv --calibration cal.nc -o cal.nc",
        "infer t.csv --calibration cal.nc -o fing/../t.csv",
        "calibrate fing -o fing/touches.csv",
        "calibrate fing -o fing/sensor.toml",
        "calibrate fing -o earlier.nc --like earlier.nc",
        "calibrate fing -o model.toml --model model.toml",
        "check fing --plot fing/calibration.csv",
    ],
)
def test_an_input_is_not_overwritten(command: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    assert main(command.split()) == 2
    error = capsys.readouterr().err.strip()
    assert "is read, so that it cannot be the output too" in error and "\n" not in error
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before


def test_a_table_through_a_link_is_not_overwritten_either(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("link.csv").symlink_to("t.csv")
    assert main(["infer", "t.csv", "--calibration", "cal.nc", "-o", "link.csv"]) == 2
    assert "link.csv: is read, so that it cannot be the output too" in capsys.readouterr().err
    assert Path("t.csv").read_text() == "t.csv"


def test_python_does_not_overwrite_its_table_either(tmp_path: Path) -> None:
    from bayestouch.inference import Options, infer_to_file

    (tmp_path / "t.csv").write_text("touch,e01\n")
    with pytest.raises(InputError, match=r"t\.csv: is read"):
        infer_to_file(tmp_path / "t.csv", None, tmp_path / "t.csv", Options())  # type: ignore[arg-type]
    assert (tmp_path / "t.csv").read_text() == "touch,e01\n"


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("calibrate fing -o t.csv/c.nc", "t.csv/c.nc: cannot be written: Not a directory"),
        ("diagnose fing -o t.csv/diagnosis", "t.csv/diagnosis: cannot be written: Not a directory"),
        ("report fing -o t.csv/a/report", "t.csv/a/report: cannot be written: Not a directory"),
        ("report fing -o t.csv", "t.csv: expected the name of a folder to write"),
        ("calibrate fing -o fing", "fing: expected the name of a file to write"),
        ("calibrate fing -o new/c.nc", "new: the folder to write into does not exist"),
        (f"calibrate fing -o {'c' * 300}", f"{'c' * 300}: cannot be written: File name too long"),
        ("calibrate fing -o pipe", "pipe: expected the name of a file to write, this is no regular file"),
        (
            "infer t.csv --calibration cal.nc -o pipe",
            "pipe: expected the name of a file to write, this is no regular file",
        ),
        ("check fing --plot pipe", "pipe: expected the name of a file to write, this is no regular file"),
        ("calibrate fing -o lost.nc", "new: the folder to write into does not exist"),
        (f"check {'a' * 300}", f"{'a' * 300}: File name too long"),
        (f"infer {'a' * 300} --calibration cal.nc -o p.nc", f"{'a' * 300}: File name too long"),
    ],
)
def test_what_cannot_be_written_or_looked_at_is_one_line(
    command: str, words: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = sorted(folder.rglob("*"))
    assert main(command.split()) == 2
    error = capsys.readouterr().err.strip()
    assert words in error and "\n" not in error
    assert sorted(folder.rglob("*")) == before


@pytest.mark.parametrize("command", ["simulate -o fing", "example finger -o fing", "example fluid-oil-1.5 -o fing"])
def test_a_data_set_that_was_measured_is_not_replaced(
    command: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = {path: path.read_bytes() for path in (folder / "fing").iterdir()}
    assert main(command.split()) == 2
    error = capsys.readouterr().err.strip()
    assert "fing/sensor.toml: exists already and is not replaced: the data set is not simulated" in error
    assert {path: path.read_bytes() for path in (folder / "fing").iterdir()} == before


def test_a_data_set_that_was_simulated_is_replaced(folder: Path) -> None:
    (folder / "fing" / "truth.json").write_text("{}")
    assert main(["example", "finger", "-o", "fing", "--quiet"]) == 0
    assert bayestouch.load_dataset("fing").touches.n_touches == 126


def test_a_folder_that_is_closed_is_known_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Root may write everywhere, so the system is asked in place of the file system."""
    closed, touch = tmp_path / "closed", Path.touch
    closed.mkdir()

    def refused(self: Path, mode: int = 0o666, exist_ok: bool = True) -> None:
        if self.parent == closed:
            raise PermissionError(13, "Permission denied", str(self))
        touch(self, mode, exist_ok)

    monkeypatch.setattr(Path, "touch", refused)
    for check, name in (
        (check_output, "c.nc"),
        (check_folder, "report"),
        (check_folder, "a/report"),
        (check_folder, ""),
    ):
        with pytest.raises(InputError, match="cannot be written: Permission denied"):
            check(closed / name)
    check_folder(tmp_path / "open")
    check_output(tmp_path / "c.nc")
    assert list(tmp_path.iterdir()) == [closed]
