"""Table 4's noise row: what 1.72 % reading noise alone does to θ_c, P and R, and which shear modulus that needs.

The paper fitted raw samples at 40 locations with 6 indenters from edge to flat, P unknown, and found standard
deviations of 0.14 degree, 9.6 N/m and 0.79 mm about each location's mean (model-based calibration). Beside them: the
Cramér-Rao bound and the rms posterior standard deviation of the same design, over the shear modulus, which the paper
does not print.

    python studies/noise_row.py [FOLDER] [--small] [--no-pictures]
"""

from __future__ import annotations

import os
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from _published import figure, options, plain_ticks, save

from bayestouch.chain.finger import FingerChain
from bayestouch.chain.noise import Noise
from bayestouch.finger.reading.draws import FingerSampler
from bayestouch.finger.reading.reader import IndenterPriors, TouchReadings
from bayestouch.finger.reading.reading_table import ReadingTable
from bayestouch.paper import published
from bayestouch.reading.draws import DrawPlan, draw

LOAD, ELEMENTS, NOISE_PERCENT = 200.0, 16, 1.72
# Composite radii of an edge, tips of 3.9, 6.01, 9.3 and 12.3 mm and a flat: six of the paper's, edge to flat.
RADII = np.array([0.0, 2.984, 4.080, 5.369, 6.248, 12.7])
ANGLES = np.radians(np.arange(-20.0, 20.0))
MODULI = (0.05, 0.075, 0.1, 0.15, 0.2, 0.3)


def finger(modulus: float) -> FingerChain:
    """The paper's finger with the mean fitted depth, 10.3 mm, and σ 0.46 (Table 1)."""
    angles = np.radians((np.arange(ELEMENTS) - 7.5) * 8.8)
    one = np.ones(ELEMENTS)
    return FingerChain(9.4, 12.7, one, 10.3 * one, angles, 0 * one, 0.46, modulus, 3.2 * LOAD)


def cramer_rao(chain: FingerChain, noise_sd: float) -> np.ndarray:
    """Root mean square bound on θ_c (degree), P (N/m), R (mm) over the design, P unknown."""
    radius, angle = (grid.ravel() for grid in np.meshgrid(RADII, ANGLES, indexing="ij"))
    load = np.full(len(radius), LOAD)
    # R by a one-sided difference inward at the flat and outward elsewhere: 5 % of the finger's radius
    step = np.where(radius > 6.5, -0.3, 0.3)
    base = chain.predict(radius, angle, load)
    by_radius = (chain.predict(radius + step, angle, load) - base) / step[:, None]
    by_angle = (chain.predict(radius, angle + 1e-3, load) - chain.predict(radius, angle - 1e-3, load)) / 2e-3
    by_load = (chain.predict(radius, angle, load + 1) - chain.predict(radius, angle, load - 1)) / 2
    jacobian = np.stack([by_angle, by_load, by_radius], axis=1) / noise_sd
    information = jacobian @ jacobian.swapaxes(1, 2)
    variance = np.einsum("tii->ti", np.linalg.inv(information))
    return np.sqrt(variance.mean(axis=0)) * np.array([180 / np.pi, 1, 1])


def posterior_sds(chain: FingerChain, noise_sd: float, samples: int) -> np.ndarray:
    """Root mean square posterior sd of θ_c (degree), P (N/m), R (mm): raw samples, no force reading."""
    rng = np.random.default_rng(0)
    radius, angle, _ = (g.ravel() for g in np.meshgrid(RADII, ANGLES, np.arange(samples), indexing="ij"))
    clean = chain.predict(radius, angle, np.full(len(radius), LOAD))
    noise = Noise(np.full(ELEMENTS, noise_sd), np.zeros(ELEMENTS))
    nan = np.full(len(radius), np.nan)
    touches = TouchReadings(
        clean + noise_sd * rng.standard_normal(clean.shape), np.ones(clean.shape, dtype=np.int64), nan, nan
    )
    priors = IndenterPriors.of(chain, LOAD)
    table = ReadingTable.of(chain, *priors.location.support)
    drawn = draw(FingerSampler(chain, priors, table, noise, None), touches, DrawPlan(1024, seed=0, method="importance"))
    sds = [drawn[name].std(axis=(0, 1)) for name in ("theta_c", "P", "R")]
    return np.sqrt(np.mean(np.square(sds), axis=1))


def printed() -> list[float]:
    """The paper's standard deviations of θ_c (degree), P (N/m) and R (mm)."""
    return [published.number(f"table_4.model.noise.{name}").value for name in ("theta_c", "P", "R")]


def picture(folder: Path, results: dict[float, tuple[np.ndarray, np.ndarray]]) -> None:
    """Bound and posterior sd over the modulus, beside what is printed."""
    drawn, axes = figure(columns=3)
    moduli = list(results)
    for column, (axis, name) in enumerate(zip(axes, ("$\\theta_c$ (degree)", "P (N/m)", "R (mm)"), strict=True)):
        axis.semilogx(moduli, [results[modulus][0][column] for modulus in moduli], "o-", label="Cramér-Rao bound")
        axis.semilogx(moduli, [results[modulus][1][column] for modulus in moduli], "s--", label="posterior sd")
        axis.axhline(printed()[column], color="0.5", linestyle=":", label="paper")
        axis.set(xlabel="shear modulus μ (MPa)", ylabel=f"sd of {name}")
        plain_ticks(axis.xaxis, MODULI)
        axis.set_ylim(bottom=0)
    axes[0].legend()
    save(drawn, folder, "noise_row")


def main(samples: int = 20, folder: Path | None = None) -> dict[float, tuple[np.ndarray, np.ndarray]]:
    """Print the table and save the picture; returns (bound, posterior sds) by modulus."""
    paper = printed()
    print(f"{'':28s}{'θ_c (deg)':>12s}{'P (N/m)':>12s}{'R (mm)':>12s}")
    print(f"{'paper, noise row (model)':28s}{paper[0]:12.2f}{paper[1]:12.1f}{paper[2]:12.2f}")
    results = {}
    for modulus in MODULI:
        chain = finger(modulus)
        # noise in per cent of the peak reading of the calibration's edge at this load
        noise_sd = NOISE_PERCENT / 100 * LOAD
        bound, sds = cramer_rao(chain, noise_sd), posterior_sds(chain, noise_sd, samples)
        results[modulus] = (bound, sds)
        print(f"{f'μ {modulus:5.3f} MPa  Cramér-Rao':28s}{bound[0]:12.3f}{bound[1]:12.2f}{bound[2]:12.3f}")
        print(f"{'           posterior sd':28s}{sds[0]:12.3f}{sds[1]:12.2f}{sds[2]:12.3f}")
    if folder is not None:
        picture(folder, results)
    return results


if __name__ == "__main__":
    small, pictures = options(__doc__)
    main(1 if small else 20, pictures)
