"""Diagnosis of effects that nobody declared, in other functional forms than the catalogue's.

The data come from `independent`, which shares no code with the package. `studies/error_rates.py` measures the rates;
here are single fingers, on which the answer must be right, and its small version runs with `test_studies.py`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from independent.dataset import EFFECTS, LISTED, simulate, write
from independent.finger import SMALL, Design
from independent.sizes import OutOfReach
from independent.unlisted import PLACED

import bayestouch

SEED = 4


def diagnosed(folder: Path, design: Design, wanted: list[tuple[str, float]]) -> dict[str, Any]:
    """Diagnosis of a finger under effects of the `wanted` sizes; skips where no plausible value has that size."""
    try:
        simulated = simulate(design, [(EFFECTS[key], size) for key, size in wanted], SEED)
    except OutOfReach as reason:
        pytest.skip(str(reason))
    path = write(simulated, folder / "finger")
    (path / "truth.json").unlink()
    return bayestouch.diagnose(bayestouch.load_dataset(path), sample=False, seed=0).to_dict()


def named(diagnosis: dict[str, Any]) -> set[str]:
    """The effect named first and those that the tool declares the data cannot tell from it."""
    first = diagnosis["effects"][:1]
    return {each["name"] for each in first} | {name for each in first for name in each["indistinguishable_from"]}


def test_an_effect_is_named_and_removed(tmp_path: Path) -> None:
    """Size 3, lack of fit about 10, in another formula: named first, and most of the excess goes."""
    key = "gain_nonlinearity: tanh"
    diagnosis = diagnosed(tmp_path, SMALL, [(key, 3.0)])
    assert diagnosis["effects"][0]["name"] == EFFECTS[key].name
    before, after = (diagnosis[when]["lack_of_fit"] for when in ("before", "after"))
    assert before > 3
    assert after - 1 < 0.25 * (before - 1)


@pytest.mark.slow
@pytest.mark.parametrize("key", [effect.key for effect in LISTED])
def test_every_effect_is_named(tmp_path: Path, key: str) -> None:
    """Size 2 on a full finger."""
    assert EFFECTS[key].name in named(diagnosed(tmp_path, Design(), [(key, 2.0)]))


@pytest.mark.slow
@pytest.mark.parametrize("key", [effect.key for effect in PLACED])
def test_every_unlisted_effect_stays_without_a_name(tmp_path: Path, key: str) -> None:
    """Size 2 on a full finger, and at least half of the excess is corrected."""
    diagnosis = diagnosed(tmp_path, Design(), [(key, 2.0)])
    assert diagnosis["verdict"] == "unattributed"
    before, after = (diagnosis[when]["lack_of_fit"] for when in ("before", "after"))
    assert after - 1 < 0.5 * (before - 1)
