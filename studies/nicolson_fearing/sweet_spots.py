"""Sweet spots explained: bias by location predicted from the calibration alone, and then observed.

Two things can be predicted of the error that all touches at a location share, and one cannot:

size    the calibration posterior makes the bias a random function of location. Its root mean square by location and
        indenter is predicted; the sign on one finger is not, being what the calibration does not know. So a perfect
        prediction explains little of |bias|: the study prints what it could explain at best beside what it does.
sign    where the elastic model misses something, calibration touches show it. The E map identified from them (edges and
        flats) predicts the bias, with its sign, of reading other tips with the model.

Five fingers with random errors of the elements (gain, depth, angle), few calibration touches: size. The same fingers
with errors of the E map as hand-made elements have them (2.06 % of the peak, what Table 1 leaves over): sign. All
touches scored are made with tips that calibrated nothing. Then practice/finger-a.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import _path  # noqa: F401
import numpy as np
from _page import ends, markdown_table
from _published import figure, run_study, save

from bayestouch import infer, load_dataset, simulate
from bayestouch.chain.noise import Noise
from bayestouch.data.dataset import DataSet
from bayestouch.reliability import (
    BiasMap,
    Explained,
    KnownFinger,
    SweetSpots,
    attainable,
    covered,
    draw_bias,
    expected_coverage,
    explained_size,
    known_bias,
    observed_bias,
    shared_by_indenters,
    sweet_spots,
    variance_split,
)
from bayestouch.results.objects import Calibration
from nicolson_fearing.foretold import Foretold
from nicolson_fearing.paper_design import calibrated, indenter, paper_design, with_map_errors
from nicolson_fearing.paper_finger import MISFIT_PERCENT

SEEDS = (0, 1, 2, 3, 4)
CALIBRATORS = (0.0, np.inf)
# Few calibration touches, so that what they leave open is not lost in the noise of a mean of 20.
FEW = {"edge_step_deg": 12.0, "flat_step_deg": 24.0}
MANY = {"edge_step_deg": 3.0, "flat_step_deg": 6.0}
SHARED = Path(os.environ.get("BAYESTOUCH_SHARED", Path(__file__).resolve().parents[3] / "shared"))


@dataclass(frozen=True, eq=False)
class Sizes:
    """Predicted and observed sizes of errors on one finger."""

    name: str
    calibration: Calibration
    known: KnownFinger
    spots: SweetSpots
    seen: BiasMap
    drawn: np.ndarray

    @property
    def score(self) -> Explained:
        """Of |error| by location and indenter."""
        return explained_size(self.spots.radius_error, self.seen.error)

    @property
    def ratio(self) -> float:
        """Observed over predicted root mean square."""
        return float(np.sqrt(np.nanmean((self.seen.error / self.spots.radius_error) ** 2)))


@dataclass(frozen=True, eq=False)
class Signs(Foretold):
    """Bias of reading with the elastic model, predicted by the identified map and observed; and what is left of it."""

    calibration: Calibration
    seen_by_map: BiasMap
    spots: SweetSpots


def read(dataset: DataSet, calibration: Calibration, **changes: Any) -> Any:
    """Posteriors of the touches by importance sampling."""
    return infer(dataset.touches, calibration, method="importance", draws=512, workers=1, **changes)


def as_model(calibration: Calibration) -> Calibration:
    """The elastic calibration behind an identified map."""
    mode, force = calibration.mode, calibration.noise.force_sd
    noise = Noise(mode["noise_sd"], mode["discrepancy_sd"], 0.0, force)
    return replace(calibration, noise=noise, settings={**calibration.settings, "e_map": "model"})


def sizes(name: str, dataset: DataSet, draws: int = 200) -> Sizes:
    """Calibrate, predict, touch, compare."""
    calibration = calibrated(dataset)
    known = KnownFinger.of(calibration)
    posteriors = read(dataset, calibration)
    seen = observed_bias(posteriors, without=CALIBRATORS)
    samples = int(np.median(posteriors.rows.counts))
    spots = sweet_spots(known, seen.indenters_mm, seen.angle_deg, samples=samples)
    bias = draw_bias(known, seen.indenters_mm, seen.angle_deg, samples=samples, draws=draws)["R"]
    rng = np.random.default_rng(0)
    misfit = np.sqrt(np.maximum(spots.bias_rms["R"] ** 2 - bias.var(axis=0), 0.0))
    own = np.hypot(spots.noise_sd["R"], misfit)
    drawn = bias + own * rng.standard_normal(bias.shape)
    errors = spots.radius_offset + drawn * spots.radius_scatter / spots.sd("R")
    return Sizes(name, calibration, known, spots, seen, errors)


def signs(name: str, dataset: DataSet) -> Signs:
    """Calibrate in both ways, predict one by the other, touch, compare."""
    calibration = calibrated(dataset, "empirical")
    model = as_model(calibration)
    posteriors = read(dataset, model)
    seen = observed_bias(posteriors, without=CALIBRATORS)
    places = seen.indenters_mm, seen.angle_deg
    samples = int(np.median(posteriors.rows.counts))
    known, better = KnownFinger.of(model), KnownFinger.of(calibration)
    return Signs(
        name,
        known_bias(known, better, *places, samples=samples)["R"],
        seen,
        calibration=model,
        seen_by_map=observed_bias(read(dataset, calibration), without=CALIBRATORS),
        spots=sweet_spots(known, *places, samples=samples),
    )


def design(small: bool, **calibration: float) -> Any:
    """The paper's finger with these calibration touches."""
    touches = {"touch_step_deg": 2.0, "touch_span_deg": 16.0, "touch_radii_mm": (1.59, 6.01, 12.3)} if small else {}
    return paper_design(samples_per_touch=5 if small else 20, **calibration, **touches)


