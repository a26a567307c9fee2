"""A finger with an effect that nobody declared: its errors of R by location before and after the diagnosis.

The effect is a soft spot: all elements read more where the touch is near 7°. `bayestouch.diagnose` is given the data
set and nothing else. The picture is on the first page of the documentation and in the README:
`python studies/gallery.py before_and_after` makes it again.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from _published import figure, options, save
from matplotlib.patches import Circle, Wedge

import bayestouch
from bayestouch.contact import composite_radius
from bayestouch.diagnosis.traced import EvaluatedModel

EFFECT, SIZE = "soft_spot", 0.2
#: Middle of the simulated soft spot and its half width at half the height (sd 10°), degree.
MIDDLE_DEG, HALF_WIDTH_DEG = 7.0, 10 * float(np.sqrt(2 * np.log(2)))
EFFECTS = {EFFECT: SIZE, f"{EFFECT}.centre": MIDDLE_DEG, f"{EFFECT}.width": HALF_WIDTH_DEG}
BEFORE, AFTER = "#b8360b", "#1f6fb4"
TEXT = 12
RUBBER, SPOT, CORE, TIP = "#e8d9b8", "#f0a070", "#c9ccd1", "#9fb8cc"


@dataclass(frozen=True)
class Errors:
    """What the study gives; k locations at which touches were held out.

    Attributes
    ----------
    diagnosis : Diagnosis
        Of the simulated finger.
    location_deg : (k,) array
        Location of the touch, degree.
    before_mm, after_mm : (k,) arrays
        Root mean square error of R over the round tips at that location, mm.
    """

    diagnosis: bayestouch.Diagnosis
    location_deg: np.ndarray
    before_mm: np.ndarray
    after_mm: np.ndarray


def errors_by_location(stand: EvaluatedModel, outer_mm: float) -> tuple[np.ndarray, np.ndarray]:
    """Locations (k,) in degree and the rms error of R there (k,) in mm, over held-out touches with round tips."""
    held, read = stand.held_out, stand.read
    assert held is not None
    assert read is not None
    means = held.observed.means
    tip, place = means.indenter_radius_mm, means.angle_deg
    assert tip is not None and place is not None
    tip_round = (tip > 0) & np.isfinite(tip)
    squares = (read.R_mm - composite_radius(tip, outer_mm)) ** 2
    places = np.unique(np.round(place[tip_round], 6))
    rms = [np.sqrt(squares[tip_round & np.isclose(place, each)].mean()) for each in places]
    return places, np.array(rms)


def run(small: bool, seed: int = 0) -> Errors:
    """Simulate a finger with the effect, diagnose it, and compare."""
    fewer = {"n_elements": 8, "touch_step_deg": 4.0, "edge_step_deg": 3.0, "flat_step_deg": 9.0, "samples_per_touch": 5}
    design = bayestouch.FingerDesign(**fewer, calibration_span_deg=45.0) if small else bayestouch.FingerDesign()
    dataset = bayestouch.simulate(design, effects=EFFECTS, seed=seed).dataset
    diagnosis = bayestouch.diagnose(dataset, seed=seed)
    places, before = errors_by_location(diagnosis.traced.before, design.outer_radius_mm)
    _, after = errors_by_location(diagnosis.traced.after, design.outer_radius_mm)
    return Errors(diagnosis, places, before, after)


def print_errors(found: Errors) -> None:
    """The diagnosis in words, and the errors by location."""
    print(found.diagnosis)
    print(f"{'location':>10s}{'rms error of R (mm)':>24s}")
    print(f"{'degree':>10s}{'before':>12s}{'after':>12s}")
    for place, before, after in zip(found.location_deg, found.before_mm, found.after_mm, strict=True):
        print(f"{place:10.1f}{before:12.2f}{after:12.2f}")


def around(radius_mm: float, angle_deg: float) -> tuple[float, float]:
    """Place of a point of the cross-section, 0° at the top."""
    turn = np.radians(angle_deg)
    return radius_mm * float(np.sin(turn)), radius_mm * float(np.cos(turn))


def draw_finger(axis: Any, design: bayestouch.FingerDesign) -> None:
    """The finger's cross-section with its elements, a tip that presses, and the soft spot."""
    core, outer, tip = design.core_radius_mm, design.outer_radius_mm, 6.01
    first, last = MIDDLE_DEG - HALF_WIDTH_DEG, MIDDLE_DEG + HALF_WIDTH_DEG
    axis.add_patch(Wedge((0, 0), outer, 0, 180, width=outer - core, color=RUBBER))
    axis.add_patch(Wedge((0, 0), outer, 90 - last, 90 - first, width=outer - core, color=SPOT))
    axis.add_patch(Wedge((0, 0), core, 0, 180, color=CORE))
    angles = (np.arange(design.n_elements) - (design.n_elements - 1) / 2) * design.pitch_deg
    places = [around(design.sensing_radius_mm, angle) for angle in angles]
    axis.plot(*np.transpose(places), "s", ms=4, color="black")
    at = around(outer + tip, -20.0)
    axis.add_patch(Circle(at, tip, color=TIP))
    axis.text(*at, "probe", ha="center", va="center", size=TEXT)
    axis.annotate(
        "soft spot that\nnobody declared",
        around(outer - 0.8, MIDDLE_DEG),
        (8.6, outer + 5.0),
        ha="center",
        color=BEFORE,
        size=TEXT,
        arrowprops={"arrowstyle": "-", "color": BEFORE},
    )
    axis.text(0, 0.7, "rubber finger with\nstrain sensors (black)", ha="center", size=TEXT)
    axis.set(xlim=(-outer - 0.5, outer + 2.5), ylim=(-0.2, outer + 2 * tip - 0.3), aspect="equal")
    axis.set_axis_off()


