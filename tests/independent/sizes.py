"""How large an effect is: what a base fit would leave of it, in units of the noise of an averaged touch.

The residual is the signal with the effect minus the signal expected from the commanded angle, the read load and the
nominal tip; least squares take out of it what the base parameters absorb (response, depth and angle of each element,
Poisson's ratio, shear modulus; to first order). Its root mean square over all samples and elements of calibration and
touches, divided by the noise of a touch's mean, is the size s: with it the lack of fit is about 1 + s². Errors are
measured by what they add to the noise, which averages in the same way.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .body import Annulus
from .effects import Effect
from .finger import Finger, Recording


class OutOfReach(ValueError):
    """No value that could pass unnoticed gives the wanted size."""


def applied(recording: Recording, effects: list[tuple[Effect, float]], seed: int, first: int = 0) -> Recording:
    """`recording` with its signals, under `effects` with their values.

    Each draws from a stream of its own: `first` is the number of the first effect, which picks its stream.
    """
    for when in ("before", "after", "error"):
        for index, (effect, value) in enumerate(effects, start=first):
            if effect.when == when and value != 0:
                recording = effect.apply(recording, value, np.random.default_rng([seed, 100 + index]))
        if when == "before":
            recording = recording.pressed()
    return recording


def expected(recording: Recording, finger: Finger | None = None) -> np.ndarray:
    """Signal (t, m) that a calibration expects of what the tables say."""
    load = recording.by_touch(recording.read_load)
    press = replace(recording.press, tip=recording.tip, angle=recording.commanded, load=load)
    press = replace(press, land=0.0, aperture=0.0, tangential=0.0, width=0.0, half_space=0.0, hump=0.0)
    return (finger or recording.finger).signal(press)


def left_over(recording: Recording) -> np.ndarray:
    """Residual (n, m) in counts after the base parameters have absorbed what they can."""
    finger, base = recording.finger, expected(recording)
    residual = recording.signal - base[recording.touch]
    used = recording.touch < sum(recording.parts[:2])
    means = recording.by_touch(residual)[: sum(recording.parts[:2])]
    by_element = [
        base,
        (expected(recording, replace(finger, depth=finger.depth + 0.01)) - base) / 0.01,
        (expected(recording, replace(finger, angle=finger.angle + 0.05)) - base) / 0.05,
    ]
    body = finger.body
    softer = replace(finger, modulus=finger.modulus * 1.02)
    other = replace(finger, body=Annulus(body.core, body.outer, body.poisson - 0.01))
    shared = [expected(recording, each) - base for each in (softer, other)]
    local = np.stack(by_element, axis=2)[: len(means)]

    def absorbed(values: np.ndarray) -> np.ndarray:
        parts = [
            local[:, e] @ np.linalg.lstsq(local[:, e], values[:, e], rcond=None)[0] for e in range(len(finger.gain))
        ]
        return np.stack(parts, axis=1)

    columns = np.stack([(each[: len(means)] - absorbed(each[: len(means)])).ravel() for each in shared], axis=1)
    rest = means - absorbed(means)
    weights = np.linalg.lstsq(columns, rest.ravel(), rcond=None)[0]
    fitted = means - rest + (columns @ weights).reshape(rest.shape)
    return np.asarray(residual[used] - fitted[recording.touch[used]])


def size(recording: Recording) -> float:
    """Root mean square of the residual and of the errors over the noise of an averaged touch."""
    averaged = recording.noise_sd / np.sqrt(recording.n_samples)
    used = recording.touch < sum(recording.parts[:2])
    structure = np.mean(left_over(recording) ** 2) / averaged**2
    return float(np.sqrt(structure + np.mean(recording.error[used] ** 2) / recording.noise_sd**2))


def value_of_size(recording: Recording, effect: Effect, wanted: float, seed: int, index: int = 0) -> float:
    """Value at which `effect` alone has size `wanted`, within 1 %, by secants in the logarithms.

    `index` is its place among the effects of the finger: the size is that of the course that it has there.
    """
    tried: list[tuple[float, float]] = []
    value = effect.start
    for _ in range(30):
        got = size(applied(recording, [(effect, value)], seed, index))
        if abs(got / wanted - 1) < 0.01 and value <= effect.largest:
            return value
        if got < wanted and value >= effect.largest:
            break
        tried = sorted([*tried, (np.log(value), np.log(max(got, 1e-6)))])
        below = [each for each in tried if each[1] < np.log(wanted)]
        above = [each for each in tried if each[1] >= np.log(wanted)]
        if below and above:
            (x0, y0), (x1, y1) = below[-1], above[0]
            share = float(np.clip((np.log(wanted) - y0) / (y1 - y0), 0.05, 0.95))
            value = float(np.exp(x0 + (x1 - x0) * share))
        else:
            value = min(value * float(np.clip(wanted / got, 0.1, 10)) ** 1.05, effect.largest)
    raise OutOfReach(f"{effect.key}: no value up to {effect.largest:g} leaves {wanted:g} times the noise")