def interval(pair: tuple[float, float]) -> str:
    return f"[{pair[0]:5.2f}, {pair[1]:5.2f}]"


def print_sizes(found: list[Sizes]) -> None:
    """One line a finger, and what a perfect prediction would score."""
    print("\nSize: predicted root mean square error of R against the error seen, by location and indenter held out")
    print(f"{'finger':>10s} {'seen/pred':>10s} {'R² of |error|':>24s} {'at best':>20s} {'rank':>22s} {'at best':>20s}")
    for each in found:
        score, best = each.score, attainable(each.spots.radius_error, each.drawn)
        print(
            f"{each.name:>10s} {each.ratio:10.2f} {score.r_squared:9.2f} {interval(score.r_squared_interval)} "
            f"{best['r_squared'][0]:5.2f} {interval(best['r_squared'][1:])} "
            f"{score.rank_correlation:7.2f} {interval(score.rank_interval)} "
            f"{best['rank_correlation'][0]:5.2f} {interval(best['rank_correlation'][1:])}"
        )
    seen = np.concatenate([each.seen.error for each in found])
    predicted = np.concatenate([each.spots.radius_error for each in found])
    by_location = explained_size(
        np.stack([np.sqrt((e.spots.radius_error**2).mean(axis=0)) for e in found]),
        np.stack([e.seen.location_rms for e in found]),
    )
    pooled = explained_size(predicted, seen)
    print(f"all fingers together: rank {pooled.rank_correlation:.2f} {interval(pooled.rank_interval)}; ")
    print(
        f"rms over indenters by location: rank {by_location.rank_correlation:.2f} {interval(by_location.rank_interval)}"
    )


def print_signs(found: list[Signs]) -> None:
    """One line a finger."""
    print("\nSign: bias of R read with the elastic model, predicted by the map that the calibration touches identify")
    print(
        f"{'finger':>10s} {'seen rms':>9s} {'R² of bias':>24s} {'rank of |bias|':>22s} {'shared by tips':>15s} "
        f"{'left with the map':>18s} {'shared':>7s}"
    )
    for each in found:
        score, size = each.score, each.size_score
        print(
            f"{each.name:>10s} {rms(each.seen.error):6.3f} mm "
            f"{score.r_squared:9.2f} {interval(score.r_squared_interval)} "
            f"{size.rank_correlation:6.2f} {interval(size.rank_interval)} {each.seen.shared:15.2f} "
            f"{rms(each.seen_by_map.error):15.3f} mm {each.seen_by_map.shared:7.2f}"
        )


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean(values**2)))


