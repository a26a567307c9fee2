"""Chain of a finger: the interpolated response table against the series it stands for, and what it defines."""

from __future__ import annotations

import numpy as np
import pytest

from bayestouch.body.annulus import solve_annulus
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.response import ContactSpectra, ResponseTable, modes_needed
from bayestouch.contact import contact_model
from bayestouch.errors import InputError

CORE, OUTER = 9.4, 12.7
DEPTHS = (9.5, 9.9, 10.3, 10.7)
ANGLES = np.linspace(-np.pi, np.pi, 1501)  # 512 nodes of the table and 1500 are not commensurate


def summed(
    kappa: np.ndarray, angle: np.ndarray, depth: float, *, sigma: float, contact: str, core: float = CORE
) -> np.ndarray:
    """Response relative to a knife edge right above, (kappa, angle), from twice the modes a table sums."""
    modes = np.arange(2 * modes_needed(depth, OUTER))
    body = solve_annulus(modes, core_radius_mm=core, outer_radius_mm=OUTER, poisson_ratio=sigma)
    weights = np.where(modes == 0, 1.0, 2.0) * body.radial_strain(depth)
    spectrum = contact_model(contact, (core, OUTER), sigma).spectrum(kappa, modes)
    return (weights * spectrum) @ np.cos(np.outer(modes, angle)) / weights.sum()


def table_for(depths: tuple[float, ...], *, sigma: float, mu: float, contact: str, core: float = CORE) -> ResponseTable:
    largest = 0.25 * OUTER / mu  # a flat under 250 N/m
    spectra = ContactSpectra.of(
        (core, OUTER), sigma, largest_kappa=largest, largest_sensing_radius_mm=max(depths), contact=contact
    )
    return ResponseTable.of(spectra, depths)


def read(table: ResponseTable, kappa: np.ndarray, angle: np.ndarray, element: int) -> np.ndarray:
    """Interpolated response (kappa, angle) of one element."""
    n = len(table.peak_strain)
    return table(kappa[:, None], np.repeat(angle[None, :, None], n, axis=-1))[..., element]


def kappas(table: ResponseTable, at: float) -> np.ndarray:
    """κ at the knots (`at` 0) or between them (0.5)."""
    steps = np.diff(table.coordinates)
    return np.asarray(np.expm1(table.coordinates[:-1] + at * steps) * table.kappa_scale)


@pytest.mark.parametrize("contact", ["layer", "hertz", "approximate frictionless"])
@pytest.mark.parametrize(("sigma", "mu"), [(0.3, 0.05), (0.46, 0.3), (0.495, 0.05)])
def test_table_is_the_series_to_a_ten_thousandth_of_the_peak(contact: str, sigma: float, mu: float) -> None:
    table = table_for(DEPTHS, sigma=sigma, mu=mu, contact=contact)
    knots, between = kappas(table, 0.0)[::6], kappas(table, 0.5)
    for element, depth in enumerate(DEPTHS):
        truth = summed(between, ANGLES, depth, sigma=sigma, contact=contact)
        # the bounds that bayestouch.chain.response states: linear in κ, cubic in angle
        assert np.abs(read(table, between, ANGLES, element) - truth).max() < 1e-4
        truth = summed(knots, ANGLES, depth, sigma=sigma, contact=contact)
        assert np.abs(read(table, knots, ANGLES, element) - truth).max() < 1e-5


@pytest.mark.parametrize(
    ("core", "depth", "contact", "bound_angle", "bound_kappa"),
    [
        # 129 modes on 512 angles: the fewest angles a wave that any depth gets
        (9.4, 11.19, "layer", 3e-5, 1e-4),
        # a thin layer with a shallow element, Hertz: the fastest change with κ that the text speaks of
        (11.43, 12.4, "hertz", 3e-5, 5e-4),
    ],
)
def test_bounds_away_from_the_paper(
    core: float, depth: float, contact: str, bound_angle: float, bound_kappa: float
) -> None:
    table = table_for((depth,), sigma=0.46, mu=0.05, contact=contact, core=core)
    knots, between = kappas(table, 0.0)[::8], kappas(table, 0.5)[::4]
    truth = summed(knots, ANGLES, depth, sigma=0.46, contact=contact, core=core)
    assert np.abs(read(table, knots, ANGLES, 0) - truth).max() < bound_angle
    truth = summed(between, ANGLES, depth, sigma=0.46, contact=contact, core=core)
    assert np.abs(read(table, between, ANGLES, 0) - truth).max() < bound_kappa


