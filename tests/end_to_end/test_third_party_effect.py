"""An effect of another package, as docs/add_an_effect.md has it: listed, found, saved and used."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[2] / "docs" / "add_an_effect.md"

# The true location is beside the commanded one by 4 degrees under the mean load; loads vary by a quarter either way.
PROGRAM = """
import sys
import numpy as np
import bayestouch
from bayestouch.simulation import FingerDesign, simulate

design = FingerDesign(n_elements=8, samples_per_touch=2, edge_step_deg=4.0, flat_step_deg=8.0, touch_step_deg=10.0)
plain, bent = simulate(design, seed=3), simulate(design, effects={"bending_arm": 4.0}, seed=3)
dataset = bent.dataset
off = np.subtract(bent.truth["touches"]["theta_c"], plain.truth["touches"]["theta_c"])
load = np.array(plain.truth["touches"]["P"])
assert np.allclose(off, 4.0 * load / 200, rtol=0, atol=1e-9)  # beside the place by an angle that goes with the load
assert np.array_equal(dataset.touches.angle_deg, plain.dataset.touches.angle_deg)  # commanded as without
diagnosis = bayestouch.diagnose(dataset, sample=False, draws=64)
diagnosis.calibration_after.save(sys.argv[1])
read = bayestouch.infer(dataset.touches.select(dataset.touches.touch < 4), bayestouch.load(sys.argv[1]), draws=128)
assert np.isfinite(read.mean("R")).all()
(effect,) = diagnosis.to_dict()["effects"]
shift = effect["parameters"]["bending_arm_shift"]
under_200 = 200 / diagnosis.traced.before.fitted.model.reference_load
print(effect["name"], diagnosis.verdict, (shift["mean"] * under_200 - 4) / shift["sd"])
"""


@pytest.mark.slow
def test_the_example_of_the_docs_works(tmp_path: Path) -> None:
    code, toml = re.findall(r"```(?:python|toml)\n(.*?)```", DOCS.read_text("utf-8"), re.DOTALL)
    assert len(code.strip().splitlines()) <= 36
    (tmp_path / "my_effects.py").write_text(code)
    installed = tmp_path / "my_effects-1.0.dist-info"
    installed.mkdir()
    (installed / "METADATA").write_text("Metadata-Version: 2.1\nName: my-effects\nVersion: 1.0\n")
    point = re.search(r'^bending_arm = "(.*)"$', toml, re.MULTILINE)
    assert point is not None and '"bayestouch.effects"' in toml
    (installed / "entry_points.txt").write_text(f"[bayestouch.effects]\nbending_arm = {point[1]}\n")
    path = os.pathsep.join([str(tmp_path), *(p for p in sys.path if p)])
    environment = os.environ | {"PYTHONPATH": path}

    def run(*arguments: str) -> str:
        return subprocess.run(
            [sys.executable, *arguments], env=environment, capture_output=True, text=True, check=True
        ).stdout

    assert "bending_arm" in run("-m", "bayestouch", "effects")
    name, verdict, off = run("-c", PROGRAM, str(tmp_path / "after.nc")).split()
    assert (name, verdict) == ("bending_arm", "explained")
    # Four standard deviations of the posterior.
    assert abs(float(off)) < 4
