"""The catalogue of effects as a page: docs/effects.md with a picture of what each effect does to readings.

    python studies/effects_gallery.py [FOLDER]

Text and parameters come from the classes. The pictures are of the paper's finger, touched with six tips at 73
locations: left what the effect changes in the mean reading of each touch, at the size that the title states; right what
is left of that when gains, depths, angles and the rubber have been fitted anew, which is all that a diagnosis can see.
"""

from __future__ import annotations

import argparse
import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from _effects_page import page

from bayestouch.chain.recording import Recording
from bayestouch.contact import composite_radius
from bayestouch.diagnosis.pictures.maps import binned, draw_map, most_telling
from bayestouch.effects import Effect, NoiseEffect, RandomEffect, Setting, effect_classes
from bayestouch.effects.effect import OWN
from bayestouch.effects.listing import PAD, typical
from bayestouch.effects.readout import RestOffset
from bayestouch.effects.surface import SurfaceProfile
from bayestouch.finger.quantities import quantities
from bayestouch.finger.start import base_fit
from bayestouch.model.fitting import Fitted, drift_columns
from bayestouch.model.quantities import Quantity
from bayestouch.model.split_data import SplitData
from bayestouch.output.pictures import BLUE, GREY, RED, canvas, drawing, rendered
from bayestouch.simulation import FingerDesign, simulate

DOCS = Path(__file__).resolve().parent.parent / "docs"
# Largest change that is drawn, over the peak reading.
LARGEST = 0.05


@dataclass(frozen=True, eq=False)
class Scene:
    """A fitted finger under touches that show every effect."""

    fitted: Fitted
    setting: Setting
    quantities: tuple[Quantity, ...]

    @classmethod
    def of(cls, contact: str) -> Scene:
        design = FingerDesign(
            samples_per_touch=2, edge_step_deg=3.0, flat_step_deg=6.0, touch_radii_mm=(0.0, 2.0, 6.0, np.inf)
        )
        data = SplitData.of(simulate(design, seed=1).dataset)
        observed = data.observations(data.training | data.held_out)
        fitted = base_fit(observed, data.dataset.sensor, contact)
        model, recording = fitted.model, fitted.model.poses(fitted.vector)
        signal = model.predict(fitted.vector).touches / model.peak
        shown = quantities(
            observed,
            np.asarray(model.finger.element_angles_deg),
            recording.place[0],
            composite_radius(recording.indenter_radius_mm, model.finger.outer_radius_mm),
            recording.load,
            signal,
            model.peak,
        )
        return cls(fitted, data.setting(contact, model.reference_load), shown)

    def change(self, effect: Effect, values: tuple[float, ...]) -> np.ndarray:
        """What the effect adds to the mean readings, (t, m)."""
        fitted = self.fitted
        if isinstance(effect, RandomEffect):
            columns = drift_columns(fitted.model, fitted.vector, ((effect, values),))
            return np.tensordot(np.random.default_rng(3).standard_normal(len(columns)), columns, axes=1)
        model = fitted.model.with_effects((effect,))
        with_it, without = (
            model.predict(model.extended(fitted.vector, each)).touches for each in (values, effect.without(values))
        )
        return with_it - without

    def left(self, change: np.ndarray) -> np.ndarray:
        """What the base parameters cannot take up of a change, (t, m)."""
        fitted = self.fitted
        slopes, _ = fitted.model.derivatives(fitted.vector)
        gradient = fitted.linear.jacobian.T @ fitted.whitening.touches(change).ravel()
        step = np.linalg.solve(fitted.linear.hessian(), gradient)
        return change - np.tensordot(step, slopes, axes=1)


