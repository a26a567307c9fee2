"""Direct identification of the E map (section 3.2, Table 2) on the practice fingers, by three calibrations.

model       the elastic model's E, fitted (section 3.1)
least sq.   equation (6): E by least squares. The touches cover one side of the finger, so P is not of full rank:
            directions below a hundredth of its largest singular value are left out
Bayesian    E with a prior centred on the model, of inferred strength (`bayestouch.finger.empirical.calibration`)

Held-out touches are those of touches.csv made with other indenters than the calibration's edge and flat. With
`--small` finger-b alone.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from _published import figure, options, save

from bayestouch.chain.empirical import EmpiricalFingerChain, elastic_e_matrix, modes_of, pressure_matrix
from bayestouch.chain.neighbours import calibration_jacobian
from bayestouch.chain.noise import Noise
from bayestouch.contact import composite_radius
from bayestouch.data.averages import TouchMeans
from bayestouch.data.dataset import load_dataset
from bayestouch.finger.empirical.calibration import EmpiricalFit, fit_empirical
from bayestouch.finger.fit import FingerFit, fit_finger
from bayestouch.finger.priors import FingerPriors
from bayestouch.finger.reading.covariance import reading_covariance
from bayestouch.finger.reading.modes import find_modes, hessian_at, with_whitener
from bayestouch.finger.reading.profile import profile_proposal
from bayestouch.finger.reading.reader import (
    FingerPosterior,
    IndenterPriors,
    TouchReadings,
    full_whitener,
    noise_whitener,
)
from bayestouch.finger.reading.reading_table import ReadingTable
from bayestouch.paper import published
from bayestouch.sampling import sample_blocks

SMALLEST_SINGULAR_VALUE = 0.01
CALIBRATIONS = ("model", "least sq.", "Bayesian")

CovarianceOf = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False)
class Finger:
    """A finger calibrated in three ways, and its held-out touches."""

    fit: FingerFit
    means: TouchMeans
    held_out: TouchMeans
    empirical: EmpiricalFit
    chains: dict[str, EmpiricalFingerChain]
    noises: dict[str, Noise]
    covariances: dict[str, CovarianceOf | None]

    @property
    def peak(self) -> np.ndarray:
        """Reading of each element right under an edge of the mean load."""
        return np.abs(self.fit.chain.response) * float(self.fit.likelihood.known.load.mean())


def least_squares(fit: FingerFit, rows: np.ndarray) -> np.ndarray:
    """Equation (6) from some of the calibration touches, with the weak directions of P left out."""
    known = fit.likelihood.known
    design = pressure_matrix(fit.chain, known.radius_mm, known.angle, known.load, modes_of(fit.chain))[rows]
    solution, *_ = np.linalg.lstsq(design, known.readings[rows], rcond=SMALLEST_SINGULAR_VALUE)
    return solution.T


def calibrated(folder: Path) -> Finger:
    """Calibrate the finger of a data set in all three ways."""
    dataset = load_dataset(folder)
    means = dataset.calibration.baseline_corrected().averaged()
    priors, _ = FingerPriors.of(dataset.sensor)
    fit, _ = fit_finger(means, dataset.sensor.body, priors)
    empirical = fit_empirical(fit)
    known, chain = fit.likelihood.known, fit.chain
    touched = dataset.touches.baseline_corrected().averaged()
    other = ~np.isin(touched.indenter_radius_mm, means.indenter_radius_mm)
    identified = EmpiricalFingerChain(chain, least_squares(fit, np.ones(len(known.load), dtype=bool)))
    left = known.readings - identified.predict(known.radius_mm, known.angle, known.load)
    excess = (left**2).mean(axis=0) - fit.noise.tactile_sd**2 / known.counts.mean(axis=0)
    return Finger(
        fit=fit,
        means=means,
        held_out=select(touched, other),
        empirical=empirical,
        chains={
            "model": EmpiricalFingerChain(chain, elastic_e_matrix(chain, modes_of(chain))),
            "least sq.": identified,
            "Bayesian": empirical.calibration.chain,
        },
        noises={
            "model": fit.noise,
            "least sq.": replace(fit.noise, discrepancy_sd=np.sqrt(np.maximum(excess, 0.0))),
            "Bayesian": empirical.calibration.noise,
        },
        covariances={
            "model": lambda r, a, p: reading_covariance(calibration_jacobian(chain, r, a, p), fit.covariance),
            "least sq.": None,
            "Bayesian": empirical.calibration.reading_covariance,
        },
    )


def select(means: TouchMeans, rows: np.ndarray) -> TouchMeans:
    """Some of the touches."""
    by_touch = ("touch", "readings", "counts", "load", "indenter_radius_mm", "depth_mm", "time_s", "angle_deg")
    return replace(means, **{name: getattr(means, name)[rows] for name in by_touch})


def poses(means: TouchMeans, finger: Finger) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Composite radius (mm), location (rad), load (N/m)."""
    outer = finger.fit.chain.outer_radius_mm
    return composite_radius(means.indenter_radius_mm, outer), np.radians(means.angle_deg), means.load


