"""Condition numbers of the E map: 2.7 for the model and 3.3 for the empirical one, says the paper (section 3.2).

It prints neither the number of Fourier coefficients n_c nor which elements and touches they belong to. This study
tries what is plausible: arrays of the paper's spacing (1.52 mm at 9.9 mm, 8.8 degrees), the sensing radii and
Poisson's ratios of its Table 1, and knife-edge touches with its noise.
"""

from __future__ import annotations

from pathlib import Path

import _path  # noqa: F401
import numpy as np
from _published import figure, options, plain_ticks, save

from bayestouch.body.emap import (
    condition_number,
    empirical_e_matrix,
    model_e_matrix,
    traction_coefficients,
)

BODY = {"core_radius_mm": 9.4, "outer_radius_mm": 12.7}
SPACING_DEG = np.degrees(1.52 / 9.9)
ARRAYS = {
    "16 on an arc": SPACING_DEG * np.arange(16),
    "41 all around": 360 / 41 * np.arange(41),
    "16 all around": 360 / 16 * np.arange(16),
}
TRUE_MODES = 120  # of the simulated strain; at r_s <= 10.7 mode 120 is 1e-7 of the largest


def elements(array: str, seed: int | None) -> dict[str, np.ndarray]:
    """Sensing radius and Poisson's ratio of each element: Table 1's averages, or (with a seed) its ranges."""
    n = ARRAYS[array].size
    if seed is None:
        return {"sensing_radius_mm": np.full(n, 10.3), "poisson_ratio": np.full(n, 0.46)}
    rng = np.random.default_rng(seed)
    return {
        "sensing_radius_mm": rng.triangular(9.8, 10.3, 10.7, n),
        "poisson_ratio": rng.triangular(0.41, 0.46, 0.48, n),
    }


def model_condition(array: str, n_coefficients: int, seed: int | None = None, **change: float) -> float:
    """Condition number of the model E map; `change` sets one sensing radius or Poisson's ratio for all."""
    return condition_number(model_e_matrix(ARRAYS[array], n_coefficients, **(elements(array, seed) | change), **BODY))


def empirical_condition(array: str, n_coefficients: int, n_touches: int, seed: int | None = None) -> float:
    """Condition number of the E map identified by equation (6) from simulated knife-edge touches all around.

    With a seed elements differ as in Table 1 and readings carry the paper's noise: 0.5 % of load, 0.4 % of peak.
    """
    angles = 360 / n_touches * np.arange(n_touches)
    touches = traction_coefficients(
        np.ones(TRUE_MODES + 1), angles, np.full(n_touches, 0.2), outer_radius_mm=BODY["outer_radius_mm"]
    )
    readings = model_e_matrix(ARRAYS[array], TRUE_MODES, **elements(array, seed), **BODY) @ touches
    if seed is not None:
        rng = np.random.default_rng(1000 + seed)
        peak = np.abs(readings).max(axis=1, keepdims=True)
        readings = readings * (1 + 0.005 * rng.normal(size=n_touches))
        readings += 0.004 * peak * rng.normal(size=readings.shape)
    return condition_number(empirical_e_matrix(touches[: 2 * n_coefficients + 1], readings))


def spread(values: list[float]) -> str:
    return "{:7.2f} [{:.2f}, {:.2f}]".format(*np.percentile(values, [50, 5, 95]))


def print_model_table(seeds: int = 40) -> None:
    print("Model E map (paper: 2.7). Sensing radius 9.9 (design), 10.3 (mean fit), 10.7 (largest fit);")
    print("Table 1: radii and Poisson's ratios spread over its ranges, median [5 %, 95 %].\n")
    print(f"{'array':>14} {'n_c':>4} {'9.9':>9} {'10.3':>9} {'10.7':>9}    Table 1")
    for array in ARRAYS:
        for n in (7, 15, 16, 20, 25, 40):
            fixed = " ".join(
                f"{model_condition(array, n, sensing_radius_mm=radius):9.4g}" for radius in (9.9, 10.3, 10.7)
            )
            print(f"{array:>14} {n:4d} {fixed} {spread([model_condition(array, n, s) for s in range(seeds)])}")


def print_empirical_table(seeds: int = 20) -> None:
    print(
        "\nEmpirical E map (paper: 3.3), simulated edge touches: without noise and spread, then Table 1 with noise.\n"
    )
    print(f"{'array':>14} {'n_c':>4} {'touches':>8} {'model':>9} {'empirical':>9}    Table 1 and noise")
    for array in ("16 on an arc", "41 all around"):
        for n in (15, 16, 20, 25):
            for touches in (2 * n + 1, 360):
                noisy = [empirical_condition(array, n, touches, s) for s in range(seeds)]
                print(
                    f"{array:>14} {n:4d} {touches:8d} {model_condition(array, n):9.4g} "
                    f"{empirical_condition(array, n, touches):9.4g} {spread(noisy)}"
                )


def save_picture(folder: Path) -> None:
    drawn, axes = figure(figsize=(6.4, 4.0))
    orders = np.arange(5, 41)
    for array in ARRAYS:
        axes.semilogy(orders, [model_condition(array, n) for n in orders], label=f"{array} (model)")
    for value, label in ((2.7, "paper, model"), (3.3, "paper, empirical")):
        axes.axhline(value, color="0.6", linestyle="--" if value < 3 else ":", label=label)
    axes.set(xlabel="highest Fourier coefficient $n_c$", ylabel="condition number of E", ylim=(1, 1e3))
    plain_ticks(axes.yaxis, (1, 2, 5, 10, 20, 50, 100, 1000))
    axes.legend(title="elements")
    save(drawn, folder, "condition_numbers")


if __name__ == "__main__":
    _, pictures = options(__doc__)
    print_model_table()
    print_empirical_table()
    if pictures is not None:
        save_picture(pictures)
