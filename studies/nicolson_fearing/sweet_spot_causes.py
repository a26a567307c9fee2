"""Sweet spots by physical cause: rows of Table 4, what tips share, and what calibration touches foretell of the bias.

    python studies/nicolson_fearing/sweet_spot_causes.py [FOLDER] [--small] [--no-pictures] [--docs]

Each cause acts alone on linear fingers, in the amount that `explained` infers from the paper's tables. Noise is that of
means of 20 samples. The bias of R of round tips is predicted from calibration touches alone, and scored about zero:
from edges (the identified E map, and what it leaves over at the place), or from edges and flats every 3°, which see
the width of the contact.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

from dataclasses import dataclass, replace
from pathlib import Path

import _path  # noqa: F401
import numpy as np
from _page import DOCS, markdown_table
from _published import figure, run_study, save

from bayestouch.contact import composite_radius
from bayestouch.paper.published import number
from bayestouch.reliability import shared_by_indenters
from nicolson_fearing import figure_13
from nicolson_fearing.explained_case import posterior_mean
from nicolson_fearing.explained_fit import finger as finger_of
from nicolson_fearing.finger_errors import AT, OF_TABLE_3, SAMPLES, EdgeErrors, true_radii
from nicolson_fearing.linear_finger import Calibrated, LinearFinger
from nicolson_fearing.linear_touches import LOAD, R_B, Estimates, TouchFits, read_by_curvature
from nicolson_fearing.made_by_hand_causes import (
    OFF_CENTRE_MM,
    TILT_LOAD,
    TURN,
    Cause,
    core_off_centre,
    nothing,
    prober_off_centre,
    tilted_tips,
    turned_tips,
)
from nicolson_fearing.paper_finger import CALIBRATIONS, DESIGN, LOCATIONS_DEG
from nicolson_fearing.paper_run import TIPS_MM
from nicolson_fearing.residual_parts import ResidualParts
from nicolson_fearing.surface_causes import contact_shares, curved, fine_maps, load_by_place, pushed_along
from nicolson_fearing.unknowns import Unknowns

FloatArray = np.ndarray

PAGE = DOCS / "1995.md"
SCRIPT = "nicolson_fearing/sweet_spot_causes.py"
FINGERS = 12
CURVATURE_PER_MM = 0.0084
"""Of the surface, as in `studies/surface_profile.py`; the tables of 1995 say nothing of its size."""
NO_ERRORS = {"map_error": 0.0, "place_error": 0.0, "tail": 0.0, "prober_deg": 0.0, "drift": 0.0, "tip_sd_mm": 0.0}
INFERRED = {
    "E maps, near the touch": ("map_error",),
    "E maps, tails": ("tail",),
    "places, every element its own": ("place_error",),
    "location of the prober": ("prober_deg",),
    "drift from touch to touch": ("drift",),
}
CURVED = "curvature of the surface"
LOAD_PERCENT, PUSH_PERCENT = 2.0, 5.0
FINE_PERCENT = 1.3
FINE, ALLOWED = f"fine E maps, {FINE_PERCENT:g} %", "fine E maps, load, push, curvature and core"
IN_MIXTURE = (1.3, 2.1, 2.2, 0.017, 0.11)
"""Amounts of these in `place_mixtures`, in that order; the curvature in 1/mm, the core in mm."""
BY_LOAD, BY_PUSH = f"load by place, {LOAD_PERCENT:g} %", f"push along the surface, {PUSH_PERCENT:g} %"
TOGETHER, ALL = "inferred ones and curvature", "all of these"


@dataclass(frozen=True)
class Alone:
    """Causes that act together: names of unknowns that are as inferred, and what was made by hand."""

    free: tuple[str, ...] = ()
    made: tuple[Cause, ...] = ()


CORE = f"core {OFF_CENTRE_MM:g} mm off centre"
PANELS = (*list(INFERRED)[:4], CURVED, CORE, TOGETHER, ALL)
NONE_MM = 0.1  # half of the noise of a mean of 20: a smaller bias is not scored
ROUND = np.array([1.0 < tip < np.inf for tip in TIPS_MM])
_FLAT = TIPS_MM.index(np.inf)
FIGURE_13 = [TIPS_MM.index(tip) for tip in figure_13.TIPS]
_TRUE_13 = composite_radius(np.array(figure_13.TIPS), R_B)


@dataclass(frozen=True, eq=False)
class Seen:
    """Errors of one finger's averages, and predictions of the errors of R: (2, tips, places); mm.

    Attributes
    ----------
    angle_deg, load, radius_mm : (2, tips, places) arrays
        Errors of θ_c, P and R.
    bias_mm : (2, tips, places) array
        Errors of R without noise.
    by_edges, by_flats : (2, tips, places) arrays
        Predicted errors of R, from edges, and from edges and flats.
    of_elements : (2,) array
        Mean errors of the elements in Tables 1 and 2, % of the peak.
    """

    angle_deg: FloatArray
    load: FloatArray
    radius_mm: FloatArray
    bias_mm: FloatArray
    by_edges: FloatArray
    by_flats: FloatArray
    of_elements: FloatArray


def cases(u: Unknowns) -> dict[str, Alone]:
    """All rows of the table; the sine of a prober off centre has the rms of its errors by place."""
    names = tuple(name for names in INFERRED.values() for name in names)
    made: dict[str, Cause] = {
        FINE: fine_maps(FINE_PERCENT),
        BY_LOAD: load_by_place(LOAD_PERCENT),
        BY_PUSH: pushed_along(PUSH_PERCENT),
        CORE: core_off_centre(OFF_CENTRE_MM),
        "axis of the prober off centre": prober_off_centre(u.prober_deg),
        f"tips tilted along the finger, {TILT_LOAD:g} N/m": tilted_tips,
        f"tips turned by {np.degrees(TURN):.0f}°": turned_tips,
    }
    surface = curved(CURVATURE_PER_MM)
    kinds = (fine_maps, load_by_place, pushed_along, curved, core_off_centre)
    allowed = tuple(kind(amount) for kind, amount in zip(kinds, IN_MIXTURE, strict=True))
    others = tuple(name for name in names if name != "place_error")
    return {
        **{cause: Alone(free) for cause, free in INFERRED.items()},
        CURVED: Alone(made=(surface,)),
        **{cause: Alone(made=(each,)) for cause, each in made.items()},
        TOGETHER: Alone(names, (surface,)),
        ALLOWED: Alone(others, allowed),
        # errors of the elements' own take the part of fine maps there
        ALL: Alone(names, (surface, *(cause for name, cause in made.items() if name != FINE))),
        "none: noise alone": Alone(),
    }


def touched(u: Unknowns, seed: int, made: tuple[Cause, ...] = ()) -> Seen:
    """Calibrate, predict, touch."""
    finger, rng = finger_of(seed), np.random.default_rng([seed, 21])
    wrong = EdgeErrors.of(u, finger.levels, rng)
    radii = true_radii(u, rng)
    by_hand = np.random.default_rng([seed, 22])
    added = sum((cause(finger, u, radii, by_hand) for cause in made), nothing(finger))
    found = finger.calibrated(wrong, added)
    reach = finger.reach(u, radii)
    quiet = finger.levels / np.sqrt(SAMPLES)
    shape = (len(TIPS_MM), len(LOCATIONS_DEG))
    drift = u.drift / 100 * rng.standard_normal(shape)
    missed = finger.missed(found, reach) + added.tips
    averaged = reach.fit(missed + quiet * rng.standard_normal((*shape, len(quiet))), drift)
    silent = reach.fit(np.zeros((2, *shape, len(quiet))), np.zeros(shape))

    def radius(estimates: Estimates) -> FloatArray:
        return estimates.radius_mm(u.modulus_MPa, u.squeeze_mm)

    true = composite_radius(np.array(TIPS_MM), R_B)
    base = radius(silent)
    curved_mm = read_by_curvature(u, true, added.curvature_per_mm)[1]
    seen, bias = (radius(each) - base + curved_mm for each in (averaged, reach.fit(missed, np.zeros(shape))))
    at = np.arange(0, shape[1], int(DESIGN.flat_step_deg))
    flat_strains = missed + quiet * rng.standard_normal((*shape, len(quiet)))
    strains = foretold(finger, found, reach, contact_shares(u, true), flat_strains[:, _FLAT, at], at)
    by_edges = radius(reach.fit(strains, np.zeros(shape))) - base
    # what flats read beside what the edges foretell is taken for curvature
    per_f = read_by_curvature(u, true, np.ones(shape[1]))[1]
    flats = reach.fit(flat_strains, 0 * drift)
    left = (radius(flats) - base + curved_mm - by_edges)[:, _FLAT, at] / per_f[_FLAT, at]
    share = np.clip(1 - _noise_of_flats(reach, quiet, u) / per_f[_FLAT, 0] ** 2 / (left**2).mean(axis=1), 0.0, 1.0)
    guess = np.array([np.interp(LOCATIONS_DEG, LOCATIONS_DEG[at], s * x) for s, x in zip(share, left, strict=True)])
    by_flats = by_edges + per_f * guess[:, None]
    angle = averaged.angle_error_deg + found.prober
    sizes = np.array([each.mean() for each in found.errors])
    return Seen(angle, averaged.load_error, seen, bias, by_edges, by_flats, sizes)


def _noise_of_flats(reach: TouchFits, quiet: FloatArray, u: Unknowns) -> float:
    """Variance of a flat's R by the noise of a mean, mm², to first order and without what P adds."""
    solve = reach.solve[_FLAT]
    per_kappa = u.modulus_MPa / (LOAD / 1000)
    return float(per_kappa**2 * np.mean((solve[:, 2] ** 2 * quiet**2).sum(axis=-1)))


