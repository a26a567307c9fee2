"""Figure 4: what the paper's criterion tells from a knife edge, over r_c/r_b and depth.

The paper prints 3.7 % (largest noise at which a flat is told from an edge, α = 0.70) and 0.16 (smallest r_c/r_b at 1 %
noise). It prints neither modulus nor sensing radius, nor over which angles the square is averaged. Here the sensing
radius is that of Figure 2's cut-off at this α, and both readings of "mean square" are tried over a range of moduli.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import _path  # noqa: F401
import numpy as np
from _published import Beside, figure, options, plain_ticks, print_beside, save

from bayestouch.body.frequency import sensing_radius_for_cut_off
from bayestouch.paper import published
from bayestouch.reliability import Annulus, smallest_radius, strain_difference, tolerable_noise
from bayestouch.reliability.paper_criterion import SPANS_DEG
from nicolson_fearing.paper_design import MODULUS_INTERVAL, SHEAR_MODULUS

MODULI = (0.03, 0.045, 0.054, 0.065, 0.1, 0.15, 0.3)
# The typical noise of the sensor, from Table 1: % of the peak.
NOISE = published.number("table_1.noise_level.avg").value / 100


@dataclass(frozen=True)
class Thresholds:
    """Both numbers of the paper for one reading and modulus."""

    noise_percent: float
    radius_share: float


@cache
def deep_sensing_radius() -> float:
    """``r_s/r_b`` that has Figure 2's cut-off at α = 0.70."""
    return sensing_radius_for_cut_off(
        published.number("cutoff.deep").value,
        core_radius_mm=published.number("alpha.deep").value,
        outer_radius_mm=1.0,
        poisson_ratio=0.46,
    )


def deep_finger(modulus: float = SHEAR_MODULUS, contact: str = "layer") -> Annulus:
    """α = 0.70 with the sensing radius that has Figure 2's cut-off."""
    alpha = published.number("alpha.deep").value
    return Annulus(alpha, deep_sensing_radius(), shear_modulus_MPa=modulus, contact=contact)


def thresholds(finger: Annulus, span_deg: float) -> Thresholds:
    """The two numbers: % of the peak, and r_c/r_b."""
    low = published.number("figure_4.low_noise").value / 100
    return Thresholds(
        100 * tolerable_noise(finger, span_deg=span_deg),
        smallest_radius(finger, low, span_deg=span_deg) / finger.outer_radius_mm,
    )


def modulus_for(span_deg: float, contact: str) -> tuple[float, float]:
    """Shear moduli (MPa) at which 3.7 % and 0.16 come out as printed; both numbers are close to powers of μ."""
    found = [thresholds(deep_finger(m, contact), span_deg) for m in MODULI]
    log_modulus = np.log(MODULI)
    noise, radius = (
        np.log([getattr(f, name) for f in found]) - np.log(published.number(key).value)
        for name, key in (("noise_percent", "figure_4.flat_from_edge_noise"), ("radius_share", "figure_4.r_c_over_r_b"))
    )
    # The noise falls with μ, the radius grows.
    return (
        float(np.exp(np.interp(0.0, -noise, log_modulus, left=np.nan, right=np.nan))),
        float(np.exp(np.interp(0.0, radius, log_modulus, left=np.nan, right=np.nan))),
    )


def compared() -> list[Beside]:
    """The paper's two numbers, averaged over the circumference, over the posterior of μ."""
    ends, middle = (
        [thresholds(deep_finger(m), SPANS_DEG["circumference"]) for m in moduli]
        for moduli in (MODULUS_INTERVAL, (SHEAR_MODULUS,))
    )
    by_noise, by_radius = modulus_for(SPANS_DEG["circumference"], "layer")
    rows = []
    for key, name, modulus in (
        ("figure_4.flat_from_edge_noise", "noise_percent", by_noise),
        ("figure_4.r_c_over_r_b", "radius_share", by_radius),
    ):
        low, high = sorted(getattr(end, name) for end in ends)
        why = (
            f"with the mean square over the circumference; at {modulus:.3f} MPa ours is as printed, and Table 3 allows "
            "that modulus"
        )
        rows.append(Beside(key, getattr(middle[0], name), low, high, why))
    return rows


