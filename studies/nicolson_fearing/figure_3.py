"""Figure 3: Fourier coefficients of the pressure under five indenters at 200 N/m, and whether strain tells them apart.

"At 3 cycles/radian the frequency responses are clearly different and should be distinguishable with α = 0.70 and a
noise level at -40 dB": asked here of neighbours in the list, as the difference of their strain spectra at any one
frequency against the noise level.
"""

from __future__ import annotations

from pathlib import Path

import _path  # noqa: F401
import numpy as np
from _published import figure, options, print_beside, save
from figure_4 import deep_sensing_radius

from bayestouch.body.annulus import solve_annulus
from bayestouch.contact import composite_radius, contact_model
from bayestouch.paper import published
from bayestouch.reliability import Beside
from nicolson_fearing.paper_design import SHEAR_MODULUS
from nicolson_fearing.paper_finger import DESIGN
from nicolson_fearing.paper_run import CONTACT, indenter_rows

RADII_MM = tuple(n.value for n in published.all_numbers() if n.key.startswith("figure_3.r_c["))
LOAD = published.number("figure_3.load").value
NOISE_DB = published.number("figure_3.noise_level").value
OUTER = DESIGN.outer_radius_mm


def body() -> dict[str, float]:
    """Deep sensor."""
    core = published.number("alpha.deep").value * OUTER
    return {"core_radius_mm": core, "outer_radius_mm": OUTER, "poisson_ratio": DESIGN.poisson_ratio}


def pressure(modes: np.ndarray, contact: str = CONTACT) -> np.ndarray:
    """q_k of each indenter, (5, n)."""
    model = contact_model(contact, (body()["core_radius_mm"], OUTER), DESIGN.poisson_ratio)
    return model.spectrum(LOAD / 1000 / SHEAR_MODULUS * composite_radius(RADII_MM, OUTER), modes)


def strain(modes: np.ndarray) -> np.ndarray:
    """Strain amplitudes over the largest of a line load, (5, n)."""
    solution = solve_annulus(modes, **body()).radial_strain(deep_sensing_radius() * OUTER)
    reference = solve_annulus(np.arange(60), **body()).radial_strain(deep_sensing_radius() * OUTER)
    return np.abs(solution / np.abs(reference).max()) * pressure(modes)


def differences_db(cycles: np.ndarray) -> np.ndarray:
    """Difference of the strain spectra of neighbouring indenters, dB of the largest response, (4, n)."""
    return np.asarray(20 * np.log10(np.abs(np.diff(strain(2 * np.pi * cycles), axis=0))))


def rows() -> list[Beside]:
    """Settings, and the frequency up to which all neighbours differ by more than the noise."""
    cycles = np.linspace(0.4, 6.0, 561)
    above = (differences_db(cycles) > NOISE_DB).all(axis=0)
    upper = float(cycles[above].max()) if above.any() else np.nan
    return [
        *indenter_rows("figure_3", RADII_MM, {"load": LOAD, "n_radii": len(RADII_MM), "noise_level": NOISE_DB}),
        Beside(
            "figure_3.distinct_at",
            upper,
            why="highest frequency at which the strains of all neighbours differ by more than -40 dB; the blunt pair "
            "goes first",
        ),
    ]


def picture(folder: Path) -> None:
    """Spectra of pressure, and differences of strain."""
    drawn, (left, right) = figure(2, sharex=True, figsize=(9.5, 4.4))
    cycles = np.linspace(0.4, 6.0, 561)
    at = published.number("figure_3.distinct_at").value
    for radius, row in zip(RADII_MM, pressure(2 * np.pi * cycles), strict=True):
        left.plot(cycles, 20 * np.log10(np.abs(row)), label=f"tip of {radius:g} mm")
    left.set(xlabel="spatial frequency (cycles/radian)", ylabel="pressure coefficient (dB)", ylim=(-50, 3))
    left.set_title(f"Figure 3: pressure of five indenters at {LOAD:g} N/m")
    for i, row in enumerate(differences_db(cycles)):
        right.plot(cycles, row, label=f"{RADII_MM[i]:g} and {RADII_MM[i + 1]:g} mm")
    right.axhline(NOISE_DB, color="0.4", ls="--", label="noise level")
    right.set(xlabel="spatial frequency (cycles/radian)", ylabel="difference in strain (dB)", ylim=(-70, 5))
    right.set_title("α = 0.70: strains of neighbours, one less the other")
    for side in (left, right):
        side.axvline(at, color="0.8", zorder=0, label=f"{at:g} cycles/radian: distinct up to here")
        side.legend(loc="upper center", bbox_to_anchor=(0.5, -0.15), ncols=2)
    save(drawn, folder, "figure_3")


def main(small: bool = False, folder: Path | None = None) -> list[Beside]:
    """Print the numbers and save the picture; small is the same."""
    out = rows()
    print_beside(out)
    at = published.number("figure_3.distinct_at").value
    found = differences_db(np.array([at]))[:, 0]
    print(f"\nat {at:g} cycles/radian neighbours differ by (dB): " + ", ".join(f"{value:.1f}" for value in found))
    if folder is not None:
        picture(folder)
    return out


if __name__ == "__main__":
    main(*options(__doc__))