def sized(scene: Scene, effect: Effect) -> tuple[tuple[float, ...], np.ndarray]:
    """Values at which the largest change is `LARGEST`, and the change over the peak."""
    values = effect.probes[len(effect.probes) // 2]
    if isinstance(effect, SurfaceProfile):
        # a constant profile would be taken for another modulus: five waves over the range
        values = tuple(np.array(values) * np.cos(np.linspace(0, 10 * np.pi, len(values))))
    if isinstance(effect, RestOffset):
        values = tuple(np.array(values) * (-1.0) ** np.arange(len(values)))
    peak = scene.fitted.model.peak
    for _ in range(3):
        change = scene.change(effect, values) / peak
        factor = LARGEST / max(float(np.abs(change).max()), 1e-12)
        scaled = list(values)
        for i in effect.amplitudes:
            if np.isfinite(effect.parameters[i].null or 0.0):
                low, high = effect.parameters[i].prior.support
                scaled[i] = float(np.clip(values[i] * factor, low, high))
        values = tuple(scaled)
    return values, scene.change(effect, values) / peak


def stated(effect: Effect, values: tuple[float, ...]) -> str:
    """Values with names and units; of those of the elements only the first two."""
    pairs = [(p, v) for p, v in zip(effect.parameters, values, strict=True) if not p.of_element or p.name <= f"{OWN}02"]
    return ", ".join(f"{p.name.replace('_', ' ')} {v:.3g} {p.unit}".rstrip() for p, v in pairs)


def maps(scene: Scene, effect: Effect) -> bytes:
    """Change and what is left of it, as maps."""
    values, change = sized(scene, effect)
    with drawing():
        figure, axes = canvas(3.1, 1, 2, sharey=True)
        draw_change(figure, axes[0], scene, change)
        figure.suptitle(stated(effect, values), fontsize=10)
        return rendered(figure, "png")


def draw_change(figure: Any, axes: Any, scene: Scene, change: np.ndarray) -> None:
    """Draw the maps of a change over the peak, and of what is left of it."""
    left = scene.left(change * scene.fitted.model.peak) / scene.fitted.model.peak
    quantity = most_telling(scene.quantities, left)
    for axis, each, title in zip(axes, (change, left), ("what it changes", "what fits leave of it"), strict=True):
        limit = 100 * float(np.nanmax(np.abs(binned(quantity, each)[1])))
        mesh = draw_map(axis, quantity, each, limit)
        axis.set_title(title)
        figure.colorbar(mesh, ax=axis, label="% of the peak", shrink=0.9)
    axes[0].set_ylabel("element")


def profile(scene: Scene, effect: SurfaceProfile) -> bytes:
    """The profile, then its change and what is left of it."""
    values, change = sized(scene, effect)
    place = np.linspace(effect.knots_deg[0], effect.knots_deg[-1], 361)
    with drawing():
        figure, axes = canvas(3.1, 1, 3)
        axes[0, 0].plot(place, effect.departures(place) @ np.array(values), color=BLUE)
        axes[0, 0].set(xlabel="place touched (degree)", ylabel="curvature - 1/r_b (1/mm)", title="the profile")
        draw_change(figure, axes[0, 1:], scene, change)
        return rendered(figure, "png")


def lines(effect: Effect) -> bytes:
    """Readings of one element under six touches, with the effect and without."""
    rng = np.random.default_rng(2)
    peaks, n = np.array([1.0, 0.3, 0.8, 0.1, 0.6, 0.0]), 12
    signal, sd = np.repeat(peaks, n)[:, None], 0.02
    held = np.tile(np.linspace(0, 1.0, n), len(peaks))
    time = held + np.repeat(np.arange(len(peaks)), n) * 1.4
    noise = sd * rng.standard_normal((len(time), 1))
    without, what = signal + noise, ""
    if isinstance(effect, NoiseEffect):
        values = {"common_mode_noise": (0.05, 1.0), "signal_dependent_noise": (0.1, 1.0), "outliers": (0.1, 0.3)}[
            effect.name
        ]
        if effect.name == "common_mode_noise":
            more = np.repeat(values[0] * rng.standard_normal((len(time), 1)), 2, axis=1)
            signal = signal * np.array([1.0, 0.5])
            without = signal + sd * rng.standard_normal(signal.shape)
            changed, what = without + more, " (two elements)"
        elif effect.name == "signal_dependent_noise":
            changed = without + values[0] * signal ** values[1] * rng.standard_normal(signal.shape)
        else:
            wrong = rng.random(signal.shape) < values[0]
            changed = without + wrong * values[1] * rng.standard_normal(signal.shape)
    else:
        values = (0.15, 0.3)
        recording = Recording(
            *(np.zeros(len(time)), (np.zeros(len(time)),), np.ones(len(time)), time, held, (np.zeros(1),)),
            peak=np.ones(1),
            reference_load=1.0,
            signal=signal,
        )
        changed = effect.signal(recording, values) + noise
    with drawing():
        figure, axes = canvas(2.8, 1, 1)
        axes[0, 0].plot(time, without, ".", color=GREY, label=None)
        axes[0, 0].plot(time, changed, "x", color=RED, ms=4)
        axes[0, 0].plot([], [], ".", color=GREY, label="without")
        axes[0, 0].plot([], [], "x", color=RED, label=f"with {stated(effect, values)}{what}")
        axes[0, 0].set(xlabel="time (s)", ylabel="reading over the peak")
        axes[0, 0].legend(loc="upper right", ncols=2)
        return rendered(figure, "png")


def of_load(effect: Effect) -> bytes:
    """Load that acts against load that is read: for effects of pads."""
    load = np.linspace(0, 2, 60)
    values = (0.3, 0.1)
    recording = Recording(
        *(np.zeros(60), (np.zeros(60),), load, np.zeros(60), np.zeros(60), (np.zeros(1),)),
        peak=np.ones(1),
        reference_load=1.0,
        signal=np.zeros((60, 1)),
    )
    with drawing():
        figure, axes = canvas(2.8, 1, 1)
        axes[0, 0].plot(load, load, color=GREY, ls=":", label="in proportion to the load")
        axes[0, 0].plot(load, effect.pose(recording, values).load, color=BLUE, label=f"with {stated(effect, values)}")
        axes[0, 0].set(xlabel="load (N; the reference is 1)", ylabel="readings (relative)")
        axes[0, 0].legend()
        return rendered(figure, "png")


def of_hold(effect: Effect) -> bytes:
    """Readings of three elements while a touch is held: for effects of pads."""
    held, shares, rest = np.linspace(0, 3, 60), (-0.2, -0.1, -0.05), len(effect.parameters) - 4
    recording = Recording(
        *(np.full(60, np.nan), (np.zeros(60),), np.ones(60), held, held, (np.zeros(3 + rest),)),
        peak=np.ones(3 + rest),
        reference_load=1.0,
        signal=np.ones((60, 3 + rest)),
    )
    changed = effect.signal(recording, (*shares, *[0.0] * rest, 0.6))
    with drawing():
        figure, axes = canvas(2.8, 1, 1)
        axes[0, 0].plot(held, recording.signal[:, 0], color=GREY, ls=":", label="without")
        for e, share in enumerate(shares):
            axes[0, 0].plot(held, changed[:, e], color=BLUE, alpha=1 - 0.3 * e, label=f"share {share:g}, time 0.6")
        axes[0, 0].set(xlabel="time since the touch began", ylabel="reading (relative)")
        axes[0, 0].legend()
        return rendered(figure, "png")


def picture(effect: Effect, scenes: dict[str, Scene]) -> bytes:
    """The picture of one effect."""
    if isinstance(effect, NoiseEffect) or effect.name == "creep":
        return lines(effect)
    if type(effect).suited(PAD) is not None and type(effect).suited(scenes["layer"].setting) is None:
        contact = "hertz"
        if type(effect).suited(replace(scenes["layer"].setting, contact="hertz")) is None:
            return of_hold(effect) if effect.needs_samples else of_load(effect)
    contact = "layer" if type(effect).suited(scenes["layer"].setting) is not None else "hertz"
    if contact not in scenes:
        scenes[contact] = Scene.of(contact)
    suited = type(effect).suited(scenes[contact].setting)
    assert suited is not None
    return profile(scenes[contact], suited) if isinstance(suited, SurfaceProfile) else maps(scenes[contact], suited)


def main(folder: Path = DOCS) -> None:
    """Write the page and all pictures."""
    scenes = {"layer": Scene.of("layer")}
    (folder / "effects").mkdir(parents=True, exist_ok=True)
    for name, cls in effect_classes().items():
        effect = typical(cls)
        assert effect is not None
        (folder / "effects" / f"{name}.png").write_bytes(picture(effect, scenes))
        print(name)
    (folder / "effects.md").write_text(page(), encoding="utf-8", newline="\n")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("folder", type=Path, nargs="?", default=DOCS, help="where page and pictures go")
    main(parser.parse_args().folder)
