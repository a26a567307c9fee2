"""The template of a data set, for names and sizes that are not ordinary."""

from __future__ import annotations

import os
import tomllib
from pathlib import Path

import pytest

from bayestouch.commands.cli import main
from bayestouch.data.tables import MAX_COLUMNS
from bayestouch.data.template import new_dataset
from bayestouch.errors import InputError


def test_a_folder_whose_name_is_no_text(tmp_path: Path) -> None:
    folder = Path(os.fsdecode(os.fsencode(tmp_path) + b"/f\xff"))
    try:
        folder.mkdir()
    except OSError as error:
        pytest.skip(f"no such names on this file system: {error}")
    assert len(new_dataset(folder)) == 3
    assert tomllib.loads((folder / "sensor.toml").read_text("utf-8"))["name"] == "f?"


@pytest.mark.parametrize("elements", [2.5, "a", 0])
def test_elements_are_a_whole_number(tmp_path: Path, elements: object) -> None:
    with pytest.raises(InputError, match=f"^elements: expected a whole number, at least 1, got {elements!r}$"):
        new_dataset(tmp_path / "none", elements=elements)  # type: ignore[arg-type]
    assert not (tmp_path / "none").exists()


def test_no_more_elements_than_a_table_has_columns(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for body, most in (("finger", MAX_COLUMNS - 5), ("pad", MAX_COLUMNS - 6)):
        _, table, _ = new_dataset(tmp_path / body, body=body, elements=most)
        assert len(table.read_text().split(",")) == MAX_COLUMNS
        with pytest.raises(InputError, match=f"elements: expected at most {most}, .*, got {most + 1}"):
            new_dataset(tmp_path / "more", body=body, elements=most + 1)
    assert main(["init", str(tmp_path / "more"), "--elements", "20000"]) == 2
    assert "got 20000" in capsys.readouterr().err
    assert not (tmp_path / "more").exists()


def test_a_table_of_the_other_format_is_not_joined_by_a_template(tmp_path: Path) -> None:
    (tmp_path / "touches.parquet").touch()
    with pytest.raises(InputError, match="exists already") as error:
        new_dataset(tmp_path)
    assert str(tmp_path / "touches.parquet") in str(error.value) and len(list(tmp_path.iterdir())) == 1
