"""The independent simulator: against the checked numbers, against the package's chain, and against itself."""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import pytest
from independent.body import Annulus, solve
from independent.contact import Influence, contact_table, press
from independent.dataset import EFFECTS, Simulated, forms, simulate, write
from independent.finger import SMALL, Design, Press, build, record
from independent.sizes import OutOfReach, applied, left_over, size

from bayestouch.data.dataset import DataSet, load_dataset
from bayestouch.data.sensor import Finger
from bayestouch.finger.fit import fit_finger
from bayestouch.finger.priors import FingerPriors
from bayestouch.simulation import FingerDesign
from bayestouch.simulation.finger import BuiltFinger

PAPER = Annulus(9.4, 12.7, 0.46)
# mode: e_rr at 9.5, 9.9 and 10.7 mm, u_r(r_b) in mm, for unit traction at μ = 1 MPa (Michell's stress functions)
E_MAP = {
    0: (0.07583858, 0.07286806, 0.06789520, 0.22005645),
    1: (0.07792086, 0.08539014, 0.09312645, 0.29815262),
    2: (0.08214425, 0.11048738, 0.14163677, 0.44248462),
    5: (0.08978263, 0.16782027, 0.23761632, 0.67523262),
    10: (0.06354410, 0.14725101, 0.22297318, 0.61740961),
    20: (0.00953883, 0.02664195, 0.07039330, 0.34217545),
    30: (0.00091312, 0.00309535, 0.01826490, 0.22828814),
}
# r_c: half-width (mm) and centre pressure (MPa) under 0.2 N/mm at μ = 0.3, then 0.05 MPa (Chebyshev polynomials)
CONTACTS = {
    0.5: (0.3307, 0.38500, 0.7969, 0.15984),
    3.9: (0.8097, 0.15731, 1.8411, 0.06960),
    12.3: (1.1490, 0.11096, 2.5004, 0.05176),
    25.25: (1.3203, 0.09664, 2.8159, 0.04625),
    np.inf: (1.5854, 0.08062, 3.2883, 0.04003),
}


def dataset(simulated: Simulated, folder: Path) -> DataSet:
    return load_dataset(write(simulated, folder))


def lack_of_fit(data: DataSet) -> float:
    """Of the base calibration."""
    assert data.calibration is not None
    assert isinstance(data.sensor.body, Finger)
    priors, _ = FingerPriors.of(data.sensor)
    fit, _ = fit_finger(data.calibration.averaged(), data.sensor.body, priors)
    return fit.lack_of_fit


def test_it_shares_no_code_with_the_package() -> None:
    for path in (Path(__file__).parents[1] / "independent").glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.level == 0:
                names = [node.module or ""]
            assert not any(name.startswith("bayestouch") for name in names), path


def test_body_gives_the_checked_numbers() -> None:
    response = solve(PAPER, np.array(list(E_MAP)))
    strain = response.strain_at(np.array([9.5, 9.9, 10.7]))
    wanted = np.array(list(E_MAP.values()))
    # the last printed digit
    np.testing.assert_allclose(np.column_stack([strain, response.surface]), wanted, rtol=0, atol=0.51e-8)


def test_body_does_not_depend_on_the_collocation() -> None:
    modes = np.arange(0, 200, 7)
    coarse, fine = solve(PAPER, modes), solve(PAPER, modes, points=96)
    # differentiating twice on 96 points loses 96^4 of double precision's 1e-16
    np.testing.assert_allclose(coarse.surface, fine.surface, rtol=1e-8)
    np.testing.assert_allclose(
        coarse.strain_at(np.array([9.7, 10.2])), fine.strain_at(np.array([9.7, 10.2])), atol=1e-8
    )


def test_shear_and_normal_traction_are_reciprocal() -> None:
    """Betti: what shear does to u_r, the normal traction does to u_θ."""
    modes = np.arange(1, 100)
    normal, shear = solve(PAPER, modes), solve(PAPER, modes, "shear")
    np.testing.assert_allclose(shear.surface, normal.slip, rtol=0, atol=1e-8)
    assert np.abs(shear.surface).max() > 0.01


def test_contact_gives_the_checked_numbers() -> None:
    influence, table = Influence.of(PAPER), contact_table(PAPER, 60)
    for tip, (*wanted,) in CONTACTS.items():
        radius = 1 / (1 / 12.7 + 1 / tip)
        for modulus, half_width, pressure in ((0.3, *wanted[:2]), (0.05, *wanted[2:])):
            # piecewise linear pressure is (π/2·96)²/8 off in the load: half of that in the width, and a printed digit
            tolerance = 2e-5 * half_width + 5e-5
            assert table.width(np.array([0.2 * radius / modulus]))[0] == pytest.approx(half_width, abs=tolerance)
            solved = press(influence, 12.7, half_width / 12.7)
            # the printed half-width is off by up to 5e-5 mm, and the load goes as its square
            tolerance = 2 * 0.5e-4 / half_width + 2e-4
            assert solved.load * modulus / radius == pytest.approx(0.2, rel=tolerance)
            assert solved.pressure[0] * modulus / radius == pytest.approx(pressure, rel=tolerance, abs=5e-6)