def squared_errors(finger: Finger, name: str) -> np.ndarray:
    """Squared held-out errors (t, m), in (% of peak)²."""
    touches = finger.held_out
    predicted = finger.chains[name].predict(*poses(touches, finger))
    return ((touches.readings - predicted) / finger.peak * 100) ** 2


def error(squared: np.ndarray) -> float:
    """Root mean square over touches, mean over elements."""
    return float(np.sqrt(squared.mean(axis=0)).mean())


def change(finger: Finger, name: str) -> tuple[float, float]:
    """Mean squared held-out error minus that of the model, and its standard error over touches, (% of peak)²."""
    difference = (squared_errors(finger, name) - squared_errors(finger, "model")).mean(axis=1)
    return float(difference.mean()), float(difference.std(ddof=1) / np.sqrt(len(difference)))


def read(finger: Finger, name: str, *, draws: int = 256, every: int = 1, seed: int = 0) -> dict[str, float]:
    """Errors of R, θ_c and P of held-out touches read with one calibration, and coverage of R's 90 % intervals."""
    touches = select(finger.held_out, np.arange(0, finger.held_out.n_touches, every))
    chain, noise = finger.chains[name], finger.noises[name]
    reads = np.maximum(touches.counts.max(axis=1), 1)
    readings = TouchReadings(touches.readings, touches.counts, touches.load, noise.force_sd / np.sqrt(reads))
    priors = IndenterPriors.of(chain, float(finger.means.load.mean()))
    table = ReadingTable.of_map(chain, *priors.location.support)
    posterior = FingerPosterior(chain, readings, priors, noise_whitener(noise, readings), table)
    mode = find_modes(posterior)
    covariance_of = finger.covariances[name]
    if covariance_of is not None:
        covariance = covariance_of(posterior.radius(mode[:, 0]), mode[:, 1], mode[:, 2])
        posterior = with_whitener(posterior, full_whitener(noise, readings, covariance))
        mode = find_modes(posterior)
    proposal = profile_proposal(posterior, mode, hessian_at(posterior, mode))
    drawn = sample_blocks(posterior.log_density, proposal, walkers=4, draws=draws, seed=seed).draws
    flat = drawn.reshape(-1, *drawn.shape[2:])
    radius, (true_radius, true_angle, load) = posterior.radius(flat[..., 0]), poses(touches, finger)
    low, high = np.quantile(radius, [0.05, 0.95], axis=0)
    miss = radius.mean(axis=0) - true_radius
    turn = np.degrees(flat[..., 1].mean(axis=0) - true_angle)
    return {
        "R_bias": float(miss.mean()),
        "R_rms": float(np.sqrt((miss**2).mean())),
        "theta_rms": float(np.sqrt((turn**2).mean())),
        "P_rms": float(np.sqrt(((flat[..., 2].mean(axis=0) - load) ** 2).mean())),
        "coverage": float(((low <= true_radius) & (true_radius <= high)).mean()),
    }


def table_2(finger: Finger) -> dict[str, tuple[float, float, float]]:
    """Standard error of the fits to the edges, % of peak: minimum, mean and maximum over the elements."""
    known = finger.fit.likelihood.known
    edges = known.radius_mm == 0
    design = pressure_matrix(finger.fit.chain, known.radius_mm, known.angle, known.load, modes_of(finger.fit.chain))
    chains = {name: chain.e_matrix for name, chain in finger.chains.items()}
    maps = chains | {"least sq. of edges alone": least_squares(finger.fit, edges)}
    out = {}
    for name, e_matrix in maps.items():
        left = known.readings[edges] - design[edges] @ e_matrix.T
        percent = np.sqrt((left**2).mean(axis=0)) / finger.peak * 100
        out[name] = (float(percent.min()), float(percent.mean()), float(percent.max()))
    return out


def shared_folder() -> Path:
    """Folder of practice data: `$BAYESTOUCH_SHARED`, or `shared` beside the checkout."""
    named = os.environ.get("BAYESTOUCH_SHARED")
    return Path(named) if named else Path(__file__).resolve().parents[2] / "shared"


