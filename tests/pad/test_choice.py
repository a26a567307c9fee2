"""Which models of a pad are fitted, and which one is chosen."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pad_simulation import line

from bayestouch.chain.kernel_choice import kernel_names
from bayestouch.chain.kernels import LayerKernel
from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import Pad, Rubber
from bayestouch.pad import choice
from bayestouch.pad.choice import CLEARLY_BETTER, choose_model
from bayestouch.pad.problem import pad_problem
from bayestouch.priors.parameters import LogNormal

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
        f"{first} with map": SimpleNamespace(score=10.0 + 0.5 * CLEARLY_BETTER),
        "map alone": SimpleNamespace(score=10.0 + alone * CLEARLY_BETTER),
    }
    for name in ("fit_kernel", "add_map"):
        monkeypatch.setattr(choice, name, lambda *given: pytest.fail("fitted again"))
    model, models = choose_model(problem, dataset, "auto", "auto", earlier=earlier)
    assert model is earlier[first if chosen == "kernel" else chosen]
    assert models == earlier


@pytest.mark.parametrize(("body", "ahead", "chosen"), [
    ({"thickness_mm": 6.0}, 0.9, "layer"),
    ({"thickness_mm": 6.0, "depth_mm": 6.0}, 0.9, "layer"),
    ({"thickness_mm": 6.0}, 1.1, "gaussian"),
    ({"depth_mm": 6.0}, 0.9, "half-space"),
    ({"depth_mm": 6.0}, 1.1, "gaussian"),
    ({}, 0.1, "gaussian"),
])  # fmt: skip
def test_others_must_be_clearly_better_than_a_kernel_of_stated_dimensions(
    body: dict[str, float], ahead: float, chosen: str
) -> None:
    pad = line()
    dataset = pad.dataset(pad.touch(np.linspace(6, 34, 29)[:, None], np.random.default_rng(0)))
    dataset = replace(dataset, sensor=replace(pad.sensor, body=Pad(tuple(pad.nominal[:, 0]), **body)))
    problem, _ = pad_problem(dataset.sensor, dataset.touches, samples="mean", seed=0)
    scores = dict.fromkeys(KERNELS, 8.0) | {
        "layer": 10.0,
        "half-space": 10.0,
        "gaussian": 10.0 + ahead * CLEARLY_BETTER,
    }
    earlier: Any = {name: SimpleNamespace(score=score) for name, score in scores.items()}
    model, _ = choose_model(problem, dataset, "auto", False, earlier=earlier)
    assert model is earlier[chosen]


@pytest.mark.parametrize("seed", [3, 6, 13, 14, 15, 17])
def test_readings_between_few_places_are_those_of_the_stated_layer(seed: int) -> None:
    """A layer of 6 mm touched at four places only, where a Gaussian fits a little better with these seeds.

    Over the line the Gaussian is 1.7 to 1.9 % of the peak off (rms). The error that the noise of 1 % leaves is 0.5 %.
    """
    rng, layer = np.random.default_rng(seed), LayerKernel(6.0, *[LogNormal(6.0, 0.1)] * 3)
    pad = line(layer, (6.0, 1.0, 0.48, 1.0), floor=0.25, share=0.0)
    places = np.tile(10 + np.linspace(0.0, 18.0, 4), 6)[:, None]
    touches = pad.touch(places, rng, load=rng.uniform(1.0, 3.0, 24), measured=True, samples=3)
    rubber, body = Rubber(poisson_ratio=0.48), Pad(tuple(pad.nominal[:, 0]), thickness_mm=6.0, depth_mm=6.0)
    sensor = replace(pad.sensor, body=body, rubber=rubber, force_noise_sd=0.001)
    dataset = DataSet(sensor, None, touches)
    problem, _ = pad_problem(sensor, touches, samples="mean", seed=0)
    model, _ = choose_model(problem, dataset, "auto", False)
    between = 10 + np.linspace(0.0, 18.0, 37)[:, None]
    truth = pad.chain.sensitivity(between)
    error = 100 * np.sqrt(np.mean((model.sensitivity(between) / truth.max(axis=0) - truth / truth.max(axis=0)) ** 2))
    assert error < 1.0
