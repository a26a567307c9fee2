"""The shear modulus that Table 3 implies, and what it predicts of the rest of the paper with nothing else fitted.

The paper prints no modulus. Its Hertz columns read the tips too sharp by an amount that depends on the modulus alone:
the rigid core narrows the contact, the more so the softer the rubber. Here the authors' procedure is simulated (edges
calibrate the finger in both of their ways, the layer's contact presses nine tips at 40 locations, Hertz reads them),
and the modulus inferred. The posterior then predicts the 4.2 % and 2.2 % of section 3.1, the two numbers read off
Figure 4, and the noise row of Table 4.

    python studies/nicolson_fearing/table_3_modulus.py [folder for pictures] [--small]
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import _path  # noqa: F401
import numpy as np
from _published import Beside, figure, options, plain_ticks, print_beside, rms, save

from bayestouch.contact import composite_radius, indenter_radius
from bayestouch.paper.published import number
from nicolson_fearing.modulus import ModulusPosterior
from nicolson_fearing.paper_finger import CALIBRATIONS, TIPS_MM, PaperFinger, simulated
from nicolson_fearing.published_fits import R_B, BiasCurves, bias_curves, infer_from_table_3, printed
from nicolson_fearing.published_predictions import (
    HALF_WIDTH_DEG,
    distinguished_radius,
    flat_fit_error,
    flat_from_edge_noise,
    noise_row,
)

MODULI = np.array([0.03, 0.04, 0.05, 0.06, 0.08, 0.1, 0.15, 0.2])
SMALL_MODULI = np.array([0.04, 0.07])
SMALL_CURVES = np.geomspace(0.03, 0.2, 4)
WHY_NOISE = {
    "theta_c": "the printed noise alone gives more than is printed",
    "P": "less than printed; no depth, σ or simplex stopped early gives it; table_4_noise.py says what would",
    "R": "as P: the authors' estimates scatter further along the ridge of R and P than noise takes them",
}
NOISE_ROW = ("theta_c", "P", "R")


@dataclass(frozen=True)
class Findings:
    """What the study found.

    Attributes
    ----------
    posterior : ModulusPosterior
        From both Hertz columns.
    by_column : dict
        From each alone.
    rms_R_mm, rms_r_c_mm : dict
        Error of the predicted Hertz columns against the printed ones, at the posterior mean, by calibration.
    rows : list of Beside
        Predictions.
    moduli_MPa : (k,) array
        μ at which they were worked out.
    wanted_MPa : dict
        μ at which each printed number would be predicted.
    """

    posterior: ModulusPosterior
    by_column: dict[str, ModulusPosterior]
    rms_R_mm: dict[str, float]
    rms_r_c_mm: dict[str, float]
    rows: list[Beside]
    wanted_MPa: dict[str, float]


def wanted(moduli: np.ndarray, values: np.ndarray, printed_value: float) -> float:
    """Modulus at which a prediction meets the print, by interpolation in log μ; NaN where it never does."""
    fine = np.linspace(np.log(moduli[0]), np.log(moduli[-1]), 2000)
    off = np.interp(fine, np.log(moduli), values) - printed_value
    crossing = np.flatnonzero(np.diff(np.sign(off)) != 0)
    return float(np.exp(fine[crossing[0]])) if crossing.size else float("nan")


def predictions(posterior: ModulusPosterior, moduli: np.ndarray) -> tuple[list[Beside], dict[str, float]]:
    """Each number over the modulus, averaged over the posterior; and the modulus it would take."""
    finger = PaperFinger.of(simulated(0.1, 0))
    noise = np.array([noise_row(finger, m) for m in moduli])
    curves: list[tuple[str, str, np.ndarray, str]] = [
        (
            "flat_fit.hertz",
            "",
            np.array([flat_fit_error(finger, m, "hertz") for m in moduli]),
            "edges and flats refitted together; what Hertz adds, in quadrature to the paper's 2.16 % for edges",
        ),
        (
            "flat_fit.frictionless",
            "",
            np.full(len(moduli), flat_fit_error(finger, 0.05, "layer")),
            "the layer's contact is the simulated truth and adds nothing: no test of μ",
        ),
    ]
    for over in HALF_WIDTH_DEG:
        for key, function in (
            ("figure_4.flat_from_edge_noise", flat_from_edge_noise),
            ("figure_4.r_c_over_r_b", distinguished_radius),
        ):
            values = np.array([function(m, over) for m in moduli])
            curves.append((key, f" (mean over {over})", values, f"mean square over the {over}"))
    for name, values in zip(NOISE_ROW, noise.T, strict=True):
        curves.append((f"table_4.model.noise.{name}", "", values, WHY_NOISE[name]))
    rows, needs = [], {}
    for key, suffix, values, why in curves:
        finite = np.where(np.isfinite(values), values, 10.0)  # a tip that is never distinguished
        rows.append(Beside(key, *posterior.implied(moduli, finite), why))
        if np.ptp(values[:2]) > 1e-3:
            needs[key + suffix] = wanted(moduli, finite, number(key).value)
    return rows, needs


def print_table_3(curves: BiasCurves, posterior: ModulusPosterior) -> tuple[dict[str, float], dict[str, float]]:
    """Hertz columns printed and predicted; rms differences in R and r_c."""
    found = curves.means(posterior.mean_MPa)[0]
    print(f"\nTable 3, Hertz columns: r_c (mm) printed and predicted at μ = {posterior.mean_MPa:.4f} MPa")
    print(f"{'actual':>8s}" + "".join(f"{c + ' printed':>20s}{'predicted':>11s}" for c in CALIBRATIONS))
    columns = [
        (indenter_radius(printed("hertz", c), R_B), indenter_radius(found[i], R_B)) for i, c in enumerate(CALIBRATIONS)
    ]
    for row, tip in enumerate(TIPS_MM):
        print(f"{tip:8.2f}" + "".join(f"{p[row]:20.2f}{q[row]:11.2f}" for p, q in columns))
    in_r = {c: rms(found[i] - printed("hertz", c)) for i, c in enumerate(CALIBRATIONS)}
    in_r_c = {c: rms(q - p) for c, (p, q) in zip(CALIBRATIONS, columns, strict=True)}
    for c in CALIBRATIONS:
        print(f"{c}: rms difference {in_r[c]:.2f} mm in R, {in_r_c[c]:.2f} mm in r_c")
    return in_r, in_r_c


def picture(folder: Path, curves: BiasCurves, found: Findings) -> None:
    """Bias curves with the printed columns, the posteriors, and the moduli that other numbers want."""
    drawn, (left, middle, right) = figure(3, figsize=(13.0, 3.8))
    truth = composite_radius(TIPS_MM, R_B)
    for modulus in (0.03, 0.1, 0.3):
        read = curves.means(modulus)[0, 0]
        left.plot(truth, read, color="0.75", lw=1)
        left.annotate(
            f"{modulus:g} MPa", (truth[-1], read[-1]), (3, 0), textcoords="offset points", fontsize=8, va="center"
        )
    mean, covariance = curves.means(found.posterior.mean_MPa), curves.covariance(found.posterior.mean_MPa, [0], [0])
    left.errorbar(truth, mean[0, 0], np.sqrt(covariance.diagonal()), color="C0", label="predicted, model calibration")
    for mark, calibration in zip("os", CALIBRATIONS, strict=True):
        left.plot(truth, printed("hertz", calibration), mark, label=f"printed, {calibration}")
    left.plot(truth, truth, ":", color="0.5")
    left.set(xlabel="R of the tip (mm)", ylabel="R of the mean estimate (mm)", title="Table 3 read by Hertz")
    left.set_xlim(None, 1.18 * truth[-1])
    left.legend()
    for name, posterior in {**found.by_column, "both": found.posterior}.items():
        grid = posterior.modulus_MPa
        middle.plot(grid, posterior.weight / np.gradient(np.log(grid)), label=name)
    middle.set(xscale="log", xlabel="μ (MPa)", ylabel="density in log μ", title="posterior from the Hertz columns")
    middle.legend(title="columns")
    low, high = found.posterior.interval()
    right.axvspan(low, high, color="C2", alpha=0.2, label="posterior, 90 %")
    names = []
    for i, (key, modulus) in enumerate(found.wanted_MPa.items()):
        names.append(key.replace(" (", "\n(") + ("" if np.isfinite(modulus) else ": none"))
        if np.isfinite(modulus):
            right.plot(modulus, i, "ko")
    right.set(xscale="log", xlim=(0.02, 0.3), xlabel="μ (MPa)", title="μ that other numbers want")
    right.set_yticks(range(len(names)), names, fontsize=8)
    right.set_ylim(len(names) - 0.4, -0.6)
    right.legend()
    for side, ticks in ((middle, (0.03, 0.05, 0.1, 0.2, 0.4)), (right, (0.02, 0.05, 0.1, 0.2))):
        plain_ticks(side.xaxis, ticks)
    save(drawn, folder, "table_3_modulus")


def main(small: bool = False, folder: Path | None = None) -> Findings:
    """Print the tables and save the picture."""
    curves = bias_curves(SMALL_CURVES, fingers=1, errors=5) if small else bias_curves()
    posterior = infer_from_table_3(curves)
    by_column = {c: infer_from_table_3(curves, calibrations=[c]) for c in CALIBRATIONS}
    print("Shear modulus (MPa) from the Hertz columns of Table 3: mean, 90 % interval, extra sd of a printed mean")
    for name, p in {**by_column, "both": posterior}.items():
        low, high = p.interval()
        print(f"  {name:10s} {p.mean_MPa:.4f}   {low:.4f} to {high:.4f}   {p.extra_sd:.2f} mm")
    in_r, in_r_c = print_table_3(curves, posterior)
    rows, needs = predictions(posterior, SMALL_MODULI if small else MODULI)
    print("\nPredicted with that posterior and nothing else fitted")
    print_beside(rows)
    print("\nModulus (MPa) at which each number would be as printed")
    for key, modulus in needs.items():
        print(f"  {key:52s} {modulus:.3f}" if np.isfinite(modulus) else f"  {key:52s} none")
    found = Findings(posterior, by_column, in_r, in_r_c, rows, needs)
    if folder is not None:
        picture(folder, curves, found)
    return found


if __name__ == "__main__":
    main(*options(__doc__))
