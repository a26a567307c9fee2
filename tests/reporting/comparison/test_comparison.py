"""Two calibrations, and two data sets, side by side."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from posterior_cases import calibration
from report_cases import FINGER, LINE, Page, small

import bayestouch
from bayestouch.commands.cli import main
from bayestouch.errors import InputError
from bayestouch.reporting.comparison.numbers import _sentences, compared_parameters, in_other_units
from bayestouch.simulation import simulate


@pytest.mark.slow
def test_two_data_sets_side_by_side(tmp_path: Path) -> None:
    """A finger and the same finger with one element's gain changed by the repairer: that element is named."""
    first = simulate(FINGER, seed=4).dataset
    readings = np.array(first.touches.readings), np.array(first.calibration.readings)  # type: ignore[union-attr]
    for table in readings:
        table[:, 2] *= 1.3
    second = replace(
        first,
        touches=first.touches.with_(readings=readings[0]),
        calibration=first.calibration.with_(readings=readings[1]),  # type: ignore[union-attr]
    )
    compared = bayestouch.compare(first, second, tmp_path / "out", draws=128, diagnosis=False)
    table = compared.to_dataframe()
    telling = table[table["difference_in_sd"].abs() > 3]
    # its response and gain; its noise and discrepancy in counts grow with it
    assert set(telling["element"].dropna()) == {"e03"}
    change = table[(table["parameter"] == "response") & (table["element"] == "e03")].iloc[0]
    sd = np.hypot(change["first_sd"], change["second_sd"])
    assert change["second_mean"] / change["first_mean"] == pytest.approx(1.3, abs=4 * sd / change["first_mean"])
    assert "of e03 (+" in str(compared)
    assert json.loads((tmp_path / "out" / "comparison.json").read_text("utf-8")) == compared.numbers
    text = (tmp_path / "out" / "index.html").read_text("utf-8")
    page = Page(text)
    for side in ("first", "second"):
        assert f'href="{side}/index.html"' in text
        assert (tmp_path / "out" / side / "index.html").is_file()
    assert "Can its readings be trusted?" in "".join(page.text)
    assert "<table>" in compared._repr_html_()


def test_two_calibrations_on_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bayestouch.save_dataset(small(FINGER).dataset, tmp_path / "finger")
    for name, seed in (("a", "1"), ("b", "2")):
        output = str(tmp_path / f"{name}.nc")
        assert (
            main(["calibrate", str(tmp_path / "finger"), "-o", output, "--draws", "200", "--seed", seed, "--quiet"])
            == 0
        )
    assert main(["report", str(tmp_path / "a.nc"), str(tmp_path / "b.nc"), "-o", str(tmp_path / "out")]) == 0
    # other draws of one posterior
    assert "None of" in capsys.readouterr().out
    both = [str(tmp_path / "a.nc"), str(tmp_path / "finger")]
    assert main(["report", *both, "-o", str(tmp_path / "none")]) == 2
    assert "got one of each" in capsys.readouterr().err
    assert main(["report", *both, both[0], "-o", str(tmp_path / "none")]) == 2
    assert not (tmp_path / "none").exists()


def test_a_finger_and_a_pad_are_not_compared(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="two fingers or two pads"):
        bayestouch.compare(small(FINGER).dataset, small(LINE).dataset, tmp_path / "out")


def test_parameters_in_different_units_are_not_compared() -> None:
    """Readings in counts and in volts have responses that only share a name."""
    one = calibration()
    volts = [replace(each, unit="V") if each.name == one.parameters[0].name else each for each in one.parameters]
    other = replace(one, parameters=tuple(volts))
    name = one.parameters[0].name
    assert in_other_units(one, other) == [name] and in_other_units(one, one) == []
    assert name not in {row["parameter"] for row in compared_parameters(one, other)}
    assert name in {row["parameter"] for row in compared_parameters(one, one)}


def test_paths_are_not_compared(tmp_path: Path) -> None:
    with pytest.raises(InputError) as error:
        bayestouch.compare("a.nc", calibration(), tmp_path / "out")  # type: ignore[arg-type]
    assert str(error.value) == (
        "expected a data set or a calibration, got 'a.nc'; bayestouch.load_dataset(folder) and bayestouch.load(file) "
        "read them"
    )


@pytest.mark.parametrize("output", [123, None])
def test_output_of_a_comparison_is_a_path(output: object) -> None:
    with pytest.raises(InputError, match=f"^expected a path, got {output}$"):
        bayestouch.compare(calibration(), calibration(), output)  # type: ignore[arg-type]


@pytest.mark.parametrize("diagnosis", [None, 5])
def test_diagnosis_of_a_report_is_a_choice_or_a_folder(tmp_path: Path, diagnosis: object) -> None:
    told = f"^diagnosis: expected True, False or the folder of a saved diagnosis, got {diagnosis}$"
    with pytest.raises(InputError, match=told):
        bayestouch.report(None, tmp_path / "out", diagnosis=diagnosis)  # type: ignore[arg-type]
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("quantity", "name"),
    [
        ("load error, rms", "load error"),
        ("composite radius R error, rms", "composite radius R error"),
        ("location error, rms, all", "location error"),
        ("location error, rms, inside the array", "location error inside the array"),
        ("location error, rms, outside", "location error outside"),
    ],
)
def test_every_error_is_compared(quantity: str, name: str) -> None:
    row = {"quantity": quantity, "unit": "mm", "first": 0.5, "second": 0.4}
    said = _sentences({"quantities": [row], "parameters": []}, calibration(), calibration())
    assert said[0] == f"The {name} is 0.50 mm rms on the first and 0.40 mm on the second (−20 %)."


def test_what_is_no_error_is_not_compared() -> None:
    row = {"quantity": "location, posterior sd", "unit": "mm", "first": 0.5, "second": 0.4}
    (said,) = _sentences({"quantities": [row], "parameters": []}, calibration(), calibration())
    assert said.startswith("None of")


def test_an_element_without_readings_in_one_is_not_compared(tmp_path: Path) -> None:
    """Of such an element only the prior is known, which no other value differs from."""
    data = simulate(FINGER, seed=4).dataset
    assert data.calibration is not None
    readings = np.array(data.calibration.readings)
    readings[:, 1] = np.nan
    broken = replace(data, calibration=data.calibration.with_(readings=readings))
    first, second = (bayestouch.calibrate(each, discrepancy="touch", draws=64) for each in (data, broken))
    for number, sides in enumerate(((first, second), (second, first))):
        compared = bayestouch.compare(*sides, tmp_path / f"{number}")
        table = compared.to_dataframe()
        others = [f"e{e + 1:02d}" for e in range(data.sensor.n_elements) if e != 1]
        assert table["element"].dropna().unique().tolist() == others
        assert "Without readings in one of the two, and not compared: e02." in str(compared)
        # Each element is above its own tick.
        line = compared.plot_parameter("r_s").containers[0].lines[0]
        places = [0, *range(2, data.sensor.n_elements)]
        np.testing.assert_allclose(np.asarray(line.get_xdata()) + 0.12, places)
