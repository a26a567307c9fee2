"""Files are written together or not at all, and it is known beforehand whether they can be."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from bayestouch.data.files import check_not_read, check_room, check_writable, path_of, replacing, write_together
from bayestouch.errors import InputError


def test_a_folder_of_the_name_of_one_file_keeps_all_files_as_they_were(tmp_path: Path) -> None:
    names = [tmp_path / name for name in ("a", "b", "c")]
    for path in (names[0], names[2]):
        path.write_text("old")
    names[1].mkdir()
    with pytest.raises(InputError, match="b: expected the name of a file to write, this is a folder"):
        write_together({path: lambda temporary: temporary.write_text("new") and None for path in names})
    assert sorted(tmp_path.iterdir()) == names and [names[0].read_text(), names[2].read_text()] == ["old", "old"]


def test_what_is_no_path_is_refused(tmp_path: Path) -> None:
    assert path_of("a") == path_of(Path("a")) == Path("a")
    for write in (path_of, check_writable, lambda path: replacing(path).__enter__()):
        with pytest.raises(InputError, match=r"^expected a path, got None$"):
            write(None)  # type: ignore[arg-type]


def test_a_pipe_is_no_file_to_write(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to("pipe")
    for path in (tmp_path / "pipe", tmp_path / "link"):
        with pytest.raises(InputError) as caught, replacing(path):
            raise AssertionError("written")
        assert str(caught.value) == f"{path}: expected the name of a file to write, this is no regular file"
    assert (tmp_path / "pipe").is_fifo() and (tmp_path / "link").is_symlink()


@pytest.mark.parametrize("before", ["old", None])
def test_of_a_link_the_file_is_written_to_which_it_leads(tmp_path: Path, before: str | None) -> None:
    """As `open` writes, and with it numpy and pandas: also where the file does not exist yet."""
    folder, link = tmp_path / "folder", tmp_path / "link"
    folder.mkdir()
    if before is not None:
        (folder / "file").write_text(before)
    link.symlink_to(Path("folder") / "file")
    with replacing(link) as temporary:
        temporary.write_text("new")
    assert link.is_symlink() and (folder / "file").read_text() == "new"
    assert [each.name for each in folder.iterdir()] == ["file"]


@pytest.mark.parametrize("name", ["n" * 255, "µ" * 127])
def test_the_longest_names_can_be_written(tmp_path: Path, name: str) -> None:
    check_writable(tmp_path / name)
    with replacing(tmp_path / name) as temporary:
        temporary.write_text("here")
    assert [(each.name, each.read_text()) for each in tmp_path.iterdir()] == [(name, "here")]


def test_what_cannot_be_written_is_known_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    check_writable(tmp_path / "new" / "folders" / "c.nc")
    assert [each.name for each in tmp_path.iterdir()] == ["file"], "the trial leaves nothing"
    for path, words in (("file/c.nc", "Not a directory"), ("n" * 256, "File name too long")):
        with pytest.raises(InputError, match=rf"cannot be written: {words}"):
            check_writable(tmp_path / path)

    def refused(self: Path, mode: int = 0o666, exist_ok: bool = True) -> None:
        raise PermissionError(13, "Permission denied", str(self))

    monkeypatch.setattr(Path, "touch", refused)  # root may write everywhere
    with pytest.raises(InputError, match=r"c\.nc: cannot be written: Permission denied"):
        check_writable(tmp_path / "c.nc")


def test_an_input_is_no_output(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("t.csv").touch()
    Path("other.csv").touch()
    Path("link.csv").symlink_to("t.csv")
    check_not_read("other.csv", ["t.csv", "absent.csv"])
    check_not_read("absent.csv", ["t.csv", "absent.csv"])
    for name in ("t.csv", tmp_path / "t.csv", "link.csv"):
        with pytest.raises(InputError, match=r"\.csv: is read, so that it cannot be the output too"):
            check_not_read(name, ["other.csv", "./t.csv"])


def test_room_is_asked_of_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []
    monkeypatch.setattr(os, "posix_fallocate", lambda file, start, size: asked.append(size), raising=False)
    for size in (0, 44_000):
        check_room(tmp_path / "room", size)
    assert asked == [44_000] and not (tmp_path / "room").exists()