def foretold(
    finger: LinearFinger,
    found: Calibrated,
    reach: TouchFits,
    shares: FloatArray,
    flat_strains: FloatArray,
    at: FloatArray,
) -> FloatArray:
    """Errors of strains that the edges foretell, (2, tips, places, m): the identified map, and errors of the places.

    Of what the edges leave over, errors of location and a factor of the touch are taken off (`residual_parts`). A tip
    has the rest as the edge at its place had it, or as the mean over its contact (`shares`): whichever is nearer to
    the errors of the flats, `flat_strains` (2, flats, m) at the places `at`.
    """
    patterns = np.stack([finger.by_degree, finger.by_load], axis=-1)
    parts = ResidualParts.of(found.residual, patterns, finger.levels**2 / SAMPLES)
    better = found.absorbed[1]
    of_maps = np.array(
        [finger.felt([b - a for a, b in zip(absorbed, better, strict=True)], reach) for absorbed in found.absorbed]
    )
    ways = [of_maps + parts.places[AT], of_maps + shares @ parts.places]
    return min(ways, key=lambda each: float(((each[:, _FLAT, at] - flat_strains) ** 2).sum()))


def r_squared(predicted: FloatArray, seen: FloatArray) -> float:
    """Share of the mean square of errors that a prediction of their values removes."""
    return 1 - float(((seen - predicted) ** 2).sum() / (seen**2).sum())


