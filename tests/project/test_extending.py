"""What it takes to add an effect, a prior or a body, as the documentation shows it."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from report_cases import FINGER, small

import bayestouch
from bayestouch.model.body import BODIES

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


def test_a_body_is_one_folder_and_one_line() -> None:
    """What is known of a body is its module; nothing else of the package names it (test_bodies.py)."""
    assert sorted(BODIES) == ["finger", "pad"]
    for kind, module in BODIES.items():
        assert module == f"bayestouch.{kind}.body"
