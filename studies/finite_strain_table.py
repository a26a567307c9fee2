"""The table of bayestouch.body.finite_strain: what large strain adds to the linear response of the paper's finger.

A right-angled wedge with a round nose is pressed into a neo-Hookean annulus (plane strain, bonded core, no friction)
from a nose of 0.1 mm, the paper's edge, to a flat. Radial strain along the sensing radii is compared with that of the
linear chain (parabola on the layer, `bayestouch.contact`) of the same load and radius; the difference is what is
tabulated, as cosine coefficients over P/μ, R and r_s, relative to the linear peak under a knife edge of the same
load.

    python studies/finite_strain_table.py --write     every tip on the fine mesh (half an hour; kept), then the table
    python studies/finite_strain_table.py             what the table says, checked on two tips with a coarser mesh
"""

from __future__ import annotations

import argparse
import os
import time
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from _finite_strain import Annulus, annulus, radial_strains
from _published import OUTPUT, figure, save
from _rigid_tip import Tip

from bayestouch.body.annulus import solve_annulus
from bayestouch.body.finite_strain import DATA, FiniteStrainTable, Measure
from bayestouch.contact import composite_radius, contact_model

CORE, OUTER, POISSON = 9.4, 12.7, 0.46
NOSES = (0.1, 0.25, 0.5, 0.95, 1.6, 2.6, 3.9, 6.0, 9.3, 16.0, 35.0, np.inf)
FLANK_DEG = 45.0
SENSING_RADII = (9.4, 9.5, 9.65, 9.8, 9.95, 10.15, 10.4, 10.65, 10.9)
LOADS = (0.0, 0.15, 0.35, 0.65, 1.0, 1.4, 1.9, 2.5, 3.2, 4.0, 5.0)
ANGLES = np.linspace(0, np.pi, 361)
MODES = np.arange(64)
SHAPES = 12
DEPTHS = np.concatenate([[0.002, 0.006, 0.015, 0.03, 0.05], np.arange(0.08, 3.0, 0.04)])
RAW = OUTPUT / "finite_strain_raw.npz"
MEASURES: tuple[Measure, Measure] = ("projected", "stretch")
# Mesh sizes, with and without friction: what sticks needs twice the iterations.
SIZES = {False: 1.0, True: 1.4}


def linear_strain(load: float, radius: float, sensing: np.ndarray) -> np.ndarray:
    """Strain (r_s, angles) of the linear chain under P/μ = load (mm) with composite radius R."""
    modes = np.arange(161)
    body = solve_annulus(modes, core_radius_mm=CORE, outer_radius_mm=OUTER, poisson_ratio=POISSON)
    spectrum = contact_model("layer", (CORE, OUTER), POISSON).spectrum(load * radius, modes)
    weights = np.where(modes == 0, 1.0, 2.0) * spectrum * body.radial_strain(sensing)
    return -load / (2 * np.pi * OUTER) * weights @ np.cos(np.outer(modes, ANGLES))


def edge_peaks(sensing: np.ndarray) -> np.ndarray:
    """Linear compressive strain right under a knife edge of P/μ = 1 mm, at each r_s."""
    return -linear_strain(1.0, 0.0, sensing)[:, 0]


