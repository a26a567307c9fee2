"""The live reader against `infer` by emcee: agreement, flags, and time of one read on one core.

For a finger each sample of a calibration set of the paper's design is a touch of its own; with effects and on pads a
touch is streamed sample by sample, and its last posterior is compared. Agreement means that every parameter has its
mean within 0.1 sd and its sd within 5 % of those of 8,192 draws, whose own errors are about 0.02 sd and 1.3 %. With a
drift, `infer` uses the touches after a touch too, and the live reader cannot: there the sds are larger.

Times are processor time of the thread (`time.thread_time`). Where other work shares the machine, the same read takes
0.5 to 1.5 ms of it. The stream is therefore read seven times: the first times are of every read, the last two of the
fastest of the seven, over the reads of the stream.

    python studies/benchmarks/live.py [touches of the finger] [names of cases]
"""

from __future__ import annotations

import os
import sys
import time
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

import bayestouch
from bayestouch.effects.stated import StatedModel

DRAWS = 8192
SMALL = bayestouch.FingerDesign(n_elements=8, edge_step_deg=2.0, flat_step_deg=4.0, touch_step_deg=4.0)
LINE = bayestouch.PadDesign(element_x_mm=(0.0, 6.0, 12.0, 18.0), element_y_mm=None, n_touches=200)
#: Design, simulated effects, effects of the calibration, whether each sample is a touch, options of the reader.
CASES: dict[str, tuple[Any, dict[str, float], tuple[str, ...], bool, dict[str, Any]]] = {
    "finger": (bayestouch.FingerDesign(), {}, (), True, {}),
    "finger, no load": (SMALL, {}, (), False, {"use_load": False}),
    "finger, cross-talk": (SMALL, {"crosstalk": 0.04}, ("crosstalk",), False, {}),
    "finger, creep": (SMALL, {"creep": 0.05}, ("creep",), False, {}),
    "finger, drift": (SMALL, {"baseline_drift": 0.01}, ("baseline_drift",), False, {}),
    "pad, one dimension": (LINE, {}, (), False, {}),
    "pad, two dimensions": (bayestouch.PadDesign(n_touches=200), {}, (), False, {}),
}


REPEATS = 7


def compare(name: str, most: int) -> dict[str, float]:
    """Print and return the numbers of one case."""
    design, effects, model, each_sample, options = CASES[name]
    data = bayestouch.simulate(design, effects=effects, seed=3).dataset
    body, contact = ("pad", "") if isinstance(design, bayestouch.PadDesign) else ("finger", "layer")
    stated = StatedModel(body, contact, tuple((each, {}) for each in model)) if model else None
    calibration = bayestouch.calibrate(data, model=stated, draws=64, seed=1)
    touches = data.touches
    if each_sample:
        rows = np.flatnonzero(touches.in_contact)
        touches = touches.select(np.sort(np.random.default_rng(0).permutation(rows)[:most]))
    begun = time.process_time()
    reader = bayestouch.Reader(calibration, **options)
    setup = time.process_time() - begun
    runs = []
    for _ in range(REPEATS):
        reader.restart()
        live, seconds = _read(reader, touches, each_sample)
        runs.append(seconds)
    more = {"each_sample": True} if each_sample else {}
    read = bayestouch.infer(touches, calibration, check_sensor=False, draws=DRAWS, seed=2, **options, **more)
    draws = np.stack([read.posterior[each.name] for each in read.parameters])
    mean, sd = draws.mean(axis=(1, 2)).T, draws.std(axis=(1, 2)).T
    far = np.abs((np.array([each.mean for each in live]) - mean) / sd).max(axis=1)
    wide = np.abs(np.array([each.sd for each in live]) / sd - 1).max(axis=1)
    good, flagged = (far < 0.1) & (wide < 0.05), np.array([bool(each.flags) for each in live])
    half, late = np.percentile(1e3 * np.array(runs), [50, 99])
    best_half, best_late = np.percentile(1e3 * np.min(runs, axis=0), [50, 99])
    print(
        f"{name:20s} {len(live):5d} touches, {len(seconds):5d} reads: as emcee {good.mean():7.2%} "
        f"(mean {np.mean(far < 0.1):7.2%}, sd {np.mean(wide < 0.05):7.2%}), flagged {flagged.mean():6.2%}, "
        f"neither {np.mean(~good & ~flagged):6.2%}; one read {half:.2f} ms, 99 % {late:.2f}; "
        f"the fastest {best_half:.2f}, 99 % {best_late:.2f}; set-up {setup:.2f} s",
        flush=True,
    )
    return {"good": float(good.mean()), "neither": float(np.mean(~good & ~flagged)), "p99_ms": float(best_late)}


def _read(
    reader: bayestouch.Reader, touches: bayestouch.Touches, each_sample: bool
) -> tuple[list[bayestouch.LiveTouch], list[float]]:
    """The last posterior of each touch, and the seconds of every read."""
    rest, out, seconds, touch, last = touches.rest_reading(), [], [], None, None
    if rest is not None:
        reader.rest_reading = rest
    for row in np.flatnonzero(touches.in_contact):
        if last is not None and (each_sample or touches.touch[row] != touch):
            out.append(last)
            reader.new_touch()
        touch = touches.touch[row]
        reads = 1 if touches.reads is None else int(touches.reads[row])
        time_s = float(touches.time_s[row]) if np.isfinite(touches.time_s[row]) else None
        begun = time.thread_time()
        last = reader.update(touches.readings[row], touches.load[row], reads=reads, time_s=time_s)
        seconds.append(time.thread_time() - begun)
    if last is not None:
        out.append(last)
    return out, seconds


def main(touches: int = 4800, *names: str) -> dict[str, dict[str, float]]:
    """Print a line for each case."""
    return {name: compare(name, touches) for name in names or CASES}


if __name__ == "__main__":
    number = int(sys.argv[1]) if len(sys.argv) > 1 else 4800
    main(number, *sys.argv[2:])
