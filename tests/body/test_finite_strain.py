"""The finite-strain table against its own finite elements on other meshes, and as an effect of a finger's chain."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline
from study_modules import study

from bayestouch.body.finite_strain import MEASURES, FiniteStrainTable, Measure
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.neighbours import calibration_jacobian
from bayestouch.chain.noise import Noise
from bayestouch.contact import composite_radius
from bayestouch.effects import Setting, effect_classes
from bayestouch.errors import InputError
from bayestouch.finger.reading.reader import FingerPosterior, IndenterPriors, TouchReadings, noise_whitener
from bayestouch.finger.reading.reading_table import ReadingTable

ANGLES = np.radians((np.arange(16) - 7.5) * 8.8)


def finite_strain_correction(
    load: ArrayLike, radius: ArrayLike, turn: ArrayLike, sensing: ArrayLike, *, measure: Measure = "projected"
) -> NDArray[np.float64]:
    """Response that finite strain adds to elements at depths `sensing` (mm), `turn` (rad) from the touch."""
    return FiniteStrainTable.load(measure).for_elements(sensing)(load, radius, turn)


def finger(finite_strain: float = 0.0, modulus: float = 0.1) -> FingerChain:
    one = np.ones(16)
    depths = np.linspace(9.8, 10.7, 16)
    return FingerChain(9.4, 12.7, one, depths, ANGLES, 0 * one, 0.46, modulus, 600.0, finite_strain=finite_strain)


def touches(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Composite radius, location and load."""
    rng = np.random.default_rng(0)
    return rng.uniform(0, 12.7, count), rng.uniform(-0.5, 0.5, count), rng.uniform(20, 300, count)


def test_finite_elements_converge_to_the_linear_chain() -> None:
    """At hardly any load the neo-Hookean annulus is the linear one, the closer the finer its mesh."""
    module = study("finite_strain_table")
    sensing, errors = np.array([9.5, 9.95, 10.4, 10.7]), []
    radius = float(composite_radius(3.9, module.OUTER))
    for size in (5.0, 2.5):
        body = module.annulus(size, module.CORE, module.OUTER, module.POISSON)
        step = next(iter(body.press(module.Tip(3.9, module.FLANK_DEG), np.array([0.002]))))
        strain = np.stack(
            [
                module.radial_strains(module.ANGLES, body.radial_slope(module.ANGLES, float(r)) @ step.displacement)
                for r in sensing
            ]
        )
        off = strain - module.linear_strain(step.load, radius, sensing)[:, None]
        errors.append(np.sqrt(np.mean((off / step.load / module.edge_peaks(sensing)[:, None, None]) ** 2)))
    # Quadratic elements give strains of second order; at two mesh sizes this coarse the rate itself is good to 0.5
    assert np.log2(errors[0] / errors[1]) > 1.5
    assert errors[1] < 1.5e-3


@pytest.mark.slow
@pytest.mark.parametrize("nose", [2.0, 5.0])
def test_table_is_what_a_coarser_mesh_says_of_tips_between_those_solved(nose: float) -> None:
    """A mesh twice as coarse is off by 0.004 (a mesh 1.4 times as coarse by 0.001): so is what is interpolated."""
    found = study("finite_strain_table").check(nose, 2.0, (0.25, 1.2))
    assert found.worst["projected"] < 0.005
    assert found.worst["stretch"] < 0.005
    assert found.added_peak > 10 * 0.005


def test_interpolation_is_close_to_splines_and_cosines() -> None:
    radius, angle, load = touches(200)
    pressed, sensing = load / 1000 / 0.06, 10.3
    for measure in MEASURES:
        table = FiniteStrainTable.load(measure)
        held = np.clip(radius, table.radius_mm[0], None)
        amplitudes = CubicSpline(table.load_over_modulus_mm, table.amplitudes, axis=0)(pressed)
        amplitudes = np.array(
            [CubicSpline(table.radius_mm, a, axis=0)(r) for a, r in zip(amplitudes, held, strict=True)]
        )
        shapes = CubicSpline(table.sensing_radius_mm, table.shapes, axis=1)(sensing)
        modes = np.arange(shapes.shape[-1])
        turn = ANGLES - angle[:, None]
        waves = np.where(modes == 0, 1.0, 2.0) * np.cos(turn[..., None] * modes)
        expected = np.einsum("tj,jk,tmk->tm", amplitudes, shapes, waves)
        found = finite_strain_correction(pressed, radius, turn, np.full(16, sensing), measure=measure)
        assert np.abs(found - expected).max() < 6e-4  # half of what the table itself is good to
        assert np.abs(found).max() > 0.05


