"""The command line as people meet it: help, JSON, completion, colours, Ctrl-C, a first data set."""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from known_fingers import dataset, known_touches

import bayestouch
from bayestouch.chain.kernel_choice import kernel_names
from bayestouch.commands.cli import cli, main
from bayestouch.commands.options import KERNELS
from bayestouch.data.dataset import save_dataset
from bayestouch.data.touches import touches_from
from bayestouch.errors import InputError

COMMAND = [sys.executable, "-m", "bayestouch"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("interface") / "finger"
    save_dataset(dataset(known_touches(1, step=3.0)), path)
    return path


def strict_json(text: str) -> dict[str, Any]:
    def refuse(name: str) -> None:
        raise AssertionError(f"{name} in JSON")

    loaded = json.loads(text, parse_constant=refuse)
    assert isinstance(loaded, dict)
    return loaded


@pytest.mark.parametrize("verb", list(cli.commands))
def test_each_verb_has_an_example_that_it_would_take(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([verb, "--help"]) == 0
    text = capsys.readouterr().out
    example = re.search(rf"^\s*Example: bayestouch {verb}( .+)$", text, re.MULTILINE)
    assert example, text
    # parsed, not run: unknown options and missing ones raise
    cli.commands[verb].make_context(verb, example[1].split())
    assert "--json" in text and "--quiet" in text


def test_verbs_come_in_the_order_of_work(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    listed = re.findall(r"^  (\w+)  +\S", capsys.readouterr().out.partition("Commands:")[2], re.MULTILINE)
    assert listed == list(cli.commands)
    assert listed[:4] == ["init", "check", "calibrate", "infer"]


def test_json_of_the_verbs_that_print(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def run(*arguments: str) -> dict[str, Any]:
        assert main([*arguments, "--json"]) == 0
        return strict_json(capsys.readouterr().out)

    calibration, posterior = str(tmp_path / "c.nc"), str(tmp_path / "p.nc")
    found = run("calibrate", str(folder), "-o", calibration, "--draws", "100")
    saved = bayestouch.load(calibration)
    assert isinstance(saved, bayestouch.Calibration)
    assert found["statistics"]["lack_of_fit"] == pytest.approx(saved.statistics["lack_of_fit"])
    assert found["notes"] == list(saved.notes)
    found = run("infer", f"{folder}/touches.csv", "--calibration", calibration, "-o", posterior, "--draws", "128")
    read = bayestouch.load(posterior)
    assert isinstance(read, bayestouch.TouchPosteriors)
    assert found["touches"] == len(read.rows.touch)
    assert found["ess_bulk_least"] == pytest.approx(read.sample_stats["ess_bulk"].min())
    assert run("simulate", "-o", str(tmp_path / "s"), "--seed", "3")["seed"] == 3
    assert len(run("init", str(tmp_path / "new"))["files"]) == 3


def test_check_says_what_is_there_and_what_lacks(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "check.png"
    assert main(["check", str(folder), "--plot", str(picture)]) == 0
    text = capsys.readouterr().out
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert "test finger: a finger of 7 elements" in text
    table = known_touches(1, step=3.0)
    means = table.averaged()
    for e in range(7):
        line = next(line for line in text.splitlines() if line.startswith(f"e{e + 1:02d} "))
        shown = float(line.split()[2])
        # four digits are shown
        assert shown == pytest.approx(np.abs(means.readings[:, e]).max(), rel=1e-3)
        assert float(line.split()[4]) == pytest.approx(np.sqrt(means.pure_error_variance[e]), rel=0.05)  # two digits
    assert "no reading without contact" in text
    assert "no touch is repeated" not in text and "no flat" not in text
    assert main(["check", str(folder), "--json"]) == 0
    facts = strict_json(capsys.readouterr().out)
    assert [table["touches"] for table in facts["tables"]] == [means.n_touches] * 2


def test_check_advises_on_what_is_missing() -> None:
    whole = known_touches(1, step=3.0)
    poor = whole.select((whole.sample == 0) & (whole.indenter_radius_mm == 0) & (whole.angle_deg < 15))
    advice = " ".join(bayestouch.check(dataset(poor)).facts["advice"])
    # pitch 8.8: edges up to 12° leave out the elements at 17.6 and 26.4
    for words in ("no knife edge within half a pitch (4.4°) of e06, e07", "no flat", "no touch is repeated"):
        assert words in advice
    blind = bayestouch.check(dataset(whole.with_(load=np.full(whole.n_rows, np.nan)))).facts["advice"]
    assert any(line.startswith("cannot be calibrated: no calibration touch has a measured load") for line in blind)
    assert "errors of the load cannot be given" in " ".join(blind)


def test_a_started_data_set_is_refused_by_name_until_it_is_filled_in(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    new = tmp_path / 'my "first" finger'
    assert main(["init", str(new), "--elements", "3"]) == 0
    command = capsys.readouterr().out.partition("what was read: ")[2]
    assert shlex.split(command) == ["bayestouch", "check", str(new)]
    assert main(["init", str(new), "--quiet"]) == 2
    assert "exists already" in capsys.readouterr().err
    sensor = new / "sensor.toml"
    for key, value in (("core_radius_mm", 9.4), ("outer_radius_mm", 12.7), ("sensing_radius_mm", 9.9)):
        with pytest.raises(InputError, match=rf"sensor.toml, row \d+, column geometry\.{key}"):
            bayestouch.load_dataset(new)
        sensor.write_text(sensor.read_text("utf-8").replace(f"{key} = 0 ", f"{key} = {value} "), "utf-8")
    with pytest.raises(InputError, match="element_angles_deg: expected one number for each element"):
        bayestouch.load_dataset(new)
    sensor.write_text(sensor.read_text("utf-8").replace("[]", "[-8.8, 0.0, 8.8]"), "utf-8")
    for line in ("noise_sd_N_per_m", "shear_modulus_MPa", "poisson_ratio", "unit", "quantity", "made_by", "date"):
        sensor.write_text(sensor.read_text("utf-8").replace(f"# {line} =", f"{line} ="), "utf-8")
    with pytest.raises(InputError, match=r"calibration\.csv"):
        bayestouch.load_dataset(new)
    for name in ("calibration.csv", "touches.csv"):
        with (new / name).open("a") as stream:
            stream.write("0,0,0,1.5,200,10,20,30\n1,0,inf,1.5,200,11,21,31\n")
    filled = bayestouch.load_dataset(new)
    assert filled.sensor.name == new.name
    assert filled.sensor.rubber.shear_modulus_MPa == 0.15
    assert filled.touches.n_touches == 2
    assert not filled.notes


def test_a_started_pad(tmp_path: Path) -> None:
    bayestouch.new_dataset(tmp_path, body="pad", elements=4)
    sensor = tmp_path / "sensor.toml"
    text = sensor.read_text("utf-8").replace("element_x_mm = []", "element_x_mm = [0, 0, 5, 5]")
    sensor.write_text(text.replace("# element_y_mm = []", "element_y_mm = [0, 5, 0, 5]"), "utf-8")
    with (tmp_path / "touches.csv").open("a") as stream:
        stream.write("0,0,,1,2,0.5,1,2,3,4\n")
    (tmp_path / "calibration.csv").unlink()
    assert bayestouch.load_dataset(tmp_path).touches.readings.tolist() == [[1, 2, 3, 4]]
    with pytest.raises(InputError, match="expected finger or pad"):
        bayestouch.new_dataset(tmp_path / "other", body="glove")


def environment(**changes: str) -> dict[str, str]:
    kept = {name: value for name, value in os.environ.items() if name not in ("NO_COLOR", "FORCE_COLOR")}
    return {**kept, "TERM": "xterm", **changes}


def test_completion_is_what_the_documentation_says() -> None:
    script = subprocess.run(
        COMMAND, env=environment(_BAYESTOUCH_COMPLETE="bash_source"), capture_output=True, text=True, check=False
    )
    if "bash" in script.stderr.lower() and script.returncode:
        pytest.skip(f"no bash that click completes for: {script.stderr.strip()}")
    assert "complete" in script.stdout and "bayestouch" in script.stdout
    for words, count, wanted in (
        ("bayestouch ca", 1, {"calibrate"}),
        ("bayestouch calibrate --k", 2, {"--kernel"}),
        ("bayestouch infer --method ", 3, {"emcee", "importance"}),
    ):
        done = subprocess.run(
            COMMAND,
            env=environment(_BAYESTOUCH_COMPLETE="bash_complete", COMP_WORDS=words, COMP_CWORD=str(count)),
            capture_output=True,
            text=True,
            check=False,
        )
        assert {line.partition(",")[2] for line in done.stdout.split()} == wanted


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="no pseudo-terminals on this system")
@pytest.mark.parametrize(("changes", "coloured"), [({}, True), ({"NO_COLOR": "1"}, False)])
def test_colours_on_a_terminal_unless_refused(changes: dict[str, str], coloured: bool, tmp_path: Path) -> None:
    ours, theirs = os.openpty()
    arguments = [*COMMAND, "check", "absent"]
    with subprocess.Popen(arguments, stderr=theirs, stdout=theirs, env=environment(**changes), cwd=tmp_path) as process:
        process.wait(60)
    os.close(theirs)
    text = os.read(ours, 10_000).decode()
    os.close(ours)
    assert "no such folder" in text
    assert ("\x1b[" in text) is coloured


@pytest.mark.slow
def test_no_colours_and_no_bar_in_a_file(folder: Path, tmp_path: Path) -> None:
    arguments = [*COMMAND, "calibrate", str(folder), "-o", str(tmp_path / "c.nc"), "--draws", "100"]
    done = subprocess.run(arguments, capture_output=True, text=True, env=environment(), check=True)
    assert "\x1b" not in done.stdout + done.stderr
    assert "%|" not in done.stderr


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="signals as on Unix")
def test_control_c_ends_in_one_line_and_leaves_nothing(tmp_path: Path) -> None:
    with subprocess.Popen(
        [*COMMAND, "report", "-o", "out"],
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        # whoever runs the tests in the background may ignore the signal, and the command would inherit that
        preexec_fn=partial(signal.signal, signal.SIGINT, signal.SIG_DFL),
    ) as process:
        # the temporary folder appears when the work begins: minutes after the start on a busy machine, and before it
        # the interpreter itself ends the command
        for _ in range(6000):
            if list(tmp_path.iterdir()) or process.poll() is not None:
                break
            time.sleep(0.05)
        assert list(tmp_path.iterdir()), "the work has not begun in five minutes"
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        out, error = process.communicate(timeout=60)
    assert process.returncode == 130
    assert error == "bayestouch: stopped, nothing was written\n"
    assert out == ""
    assert not list(tmp_path.iterdir())


def test_control_c_in_infer_says_how_to_go_on(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["calibrate", str(folder), "-o", str(tmp_path / "c.nc"), "--draws", "100", "--quiet"]) == 0

    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("bayestouch.inference.infer_to_file", interrupted)
    arguments = [
        "infer",
        f"{folder}/touches.csv",
        "--calibration",
        str(tmp_path / "c.nc"),
        "-o",
        str(tmp_path / "p.nc"),
    ]
    assert main(arguments) == 130
    assert capsys.readouterr().err == "bayestouch: stopped; repeat the same command to continue\n"
    shutil.rmtree(tmp_path / "p.nc.partial", ignore_errors=True)


def test_a_check_in_a_notebook_escapes_names() -> None:
    touches = touches_from(touch=[0, 1], readings=[[1.0] * 7, [2.0] * 7])
    named = replace(dataset(touches).sensor, name="<b>x</b>")
    html = bayestouch.check(bayestouch.DataSet(named, None, touches))._repr_html_()
    assert "<b>" not in html and "&lt;b&gt;" in html and "cannot be calibrated" in html


def test_every_kernel_can_be_chosen_and_is_described() -> None:
    """`kernel="constant"` could be given in Python alone, and nothing said so."""
    assert sorted(KERNELS.choices) == sorted(["auto", *kernel_names(1)])
    described = (bayestouch.calibrate.__doc__ or "").split("kernel : {")[1].split("}")[0]
    assert sorted(described.replace('"', "").split(", ")) == sorted(KERNELS.choices)