def test_contact_presses_inside_and_leaves_a_gap_outside() -> None:
    """The free boundary is where complementarity puts it: pressure above zero inside, no overlap outside."""
    influence = Influence.of(PAPER)
    solved = press(influence, PAPER.outer, 0.15)
    assert np.all(solved.pressure[:-1] > 0)
    k = np.arange(2000)
    tail = influence.half_plane / k[200:] + influence.next_order / k[200:] ** 2
    compliance = np.append(solve(PAPER, k[:200]).surface, tail)
    angles = np.linspace(0.152, 0.3, 30)
    series = np.where(k == 0, 1, 2) * compliance * solved.spectrum(k) * solved.load / (2 * np.pi * PAPER.outer)
    gap = (PAPER.outer * angles) ** 2 / 2 - solved.depth + np.cos(np.outer(angles, k)) @ series
    assert np.all(gap > 0)
    assert np.all(np.diff(gap) > 0)


def test_agrees_with_the_chain_of_the_package() -> None:
    design = Design()
    finger = build(design, np.random.default_rng(5))
    recording = record(design, finger, np.random.default_rng(6))
    package = BuiltFinger(FingerDesign(poisson_ratio=0.465), finger.depth, finger.angle, finger.gain)
    press = recording.press
    difference = finger.gain * package.strain(press.tip, press.angle, press.load) - finger.signal(press)
    # the package's contact is good to 1e-5 in the spectrum, this one to 2e-6 in the modes that reach an element
    assert np.abs(difference / finger.peak).max() < 1e-5


def test_without_an_effect_the_package_has_nothing_to_find(tmp_path: Path) -> None:
    data = dataset(simulate(Design(), [], 11), tmp_path / "plain")
    assert data.calibration is not None
    rows = 242 * 16
    # χ² of the rows, over a pure error that has four times as many degrees of freedom; the shared load noise widens it
    assert abs(lack_of_fit(data) - 1) < 5 * np.sqrt(2 / rows * 1.25)


@pytest.mark.parametrize("key", EFFECTS)
def test_effects_have_the_size_asked_for(key: str) -> None:
    """And vanish at zero, and grow."""
    effect = EFFECTS[key]
    try:
        value = simulate(SMALL, [(effect, 0.5)], 3).truth["effects"][key]  # type: ignore[index]
    except OutOfReach:
        pytest.skip("absorbed by the base parameters: no plausible value leaves half the noise")
    plain = simulate(SMALL, [], 3).recording
    assert size(plain) < 1e-9
    assert size(applied(plain, [(effect, value)], 3)) == pytest.approx(0.5, rel=0.01)
    assert size(applied(plain, [(effect, value / 2)], 3)) < 0.45


@pytest.mark.parametrize("seed", range(4))
def test_the_second_effect_of_a_pair_has_the_size_asked_for(seed: int) -> None:
    """With the course that it has on this finger, which is another one than if it were the first."""
    pair = [EFFECTS["crosstalk: unequal, second neighbours"], EFFECTS["baseline_drift: random walk"]]
    simulated = simulate(SMALL, [(effect, 2.0) for effect in pair], seed)
    value = simulated.truth["effects"][pair[1].key]  # type: ignore[index]
    second = pair[1].apply(simulate(SMALL, [], seed).recording, value, np.random.default_rng([seed, 101]))
    assert size(second) == pytest.approx(2.0, rel=0.01)


def test_size_predicts_the_lack_of_fit(tmp_path: Path) -> None:
    """The lack of fit is 1 + s² of the calibration touches: their own residual, as left over by the base parameters."""
    (effect,) = forms("crosstalk")
    simulated = simulate(Design(), [(effect, 1.0)], 7)
    data = dataset(simulated, tmp_path / "crosstalk")
    recording = simulated.recording
    rows = recording.touch[recording.touch < sum(recording.parts[:2])] < recording.parts[0]
    own = np.mean(left_over(recording)[rows] ** 2) / (recording.noise_sd**2 / recording.n_samples)
    # the fit to these touches alone leaves less than the one to all touches, by which size is defined
    assert 0.75 * own < lack_of_fit(data) - 1 < 1.1 * own


def test_a_tilted_touch_pulls_to_one_side() -> None:
    """Shear is odd about the contact: nothing right under it for an even response, opposite on both sides."""
    finger = build(Design(depth_sd=0, gain_sd=0, angle_sd=0), np.random.default_rng(0))
    at = np.zeros(1)
    upright = finger.signal(Press(at, at, at + 200.0))
    pulled = finger.signal(Press(at, at, at + 200.0, tangential=at + 0.2)) - upright
    np.testing.assert_allclose(pulled, -pulled[:, ::-1], atol=1e-9 * upright.max())
    assert np.abs(pulled).max() > 0.02 * upright.max()