def draw_errors(axis: Any, found: Errors) -> None:
    """Errors over location, before and after, with the soft spot in the background."""
    axis.axvspan(MIDDLE_DEG - HALF_WIDTH_DEG, MIDDLE_DEG + HALF_WIDTH_DEG, color=SPOT, alpha=0.3, lw=0)
    numbers, top = found.diagnosis.to_dict(), float(found.before_mm.max())
    for values, colour, part, words, height in (
        (found.before_mm, BEFORE, "before", "before", 1.28 * top),
        (found.after_mm, AFTER, "after", "after the diagnosis", 1.13 * top),
    ):
        axis.plot(found.location_deg, values, "-", lw=2.4, color=colour)
        text = f"{words}: {numbers[part]['R_rms_mm']:.2f} mm rms"
        axis.text(found.location_deg[0] + 1, height, text, color=colour, size=TEXT, weight="bold")
    axis.text(13.5, 0.95 * top, "soft spot", color=BEFORE, size=TEXT, ha="center")
    axis.set(xlabel="where the probe touches (degree)", ylim=(0, 1.4 * top))
    axis.set_title("error of the radius that is read (mm)", size=TEXT, loc="left")
    axis.xaxis.label.set_size(TEXT)
    axis.tick_params(labelsize=TEXT)
    axis.margins(x=0)


def draw(found: Errors, folder: Path) -> None:
    """Save the finger and its errors as one picture, readable at 800 pixels."""
    picture, (left, right) = figure(2, figsize=(8.0, 3.4), width_ratios=(1.0, 1.3))
    draw_finger(left, bayestouch.FingerDesign())
    draw_errors(right, found)
    save(picture, folder, "before_and_after")


def main(small: bool = False, folder: Path | None = None) -> Errors:
    """Run, print, draw."""
    found = run(small)
    print_errors(found)
    if folder is not None:
        draw(found, folder)
    return found


if __name__ == "__main__":
    main(*options(__doc__))
