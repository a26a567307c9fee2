"""A loop at 1 kHz over a recorded stream with the live reader, and a live plot of what it finds.

A simulated finger is touched; samples arrive every millisecond. Each one updates the posterior of the held
touch, and every fortieth one (25 pictures a second) the plot.

    python studies/live_stream.py                    in a window
    python studies/live_stream.py -o frames          pictures in a folder, without a window
    python studies/live_stream.py --touches 3        fewer touches
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import bayestouch
from bayestouch.chain.noise import Noise

RATE_HZ, SAMPLES = 1000.0, 120
EVERY = 40


@dataclass(frozen=True)
class Sample:
    """One row of a stream: time (s), readings (m,), load (N/m), and whether it begins a touch."""

    time_s: float
    values: np.ndarray
    load: float
    begins: bool


def sensor() -> tuple[bayestouch.DataSet, bayestouch.Calibration]:
    """A simulated finger and its calibration."""
    design = bayestouch.FingerDesign(n_elements=8, edge_step_deg=4.0, flat_step_deg=8.0, touch_step_deg=8.0)
    data = bayestouch.simulate(design, seed=3).dataset
    return data, bayestouch.calibrate(data, draws=64, seed=1)


def stream(data: bayestouch.DataSet, noise: Noise, n_touches: int, seed: int = 0) -> Iterator[Sample]:
    """Samples at 1 kHz: mean readings and loads of touches of the data set, with noise, 120 ms each and 80 ms apart."""
    rng = np.random.default_rng(seed)
    means = data.touches.averaged()
    chosen = rng.choice(means.n_touches, n_touches, replace=n_touches > means.n_touches)
    clock = 0.0
    for touch in chosen:
        for sample in range(SAMPLES):
            values = means.readings[touch] + noise.tactile_sd * rng.standard_normal(means.readings.shape[1])
            load = float(means.load[touch] + noise.force_sd * rng.standard_normal())
            yield Sample(clock, values, load, sample == 0)
            clock += 1 / RATE_HZ
        clock += 0.08


class Plot:
    """Mean and 90 % interval of each parameter over time."""

    def __init__(self, names: tuple[str, ...], units: tuple[str, ...]) -> None:
        import matplotlib.pyplot as plt

        self.figure, axes = plt.subplots(len(names), 1, sharex=True, figsize=(7, 6), layout="constrained")
        self.axes, self.names = axes, names
        for each, name, unit in zip(axes, names, units, strict=True):
            each.set_ylabel(f"{name} ({unit})")
        axes[-1].set_xlabel("time (s)")

    def draw(self, times: list[float], found: list[bayestouch.LiveTouch]) -> None:
        """Draw what was found so far."""
        quantiles = np.array([each.quantiles for each in found])
        for k, axes in enumerate(self.axes):
            for line in [*axes.lines, *axes.collections]:
                line.remove()
            axes.fill_between(times, quantiles[:, k, 0], quantiles[:, k, 2], color="#9fb8cc", linewidth=0)
            axes.plot(times, quantiles[:, k, 1], ".", markersize=2, color="#1f6fb4")
            axes.relim()
            axes.autoscale_view()


def run(n_touches: int, folder: Path | None, *, paced: bool) -> dict[str, Any]:
    """Read a stream, draw the plot, and return the posteriors at the ends of touches and the times of the reads."""
    import matplotlib.pyplot as plt

    data, calibration = sensor()
    reader = bayestouch.Reader(calibration)
    plot: Plot | None = None
    times: list[float] = []
    found: list[bayestouch.LiveTouch] = []
    seconds: list[float] = []
    last: list[bayestouch.LiveTouch] = []
    frames = 0
    begun = time.perf_counter()
    for number, sample in enumerate(stream(data, calibration.noise, n_touches)):
        if sample.begins and found:
            last.append(found[-1])
        if sample.begins:
            reader.new_touch()
        if paced:
            time.sleep(max(0.0, begun + sample.time_s - time.perf_counter()))
        before = time.thread_time()
        touch = reader.update(sample.values, sample.load, time_s=sample.time_s)
        seconds.append(time.thread_time() - before)
        times.append(sample.time_s)
        found.append(touch)
        if number % EVERY == EVERY - 1:
            plot = plot or Plot(touch.names, touch.units)
            plot.draw(times, found)
            if folder is None:
                plt.pause(1e-3)
            else:
                folder.mkdir(parents=True, exist_ok=True)
                plot.figure.savefig(folder / f"frame_{frames:04d}.png", dpi=80)
            frames += 1
    if plot is not None and folder is not None:
        plt.close(plot.figure)
    return {"last": [*last, found[-1]], "seconds": np.array(seconds), "frames": frames}


def main(arguments: list[str] | None = None) -> dict[str, Any]:
    """Run the loop and print how long the reads took."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("-o", "--output", type=Path, help="folder for pictures, instead of a window")
    parser.add_argument("--touches", type=int, default=10)
    options = parser.parse_args(arguments)
    if options.touches < 1:
        parser.error("--touches: expected at least 1")
    if options.output is not None:
        import matplotlib

        matplotlib.use("Agg")
    out = run(options.touches, options.output, paced=options.output is None)
    half, late = np.percentile(1e3 * out["seconds"], [50, 99])
    print(f"{len(out['seconds'])} samples: one update {half:.2f} ms, 99 % below {late:.2f} ms of processor time")
    for touch in out["last"]:
        print("  " + ", ".join(f"{name} {touch[name][0]:.3g} ± {touch[name][1]:.2g}" for name in touch.names))
    return out


if __name__ == "__main__":
    main()