def rows(found: dict[str, list[Seen]]) -> list[list[str]]:
    """What is printed, then one line a cause and calibration."""
    out = []
    for calibration, error in zip(CALIBRATIONS, ("table_1.error.avg", "table_2.error.avg"), strict=True):
        keys = [f"table_4.{calibration}.location.{name}" for name in ("theta_c", "P", "R")]
        of_touches = ", ".join(number(key).printed for key in keys)
        out.append([f"printed, {calibration}", of_touches, "; all", number(error).printed, "", "", ""])
    for cause, fingers in found.items():
        for c, calibration in enumerate(CALIBRATIONS):
            sizes = [
                np.mean([np.sqrt(np.mean((a[c] - a[c].mean(axis=-1, keepdims=True)) ** 2)) for a in each])
                for each in ([f.angle_deg for f in fingers], [f.load for f in fingers], [f.radius_mm for f in fingers])
            ]
            scores = [
                [r_squared(getattr(f, name)[c][ROUND], f.bias_mm[c][ROUND]) for f in fingers]
                for name in ("by_edges", "by_flats")
            ]
            bias = np.sqrt(np.mean([f.bias_mm[c][ROUND] ** 2 for f in fingers]))
            alike = np.mean([shared_by_indenters(f.radius_mm[c][OF_TABLE_3]) for f in fingers])
            order = np.mean([figure_13.monotonic(f.radius_mm[c][FIGURE_13] + _TRUE_13[:, None]) for f in fingers])
            out.append(
                [
                    f"{cause}, {calibration}",
                    f"{sizes[0]:.2f}, {sizes[1]:.1f}, {sizes[2]:.2f}",
                    f"{alike:z.2f}; {100 * order:.0f} %",
                    f"{np.mean([f.of_elements[c] for f in fingers]):.2f}",
                    f"{bias:.2f}",
                    *("–" if bias < NONE_MM else _scored(s) for s in scores),
                ]
            )
    return out