def profiles(
    body: Annulus, tip: Tip, sensing: np.ndarray, largest: float, stick: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Loads (s,) and strains (s, 2, r_s, angles): projected and stretch, while the tip is pressed in."""
    slopes = [body.radial_slope(ANGLES, float(radius)) for radius in sensing]
    loads, strains = [0.0], [np.zeros((2, len(sensing), len(ANGLES)))]
    for step in body.press(tip, DEPTHS, stick):
        loads.append(step.load)
        strains.append(np.stack([radial_strains(ANGLES, slope @ step.displacement) for slope in slopes], axis=1))
        if step.load > largest:
            break
    return np.array(loads), np.array(strains)


def correction(
    loads: np.ndarray, strains: np.ndarray, radius: float, sensing: np.ndarray, at: np.ndarray
) -> np.ndarray:
    """Response that finite strain adds at loads `at`, (loads, 2, r_s, angles), relative to the edge's linear peak.

    What the first, tiny step differs by from the linear chain is the mesh's, and taken off.
    """
    from scipy.interpolate import CubicSpline

    # Strain over load is smooth down to no load at all, where it is that of a knife edge.
    spline = CubicSpline(loads[1:], strains[1:] / loads[1:, None, None, None])
    added = np.zeros((len(at), *strains.shape[1:]))
    of_mesh = strains[1] / loads[1] - linear_strain(loads[1], radius, sensing) / loads[1]
    for i, load in enumerate(at):
        if load > 0:
            added[i] = spline(load) - linear_strain(load, radius, sensing) / load - of_mesh
    return -added / edge_peaks(sensing)[:, None]


def cosine_coefficients(values: np.ndarray) -> np.ndarray:
    """Coefficients c_k of ``c_0 + 2 Σ c_k cos kθ`` of even profiles on `ANGLES`, first `N_MODES`."""
    from scipy.fft import dct

    return dct(values, type=1, axis=-1)[..., : len(MODES)] / (2 * (len(ANGLES) - 1))


def name_of(what: str, nose: float, stick: bool) -> str:
    """Key in the cache."""
    return f"{what} {nose} stick" if stick else f"{what} {nose} {SIZES[False]}"


def solve_all() -> None:
    """Every tip, without friction and with what touches stuck to it; keeps what is done in the cache."""
    sensing = np.array(SENSING_RADII)
    done: dict[str, np.ndarray] = dict(np.load(RAW)) if RAW.exists() else {}
    for stick, size in SIZES.items():
        body = annulus(size, CORE, OUTER, POISSON)
        for nose in NOSES:
            if name_of("loads", nose, stick) in done:
                continue
            start = time.perf_counter()
            tip = Tip(nose, FLANK_DEG if np.isfinite(nose) else 0.0)
            loads, strains = profiles(body, tip, sensing, LOADS[-1], stick)
            done[name_of("loads", nose, stick)] = loads
            done[name_of("strains", nose, stick)] = strains.astype(np.float32)
            OUTPUT.mkdir(parents=True, exist_ok=True)
            np.savez(RAW, **done)
            print(
                f"nose {nose:g} mm{', stuck' if stick else ''}: {len(loads)} steps to P/μ {loads[-1]:.2f} mm, "
                f"{time.perf_counter() - start:.0f} s",
                flush=True,
            )


def added_by(stick: bool) -> np.ndarray:
    """Cosine coefficients of what the solutions in the cache add: measure, load, nose, r_s, mode."""
    raw, sensing, at = np.load(RAW), np.array(SENSING_RADII), np.array(LOADS)
    added = []
    for nose, radius in zip(NOSES, composite_radius(NOSES, OUTER), strict=True):
        loads, strains = (raw[name_of(what, nose, stick)].astype(float) for what in ("loads", "strains"))
        added.append(correction(loads, strains, float(radius), sensing, at))
    return cosine_coefficients(np.stack(added)).transpose(2, 1, 0, 3, 4)


def tabulated() -> dict[str, np.ndarray]:
    """Arrays of the shipped file, from the cache: the first `SHAPES` terms of the singular value decomposition."""
    held = {
        "load_over_modulus_mm": np.array(LOADS),
        "radius_mm": composite_radius(NOSES, OUTER),
        "sensing_radius_mm": np.array(SENSING_RADII),
    }
    free = added_by(False)
    for measure, values in (("projected", free[0]), ("stretch", free[1]), ("stuck", added_by(True)[0])):
        rows, sizes, shapes = np.linalg.svd(values.reshape(len(LOADS) * len(NOSES), -1), full_matrices=False)
        held[f"{measure}_amplitudes"] = (rows * sizes)[:, :SHAPES].reshape(len(LOADS), len(NOSES), SHAPES)
        held[f"{measure}_shapes"] = shapes[:SHAPES].reshape(SHAPES, len(SENSING_RADII), -1)
        left = values - np.tensordot(held[f"{measure}_amplitudes"], held[f"{measure}_shapes"], 1)
        off = left @ (np.where(MODES == 0, 1.0, 2.0)[:, None] * np.cos(np.outer(MODES, ANGLES)))
        print(f"{measure}: {SHAPES} shapes are off by {np.abs(off).max():.1e} of the edge's peak at worst")
    return held


@dataclass(frozen=True)
class Check:
    """Shipped table against a solution on another mesh, both over the linear edge's peak; and sizes at one load.

    Attributes
    ----------
    worst : dict
        Largest difference of the added response at any angle, by measure, from r_s = 9.8 mm up.
    near_core : dict
        The same at 9.5 mm.
    added_peak : float
        Largest added response of the table there.
    """

    worst: dict[str, float]
    near_core: dict[str, float]
    added_peak: float


def check(nose: float, size: float, loads: tuple[float, ...]) -> Check:
    """Solve one tip on a mesh of this size and compare with the table at some P/μ (mm)."""
    sensing, at, radius = np.array([9.5, 9.8, 10.3, 10.7]), np.array(loads), float(composite_radius(nose, OUTER))
    body = annulus(size, CORE, OUTER, POISSON)
    tip = Tip(nose, FLANK_DEG if np.isfinite(nose) else 0.0)
    solved = correction(*profiles(body, tip, sensing, at.max()), radius, sensing, at)
    turn = np.repeat(ANGLES[:, None], len(sensing), axis=1)
    worst, near_core, added_peak = {}, {}, 0.0
    for i, measure in enumerate(MEASURES):
        response = FiniteStrainTable.load(measure).for_elements(sensing)
        held = np.stack([response(np.full(len(ANGLES), load), np.full(len(ANGLES), radius), turn).T for load in at])
        off = np.abs(solved[:, i] - held).max(axis=(0, 2))
        worst[measure], near_core[measure] = float(off[1:].max()), float(off[0])
        added_peak = max(added_peak, float(np.abs(held).max()))
    return Check(worst, near_core, added_peak)


def print_table() -> None:
    """Peak strain over the linear one, by load, tip and depth."""
    table = FiniteStrainTable.load()
    print("Response right below the tip that finite strain adds, over that of a linear edge (projected strain)")
    print(
        f"{'P/μ (mm)':>9s} {'r_s (mm)':>9s}" + "".join(f"{'R ' + format(r, '.2f'):>9s}" for r in table.radius_mm[::2])
    )
    added = table.coefficients[..., 0] + 2 * table.coefficients[..., 1:].sum(axis=-1)
    for i in (3, 5, 7, 9):
        for k in (1, 4, 7):
            cells = "".join(f"{value:9.4f}" for value in added[i, ::2, k])
            print(f"{table.load_over_modulus_mm[i]:9.2f} {table.sensing_radius_mm[k]:9.2f}{cells}")


def picture(folder: Path) -> None:
    """Linear and finite-strain profiles of three tips at the load and modulus of Table 3."""
    drawn, axes = figure(3, figsize=(12.5, 3.6))
    sensing, load = np.array([9.9, 10.3]), 0.2 / 0.054
    for side, nose in zip(axes, (0.1, 3.9, np.inf), strict=True):
        radius = float(composite_radius(nose, OUTER))
        linear = -linear_strain(load, radius, sensing)
        turn = np.repeat(ANGLES[:, None], 2, axis=1)
        for measure, style in zip(MEASURES, ("-", ":"), strict=True):
            response = FiniteStrainTable.load(measure).for_elements(sensing)
            added = response(np.full(len(ANGLES), load), np.full(len(ANGLES), radius), turn).T
            strain = linear + load * edge_peaks(sensing)[:, None] * added
            side.plot(np.degrees(ANGLES), strain[0], "C0" + style, label=f"neo-Hookean, {measure}")
        side.plot(np.degrees(ANGLES), linear[0], "0.5", ls="--", label="linear")
        side.set(xlim=(0, 60), xlabel="angle from the touch (degree)", ylabel="compressive strain at $r_s$ = 9.9 mm")
        side.set_title("corner" if nose < 0.2 else ("flat" if np.isinf(nose) else f"tip of {nose:g} mm"))
    axes[0].legend()
    save(drawn, folder, "finite_strain")


def main(small: bool = False, folder: Path | None = None) -> Check:
    """Print the table and check it; with `small` on one coarse mesh, one tip and one load."""
    print_table()
    cases = ((3.9, 2.0, (0.65,)),) if small else ((0.5, 1.4, (0.65, 1.9, 3.7)), (3.9, 1.4, (0.65, 1.9, 3.7)))
    for nose, size, loads in cases:
        start = time.perf_counter()
        found = check(nose, size, loads)
        print(
            f"\nnose {nose:g} mm, mesh {size:g} times as coarse, P/μ {', '.join(map(str, loads))} mm: table is off by "
            f"{found.worst['projected']:.4f} (projected), {found.worst['stretch']:.4f} (stretch) of the edge's peak, "
            f"at 9.5 mm by {found.near_core['projected']:.4f}; adds up to {found.added_peak:.3f} "
            f"({time.perf_counter() - start:.0f} s)"
        )
    if folder is not None:
        picture(folder)
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Finite-strain table of the paper's finger")
    parser.add_argument("folder", nargs="?", type=Path, default=OUTPUT, help="where the picture goes")
    parser.add_argument("--small", action="store_true")
    parser.add_argument("--write", action="store_true", help="solve every tip and write the shipped table")
    chosen = parser.parse_args()
    if chosen.write:
        solve_all()
        DATA.parent.mkdir(exist_ok=True)
        np.savez_compressed(DATA, **tabulated())
        print(f"{DATA}: {DATA.stat().st_size} bytes")
    else:
        main(chosen.small, chosen.folder)