def test_added_response_is_even_and_vanishes_with_the_load() -> None:
    turn = np.linspace(0, np.pi, 50)[:, None]
    args = np.full(50, 3.0), np.full(50, 2.0)
    left, right = (finite_strain_correction(*args, sign * turn, [10.0]) for sign in (1, -1))
    assert left == pytest.approx(right, abs=1e-12)
    assert finite_strain_correction(np.zeros(50), args[1], turn, [10.0]) == pytest.approx(0, abs=1e-12)
    # In proportion to the load where that is small: the linear chain is the limit, and its error of first order
    small = [np.abs(finite_strain_correction(np.full(50, p), args[1], turn, [10.0])).max() for p in (0.04, 0.02)]
    assert small[0] < 0.004
    assert small[0] / small[1] == pytest.approx(2.0, abs=0.2)


def test_chain_adds_its_share() -> None:
    radius, angle, load = touches(60)
    linear, half, full = (finger(share).predict(radius, angle, load) for share in (0.0, 0.5, 1.0))
    assert half - linear == pytest.approx((full - linear) / 2, abs=1e-9)
    assert np.abs(full - linear).max() > 0.03 * np.abs(linear).max()
    # stiffer rubber is strained less
    stiff = [finger(share, 3.0).predict(radius, angle, load) for share in (0.0, 1.0)]
    assert np.abs(stiff[1] - stiff[0]).max() < 0.015 * np.abs(stiff[0]).max()


def test_jacobian_has_finite_strain_in_it() -> None:
    """The derivative over log μ, against a difference of predictions five times as wide."""
    touch = touches(20)
    chain = finger(1.0)
    found = calibration_jacobian(chain, *touch)[4]
    up, down = (chain.with_(shear_modulus_MPa=0.1 * np.exp(s)).predict(*touch) for s in (5e-3, -5e-3))
    # linear between knots of load and radius: slopes jump at a knot by a tenth of their size
    assert found == pytest.approx((up - down) / 1e-2, abs=0.1 * np.abs(found).max())
    linear = calibration_jacobian(finger(), *touch)[4]
    assert np.abs(found - linear).max() > 0.1 * np.abs(linear).max()


def test_touches_are_read_by_the_table_with_finite_strain_on_top() -> None:
    """Lookup and chain give the same residuals, in noise standard deviations."""
    chain = finger(1.0)
    radius, angle, load = touches(30)
    noise = Noise(np.full(16, 2.0), np.zeros(16))
    nan = np.full(30, np.nan)
    read = TouchReadings(chain.predict(radius, angle, load), np.ones((30, 16), dtype=np.int64), nan, nan)
    priors = IndenterPriors.of(chain, 200.0)
    table = ReadingTable.of(chain, *priors.location.support)
    posterior = FingerPosterior(chain, read, priors, noise_whitener(noise, read), table)
    rng = np.random.default_rng(1)
    where = np.stack([rng.normal(0, 1, (30, 4)), rng.normal(0, 0.3, (30, 4)), rng.uniform(100, 300, (30, 4))], axis=-1)
    by_table = posterior.residual(where, np.arange(30))
    exact = replace(posterior, table=None).residual(where, np.arange(30))
    # readings reach 300: seven digits of float32 and 3e-4 of the table's interpolation
    assert by_table == pytest.approx(exact, abs=0.05)
    linear = replace(posterior, chain=finger(), table=None).residual(where, np.arange(30))
    assert np.abs(linear - exact).max() > 1


def setting(**changes: object) -> Setting:
    held: dict[str, object] = {
        "finger": True,
        "n_elements": 16,
        "element_place": (np.degrees(ANGLES),),
        "place_range": ((-60.0, 60.0),),
        "reference_load": 200.0,
        "load_unit": "N/m",
        "contact": "layer",
        "has_edges": True,
        "hold_s": 0.0,
        "gap_s": 0.0,
        "span_s": 0.0,
        "radii_mm": (9.4, 12.7),
    }
    return Setting(**{**held, **changes})  # type: ignore[arg-type]


def test_effect_belongs_to_the_finger_of_the_table() -> None:
    effect = effect_classes()["finite_strain"]
    suited = effect.suited(setting())
    assert suited is not None
    assert effect.suited(setting(radii_mm=(8.0, 12.7))) is None
    assert effect.suited(setting(finger=False, radii_mm=(0.0, 0.0))) is None
    assert suited.finger(finger(), (0.7,)).finite_strain == 0.7
    assert suited.without((0.7,)) == (0.0,)


def test_another_finger_is_refused() -> None:
    one = np.ones(2)
    other = FingerChain(8.0, 12.7, one, 9 * one, 0 * one, 0 * one, 0.46, 0.1, 600.0, finite_strain=1.0)
    with pytest.raises(InputError, match=r"tabulated for r_a 9\.4 mm"):
        other.predict([1.0], [0.0], [100.0])
    with pytest.raises(InputError, match=r"sensing radii from 9\.4 to 10\.9"):
        FiniteStrainTable.load().for_elements([11.5])
    with pytest.raises(InputError, match="measure of strain"):
        FiniteStrainTable.load("length")  # type: ignore[arg-type]
