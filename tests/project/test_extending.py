"""What it takes to add an effect, a prior or a body, as the documentation shows it."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from report_cases import FINGER, small

import bayestouch
from bayestouch.data.geometry import BODIES, geometries
from bayestouch.model.body import body_of_kind

ROOT = Path(__file__).resolve().parents[2]


def block(page: str, holding: str) -> str:
    """The block of Python on a page of the documentation that holds some text."""
    text = (ROOT / "docs" / page).read_text("utf-8")
    (found,) = (each for each in re.findall(r"```python\n(.*?)```", text, re.DOTALL) if holding in each)
    return found


def lines_of(code: str) -> int:
    return sum(1 for line in code.splitlines() if line.strip())


def test_an_effect_is_one_file_of_forty_lines() -> None:
    assert lines_of(block("add_an_effect.md", "class BendingArm(Effect)")) <= 40


def test_no_code_asks_which_kind_an_effect_is() -> None:
    """Effects of others are drifts or noise effects by their base class; what follows from it is chosen by that."""
    package = ROOT / "bayestouch"
    asked = re.compile(r"isinstance\([^)]*(RandomEffect|NoiseEffect)")
    found = {
        path.relative_to(package).as_posix() for path in package.rglob("*.py") if asked.search(path.read_text("utf-8"))
    }
    assert found == {"effects/kinds.py"}


def test_a_prior_is_twenty_lines_and_shapes_the_posterior() -> None:
    """Draws keep to the support; where the prior is far narrower than the likelihood, their sd is its own."""
    code = block("statistics.md", "class Triangle").partition("\n\ndataset = ")[0]
    assert lines_of(code) <= 25
    names: dict[str, type] = {}
    exec(code, names)
    prior = names["Triangle"](0.44, 0.46, 0.49)
    calibration = bayestouch.calibrate(small(FINGER).dataset, priors={"sigma": prior}, draws=400)
    sigma = calibration.posterior["sigma"]
    assert 0.44 < sigma.min() < sigma.max() < 0.49
    narrow = names["Triangle"](0.4695, 0.47, 0.4705)
    calibration = bayestouch.calibrate(small(FINGER).dataset, priors={"sigma": narrow}, draws=400)
    # the sd of a triangle over a width w that is highest in the middle is w/sqrt(24)
    assert calibration.posterior["sigma"].std() == pytest.approx(0.001 / np.sqrt(24), rel=0.15)


def test_an_e_map_is_one_file_and_one_line() -> None:
    """Nothing but `body/finger.py` says which body a finger has, and it says so in one line."""
    package = ROOT / "bayestouch"
    imports = re.compile(r"^.*import.*\bannulus\b.*$|^.*\bannulus import.*$", re.MULTILINE)
    found = {path: imports.findall(path.read_text("utf-8")) for path in package.rglob("*.py")}
    named = {path.relative_to(package).as_posix(): len(lines) for path, lines in found.items() if lines}
    assert named == {"body/finger.py": 1}


def test_a_body_is_one_folder_and_one_line(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    """The strip of the page: its two files and one entry of `BODIES`, then a data set is read and calibrated."""
    geometry, body = block("add_a_body.md", "class Strip"), block("add_a_body.md", "BODY = replace(")
    counted = f"two files with {lines_of(geometry)} and {lines_of(body)} lines"
    assert counted in (ROOT / "docs" / "add_a_body.md").read_text("utf-8")
    folder = tmp_path / "strip_of_the_page"
    folder.mkdir()
    for name, text in {"__init__": "", "geometry": geometry, "body": body}.items():
        (folder / f"{name}.py").write_text(text, "utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setitem(BODIES, "strip", folder.name)
    for known in (geometries, body_of_kind):
        known.cache_clear()
        request.addfinalizer(known.cache_clear)
    design = bayestouch.PadDesign(element_x_mm=(0.0, 6.0, 12.0, 18.0), element_y_mm=None, n_touches=12)
    simulated = bayestouch.simulate(design, seed=3)
    bayestouch.save_dataset(simulated.dataset, tmp_path / "data")
    settings = tmp_path / "data" / "sensor.toml"
    text = settings.read_text("utf-8").replace('body = "pad"', 'body = "strip"').replace("depth_mm = 6.0\n", "")
    settings.write_text(text.replace("thickness_mm = 6.0\n", ""), "utf-8")
    with pytest.raises(bayestouch.InputError, match=r"a strip needs element_x_mm, thickness_mm under \[geometry\]"):
        bayestouch.load_dataset(tmp_path / "data")
    settings.write_text(text, "utf-8")
    dataset = bayestouch.load_dataset(tmp_path / "data")
    calibration = bayestouch.calibrate(dataset, draws=100)
    assert calibration.settings["kernel"] == "layer-line"
    read = bayestouch.infer(dataset.touches, calibration, draws=256)
    x = read.posterior["x"].reshape(12, -1)
    true = np.array(simulated.truth["touches"]["x"])
    # Of 12 touches none is so far from the truth by chance: 5 standard deviations have a probability of 6e-7 each.
    assert np.all(np.abs(x.mean(axis=-1) - true) < 5 * x.std(axis=-1))
    with pytest.raises(bayestouch.InputError, match="there is no report of a strip"):
        bayestouch.report(dataset, tmp_path / "report")
