"""Which models of a pad are fitted, and which one is chosen."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pad_simulation import line

from bayestouch.chain.kernel_choice import kernel_names
from bayestouch.pad import choice
from bayestouch.pad.choice import WORTH_A_MAP, choose_model
from bayestouch.pad.problem import pad_problem

KERNELS = [name for name in kernel_names(1) if name != "constant"]


@pytest.mark.parametrize(("alone", "chosen"), [(1.1, "map alone"), (0.9, "kernel")])
def test_models_of_an_equal_problem_are_not_fitted_again(
    monkeypatch: pytest.MonkeyPatch, alone: float, chosen: str
) -> None:
    """All three kinds; the scores decide, and a map must be worth its trouble."""
    pad = line()
    dataset = pad.dataset(pad.touch(np.linspace(6, 34, 29)[:, None], np.random.default_rng(0)))
    problem, _ = pad_problem(pad.sensor, dataset.touches, samples="mean", seed=0)
    kinds = {name: SimpleNamespace(score=10.0 - i, kernel=SimpleNamespace(name=name)) for i, name in enumerate(KERNELS)}
    first = KERNELS[0]
    earlier: Any = {
        **kinds,
        f"{first} with map": SimpleNamespace(score=10.0 + 0.5 * WORTH_A_MAP),
        "map alone": SimpleNamespace(score=10.0 + alone * WORTH_A_MAP),
    }
    for name in ("fit_kernel", "add_map"):
        monkeypatch.setattr(choice, name, lambda *given: pytest.fail("fitted again"))
    model, models = choose_model(problem, dataset, "auto", "auto", earlier=earlier)
    assert model is earlier[first if chosen == "kernel" else chosen]
    assert models == earlier
