"""What a diagnosis of a finger costs, and what each effect of the catalogue adds to it.

The finger has 16 elements, 242 calibration touches and 369 touches of 20 samples, and cross-talk. Times are of
processor, of all processes together: a diagnosis uses all cores, and one fit uses one. Beside the whole:

* the bound: the diagnosis of a finger that misses nothing, which is one fit, one round of scores and one calibration;
  its touches are read before only.
* the peer: every effect refitted in each round, where the search refits those with the best scores. It is not run, but
  calculated from the refits of the first round.

    python studies/benchmarks/diagnosis.py
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

sys.path.insert(0, str(Path(__file__).parents[1]))

from _processor import processor_seconds

import bayestouch
from bayestouch.diagnosis.comparison import density, held_out_each_way, refit
from bayestouch.diagnosis.one_round import LEADING
from bayestouch.effects import catalogue
from bayestouch.effects.noise import NoiseEffect
from bayestouch.finger.start import base_fit
from bayestouch.model.candidates import score_effects
from bayestouch.model.noise_search import score_noise
from bayestouch.model.split_data import SplitData
from bayestouch.simulation import FingerDesign, simulate

MISSING = {"crosstalk": 0.04}
CONTACT = "layer"
T = TypeVar("T")


def timed(call: Callable[[], T]) -> tuple[T, float]:
    """Result of a call, and the seconds of processor that it takes."""
    start = processor_seconds()
    result = call()
    return result, processor_seconds() - start


def cost_of_effects(dataset: bayestouch.DataSet) -> dict[str, tuple[float, float]]:
    """Seconds of the score and of the refit of each effect in the first round; noise has no refit of its own."""
    data = SplitData.of(dataset)
    fitted = base_fit(data.observations(data.training), data.dataset.sensor, CONTACT)
    before = held_out_each_way(fitted, fitted.linear, density(fitted))
    cost = {}
    for effect in catalogue(data.setting(CONTACT, fitted.model.reference_load)):
        if isinstance(effect, NoiseEffect):
            _, seconds = timed(lambda effect=effect: score_noise(fitted, (effect,)))
            cost[effect.name] = (seconds, 0.0)
            continue
        (candidate,), scoring = timed(lambda effect=effect: score_effects(fitted, (effect,)))
        _, refitting = timed(lambda candidate=candidate: refit(fitted, candidate, before, 0.0))
        cost[effect.name] = (scoring, refitting)
    return cost


def main(design: FingerDesign | None = None) -> dict[str, float]:
    """Print the seconds of processor of each effect and of the whole; returns those of the whole, and the ratios."""
    missing, sound = (simulate(design, effects=effects, seed=3).dataset for effects in (MISSING, {}))
    whole, seconds = timed(lambda: bayestouch.diagnose(missing, seed=0))
    _, bound = timed(lambda: bayestouch.diagnose(sound, seed=0))
    cost = cost_of_effects(missing)
    print("seconds of processor")
    print("effect                  score (s)  refit (s)")
    for name, (scoring, refitting) in sorted(cost.items(), key=lambda item: -sum(item[1])):
        print(f"{name:22s} {scoring:10.3f} {refitting:10.2f}")
    scores, refits = (sum(each[k] for each in cost.values()) for k in (0, 1))
    rounds = len(whole.traced.rounds)
    peer = seconds + rounds * refits * (1 - LEADING / sum(each[1] > 0 for each in cost.values()))
    print(f"{len(cost)} effects: {scores:.2f} s a round for scores; {refits:.1f} s if all were refitted")
    print(f"diagnosis {seconds:.1f} s in {rounds} rounds; of a finger that misses nothing {bound:.1f} s")
    print(f"{seconds / bound:.1f} times the bound; {peer / seconds:.1f} times as long if all were refitted")
    return {"seconds": seconds, "over_bound": seconds / bound, "peer_over": peer / seconds}


if __name__ == "__main__":
    main()
