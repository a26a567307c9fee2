"""The command line: one line and status 2 for whatever the user got wrong, nothing half written."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from known_fingers import dataset, known_touches

from bayestouch.commands.cli import main
from bayestouch.data.dataset import save_dataset


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("cli") / "finger"
    save_dataset(dataset(known_touches(1, step=3.0)), path)
    return path


def test_calibrate_and_infer(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    import xarray

    calibration, posterior = tmp_path / "calibration.nc", tmp_path / "posterior.nc"
    assert (
        main(["calibrate", str(folder), "-o", str(calibration), "--draws", "200", "--prior", "r_s=uniform:9.5,10.6"])
        == 0
    )
    assert "lack of fit" in capsys.readouterr().out
    arguments = ["infer", str(folder / "touches.csv"), "--calibration", str(calibration), "-o", str(posterior)]
    assert main([*arguments, "--draws", "256", "--quiet"]) == 0
    assert capsys.readouterr().out == ""
    with xarray.open_datatree(calibration, engine="h5netcdf") as tree:
        assert "uniform" in str(tree.attrs["parameters"]).lower()
        units = {"noise_sd": "counts", "discrepancy_sd": "counts", "force_noise_sd": "N/m", "mu": "MPa", "r_s": "mm"}
        for name, unit in units.items():
            assert tree["posterior"][name].attrs["units"] == unit
    with xarray.open_datatree(posterior, engine="h5netcdf") as tree:
        draws = tree["posterior"]
        assert draws["R"].dims == ("chain", "draw", "touch")
        assert draws["R"].attrs["units"] == "mm"
        assert draws["theta_c"].attrs["units"] == "degree"
        place = draws["theta_c"]
        z = (place.mean(("chain", "draw")) - tree["constant_data"]["theta_c"]) / place.std(("chain", "draw"))
        # inside the elements' span, where posteriors of locations are normal
        z = z.values[np.abs(tree["constant_data"]["theta_c"].values) < 25]
        assert np.mean(z**2) == pytest.approx(1, abs=4 * np.sqrt(2 / len(z)))


def test_tips_are_inferred(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    import xarray

    calibration, posterior = tmp_path / "calibration.nc", tmp_path / "posterior.nc"
    assert main(["calibrate", str(folder), "-o", str(calibration), "--draws", "40", "--quiet"]) == 0
    arguments = ["infer", str(folder / "touches.csv"), "--calibration", str(calibration), "-o", str(posterior)]
    assert main([*arguments, "--indenter", "tips:0,inf", "--draws", "128", "--method", "importance", "--quiet"]) == 0
    with xarray.open_datatree(posterior, engine="h5netcdf") as tree:
        flat = tree["tips"]["tip_probability"].sel(tip="inf")
        inside = np.abs(tree["constant_data"]["theta_c"]) < 25
        # an edge and a flat are told apart wherever elements see them
        np.testing.assert_allclose(
            flat.values[inside], np.isinf(tree["constant_data"]["r_c"].values[inside]), atol=1e-3
        )
    posterior.unlink()
    for text, words in (("tips:0,0", "given twice"), ("sphere", "expected uniform")):
        assert main([*arguments, "--indenter", text]) == 2
        error = capsys.readouterr().err.strip()
        assert words in error
        assert "\n" not in error
    assert not posterior.exists()


def test_same_seed_same_file(folder: Path, tmp_path: Path) -> None:
    from bayestouch.results.reading import load_calibration

    for name in ("a.nc", "b.nc"):
        assert main(["calibrate", str(folder), "-o", str(tmp_path / name), "--draws", "40", "--quiet"]) == 0
    a, b = (load_calibration(tmp_path / name) for name in ("a.nc", "b.nc"))
    for name, draws in a.posterior.items():
        np.testing.assert_array_equal(draws, b.posterior[name])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["calibrate", "no-such-folder", "-o", "x.nc"], "no-such-folder"),
        (["calibrate"], "Missing"),
        (["calibrate", "DATA"], "--output"),
        (["calibrate", "DATA", "-o", "missing/x.nc"], "missing"),
        (["calibrate", "DATA", "-o", "x.nc", "--kernel", "layer"], "pad"),
        (["calibrate", "DATA", "-o", "x.nc", "--prior", "sigma=uniform:0.5,0.6"], "prior of sigma: nothing of"),
        (["calibrate", "DATA", "-o", "x.nc", "--seed", "-1"], "seed"),
        (["infer", "DATA/touches.csv", "--calibration", "absent.nc", "-o", "x.nc"], "absent.nc"),
        (["infer", "DATA/touches.csv", "--calibration", "DATA/sensor.toml", "-o", "x.nc"], "sensor.toml"),
        (["report", "no-such-folder", "-o", "out"], "no-such-folder"),
        (["report", "DATA", "-o", "out", "--baselines"], "offered for pads"),
        (["report", "DATA", "-o", "out", "--baselines", "--no-diagnosis"], "--no-diagnosis exclude each other"),
        (["report", "DATA", "-o", "out", "--baselines", "--diagnosis", "DATA"], "--diagnosis exclude each other"),
        (["report", "DATA", "DATA", "-o", "out", "--baselines"], "one data set"),
        (["simulate", "-o", "out", "--effect", "crosstalk"], "NAME=VALUE"),
        (["simulate", "-o", "out", "--effect", "no_such_effect=1"], "no_such_effect"),
        (["unknown-verb"], "unknown-verb"),
    ],
)
def test_wrong_input_is_one_line_and_status_two(
    arguments: list[str],
    words: str,
    folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main([argument.replace("DATA", str(folder)) for argument in arguments]) == 2
    error = capsys.readouterr().err.strip()
    assert words in error
    assert "\n" not in error
    assert not list(tmp_path.iterdir()), "something was written"


def test_bad_cell_is_placed(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = (folder / "touches.csv").read_text().splitlines()
    cells = lines[4].split(",")
    column = lines[0].split(",").index("e03")
    cells[column] = "oops"
    broken = tmp_path / "finger"
    broken.mkdir()
    for name in ("sensor.toml", "calibration.csv"):
        (broken / name).write_bytes((folder / name).read_bytes())
    (broken / "touches.csv").write_text("\n".join([*lines[:4], ",".join(cells), *lines[5:]]) + "\n")
    assert main(["calibrate", str(broken), "-o", str(tmp_path / "x.nc")]) == 2
    error = capsys.readouterr().err
    assert "touches.csv, row 5, column e03" in error
    assert not (tmp_path / "x.nc").exists()


@pytest.mark.parametrize("said", ["", "Unable to allocate 1.31 TiB"])
def test_a_lack_of_memory_is_one_line(
    said: str, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """As numpy raises it for a thousand million draws, and as Python does."""
    import bayestouch

    def refused(*_: object, **__: object) -> None:
        raise MemoryError(said)

    monkeypatch.setattr(bayestouch, "check", refused)
    assert main(["check", str(folder)]) == 1
    much = f" ({said})" if said else ""
    line = f"bayestouch: not enough memory{much}; ask for fewer --draws, or take a part of the data\n"
    assert capsys.readouterr().err == line


def test_help_imports_nothing_heavy() -> None:
    code = (
        "import sys; from bayestouch.commands.cli import main; main(['--help'])\n"
        "heavy = {'numpy', 'scipy', 'arviz', 'pandas', 'matplotlib', 'xarray', 'emcee'} & set(sys.modules)\n"
        "sys.exit(','.join(sorted(heavy)) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "calibrate" in done.stdout