def test_more_knots_converge_with_second_order() -> None:
    """Linear interpolation: half the spacing, a quarter of the error."""
    errors = []
    for knots in (12, 23, 45):
        spectra = ContactSpectra.of(
            (CORE, OUTER), 0.46, largest_kappa=60.0, largest_sensing_radius_mm=10.3, knots=knots
        )
        table = ResponseTable.of(spectra, [10.3])
        between = kappas(table, 0.5)
        truth = summed(between, ANGLES, 10.3, sigma=0.46, contact="layer")
        errors.append(np.abs(read(table, between, ANGLES, 0) - truth).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 1.8), (errors, orders)


def test_omitted_modes_do_not_reach_the_element() -> None:
    for depth in (9.5, 10.7, 12.0):
        last = modes_needed(depth, OUTER)
        modes = np.arange(8 * last)
        strain = solve_annulus(modes, core_radius_mm=CORE, outer_radius_mm=OUTER, poisson_ratio=0.46).radial_strain(
            depth
        )
        # strain falls as k (r_s/r_b)^k at most, so the tail is a few hundred times the tolerance of 1e-7
        assert 2 * np.abs(strain[last + 1 :]).sum() < 1e-4 * 2 * strain.sum()
    with pytest.raises(InputError, match="inside the finger"):
        modes_needed(OUTER, OUTER)


def chain(**changes: object) -> FingerChain:
    values: dict[str, object] = {
        "core_radius_mm": CORE,
        "outer_radius_mm": OUTER,
        "response": np.array([4.0, 5.0, 6.0]),
        "sensing_radius_mm": np.array([9.7, 9.9, 10.2]),
        "angle": np.radians([-8.8, 0.3, 9.0]),
        "offset": np.array([0.0, 0.0, 0.0]),
        "poisson_ratio": 0.46,
        "shear_modulus_MPa": 0.15,
        "largest_load": 300.0,
    }
    return FingerChain(**(values | changes))  # type: ignore[arg-type]


def test_knife_edge_right_above_reads_one_and_nothing_reads_more() -> None:
    table = table_for(DEPTHS, sigma=0.46, mu=0.15, contact="layer")
    above = table(0.0, np.zeros(4))
    # the inverse transform's rounding
    np.testing.assert_allclose(above, 1.0, rtol=0, atol=1e-12)
    assert table.values.max() <= 1 + 1e-12
    finger = chain()
    edges = finger.predict(np.zeros(3), finger.angle, np.full(3, 200.0))
    # up to the angle's interpolation
    np.testing.assert_allclose(np.diagonal(edges), finger.response * 200.0, rtol=1e-5)


def test_response_is_even_and_periodic() -> None:
    table = table_for(DEPTHS, sigma=0.46, mu=0.15, contact="layer")
    rng = np.random.default_rng(1)
    kappa, angle = rng.uniform(0, 20, 50), rng.uniform(-np.pi, np.pi, (50, 1)) * np.ones(4)
    value = table(kappa, angle)
    # Rounding of an angle of a few turns moves the place between two angles by 1e-13 of their spacing.
    np.testing.assert_allclose(table(kappa, -angle), value, rtol=0, atol=1e-11)
    for turns in (-2, -1, 1, 3):
        np.testing.assert_allclose(table(kappa, angle + 2 * np.pi * turns), value, rtol=0, atol=1e-11)
    ends = np.array([-np.pi, np.pi, 3 * np.pi])[:, None] * np.ones(4)
    assert np.ptp(table(3.0, ends), axis=0).max() < 1e-11


def test_beyond_the_table_its_end_is_used() -> None:
    table = table_for(DEPTHS, sigma=0.46, mu=0.15, contact="layer")
    end = np.expm1(table.coordinates[-1]) * table.kappa_scale
    angle = np.full(4, 0.05)
    np.testing.assert_allclose(table(10 * end, angle), table(end, angle), rtol=0, atol=1e-8)
    np.testing.assert_array_equal(table(-1.0, angle), table(0.0, angle))


def test_table_that_begins_above_the_knife_edge() -> None:
    whole = table_for(DEPTHS, sigma=0.46, mu=0.15, contact="layer")
    spectra = ContactSpectra.of(
        (CORE, OUTER), 0.46, smallest_kappa=2.0, largest_kappa=20.0, largest_sensing_radius_mm=max(DEPTHS)
    )
    part = ResponseTable.of(spectra, DEPTHS)
    kappa, angle = np.linspace(2.0, 20.0, 40), np.linspace(-0.5, 0.5, 40)[:, None] * np.ones(4)
    # each is good to 1e-4 of the peak
    np.testing.assert_allclose(part(kappa, angle), whole(kappa, angle), rtol=0, atol=2e-4)
    np.testing.assert_allclose(part(0.5, angle[0]), part(2.0, angle[0]), rtol=0, atol=1e-12)
    np.testing.assert_array_equal(part.peak_strain, whole.peak_strain)