def print_split(name: str, dataset: DataSet, calibration: Calibration) -> None:
    """Table 4's split for posterior means, and coverage with and without the calibration's uncertainty.

    Without the force sensor, as in the paper: its reading is the reference that loads are held against.
    """
    averaged = read(dataset, calibration, use_load=False)
    single = read(dataset, calibration, use_load=False, each_sample=True)
    plugged = read(dataset, calibration, use_load=False, plug_in=True)
    known, seen = KnownFinger.of(calibration), observed_bias(averaged)
    places = seen.indenters_mm, seen.angle_deg
    one = sweet_spots(known, *places, use_load=False)
    mean = sweet_spots(known, *places, samples=dataset_samples(dataset), use_load=False)
    blind = sweet_spots(known, *places, samples=dataset_samples(dataset), use_load=False, plug_in=True)
    print(f"\n{name}: standard deviations of posterior means, seen (predicted); load not measured")
    for parameter, unit in (("theta_c", "degree"), ("P", "N/m"), ("R", "mm")):
        split = variance_split(averaged, single, parameter)
        expected = {
            "total": rms(one.sd(parameter)),
            "location": rms(mean.sd(parameter)),
            "noise": rms(one.noise_sd[parameter]),
        }
        cells = "   ".join(f"{part} {split[part]:.3f} ({expected[part]:.3f})" for part in split)
        print(f"  {parameter:>8s} ({unit}): {cells}")
    print("90 % intervals that hold the truth: with the calibration's uncertainty, and without (expected)")
    for parameter in ("theta_c", "P", "R"):
        inside = [100 * float(np.nanmean(covered(each, parameter))) for each in (averaged, plugged)]
        expected_share = 100 * float(np.mean(expected_coverage(blind.noise_sd[parameter], blind.bias_rms[parameter])))
        print(f"  {parameter:>8s}: {inside[0]:.0f} %, {inside[1]:.0f} % ({expected_share:.0f} %)")


def dataset_samples(dataset: DataSet) -> int:
    return int(np.median(np.unique(dataset.touches.touch, return_counts=True)[1]))


def print_elements(each: Sizes) -> None:
    """Which elements make the best and the worst location."""
    spots = each.spots
    tip = len(spots.indenters_mm) // 2
    total = spots.sd("R")[tip]
    angles = np.degrees(each.known.chain.angle)
    print(f"\n{each.name}, {indenter(spots.indenters_mm[tip])}: share of the variance of R by element")
    for label, place in (("sweet spot", int(total.argmin())), ("worst", int(total.argmax()))):
        share = (spots.bias_by_element["R"] + spots.noise_by_element["R"])[tip, place] / total[place] ** 2
        order = np.argsort(-share)[:4]
        parts = ", ".join(f"e{e + 1:02d} at {angles[e]:.1f}° {100 * share[e]:.0f} %" for e in order)
        print(f"  {label} at {spots.angle_deg[place]:.0f}° (sd {total[place]:.3f} mm): {parts}")


