"""Fingers whose surface is out of round: does a diagnosis name it, and are touches read right with it?

Fingers, touches and noise are of the simulator of the tests (`tests/independent`), which shares no code with the
package: the radius of the surface is a sum of bells, and its curvature that of the plane curve. Of two rubbers: that of
the practice fingers, and that of the paper's finger with elements nearer to the surface. Each finger is calibrated with
edges and flats, and touched with three tips, 20 samples each; `bayestouch.diagnose` is told nothing. Touches of an exam
that it never saw, drawn from the priors of R and θ_c, are read with the calibration before and after, each several
times with new noise. A bias is the mean error over these.

    python studies/surface_profile.py [FOLDER] [--fingers 6] [--modulus 0.15] [--curvature 0.0084] [--small]
        [--processes N | --scheduler ADDRESS]
    python studies/surface_profile.py --docs            writes the table of docs/made_by_hand.md

FOLDER gets a picture of the profiles that are true, with those that were found.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import sys
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "tests")]

from _page import MADE_BY_HAND, markdown_table, put_into_page  # noqa: E402
from _shared_out import finished  # noqa: E402
from independent import shape  # noqa: E402
from independent.dataset import Simulated, write  # noqa: E402
from independent.finger import Design, Recording, build, record  # noqa: E402
from independent.sizes import applied  # noqa: E402

import bayestouch  # noqa: E402
from bayestouch.contact import composite_radius  # noqa: E402
from bayestouch.data.dataset import load_dataset  # noqa: E402
from bayestouch.data.touch_table import read_touches  # noqa: E402
from bayestouch.data.touches import Touches  # noqa: E402
from bayestouch.diagnosis.pictures.profile import draw_profile, profile_band  # noqa: E402
from bayestouch.effects.surface import SurfaceProfile  # noqa: E402
from bayestouch.finger.chain_with_effects import ChainWithEffects  # noqa: E402
from bayestouch.model.observations import UntimedTouches  # noqa: E402
from bayestouch.output.pictures import RED, canvas, drawing, rendered  # noqa: E402
from bayestouch.results.objects import Calibration  # noqa: E402

EFFECT = shape.EFFECTS[0]
#: Rms of the departure of the curvature, 1/mm: 50 to 160 µm of radius, rms.
CURVATURE = 0.0084
DESIGN = Design(
    samples=20,
    edge_step=3.0,
    flat_step=4.0,
    tips=(0.0, 6.01, np.inf),
    tip_step=6.0,
    tip_span=60.0,
    exam_tips=(1.0,),
    exam_step=1.0,
)
RUBBERS = {
    "0.15 MPa, elements at 9.9 mm": DESIGN,
    "0.054 MPa, elements at 10.3 mm": replace(DESIGN, modulus=0.054, depth=10.3),
}
#: For a look that takes a minute: half as many elements, fewer samples and places.
SMALL = {"eight elements, 0.15 MPa": replace(DESIGN, n_elements=8, samples=8, tip_span=30.0, exam_step=4.0)}
#: Composite radii of blunt tips, mm. Blunter ones are read against the bound R <= r_b, which holds their bias back.
BLUNT_MM = (5.0, 10.0)
#: How often the exam is read.
REPEATS = 8
NAMED = "surface_profile"


@dataclass(frozen=True, eq=False)
class Examined:
    """One finger: what its diagnosis found, and its exam; t touches.

    Attributes
    ----------
    found : tuple of str
        Effects, the first one first.
    verdict : str
        Verdict.
    radius : (t,) array
        True R, mm.
    before, after : (t,) arrays
        Bias of R read with the calibrations before and after, mm.
    predicted, formula : (t,) arrays
        Bias before that the calibration after predicts, and -R² times the departure that it found, mm.
    hit_before, hit_after : (t,) arrays
        How often the 90 % interval of R held the truth.
    band : tuple of (k,) arrays
        Places (degree) and the true profile; if one was found, its 5 %, median and 95 % too.
    """

    found: tuple[str, ...]
    verdict: str
    radius: np.ndarray
    before: np.ndarray
    after: np.ndarray
    predicted: np.ndarray
    formula: np.ndarray
    hit_before: np.ndarray
    hit_after: np.ndarray
    band: tuple[np.ndarray, ...]


def simulated(design: Design, seed: int, curvature: float) -> Simulated:
    """A finger out of round, its touches and their noise; curvature 0 is round."""
    of_finger, of_plan, of_noise = (np.random.default_rng([seed, stream]) for stream in range(3))
    recording = drawn_exam(record(design, build(design, of_finger), of_plan), of_plan)
    recording = applied(recording, [(EFFECT, curvature)], seed)
    readings = recording.signal + design.noise_sd * of_noise.standard_normal(recording.signal.shape)
    loads = recording.read_load + design.force_sd * of_noise.standard_normal(len(recording.time))
    return Simulated(design, recording, readings, loads, {"curvature_rms": curvature})


def drawn_exam(recording: Recording, rng: np.random.Generator) -> Recording:
    """The recording with tips and places of the exam drawn from the priors, uniform in the composite radius."""
    exam = np.arange(len(recording.tip)) >= sum(recording.parts[:2])
    outer, span = recording.finger.body.outer, DESIGN.tip_span
    radius = rng.uniform(0, outer, exam.sum())
    tip, angle = recording.tip.copy(), recording.commanded.copy()
    tip[exam], angle[exam] = 1 / (1 / radius - 1 / outer), rng.uniform(-span, span, exam.sum())
    return replace(recording, tip=tip, commanded=angle, press=replace(recording.press, tip=tip, angle=angle))


def examine(shared: Mapping[str, Design], case: tuple[str, float, int]) -> Examined:
    """Build a finger, let it be diagnosed, and read its exam."""
    rubber, curvature, seed = case
    design = shared[rubber]
    made = simulated(design, seed, curvature)
    with tempfile.TemporaryDirectory() as folder:
        write(made, Path(folder))
        diagnosis = bayestouch.diagnose(load_dataset(folder), seed=seed)
        exam = read_touches(Path(folder) / "exam.csv", load_dataset(folder).sensor)
    before, after = diagnosis.calibration_before, diagnosis.calibration_after
    press, first = made.recording.press, sum(made.recording.parts[:2])
    angle = press.angle[first:]
    radius = composite_radius(press.tip[first:], design.body.outer)
    errors, hits = np.zeros((2, len(radius))), np.zeros((2, len(radius)))
    for touches in again(exam, made, seed):
        for i, calibration in enumerate((before, after)):
            read = bayestouch.infer(touches, calibration, check_sensor=False)
            low, high = read.interval("R", 0.9)
            errors[i] += (read.mean("R") - radius) / REPEATS
            hits[i] += ((low <= radius) & (radius <= high)) / REPEATS
    profile = found_profile(after)
    predicted, formula = np.zeros(len(radius)), np.zeros(len(radius))
    place = np.linspace(-design.tip_span, design.tip_span, 121)
    band: tuple[np.ndarray, ...] = (place, _truth(made, place))
    if profile is not None:
        effect, draws = profile
        mean = effect.departures(angle) @ draws.mean(axis=0)
        formula = -(radius**2) * mean
        touches = expected(exam, after, radius, angle, made.recording.press.load[first:])
        predicted = bayestouch.infer(touches, before, check_sensor=False).mean("R") - radius
        place, *limits = profile_band(effect, draws)
        band = (place, _truth(made, place), *limits)
    return Examined(
        found=diagnosis.effects,
        verdict=diagnosis.verdict,
        radius=radius,
        before=errors[0],
        after=errors[1],
        predicted=predicted,
        formula=formula,
        hit_before=hits[0],
        hit_after=hits[1],
        band=band,
    )


def again(exam: Touches, made: Simulated, seed: int) -> Iterator[Touches]:
    """The touches of the exam, with noise drawn anew."""
    rng, design = np.random.default_rng([seed, 9]), made.design
    rows = made.recording.touch >= sum(made.recording.parts[:2])
    signal, load = made.recording.signal[rows], made.recording.read_load[rows]
    for _ in range(REPEATS):
        yield replace(
            exam,
            readings=signal + design.noise_sd * rng.standard_normal(signal.shape),
            load=load + design.force_sd * rng.standard_normal(len(load)),
        )


def found_profile(calibration: Calibration) -> tuple[SurfaceProfile, np.ndarray] | None:
    """The profile of a calibration and draws (n, k) of its values, if it has one."""
    from bayestouch.model.effect_list import EffectList

    listed = EffectList.of(calibration)
    for effect in () if listed is None else listed.effects:
        if isinstance(effect, SurfaceProfile):
            names = [parameter.name for parameter in effect.public_parameters()]
            return effect, np.stack([np.asarray(calibration.posterior[name]).ravel() for name in names], axis=1)
    return None


def expected(
    exam: Touches, calibration: Calibration, radius: np.ndarray, angle: np.ndarray, load: np.ndarray
) -> Touches:
    """The touches with the readings that a calibration with effects expects of them."""
    chain = ChainWithEffects.of(calibration)
    model = chain.model.observing(UntimedTouches(len(load))).at(radius, np.radians(angle), load)
    readings = model.predict(chain.vector).touches
    return replace(exam, readings=readings[exam.touch], load=load[exam.touch])


def _truth(made: Simulated, place: np.ndarray) -> np.ndarray:
    """Departure of the curvature at places (degree): that of the touches, by a spline through them all."""
    from scipy.interpolate import CubicSpline

    press = made.recording.press
    angle, first = np.unique(press.angle, return_index=True)
    return np.asarray(CubicSpline(angle, np.broadcast_to(press.hump, press.angle.shape)[first])(place))


def explained(fingers: list[Examined], name: str = "predicted") -> float:
    """R²: share of the variance of the bias of R under blunt tips, before, that is predicted."""
    blunt = [(each.radius > BLUNT_MM[0]) & (each.radius < BLUNT_MM[1]) for each in fingers]
    error = np.concatenate([each.before[b] for each, b in zip(fingers, blunt, strict=True)])
    predicted = np.concatenate([getattr(each, name)[b] for each, b in zip(fingers, blunt, strict=True)])
    return float(1 - ((error - predicted) ** 2).sum() / ((error - error.mean()) ** 2).sum())


def row(case: tuple[str, float, int], each: Examined) -> list[str]:
    """One line of the table."""
    rubber, curvature, seed = case
    before, after = (f"{np.sqrt(np.mean(errors**2)):.2f}" for errors in (each.before, each.after))
    covered = [f"{100 * hits.mean():.0f}" for hits in (each.hit_before, each.hit_after)]
    return [
        rubber,
        f"{curvature:g}",
        str(seed),
        f"{each.verdict}{': ' if each.found else ''}{', '.join(each.found)}",
        f"{before} → {after}",
        f"{explained([each]):.2f}" if len(each.band) > 2 else "",
        " → ".join(covered),
    ]


def main(
    cases: list[tuple[str, float, int]], *, processes: int = 1, scheduler: str | None = None
) -> tuple[str, list[Examined]]:
    """Print the table line by line, and rates over all fingers; returns the table, and the fingers."""
    head = [
        "rubber",
        "curvature, rms 1/mm",
        "finger",
        "diagnosis",
        "bias of R, rms mm",
        "bias predicted (share of variance)",
        "coverage of R, %",
    ]
    done: dict[int, Examined] = {}
    for number, result in finished(examine, RUBBERS | SMALL, cases, processes=processes, scheduler=scheduler):
        done[number] = result
        print(" | ".join(row(cases[number], result)), flush=True)
    fingers = [done[number] for number in range(len(cases))]
    for curvature in sorted({case[1] for case in cases}):
        group = [each for case, each in zip(cases, fingers, strict=True) if case[1] == curvature]
        named = sum(each.found[:1] == (NAMED,) for each in group)
        covered = np.array([each.hit_after.mean() for each in group])
        print(
            f"{curvature:g} /mm: {NAMED} found first on {named} of {len(group)}; coverage {100 * covered.mean():.1f} %"
        )
        if named:
            print(f"R² of the bias {explained(group):.2f}, of -R² f {explained(group, 'formula'):.2f}")
    return markdown_table(head, [row(case, each) for case, each in zip(cases, fingers, strict=True)]), fingers


def save_picture(examined: list[Examined], folder: Path) -> None:
    """True profiles, those found first, and what was found of them with its band."""
    shown = sorted(examined, key=lambda each: NAMED not in each.found)[:4]
    with drawing():
        figure, axes = canvas(2.4 * len(shown), len(shown), 1, sharex=True)
        for axis, each in zip(axes[:, 0], shown, strict=True):
            place, truth, *found = each.band
            if found:
                draw_profile(axis, place, (found[0], found[1], found[2]))
            axis.plot(place, truth, color=RED, label="true" if found else "true, not found")
            axis.set(xlabel="place touched (degree)", ylabel="curvature - 1/r_b (1/mm)")
            axis.legend(loc="upper right", ncols=3)
        content = rendered(figure, "png")
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "surface_profile.png").write_bytes(content)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("folder", type=Path, nargs="?", help="where a picture goes")
    parser.add_argument("--fingers", type=int, default=6, help="of each rubber and curvature")
    parser.add_argument("--modulus", type=float, help="only the rubber of this shear modulus, MPa")
    parser.add_argument("--curvature", type=float, help="rms 1/mm; by default 0.0084, then round fingers")
    parser.add_argument("--small", action="store_true", help="one finger of eight elements")
    parser.add_argument("--processes", type=int, default=1, help="of this machine")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="Dask cluster that does the work")
    parser.add_argument("--docs", action="store_true", help="write the table of docs/made_by_hand.md")
    options = parser.parse_args()
    rubbers = [name for name, each in RUBBERS.items() if options.modulus in (None, each.modulus)]
    curvatures = [CURVATURE, 0.0] if options.curvature is None else [options.curvature]
    every = [(r, c, seed) for c in curvatures for r in rubbers for seed in range(options.fingers)]
    one = [(name, CURVATURE, 0) for name in SMALL]
    table, results = main(one if options.small else every, processes=options.processes, scheduler=options.scheduler)
    if options.folder is not None:
        save_picture(results, options.folder)
    if options.docs:
        put_into_page("surface_profile.py", table, MADE_BY_HAND)
