"""A drift and an effect of the noise of another package: found by a diagnosis, saved, and used to read touches."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

MODULE = '''
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bayestouch.effects import EffectParameter, NoiseEffect, RandomEffect, Stage
from bayestouch.priors.parameters import LogNormal, Normal


@dataclass(frozen=True)
class TiltDrift(RandomEffect):
    """Zeros tilt with time: up at one end of the finger, down at the other, by one random function."""

    parameters: tuple[EffectParameter, ...]

    name: ClassVar[str] = "tilt_drift"
    stage: ClassVar[Stage] = "readout"
    summary: ClassVar[str] = "zeros that tilt with time"
    mixes: ClassVar[bool] = False

    @classmethod
    def suited(cls, setting):
        time = setting.span_s / 6
        return cls((
            EffectParameter("sd", "", "sd of the tilt, over the peak", Normal(0.0, 0.05, 0.0), (0.01,), 0.0),
            EffectParameter("time", setting.time_unit, "correlation time", LogNormal(time, 1.0), (time, time / 3)),
        ))

    def own(self, values):
        return False

    def scale(self, recording):
        return np.broadcast_to(recording.peak * np.linspace(-1, 1, len(recording.peak)), recording.signal.shape)


@dataclass(frozen=True)
class PairNoise(NoiseEffect):
    """Elements that share an amplifier, two by two, share an error in each sample."""

    parameters: tuple[EffectParameter, ...] = (
        EffectParameter("sd", "", "sd of the shared error, over the peak", Normal(0.0, 0.05, 0.0), (0.01,), 0.0),
    )

    name: ClassVar[str] = "pair_noise"
    stage: ClassVar[Stage] = "noise"
    summary: ClassVar[str] = "an error that two elements share in a sample"
    mixes: ClassVar[bool] = False

    @classmethod
    def suited(cls, setting):
        return cls()

    def own(self, scatter, values):
        return np.maximum(1 - (values[0] / scatter.sd) ** 2, 0.02)

    def terms(self, scatter, values, own):
        z, size, last = np.nan_to_num(scatter.z), values[0] / scatter.sd, 2 * (scatter.z.shape[1] // 2)
        first, second = slice(0, last, 2), slice(1, last, 2)
        a, b, shared = own[first] + size[first] ** 2, own[second] + size[second] ** 2, size[first] * size[second]
        volume, one, other = a * b - shared**2, z[:, first], z[:, second]
        pairs = (b * one**2 - 2 * shared * one * other + a * other**2) / volume + np.log(volume)
        alone = z[:, last:] ** 2 / own[last:] + np.log(own[last:])
        return -0.5 * (pairs.sum(axis=1) + alone.sum(axis=1))[:, None]

    def errors(self, recording, values, rng):
        pairs = (recording.signal.shape[1] + 1) // 2
        drawn = np.repeat(rng.standard_normal((len(recording.signal), pairs)), 2, axis=1)
        return values[0] * recording.peak * drawn[:, : recording.signal.shape[1]]
'''

PROGRAM = """
import sys
import numpy as np
import bayestouch
from bayestouch.simulation import FingerDesign, simulate

name, size, file = sys.argv[1], float(sys.argv[2]), sys.argv[3]
design = FingerDesign(n_elements=8, samples_per_touch=5, edge_step_deg=3.0, flat_step_deg=6.0, touch_step_deg=6.0)
dataset = simulate(design, effects={name: size}, seed=3).dataset
diagnosis = bayestouch.diagnose(dataset, sample=False, draws=64)
diagnosis.save(file)
after = bayestouch.load(file + "/calibration_after.nc")
read = bayestouch.infer(dataset.touches.select(dataset.touches.touch < 4), after, draws=128)
assert np.isfinite(read.mean("R")).all()
model = bayestouch.effects.read_model(file + "/model.toml")
again = bayestouch.calibrate(dataset, model=model, draws=64)
(effect,) = diagnosis.to_dict()["effects"]
found = effect["parameters"][name + "_sd"]
print(effect["name"], diagnosis.verdict, found["mean"] / size, found["sd"] / size, again.mode[name + "_sd"] / size)
"""


def test_each_is_one_file_of_forty_lines() -> None:
    head, drift, noise = MODULE.strip().split("@dataclass(frozen=True)\n")
    for effect in (drift, noise):
        assert sum(1 for line in (head + effect).splitlines() if line.strip()) + 1 <= 40, effect.splitlines()[0]


# What a course of some six correlation times tells of its size is 1/sqrt(2 × 6 to 12), a fifth to a third of it. The
# noise that two elements share is told by four thousand pairs of samples, to 3 %; a true size that the peaks are off by
# adds, hence the least tolerance.
@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "size", "sds", "least"), [("tilt_drift", 0.03, (0.15, 0.6), 0.0), ("pair_noise", 0.01, (0.01, 0.06), 0.12)]
)
def test_effects_of_other_packages_are_effects_like_the_others(
    tmp_path: Path, name: str, size: float, sds: tuple[float, float], least: float
) -> None:
    (tmp_path / "their_effects.py").write_text(MODULE)
    installed = tmp_path / "their_effects-1.0.dist-info"
    installed.mkdir()
    (installed / "METADATA").write_text("Metadata-Version: 2.1\nName: their-effects\nVersion: 1.0\n")
    (installed / "entry_points.txt").write_text(
        "[bayestouch.effects]\ntilt_drift = their_effects:TiltDrift\npair_noise = their_effects:PairNoise\n"
    )
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), *(p for p in sys.path if p)])}
    command = [sys.executable, "-c", PROGRAM, name, str(size), str(tmp_path / "diagnosis")]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found, verdict, *numbers = done.stdout.split()
    share, sd, again = map(float, numbers)
    assert (found, verdict) == (name, "explained")
    assert sds[0] < sd / share < sds[1]
    assert abs(np.log(share)) < max(4 * sd / share, least)
    assert abs(np.log(again)) < max(4 * sd / share, least)
