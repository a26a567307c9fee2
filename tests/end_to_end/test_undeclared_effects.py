"""Diagnosis of effects that nobody declared, by fingers of a simulator that shares no code with the package.

Some forms of the effects are ones that the catalogue's formula can be, others are not: `independent` says which. The
catalogue and the search were changed after failures on some of these very cases (two exponentials of memory, proximity
with a drift of gains, the loose patch), so that they show that those failures do not come back, not how often a
diagnosis is right. `studies/error_rates.py` measures rates; `test_studies_of_statistics.py` runs it small.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from independent.dataset import EFFECTS, LISTED, simulate, write
from independent.finger import SMALL, Design
from independent.sizes import OutOfReach
from independent.unlisted import PLACED

import bayestouch
from bayestouch.contact import composite_radius
from bayestouch.effects.stated import StatedModel
from bayestouch.finger.chain_with_effects import ChainWithEffects
from bayestouch.finger.reading.effects import EffectContext

SEED = 4


def diagnosed(folder: Path, design: Design, wanted: list[tuple[str, float]], seed: int = SEED) -> dict[str, Any]:
    """Diagnosis of a finger under effects of the `wanted` sizes; skips where no plausible value has that size."""
    try:
        simulated = simulate(design, [(EFFECTS[key], size) for key, size in wanted], seed)
    except OutOfReach as reason:
        pytest.skip(str(reason))
    path = write(simulated, folder / "finger")
    (path / "truth.json").unlink()
    # few draws: what is named and what is left over does not depend on them, and reading touches takes long
    return bayestouch.diagnose(bayestouch.load_dataset(path), sample=False, draws=64, seed=0).to_dict()


def named(diagnosis: dict[str, Any]) -> set[str]:
    """The effect named first and those that the tool declares the data cannot tell from it."""
    first = diagnosis["effects"][:1]
    return {each["name"] for each in first} | {name for each in first for name in each["indistinguishable_from"]}


@pytest.mark.slow
def test_an_effect_is_named_and_removed(tmp_path: Path) -> None:
    """Size 3, lack of fit about 10, by a formula that the catalogue's cannot be: most of the excess goes."""
    key = "gain_nonlinearity: tanh"
    diagnosis = diagnosed(tmp_path, SMALL, [(key, 3.0)])
    assert diagnosis["effects"][0]["name"] == EFFECTS[key].name
    before, after = (diagnosis[when]["lack_of_fit"] for when in ("before", "after"))
    assert before > 3
    assert after - 1 < 0.25 * (before - 1)


@pytest.mark.slow
def test_two_effects_are_not_called_by_a_third_that_is_a_little_like_both(tmp_path: Path) -> None:
    """The best first guess is finite strain, which leads nowhere: the search begins anew from another."""
    pair = ["proximity: Lorentzian", "gain_drift: exponential"]
    diagnosis = diagnosed(tmp_path, SMALL, [(key, 1.5) for key in pair], seed=0)
    assert {each["name"] for each in diagnosis["effects"]} == {EFFECTS[key].name for key in pair}
    assert diagnosis["verdict"] == "explained"


@pytest.mark.slow
def test_touches_are_read_as_they_were_fitted_where_a_correction_stands_beside_an_effect(tmp_path: Path) -> None:
    """A correction takes a part of an effect on: the calibration holds what is left of it, and corrects after it.

    Predictions of the touches by what `infer` reads with are those of the fit, to the precision of the saved table:
    linear between locations half a degree apart, of functions of 5°. What a loose patch does goes with the load, too.
    """
    keys = ("crosstalk: unequal, second neighbours", "far_lobe: ", "loose_patch: ")
    wanted = [(EFFECTS[key], 3.0) for key in keys]
    dataset = bayestouch.load_dataset(write(simulate(SMALL, wanted, SEED), tmp_path / "finger"))
    model = StatedModel("finger", "layer", (("crosstalk", {}),), correction=True)
    calibration = bayestouch.calibrate(dataset, model=model, draws=200)
    affected, rows = ChainWithEffects.of(calibration), calibration.rows
    assert affected.correction_table is not None and affected.correction_table.loaded.any()
    touch = composite_radius(rows.radius_mm, 12.7), np.radians(rows.location["theta_c"]), rows.load
    t, m = rows.observed.shape
    context = EffectContext(
        effects_chain=affected,
        scale=np.ones((t, m)),
        shift=np.zeros((t, m)),
        extra=np.zeros((t, m, m)),
        counts=np.ones((t, m)),
        slopes=np.zeros((0, 2, t, m)),
        exact=True,
        time_s=np.full(t, np.inf),
    )
    chain = affected.model.chain(affected.vector)
    read = context.readings(chain.predict(*touch), *touch, np.arange(t))
    assert np.abs(read - rows.predicted).max() < 0.1 * calibration.noise.tactile_sd.min()


@pytest.mark.slow
def test_what_is_not_in_proportion_to_the_load_is_corrected(tmp_path: Path) -> None:
    """A patch that heavier touches press on: no cause in the catalogue, and more than half of the excess goes."""
    diagnosis = diagnosed(tmp_path, SMALL, [("loose_patch: ", 2.0)], seed=3)
    assert diagnosis["verdict"] == "unattributed"
    assert diagnosis["correction"]["sizes_percent_peak"]["loaded"] > 0
    before, after = (diagnosis[when]["lack_of_fit"] for when in ("before", "after"))
    assert after - 1 < 0.5 * (before - 1)


@pytest.mark.slow
@pytest.mark.parametrize("key", [effect.key for effect in LISTED])
def test_every_effect_is_named(tmp_path: Path, key: str) -> None:
    """Size 2 on a small finger; whole ones are in `test_diagnosis_of_fingers.py`."""
    assert EFFECTS[key].name in named(diagnosed(tmp_path, SMALL, [(key, 2.0)]))


@pytest.mark.slow
@pytest.mark.parametrize("key", [effect.key for effect in PLACED])
def test_every_unlisted_effect_stays_without_a_name(tmp_path: Path, key: str) -> None:
    """Size 2 on a small finger, and at least half of the excess is corrected.

    A whole finger is in `test_diagnosis_of_fingers.py`.
    """
    diagnosis = diagnosed(tmp_path, SMALL, [(key, 2.0)])
    assert diagnosis["verdict"] == "unattributed"
    before, after = (diagnosis[when]["lack_of_fit"] for when in ("before", "after"))
    assert after - 1 < 0.5 * (before - 1)
