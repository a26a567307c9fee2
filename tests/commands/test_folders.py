"""``bayestouch`` without a command: what the folder holds, and a next step that runs as it is printed."""

from __future__ import annotations

import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from known_fingers import dataset, known_touches

import bayestouch
from bayestouch.commands.cli import cli, main
from bayestouch.commands.folders import next_step_in, workplace
from bayestouch.errors import nearest, unknown_name


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data set, its calibration and its posteriors."""
    folder = tmp_path_factory.mktemp("made")
    data = dataset(known_touches(1, step=3.0))
    bayestouch.save_dataset(data, folder / "my-finger")
    calibration = bayestouch.calibrate(data, draws=40)
    calibration.save(folder / "calibration.nc")
    few = data.touches.select(data.touches.touch < 4)
    bayestouch.infer(few, calibration, draws=64, method="importance").save(folder / "posterior.nc")
    return folder


def folder_with(made: Path, where: Path, *names: str) -> Path:
    """A folder with some of what was made; a diagnosis and a report are known by one file."""
    for name in names:
        if name in ("diagnosis", "report"):
            (where / name).mkdir()
            (where / name / f"{name}.json").write_text('{"verdict": "explained", "effects": [{"name": "crosstalk"}]}')
        elif (made / name).is_dir():
            shutil.copytree(made / name, where / name)
        else:
            shutil.copy(made / name, where)
    return where


CASES = [
    ((), "init my-finger"),
    (("my-finger",), "check my-finger"),
    (("my-finger", "calibration.nc"), "infer my-finger/touches.csv --calibration calibration.nc -o posterior.nc"),
    (("my-finger", "calibration.nc", "posterior.nc"), "diagnose my-finger -o diagnosis"),
    (("my-finger", "diagnosis"), "report my-finger --diagnosis diagnosis -o report --open"),
    (("my-finger", "report"), "diagnose my-finger -o diagnosis"),
    (
        ("my-finger", "diagnosis", "report"),
        "infer my-finger/touches.csv --calibration diagnosis/calibration_after.nc -o posterior.nc",
    ),
    (("calibration.nc",), "infer touches.csv --calibration calibration.nc -o posterior.nc"),
]


@pytest.mark.parametrize(("names", "expected"), CASES)
def test_the_next_step_goes_with_what_is_there(
    names: tuple[str, ...],
    expected: str,
    made: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(folder_with(made, tmp_path, *names))
    assert main([]) == 0
    found, _, rest = capsys.readouterr().out.partition("\n")
    for name in names:
        assert name in found
    first = rest.split("\n")[1].strip()
    assert first == f"bayestouch {expected}"
    for command, purpose in next_step_in(Path()).commands:
        _, verb, *arguments = shlex.split(command)
        cli.commands[verb].make_context(verb, arguments)  # parsed, not run: unknown options and missing ones raise
        assert purpose in rest


def test_inside_each_folder(made: Path, tmp_path: Path) -> None:
    whole = folder_with(made, tmp_path, "my-finger", "calibration.nc", "diagnosis", "report")
    assert next_step_in(whole / "my-finger").commands[0][0] == "bayestouch check ."
    inside = next_step_in(whole / "diagnosis")
    assert inside.found == "Diagnosis: explained, effects found: crosstalk."
    assert "--calibration calibration_after.nc" in inside.commands[0][0]
    shutil.copy(whole / "calibration.nc", whole / "report")
    assert "index.html" in next_step_in(whole / "report").found
    assert "--calibration calibration.nc" in next_step_in(whole / "report").commands[0][0]


def test_a_table_without_a_sensor(made: Path, tmp_path: Path) -> None:
    """A touch table of any name is recognised by its columns, other tables are not; a calibration reads it."""
    shutil.copy(made / "my-finger" / "touches.csv", tmp_path / "monday.csv")
    (tmp_path / "prices.csv").write_text("touch,price\n1,2\n")
    step = next_step_in(tmp_path)
    assert step.found == "Table of touches: monday.csv. No sensor.toml says which sensor it is of."
    assert step.commands[0][0] == "bayestouch init my-finger" and "monday.csv takes the place" in step.commands[0][1]
    folder_with(made, tmp_path, "calibration.nc", "posterior.nc")
    read, show = next_step_in(tmp_path).commands
    assert read[0].startswith("bayestouch infer monday.csv --calibration calibration.nc -o posterior-of-new-touches.nc")
    assert "posterior.nc" in show[0]
    shutil.copy(tmp_path / "monday.csv", tmp_path / "touches.csv")
    assert workplace(tmp_path).tables == ("touches.csv", "monday.csv")


def test_a_started_data_set_is_filled_in_first(made: Path, tmp_path: Path) -> None:
    assert main(["init", str(tmp_path / "started"), "--quiet"]) == 0
    step = next_step_in(tmp_path)
    assert "Fill in sensor.toml, calibration.csv and touches.csv" in step.found
    assert [command for command, _ in step.commands] == ["bayestouch check started"]
    shutil.copy(made / "my-finger" / "touches.csv", tmp_path / "started")
    assert next_step_in(tmp_path).found == "Data set: started."


def test_steps_lead_from_a_data_set_to_its_posterior(
    made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each printed command runs, and the next one is another."""
    monkeypatch.chdir(folder_with(made, tmp_path, "my-finger", "calibration.nc"))
    step = shlex.split(next_step_in(Path()).commands[0][0])[1:]
    assert main([*step, "--draws", "64", "--method", "importance", "--quiet"]) == 0
    assert next_step_in(Path()).commands[0][0].startswith("bayestouch diagnose")