def undeclared(folder: Path) -> str:
    """Effect that the simulator put in, which nothing above knows of."""
    path = folder.parent / "truth" / folder.name / "truth.json"
    if not path.is_file():
        return "unknown"
    effects = json.loads(path.read_text(encoding="utf-8"))["effects"]
    return ", ".join(f"{name} {value:g}" for name, value in effects.items()) or "none"


def print_finger(folder: Path, finger: Finger) -> None:
    strength = finger.empirical.strength
    low, high = strength.interval()
    each = finger.empirical.strengths
    print(f"\n{folder.name}: undeclared effect {undeclared(folder)}")
    found = f"{finger.empirical.effective_coefficients.mean():.1f} of {2 * modes_of(finger.fit.chain) + 1}"
    print(f"  prior strength: scale 90 % in ({low:.4f}, {high:.4f}), elements {each.min():.4f} to {each.max():.4f}")
    print(f"  coefficients that the touches determine: {found}")
    print(
        f"  mean square left over pure error: model {finger.fit.lack_of_fit:.2f}, "
        f"Bayesian {finger.empirical.lack_of_fit.mean():.2f}"
    )
    print("  held out       error %   change ± se (%²)     R bias    R rms  θ rms   P rms  R in 90 %")
    for name in CALIBRATIONS:
        errors, (difference, se) = read(finger, name), change(finger, name)
        print(
            f"  {name:12s} {error(squared_errors(finger, name)):9.3f}  {difference:8.4f} ± {se:.4f}   "
            f"{errors['R_bias']:8.3f} {errors['R_rms']:8.3f} {errors['theta_rms']:6.3f} {errors['P_rms']:7.3f}"
            f" {errors['coverage'] * 100:8.1f}"
        )
    print(
        "  fit to edges, % of peak: "
        + "; ".join(f"{k} {a:.2f}/{b:.2f}/{c:.2f}" for k, (a, b, c) in table_2(finger).items())
    )


def save_picture(fingers: dict[str, Finger], folder: Path) -> None:
    """Departure from the model of one element of each finger, with two standard deviations, as Figure 10."""
    drawn, axes = figure(1, len(fingers), figsize=(7.0, 1.5 * len(fingers) + 0.4), sharex=True, squeeze=False)
    degrees = np.linspace(-180, 180, 721)
    for (name, finger), axis in zip(fingers.items(), axes[:, 0], strict=True):
        element, known = 8, finger.fit.likelihood.known
        edge = (np.zeros(len(degrees)), np.radians(degrees), np.full(len(degrees), float(known.load.mean())))
        scale = 100 / finger.peak[element]
        model = finger.chains["model"].predict(*edge)[:, element]
        bayes = (finger.chains["Bayesian"].predict(*edge)[:, element] - model) * scale
        covariance = finger.empirical.calibration.reading_covariance(*edge)
        sd = np.sqrt(covariance[:, element, element]) * scale
        rows = known.radius_mm == 0
        dots = (known.readings - finger.fit.predicted)[rows, element] * scale
        axis.plot(np.degrees(known.angle[rows]), dots, ".", color="0.7", ms=3, label="edges")
        axis.fill_between(degrees, bayes - 2 * sd, bayes + 2 * sd, alpha=0.3, lw=0, label="± 2 sd")
        axis.plot(degrees, bayes, label="E map with a prior")
        axis.plot(
            degrees,
            (finger.chains["least sq."].predict(*edge)[:, element] - model) * scale,
            lw=0.7,
            label="E map by equation (6)",
        )
        axis.set_ylim(-6, 6)
        axis.set_title(name, loc="left", y=0.78, x=0.01)
    drawn.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    drawn.supylabel(f"reading of element {element + 1} less the fitted model's (% of its peak)", fontsize=10)
    axes[-1, 0].set_xlabel("location of the edge (degree)")
    save(drawn, folder, "empirical_calibration")


def main(small: bool = False, pictures: Path | None = None) -> None:
    """Print every finger's table."""
    folders = sorted((shared_folder() / "practice").glob("finger-b" if small else "finger-*"))
    if not folders:
        print("no practice fingers: set $BAYESTOUCH_SHARED, or put the folder `shared` beside the checkout")
        return
    fingers = {}
    for folder in folders:
        fingers[folder.name] = calibrated(folder)
        print_finger(folder, fingers[folder.name])
    (row,) = published.TABLE_2
    print(f"\nTable 2 of the paper, empirical fits to edges: {row.minimum}/{row.average}/{row.maximum} % of peak")
    if pictures is not None:
        save_picture(fingers, pictures)


if __name__ == "__main__":
    main(*options(__doc__))