def print_tables() -> None:
    """Both numbers over modulus, contact and reading; and the modulus that each asks for."""
    print("α = 0.70: largest noise (% of peak) at which the flat is told from an edge, and r_c/r_b at 1 % noise")
    print("paper: 3.7 and 0.16\n")
    print(f"{'contact':>8s} {'mean square over':>18s}" + "".join(f"{m:>14.3f}" for m in MODULI) + "  MPa")
    for contact in ("layer", "hertz"):
        for reading, span in SPANS_DEG.items():
            found = [thresholds(deep_finger(m, contact), span) for m in MODULI]
            cells = "".join(f"{f.noise_percent:8.2f} {f.radius_share:5.2f}" for f in found)
            print(f"{contact:>8s} {reading:>18s}{cells}")
    print("\nmodulus (MPa) that gives each number as printed")
    for contact in ("layer", "hertz"):
        for reading, span in SPANS_DEG.items():
            by_noise, by_radius = modulus_for(span, contact)
            print(f"{contact:>8s} {reading:>18s}   3.7 %: {by_noise:.3f}    0.16: {by_radius:.3f}")


def picture(folder: Path, small: bool) -> None:
    """The surface with the noise plane, and the boundary for both readings."""
    alphas = np.linspace(0.6, 0.93, 6 if small else 23)
    shares = np.concatenate([np.geomspace(0.02, 4.0, 12 if small else 40), [np.inf]])
    deep = deep_finger()
    above_core = deep.sensing_radius - deep.alpha
    fingers = [replace(deep, alpha=a, sensing_radius=a + above_core) for a in alphas]
    surfaces = {
        name: np.stack([strain_difference(f, shares * f.outer_radius_mm, span_deg=span) for f in fingers])
        for name, span in SPANS_DEG.items()
    }
    figures, axes = figure(len(surfaces), figsize=(12.5, 4.0), sharey=True)
    for side, (name, surface) in zip(axes, surfaces.items(), strict=True):
        x = shares[:-1]
        filled = side.contourf(
            x, alphas, 100 * surface[:, :-1], levels=np.arange(0, 27, 2), cmap="viridis", extend="max"
        )
        for noise, style in ((NOISE, "-"), (0.01, "--")):
            line = side.contour(x, alphas, surface[:, :-1], levels=[2 * noise], colors="w", linestyles=style)
            side.clabel(line, fmt=f"{100 * noise:.3g} %%", fontsize=8)
        side.plot(published.number("figure_4.r_c_over_r_b").value, 0.7, "r*", ms=11, label="paper, 1 % noise")
        side.axhline(9.4 / 12.7, color="0.8", lw=0.8)
        side.text(3.8, 9.4 / 12.7 + 0.004, "the paper's finger", color="0.9", fontsize=8, ha="right")
        side.set(xscale="log", xlabel="$r_c/r_b$", title=f"mean square over {name}")
        plain_ticks(side.xaxis, (0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 4))
        side.legend(loc="lower left")
    axes[0].set_ylabel(r"$\alpha = r_a/r_b$")
    figures.colorbar(filled, ax=axes, label="rms difference from an edge\n(% of peak strain)")
    figures.suptitle(
        f"Figure 4: white lines are two sd of noise of 1 and {100 * NOISE:.3g} % (μ = {SHEAR_MODULUS:g} MPa)"
    )
    save(figures, folder, "figure_4")


def main(small: bool = False, folder: Path | None = None) -> list[Beside]:
    """Print the tables and save the picture."""
    print_tables()
    rows = compared()
    print()
    print_beside(rows)
    if folder is not None:
        picture(folder, small)
    return rows


if __name__ == "__main__":
    main(*options(__doc__))