def test_the_command_for_a_posterior_prints_its_touches(made: Path, tmp_path: Path) -> None:
    folder = folder_with(made, tmp_path, "posterior.nc")
    command = shlex.split(next_step_in(folder).commands[0][0])
    assert command[:2] == ["python", "-c"]
    done = subprocess.run([sys.executable, *command[1:]], cwd=folder, capture_output=True, text=True, check=True)
    rows = [line.split()[0] for line in done.stdout.splitlines() if line.strip()]
    assert set("0123") <= set(rows)


def test_other_files_are_no_posteriors(tmp_path: Path) -> None:
    (tmp_path / "calibration.nc").write_bytes(b"\x89HDF\r\n\x1a\n damaged")
    (tmp_path / "other.nc").write_text("text")
    here = workplace(tmp_path)
    assert here.calibrations == here.posteriors == ()
    assert workplace(tmp_path / "absent").datasets == ()


def test_what_may_not_be_looked_at_is_left_out(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Folders of other users; root may look everywhere, so the system is asked in place of the file system."""
    where, is_file = folder_with(made, tmp_path, "my-finger"), Path.is_file
    shutil.copytree(where / "my-finger", where / "closed")

    def refused(self: Path) -> bool:
        if self.parent.name == "closed":
            raise PermissionError(13, "Permission denied", str(self))
        return is_file(self)

    monkeypatch.setattr(Path, "is_file", refused)
    assert workplace(where).datasets == ("my-finger",)
    assert workplace(where / "closed").datasets == ()
    assert workplace(where / ("a" * 300)).datasets == ()


def test_the_newest_comes_first(made: Path, tmp_path: Path) -> None:
    import os

    for age, name in enumerate(("old", "new", "oldest")):
        shutil.copytree(made / "my-finger", tmp_path / name)
        os.utime(tmp_path / name, (1e9 - 1000 * age * (1 if name == "oldest" else -1),) * 2)
    assert workplace(tmp_path).datasets == ("new", "old", "oldest")


def test_wrong_input_says_what_to_do(
    made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = folder_with(made, tmp_path, "my-finger", "calibration.nc", "posterior.nc")
    monkeypatch.chdir(folder)
    (folder / "empty").mkdir()
    infer = ["infer", "my-finger/touches.csv", "-o", "p.nc", "--calibration"]
    for arguments, fix in (
        (["check", "absent"], "start a data set with: bayestouch init absent"),
        (["check", "."], "no data set; data sets in it: my-finger"),
        (["check", "empty"], "start one with: bayestouch init empty"),
        (["check", "my-finger/touches.csv"], "did you mean my-finger?"),
        (["calibrate", "my-finger", "-o", "absent/c.nc"], "make it with: mkdir -p absent"),
        (["calibrate", "my-finger"], "Example: bayestouch calibrate my-finger -o calibration.nc"),
        (["calibrate", "my-finger", "-o", "c.nc", "--model", "found"], "bayestouch diagnose my-finger -o found"),
        (
            ["infer", "my-finger", "--calibration", "calibration.nc", "-o", "p.nc"],
            "did you mean my-finger/touches.csv?",
        ),
        ([*infer, "absent.nc"], "did you mean calibration.nc?"),
        ([*infer, "posterior.nc"], "found posteriors of touches; did you mean calibration.nc?"),
        ([*infer, "empty/c.nc"], "make one with: bayestouch calibrate my-finger -o empty/c.nc"),
        (["report", "my-finger", "-o", "r", "--diagnosis", "empty"], "bayestouch diagnose my-finger -o empty"),
        (["effects", "crostalk"], "did you mean crosstalk?"),
        (["simulate", "-o", "s", "--effect", "crostalk=0.1"], "did you mean crosstalk?"),
        (["calibrat"], "Did you mean 'calibrate'?"),
        (["effects", "drift"], "did you mean baseline_drift or gain_drift?"),
        (["simulate", "-o", "s", "--effect", "creep.tme=1"], "known are share, time; did you mean time?"),
        (["simulate", "-o", "s", "--body", "fingr"], "did you mean finger?"),
        (["example", "fluid-oil", "-o", "s"], "did you mean fluid-oil-1.5?"),
        (["calibrate", "my-finger", "-o", "c.nc", "--contact", "Hertz"], "did you mean hertz?"),
        (["calibrate", "my-finger", "-o", "c.nc", "--kernel", "gausian"], "did you mean gaussian?"),
        (["calibrate", "my-finger", "-o", "c.nc", "--discrepancy", "plce"], "did you mean place?"),
        (["calibrate", "my-finger", "-o", "c.nc", "--prior", "sgma=normal:0.4,0.1"], "did you mean sigma?"),
        (["calibrate", "my-finger", "-o", "c.nc", "--prior", "sigma=nromal:0.4,0.1"], "did you mean normal?"),
        (["calibrate", "my-finger", "-o", "c.nc", "--groups", "log_liklihood"], "did you mean log_likelihood?"),
        (["calibrate", "my-fingr", "-o", "c.nc"], "did you mean my-finger?"),
        (["infer", "my-finger/touch.csv", "--calibration", "calibration.nc", "-o", "p.nc"], "my-finger/touches.csv?"),
        ([*infer, "calibration.nc", "--indenter", "unifrm"], "did you mean uniform?"),
        ([*infer, "calibration.nc", "--indenter", "rc=normal:3,1"], "did you mean r_c?"),
        ([*infer, "calibration.nc", "--method", "emce"], "did you mean emcee?"),
        ([*infer, "calibratoin.nc"], "did you mean calibration.nc?"),
    ):
        assert main(arguments) == 2, arguments
        error = capsys.readouterr().err.strip()
        assert fix in error and "\n" not in error, (arguments, error)
    assert not {"absent", "p.nc", "r", "s", "c.nc"} & {each.name for each in folder.iterdir()}


def test_a_wrong_model_is_asked_for_by_the_right_name(
    made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A diagnosis beside the wrong name, the nearest of two, its model.toml, and a wrong effect in it."""
    monkeypatch.chdir(folder_with(made, tmp_path, "my-finger", "diagnosis"))
    Path("diagnosis/model.toml").write_text('[[effect]]\nname = "crep"\n')
    Path("other").mkdir()
    shutil.copy("diagnosis/diagnosis.json", "other")
    calibrate = ["calibrate", "my-finger", "-o", "c.nc", "--model"]
    for arguments, fix in (
        ([*calibrate, "wrongname"], "did you mean "),
        ([*calibrate, "diagnosi"], "did you mean diagnosis?"),
        ([*calibrate, "diagnosi/model.toml"], "did you mean diagnosis?"),
        ([*calibrate, "diagnosis/modl.toml"], "did you mean diagnosis/model.toml?"),
        ([*calibrate, "diagnosis"], "unknown effect 'crep'; did you mean creep?"),
        (["report", "my-finger", "-o", "r", "--diagnosis", "diagnoses"], "did you mean diagnosis?"),
    ):
        assert main(arguments) == 2, arguments
        error = capsys.readouterr().err.strip()
        assert fix in error and "\n" not in error, (arguments, error)


def test_questions_about_names() -> None:
    known = ("gain_drift", "baseline_drift", "crosstalk", "creep_by_element")
    for wrong, question in (
        ("cross-talk", "crosstalk"),
        ("CrossTalk", "crosstalk"),
        ("Creep by element", "creep_by_element"),
        ("drift", "gain_drift or baseline_drift"),
        ("gain", "gain_drift"),
    ):
        assert nearest(wrong, known) == f"; did you mean {question}?"
    assert nearest("soft", known) == "" == nearest("", known)
    assert str(unknown_name("effect", "soft", known)) == f"unknown effect 'soft'; known are {', '.join(known)}"
    many = [*known, *(f"other{i}" for i in range(5))]
    assert str(unknown_name("effect", "crostalk", many)) == "unknown effect 'crostalk'; did you mean crosstalk?"


@pytest.mark.parametrize("there", [True, False])
def test_a_page_is_opened_or_its_path_is_said(
    there: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    import webbrowser

    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", lambda address: opened.append(address) or there)

    def written(first: object, second: object, output: Path, **options: object) -> bayestouch.Comparison:
        return bayestouch.Comparison(output, {"sentences": ["They agree."], "parameters": []})

    monkeypatch.setattr("bayestouch.compare", written)
    monkeypatch.setattr("bayestouch.commands.report.calibration_at", lambda path: None)
    arguments = ["report", "a.nc", "b.nc", "-o", str(tmp_path / "out")]
    assert main(arguments) == 0 and not opened
    assert main([*arguments, "--open", "--quiet"]) == 0
    assert opened == [(tmp_path / "out" / "index.html").as_uri()]
    assert ("open it yourself" in capsys.readouterr().err.replace(f"{tmp_path / 'out' / 'index.html'}", "it")) != there