def test_linear_in_the_load_at_fixed_kappa() -> None:
    finger = chain(offset=np.array([3.0, -2.0, 0.5]))
    once = finger.predict(8.0, 0.02, 100.0) - finger.offset
    # κ = P R/μ is the same: the products round differently in the last digit, no more
    np.testing.assert_allclose(finger.predict(4.0, 0.02, 200.0) - finger.offset, 2 * once, rtol=1e-12)
    softer = chain(shear_modulus_MPa=0.075, offset=finger.offset)
    # its table has other knots, each good to 1e-4 of the peak
    np.testing.assert_allclose(
        softer.predict(4.0, 0.02, 100.0) - finger.offset, once, rtol=0, atol=2e-4 * 100 * finger.response.max()
    )
    assert np.abs(finger.predict(8.0, 0.02, 200.0) - finger.offset - 2 * once).max() > 1.0
    np.testing.assert_array_equal(finger.predict(5.0, 0.3, 0.0), finger.offset)


def test_predict_broadcasts() -> None:
    finger = chain()
    radius, angle, load = np.array([[1.0], [5.0]]), np.array([-0.1, 0.0, 0.2]), 180.0
    together = finger.predict(radius, angle, np.full((2, 3), load))
    assert together.shape == (2, 3, 3)
    for i in range(2):
        for j in range(3):
            alone = finger.predict(radius[i, 0], angle[j], load)
            np.testing.assert_allclose(together[i, j], alone, rtol=1e-13)


def test_peaks_of_the_finite_element_model() -> None:
    """Peak strains under a line load of P/μ = 1 mm at σ = 0.46, by finite elements."""
    peaks = np.array([0.02922, 0.05857, 0.07865, 0.09785])
    depths = np.array(DEPTHS)
    angle = np.radians([-30.0, -10.0, 10.0, 30.0])
    finger = chain(
        response=np.ones(4), sensing_radius_mm=depths, angle=angle, offset=np.zeros(4), shear_modulus_MPa=0.2
    )
    readings = np.diagonal(finger.predict(np.zeros(4), angle, np.full(4, 200.0)))
    # Series and finite elements agree to 2e-4 of the peak, and the last digit printed is worth 5e-6.
    np.testing.assert_allclose(readings / finger.gain, peaks, rtol=2e-4, atol=5e-6)


def test_gain_is_reading_per_compressive_strain() -> None:
    finger = chain()
    modes = np.arange(2 * modes_needed(10.2, OUTER))
    body = solve_annulus(modes, core_radius_mm=CORE, outer_radius_mm=OUTER, poisson_ratio=0.46)
    strain = body.radial_strain(finger.sensing_radius_mm)
    twice = np.where(modes == 0, 1.0, 2.0)
    radius, angle, load = 6.0, 0.07, 210.0
    kappa = load / 1000 * radius / finger.shear_modulus_MPa
    spectrum = contact_model("layer", (CORE, OUTER), 0.46).spectrum(kappa, modes)
    series = (twice * strain * spectrum * np.cos(np.outer(finger.angle - angle, modes))).sum(axis=1)
    compression = load / 1000 / finger.shear_modulus_MPa / (2 * np.pi * OUTER) * series
    # 1.1e-4 of the peak: interpolation in κ and angle
    error = finger.predict(radius, angle, load) / finger.gain - compression
    assert np.abs(error / (finger.response * load / finger.gain)).max() < 1.1e-4
    assert compression.max() > 0


def test_changed_finger_is_the_same_as_a_new_one() -> None:
    finger = chain()
    touch = (5.0, 0.04, 190.0)
    finger.predict(*touch)  # fills the caches that with_ may keep
    changes: list[dict[str, object]] = [
        {"response": np.array([1.0, 2.0, 3.0])},
        {"angle": np.array([0.1, 0.2, 0.3]), "offset": np.ones(3)},
        {"sensing_radius_mm": np.array([9.6, 9.8, 10.1])},
        {"sensing_radius_mm": np.array([9.6, 9.8, 10.9])},
        {"poisson_ratio": 0.4},
        {"shear_modulus_MPa": 0.1},
        {"contact": "hertz"},
        {"largest_load": 500.0},
    ]
    for change in changes:
        expected = chain(**change).predict(*touch)
        got = finger.with_(**change).predict(*touch)
        # a kept table may sum a few modes more than a new one would: 1e-7 of the peak
        np.testing.assert_allclose(got, expected, rtol=0, atol=1e-6 * np.abs(expected).max(), err_msg=str(change))
        assert np.abs(got - finger.predict(*touch)).max() > 1e-9 or change == {"largest_load": 500.0}
