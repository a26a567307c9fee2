"""Figure 2: response of surface displacement and of strain at two depths to a line load, over spatial frequency.

The paper prints both cut-offs but no sensing radius. One distance of the elements from the core, the same share of r_b
for both depths, gives both.
"""

from __future__ import annotations

from pathlib import Path

import _path  # noqa: F401
import numpy as np
from _published import figure, options, plain_ticks, print_beside, save
from scipy.optimize import brentq

from bayestouch.body.frequency import cut_off, frequency_response_db
from bayestouch.paper import published
from bayestouch.reliability import Beside
from nicolson_fearing.paper_finger import DESIGN
from nicolson_fearing.paper_run import put_in

OUTER = DESIGN.outer_radius_mm
DEPTHS = ("deep", "shallow")
LEVEL = published.number("cutoff.level").value


def body(depth: str) -> dict[str, float]:
    """Radii and Poisson's ratio."""
    core = published.number(f"alpha.{depth}").value * OUTER
    return {"core_radius_mm": core, "outer_radius_mm": OUTER, "poisson_ratio": DESIGN.poisson_ratio}


def cut_offs(share: float) -> dict[str, float]:
    """Cut-offs (cycles/radian) of elements this share of r_b above the core."""
    return {
        depth: cut_off(**body(depth), sensing_radius_mm=body(depth)["core_radius_mm"] + share * OUTER, level_db=LEVEL)
        for depth in DEPTHS
    }


def best_share() -> float:
    """Distance from the core over r_b at which both cut-offs are off by the same factor, one up and one down."""

    def excess(share: float) -> float:
        found = cut_offs(share)
        return float(sum(np.log(found[depth] / published.number(f"cutoff.{depth}").value) for depth in DEPTHS))

    return float(brentq(excess, 0.05, 0.07, xtol=1e-5))


def slope(depth: str, cycles: tuple[float, float], share: float | None = None) -> float:
    """Fall of the response between two frequencies (cycles/radian), dB/decade."""
    radii = body(depth)
    sensing = None if share is None else radii["core_radius_mm"] + share * OUTER
    low, high = frequency_response_db(2 * np.pi * np.array(cycles), **radii, sensing_radius_mm=sensing)
    return float((low - high) / np.log10(cycles[1] / cycles[0]))


def rows() -> list[Beside]:
    """Cut-offs and slopes."""
    share = best_share()
    found = cut_offs(share)
    strain = min(slope(d, (found[d], 1.1 * found[d]), share) for d in DEPTHS)
    why = (
        f"both cut-offs are calculated with one distance of the elements from the core, {share:.4f} r_b (the paper "
        "prints none)"
    )
    return [
        Beside(
            "rolloff.displacement",
            slope("deep", (10.0, 100.0)),
            why="slope of the displacement between 10 and 100 cycles/radian",
        ),
        Beside(
            "rolloff.strain_at_least",
            strain,
            why="slope of the strain at the cut-off, for the depth where it is less steep; the paper prints it as a "
            "lower limit",
        ),
        *(put_in(f"alpha.{depth}", body(depth)["core_radius_mm"] / OUTER) for depth in DEPTHS),
        put_in("cutoff.level", LEVEL),
        *(Beside(f"cutoff.{depth}", found[depth], why=why) for depth in DEPTHS),
    ]


def picture(folder: Path) -> None:
    """The Bode plot."""
    share = best_share()
    drawn, side = figure(figsize=(6.4, 4.2))
    # Modes between 2 and the next are fractions; below 2 only 1 exists.
    modes = np.concatenate([[1.0], np.geomspace(2.0, 400.0, 300)])
    cycles = modes / (2 * np.pi)
    side.semilogx(cycles, frequency_response_db(modes, **body("deep")), "C0:", label="displacement, α = 0.70")
    for depth, style in zip(DEPTHS, ("C1-", "C2--"), strict=True):
        radii = body(depth)
        response = frequency_response_db(modes, **radii, sensing_radius_mm=radii["core_radius_mm"] + share * OUTER)
        alpha = published.number(f"alpha.{depth}").printed
        side.semilogx(cycles, response, style, label=f"strain, {depth}, α = {alpha}")
        side.plot(
            published.number(f"cutoff.{depth}").value,
            LEVEL,
            "kx",
            label=None if depth == "deep" else "cut-offs as printed",
        )
    side.axhline(LEVEL, color="0.8", zorder=0)
    side.set(xlabel="spatial frequency (cycles/radian)", ylabel="response to a line load (dB)", ylim=(-80, 3))
    side.set_title(f"Figure 2: strain of elements {share:.3f} $r_b$ above the core, and surface displacement")
    plain_ticks(side.xaxis, (0.2, 0.5, 1, 2, 5, 10, 20, 50))
    side.legend()
    save(drawn, folder, "figure_2")


def main(small: bool = False, folder: Path | None = None) -> list[Beside]:
    """Print the numbers and save the picture; small is the same."""
    out = rows()
    print_beside(out)
    if folder is not None:
        picture(folder)
    return out


if __name__ == "__main__":
    main(*options(__doc__))
