"""What a fit with effects costs: derivatives over the values of effects, and signals of touches that an effect moves.

A fit needs the derivative of all readings over each parameter, many times. The finger has 16 elements, 427 touches
(those of the calibration and half of the others), and effects in their looser forms, which have values of each element.
Two ratios are printed, each of two computations that take turns:

* derivatives over all values of the effects: from the signal before each effect, with one difference for the values of
  all elements, beside one prediction of the whole chain above and one below each value;
* the signals of touches that `prober_eccentricity` moves: sums over Fourier modes, beside the tables of the chain,
  which each vector of parameters needs anew.

    python studies/benchmarks/derivatives.py
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import statistics
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.effects import catalogue
from bayestouch.effects.effect import Effect
from bayestouch.finger.model import FingerModel
from bayestouch.finger.start import base_fit
from bayestouch.model.split_data import SplitData
from bayestouch.simulation import FingerDesign, simulate

ON_SIGNAL, ON_POSE = ("proximity", "memory", "gain_nonlinearity"), ("prober_eccentricity",)
CONTACT = "layer"
ROUNDS = 9


def with_effects(model: FingerModel, vector: FloatArray, effects: tuple[Effect, ...]) -> tuple[FingerModel, FloatArray]:
    """The model with effects, and its vector with their middle values."""
    found = model.with_effects(effects)
    return found, np.concatenate([vector, found.value_priors[:, 0]])


def compare(name: str, now: Callable[[], object], before: Callable[[], object]) -> float:
    """Time both in turn, print medians of processor times and their ratio, and return the ratio."""
    spent: dict[str, list[float]] = {"now": [], "before": []}
    for _ in range(ROUNDS):
        for which, call in (("now", now), ("before", before)):
            begun = time.process_time()
            call()
            spent[which].append(time.process_time() - begun)
    middle = {which: 1e3 * statistics.median(times) for which, times in spent.items()}
    ratio = middle["before"] / middle["now"]
    print(f"{name:42s}{middle['now']:9.2f} ms {middle['before']:9.2f} ms   ratio {ratio:5.1f}", flush=True)
    return ratio


def main(design: FingerDesign | None = None) -> dict[str, float]:
    """Print both comparisons, and return their ratios."""
    data = SplitData.of(simulate(design, seed=2).dataset)
    fitted = base_fit(data.observations(data.training), data.dataset.sensor, CONTACT)
    model = fitted.model
    assert isinstance(model, FingerModel)
    print(f"{model.n_elements} elements, {model.observed.n_touches} touches, processor time, medians of {ROUNDS}")
    listed = catalogue(data.setting(CONTACT, model.reference_load))
    loose = {each.name: each.looser(model.n_elements) or each for each in listed}
    on_signal, vector = with_effects(model, fitted.vector, tuple(loose[name] for name in ON_SIGNAL))
    places = range(on_signal.n_base, len(vector))
    ratios = {
        "derivatives": compare(
            f"derivatives over {len(places)} values",
            lambda: on_signal.of_values(vector, on_signal.signal(vector)),
            lambda: [on_signal.of_value(vector, place) for place in places],
        )
    }
    moved, at = with_effects(model, fitted.vector, tuple(loose[name] for name in ON_POSE))
    tables = replace(moved, evaluator=None)
    vectors = iter(at + 1e-6 * np.random.default_rng(0).standard_normal((2 * ROUNDS, len(at))))
    ratios["signals"] = compare(
        "signals of touches that an effect moves",
        lambda: moved.signal(next(vectors)),
        lambda: tables.signal(next(vectors)),
    )
    return ratios


if __name__ == "__main__":
    main()