def _scored(scores: list[float]) -> str:
    """Median and 90 % range over fingers."""
    low, high = np.quantile(scores, [0.05, 0.95])
    return f"{np.median(scores):.2f} ({low:.2f} to {high:.2f})"


def for_the_page(found: dict[str, list[Seen]]) -> str:
    """The table."""
    head = ("cause alone, calibration", "θ_c (degree), P (N/m), R (mm)", "shared by tips; in order")
    more = ("error of elements (%)", "bias of R (mm)", "R² from edges", "R² from edges and flats")
    return markdown_table((*head, *more), rows(found))


def picture(folder: Path, found: dict[str, list[Seen]]) -> None:
    """Predicted and seen, by cause."""
    drawn, axes = figure(4, 2, figsize=(13.5, 6.5), sharex=True, sharey=True)
    for side, cause in zip(axes.ravel(), PANELS, strict=True):
        fingers = found[cause]
        for name, colour, label in (("by_edges", "C0", "edges"), ("by_flats", "C1", "edges and flats")):
            predicted = np.concatenate([getattr(f, name)[0][ROUND].ravel() for f in fingers[:3]])
            seen = np.concatenate([f.bias_mm[0][ROUND].ravel() for f in fingers[:3]])
            side.plot(predicted, seen, ".", ms=2, color=colour, alpha=0.5, label=label)
        reach = np.array([-2.0, 2.0])
        side.plot(reach, reach, color="0.6", lw=0.8)
        side.set(title=cause, xlim=reach, ylim=reach)
    axes[0, 0].legend(markerscale=4, title="predicted from")
    for side in axes[-1]:
        side.set_xlabel("bias of R predicted (mm)")
    for side in axes[:, 0]:
        side.set_ylabel("bias of R (mm)")
    save(drawn, folder, "sweet_spot_causes")


def main(small: bool = False, folder: Path | None = None) -> dict[str, list[Seen]]:
    """Print the table and save the picture."""
    everything = posterior_mean(small)
    found = {}
    for cause, case in cases(everything).items():
        u = replace(everything, **{name: value for name, value in NO_ERRORS.items() if name not in case.free})
        seeds = range(3 if small else FINGERS)
        found[cause] = [touched(u, seed, case.made) for seed in seeds]
    print(for_the_page(found))
    if folder is not None:
        picture(folder, found)
    return found


if __name__ == "__main__":
    run_study(main, __doc__, SCRIPT, for_the_page, PAGE)