def picture(folder: Path, by_size: list[Sizes], sign: Signs) -> None:
    """Predicted and seen, by location."""
    figures, (left, middle, right) = figure(3, figsize=(13.5, 4.2))
    place = by_size[0].seen.angle_deg
    seen = np.stack([each.seen.error for each in by_size])
    predicted = np.stack([each.spots.radius_error for each in by_size])
    count = seen.shape[0] * seen.shape[1]
    level = np.sqrt(np.nanmean(seen**2, axis=(0, 1)))
    left.errorbar(place, level, level / np.sqrt(2 * count), fmt=".", color="C0", label="seen")
    left.plot(place, np.sqrt((predicted**2).mean(axis=(0, 1))), "C1-", label="predicted before any touch")
    for angle in by_size[0].calibration.sensor.body.element_angles_deg:
        if abs(angle) <= place.max():
            left.axvline(angle, color="0.85", zorder=0)
    left.set(xlabel="location (degree); grey: elements", ylabel="rms error of R (mm)")
    left.set_title(f"model right: the size is predicted (fingers: {len(by_size)}, all tips)")
    left.set_ylim(0, None)
    left.legend()
    for colour, i in enumerate((0, len(sign.seen.indenters_mm) // 2, -1)):
        name = indenter(sign.seen.indenters_mm[i])
        middle.plot(sign.seen.angle_deg, sign.seen.error[i], f"C{colour}.", ms=5, label=f"{name}, seen")
        middle.plot(sign.seen.angle_deg, sign.predicted[i], f"C{colour}-", lw=1)
    middle.set(xlabel="location (degree)", ylabel="bias of R (mm)")
    middle.set_title(f"{sign.name}, model misses something:\nthe sign is predicted (lines)")
    middle.legend()
    right.plot(sign.predicted.ravel(), sign.seen.error.ravel(), ".", ms=4, label="read with the model")
    right.plot(sign.predicted.ravel(), sign.seen_by_map.error.ravel(), ".", ms=3, alpha=0.6, label="read with the map")
    ends = np.array([sign.predicted.min(), sign.predicted.max()])
    right.plot(ends, ends, color="0.6")
    right.set(xlabel="bias of R predicted before any touch (mm)", ylabel="bias of R seen (mm)")
    right.set_title(f"R² {sign.score.r_squared:.2f}, indenters held out")
    right.legend()
    save(figures, folder, "sweet_spots")


def for_the_page(by_size: list[Sizes], by_sign: list[Signs], real: tuple[Sizes, Signs] | None) -> str:
    """Tables of the documentation: smallest and largest value over the fingers."""
    errors = f"simulated, errors of the E map of {MISFIT_PERCENT['model']:.2f} % of the peak"
    size_rows, sign_rows = [_size_row("simulated, few calibration touches", by_size)], [_sign_row(errors, by_sign)]
    if real is not None:
        size_rows.append(_size_row("practice/finger-a", [real[0]]))
        sign_rows.append(_sign_row("practice/finger-a", [real[1]]))
    of_size = ["size of the error", "seen over predicted", "R² (at best)", "rank (at best)", "shared by tips"]
    of_sign = ["sign of the bias", "R²", "rank of absolute bias", "shared by tips", "rms error, mm", "with the map, mm"]
    return markdown_table(of_size, size_rows) + "\n" + markdown_table(of_sign, sign_rows)


def _size_row(name: str, some: list[Sizes]) -> list[str]:
    best = [attainable(each.spots.radius_error, each.drawn) for each in some]
    return [
        name,
        ends(each.ratio for each in some),
        f"{ends(each.score.r_squared for each in some)} ({ends(b['r_squared'][0] for b in best)})",
        f"{ends(each.score.rank_correlation for each in some)} ({ends(b['rank_correlation'][0] for b in best)})",
        ends(each.seen.shared for each in some),
    ]


def _sign_row(name: str, some: list[Signs]) -> list[str]:
    return [
        name,
        ends(each.score.r_squared for each in some),
        ends(each.size_score.rank_correlation for each in some),
        ends(each.seen.shared for each in some),
        ends(rms(each.seen.error) for each in some),
        ends(rms(each.seen_by_map.error) for each in some),
    ]


def practice(folder: Path) -> tuple[Sizes, Signs] | None:
    """Finger-a, whose truth says that no effect is on; None where the folder is absent."""
    path = folder / "practice" / "finger-a"
    if not path.is_dir():
        print("\npractice/finger-a: set $BAYESTOUCH_SHARED, or put the folder `shared` beside the checkout")
        return None
    truth = folder / "practice" / "truth" / "finger-a" / "truth.json"
    effects = json.loads(truth.read_text())["effects"] if truth.is_file() else "unknown"
    print(f"\npractice/finger-a (effects: {effects or 'none'})")
    dataset = load_dataset(path)
    return sizes("finger-a", dataset), signs("finger-a", dataset)


def main(
    small: bool = False, folder: Path | None = None
) -> tuple[list[Sizes], list[Signs], tuple[Sizes, Signs] | None]:
    """Print every table and save the picture."""
    seeds = SEEDS[:1] if small else SEEDS
    few = [simulate(design(small, **FEW), seed=seed) for seed in seeds]
    by_size = [sizes(f"finger {seed}", each.dataset) for seed, each in zip(seeds, few, strict=True)]
    print_sizes(by_size)
    print_elements(by_size[0])
    print_split("finger 0", few[0].dataset, by_size[0].calibration)
    by_sign = []
    for seed in seeds:
        made = with_map_errors(simulate(design(small, **MANY), seed=seed), MISFIT_PERCENT["model"], seed)
        by_sign.append(signs(f"finger {seed}", made))
    print_signs(by_sign)
    drawn = [shared_by_indenters(one) for one in by_size[0].drawn[:50]]
    print(f"shared by tips where the model is right: {by_size[0].seen.shared:.2f} (predicted {np.mean(drawn):.2f})")
    real = None if small else practice(SHARED)
    if real is not None:
        print_sizes([real[0]])
        print_signs([real[1]])
    if folder is not None:
        picture(folder, by_size, by_sign[0])
    return by_size, by_sign, real


if __name__ == "__main__":
    run_study(main, __doc__, "nicolson_fearing/sweet_spots.py", lambda found: for_the_page(*found))
