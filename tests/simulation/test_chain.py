"""Effects in a simulation against the catalogue's formulas as they are written out in tests/independent."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import pytest
from independent import catalogue_forms as forms
from independent.body import Annulus
from independent.catalogue_finger import finite_strain
from independent.finger import Finger, Press

from bayestouch.body.layer import layer_kernel_2d
from bayestouch.data.sensor import Finger as SensorFinger
from bayestouch.effects import effect_classes
from bayestouch.errors import InputError
from bayestouch.simulation import FingerDesign, PadDesign, SimulatedDataSet, simulate

SILENT = FingerDesign(
    samples_per_touch=3,
    edge_step_deg=10.0,
    flat_step_deg=30.0,
    touch_radii_mm=(0.0, 1.59, 12.3, np.inf),
    touch_step_deg=8.0,
    noise_percent_peak=0.0,
    force_noise_sd=0.0,
)
QUIET_PAD = PadDesign(noise_percent_peak=0.0, force_noise_sd=0.0, calibration_step_mm=4.0, n_touches=20)
SEED = 6
Stated = Mapping[str, float]


@dataclass(frozen=True, eq=False)
class Made:
    """A simulation as plain arrays; n rows, m elements. Loads in N/m or N, angles in degree, lengths in mm."""

    simulated: SimulatedDataSet

    @classmethod
    def of(cls, design: FingerDesign | PadDesign, effects: Stated | None = None) -> Made:
        return cls(simulate(design, effects=effects, seed=SEED))

    def column(self, name: str) -> np.ndarray:
        dataset = self.simulated.dataset
        assert dataset.calibration is not None
        return np.concatenate([getattr(table, name) for table in (dataset.calibration, dataset.touches)])

    def true(self, name: str) -> np.ndarray:
        """Of each row."""
        values = np.concatenate([self.simulated.truth[table][name] for table in ("calibration", "touches")])
        return values[self.touch]

    @property
    def signal(self) -> np.ndarray:
        return self.column("readings")

    @property
    def load(self) -> np.ndarray:
        return self.column("load")

    @property
    def time(self) -> np.ndarray:
        return self.column("time_s")

    @property
    def touch(self) -> np.ndarray:
        """Counted over both tables."""
        return np.cumsum(self.column("sample") == 0) - 1

    @property
    def held(self) -> np.ndarray:
        return 0.25 * self.column("sample")

    @property
    def peak(self) -> np.ndarray:
        load = 200.0 if "theta_s" in self.simulated.truth else 2.0
        return np.array(self.simulated.truth["response"]) * load

    @property
    def element(self) -> np.ndarray:
        return np.array(self.simulated.truth["theta_s"])

    @property
    def nominal(self) -> np.ndarray:
        """Angles of the elements as the file of the sensor states them."""
        finger = self.simulated.dataset.sensor.body
        assert isinstance(finger, SensorFinger)
        return np.array(finger.element_angles_deg)

    @property
    def angle(self) -> np.ndarray:
        return self.column("angle_deg")

    @property
    def place(self) -> np.ndarray:
        return np.stack([self.column("x_mm"), self.column("y_mm")], axis=1)

    def independent(self) -> Finger:
        truth = self.simulated.truth
        return Finger(Annulus(poisson=0.46), 0.15, np.array(truth["r_s"]), self.element, np.array(truth["gain"]))

    def press(self, **changes: object) -> Press:
        return Press(self.column("indenter_radius_mm"), self.angle, self.load, **changes)  # type: ignore[arg-type]


#: Counts, of peaks of 1000: the two solutions of contact and body agree to 1e-5 (tests/simulator/test_simulator.py).
TOLERANCE = 0.02
PLAIN, PAD = Made.of(SILENT), Made.of(QUIET_PAD)


def turn(made: Made) -> np.ndarray:
    return (made.element - made.angle[:, None] + 180) % 360 - 180


ON_SIGNALS: tuple[tuple[Stated, Callable[[Made], np.ndarray]], ...] = (
    ({"soft_spot": 0.3}, lambda r: forms.soft_spot(r.signal, r.angle[:, None], 0.3, 12.6, 0, np.array([90 / 17]))),
    (
        {"soft_spot": -0.2, "soft_spot.centre": 7.0, "soft_spot.width": 10.0, "soft_spot.tails": 0.5},
        lambda r: forms.soft_spot(r.signal, r.angle[:, None], -0.2, 10.0, 0.5, np.array([7.0])),
    ),
    ({"crosstalk": 0.05}, lambda r: forms.crosstalk_finger(r.signal, r.element, 0.05, 0.0, 0.0)),
    (
        {"crosstalk": 0.05, "crosstalk.reach": 0.3, "crosstalk.lean": -0.4},
        lambda r: forms.crosstalk_finger(r.signal, r.element, 0.05, 0.3, -0.4),
    ),
    ({"channel_lag": 0.2}, lambda r: forms.channel_lag(r.signal, 0.2, 0.0)),
    ({"channel_lag": 0.2, "channel_lag.carry": 0.4}, lambda r: forms.channel_lag(r.signal, 0.2, 0.4)),
    (
        {"proximity": 0.04},
        lambda r: r.signal + forms.proximity(turn(r), r.peak, r.load, 200.0, (0.04, 35.0, 0.0, 0.0)),
    ),
    (
        {"proximity": 0.04, "proximity.load_power": 0.7, "proximity.width": 20.0},
        lambda r: r.signal + forms.proximity(turn(r), r.peak, r.load, 200.0, (0.04, 20.0, 0.7, 0.0)),
    ),
    ({"gain_nonlinearity": 0.15}, lambda r: forms.gain_nonlinearity(r.signal, r.peak, 0.15, 1.0)),
    (
        {"gain_nonlinearity": -0.15, "gain_nonlinearity.power": 2.0},
        lambda r: forms.gain_nonlinearity(r.signal, r.peak, -0.15, 2.0),
    ),
    ({"saturation": 0.6}, lambda r: forms.saturation(r.signal, r.peak, 0.6, 40.0, 0.0)),
    (
        {"saturation": 0.6, "saturation.knee": 8.0, "saturation.shared": 1.0},
        lambda r: forms.saturation(r.signal, r.peak, 0.6, 8.0, 1.0),
    ),
    ({"creep": 0.1}, lambda r: forms.creep(r.signal, r.held, 0.1, 1.0)),
    ({"creep": 0.1, "creep.time": 3.0}, lambda r: forms.creep(r.signal, r.held, 0.1, 3.0)),
    ({"memory": 0.3}, lambda r: forms.memory(r.signal, r.touch, r.time, 4.25, (0.3, 10.0, 0.0))),
    (
        {"memory": 0.3, "memory.time": 6.0, "memory.breadth": 0.8},
        lambda r: forms.memory(r.signal, r.touch, r.time, 4.25, (0.3, 6.0, 0.8)),
    ),
    # what is left of a touch has the crosstalk in it
    (
        {"memory": 0.3, "crosstalk": 0.1},
        lambda r: forms.memory(
            forms.crosstalk_finger(r.signal, r.element, 0.1, 0.0, 0.0), r.touch, r.time, 4.25, (0.3, 10.0, 0.0)
        ),
    ),
)


@pytest.mark.parametrize(
    ("effects", "form"), ON_SIGNALS, ids=lambda each: str(each) if isinstance(each, dict) else "form"
)
def test_readings_are_those_of_the_written_formula(effects: Stated, form: Callable[[Made], np.ndarray]) -> None:
    found, wanted = Made.of(SILENT, effects).signal, form(PLAIN)
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-8 * PLAIN.peak.max())
    assert np.abs(found - PLAIN.signal).max() > 0.01 * PLAIN.peak.max()


ON_PADS: tuple[tuple[Stated, Callable[[Made], np.ndarray]], ...] = (
    (
        {"soft_spot": 0.3, "soft_spot.centre": 4.0, "soft_spot.centre_y": 9.0, "soft_spot.width": 3.0},
        lambda r: forms.soft_spot(r.signal, r.place, 0.3, 3.0, 0.0, np.array([4.0, 9.0])),
    ),
    (
        {"crosstalk": 0.05},
        lambda r: forms.crosstalk_pad(
            r.signal, np.stack([QUIET_PAD.element_x_mm, QUIET_PAD.element_y_mm], axis=1), 6.75, 0.05
        ),
    ),
    (
        {"creep_by_element": 0.1, "creep_by_element.share_e03": -0.2, "creep_by_element.time": 0.4},
        lambda r: forms.creep(r.signal, r.held, np.array([0.1, 0, -0.2, 0, 0, 0, 0, 0]), 0.4),
    ),
    # a pad is linear in its load
    (
        {"load_nonlinearity": 0.3, "load_nonlinearity.threshold": 0.1},
        lambda r: r.signal * (forms.load_nonlinearity(r.load, 2.0, 0.3, 0.1) / r.load)[:, None],
    ),
)


@pytest.mark.parametrize(("effects", "form"), ON_PADS, ids=lambda each: str(each) if isinstance(each, dict) else "form")
def test_readings_of_pads_are_those_of_the_written_formula(effects: Stated, form: Callable[[Made], np.ndarray]) -> None:
    made = Made.of(QUIET_PAD, effects)
    np.testing.assert_allclose(made.signal, form(PAD), rtol=0, atol=1e-9 * PAD.peak.max())
    assert np.abs(made.signal - PAD.signal).max() > 0.01 * PAD.peak.max()
    # The force sensor is right: no effect of the rig is in it.
    np.testing.assert_array_equal(made.true("P"), made.load)


def test_the_force_sensor_reads_as_the_effects_of_the_rig_say() -> None:
    """What is read is the same as without them, what is pressed is not."""
    for design, effects, form in (
        (SILENT, {"load_offset": 7.0}, lambda r: forms.load_offset(r.true("P"), 7.0)),
        (
            SILENT,
            {"load_misalignment": 0.1, "load_misalignment.cosine": -0.05},
            lambda r: forms.load_misalignment_finger(r.true("P"), r.angle, 0.1, -0.05, r.nominal),
        ),
        (
            QUIET_PAD,
            {"load_misalignment": 0.1, "load_misalignment.y": -0.05},
            lambda r: forms.load_misalignment_pad(r.true("P"), r.place, np.array([0.1, -0.05])),
        ),
    ):
        made, plain = Made.of(design, effects), Made.of(design)
        np.testing.assert_array_equal(made.load, plain.load)
        np.testing.assert_allclose(made.load, form(made), rtol=1e-12)
        assert np.abs(made.true("P") / made.load - 1).max() > 0.03
    # A pad is linear in the load that is pressed.
    np.testing.assert_allclose(made.signal, plain.signal * (made.true("P") / made.load)[:, None], rtol=1e-12)


def test_touches_are_where_the_prober_is_off() -> None:
    effects = {"prober_eccentricity": 0.8, "prober_eccentricity.cosine": -0.4}
    made = Made.of(SILENT, effects)
    np.testing.assert_array_equal(made.angle, PLAIN.angle)  # what was commanded
    there = forms.prober_eccentricity(made.angle, 0.8, -0.4, made.nominal)
    np.testing.assert_allclose(made.true("theta_c"), there, atol=1e-12)
    press = replace(made.press(), angle=made.true("theta_c"))
    np.testing.assert_allclose(made.signal, made.independent().signal(press), atol=TOLERANCE)


@pytest.mark.parametrize(
    ("effects", "changes"),
    [
        ({"tangential_load": 0.15}, {"tangential": 0.15}),
        ({"tangential_load": -0.15, "aperture": 2.0}, {"tangential": -0.15, "width": 2.0}),
        ({"aperture": 1.5}, {"width": 1.5}),
        ({"blunt_edge": 2.5}, {"tip": 2.5}),
        ({"rigid_core": 0.4}, {"half_space": 0.6}),
        (
            {"surface_profile.weight_09": 0.02, "surface_profile.weight_12": -0.02},
            {"weight_09": 0.02, "weight_12": -0.02},
        ),
    ],
    ids=str,
)
def test_effects_on_contact_and_body(effects: Stated, changes: dict[str, float]) -> None:
    """Gains stay, the strain is that of a finger solved by other means."""
    design = replace(SILENT, contact="hertz") if "rigid_core" in effects else SILENT
    made, plain = Made.of(design, effects), Made.of(design)
    press = made.press()
    if "tip" in changes:
        press = replace(press, tip=np.where(press.tip == 0, changes["tip"], press.tip))
    elif "weight_09" in changes:
        press = replace(press, hump=forms.surface_profile(press.angle, changes))
    elif "tangential" in changes:
        press = replace(press, **changes | {"tangential": np.full(len(press.tip), changes["tangential"])})
    else:
        press = replace(press, **changes)
    np.testing.assert_array_equal(made.column("indenter_radius_mm"), plain.column("indenter_radius_mm"))
    np.testing.assert_allclose(made.signal, made.independent().signal(press), atol=TOLERANCE)
    assert np.abs(made.signal - plain.signal).max() > 10 * TOLERANCE


def test_responses_that_are_true_hold_the_width_of_the_elements() -> None:
    """A knife edge right above each element gives `response`, whatever the gain per strain is."""
    made = Made.of(SILENT, {"aperture": 1.5})
    press = Press(np.zeros(16), made.element, np.ones(16), width=1.5)
    above = np.diagonal(made.independent().signal(press))
    np.testing.assert_allclose(made.simulated.truth["response"], above, rtol=1e-4)
    assert np.all(made.peak < 0.99 * PLAIN.peak)


def test_finite_strain_is_that_of_the_table() -> None:
    made = Made.of(SILENT, {"finite_strain": 0.6})
    added = finite_strain(made.independent(), made.press(), 0.6)
    # Splines through the table against the package's own interpolation of it: they differ by 0.15 % of the largest.
    np.testing.assert_allclose(made.signal - PLAIN.signal, added, rtol=0, atol=0.003 * np.abs(added).max())
    assert np.abs(added).max() > 10


def drift(effects: Stated) -> tuple[np.ndarray, Made]:
    """Course of each of many elements, over the peak, under knife edges in one place, and the recording."""
    design = replace(SILENT, edge_step_deg=0.4, samples_per_touch=1, n_elements=80, pitch_deg=2.0)
    plain, made = Made.of(design), Made.of(design, effects)
    if "gain_drift" in effects:
        return made.signal / plain.signal - 1, made
    return (made.signal - plain.signal) / plain.peak, made


@pytest.mark.parametrize("effects", [{"baseline_drift": 0.02}, {"gain_drift": 0.02, "gain_drift.own": 1.0}], ids=str)
@pytest.mark.parametrize("time", [None, 150.0])
def test_drifts_are_matern_processes_of_the_stated_size(effects: dict[str, float], time: float | None) -> None:
    """Variances and correlations over the 80 elements, each of which has a course of its own."""
    name = next(iter(effects))
    course, made = drift(effects | ({} if time is None else {f"{name}.time": time}))
    length = 600.0 if time is None else time
    # 80 paths of some 2200 s: at least 80 × 2200/(2 × 600) = 150 independent values, whose sd is known to 6 %;
    # between knots the process keeps 0.95 of its sd at least.
    assert abs(np.sqrt((course**2).mean()) / 0.02 - 0.985) < 0.18
    for lag in (20, 60):
        pairs = course[lag:], course[:-lag]
        found = (pairs[0] * pairs[1]).mean() / (course**2).mean()
        away = np.sqrt(3) * (made.time[lag] - made.time[0]) / length
        # the correlation of 150 pairs is known to 0.08 at most, and knots take a little
        assert abs(found - (1 + away) * np.exp(-away)) < 0.2


def test_one_course_of_the_gain_for_all_elements_or_one_for_each() -> None:
    together, _ = drift({"gain_drift": 0.02})
    apart, _ = drift({"gain_drift": 0.02, "gain_drift.own": 1.0})
    np.testing.assert_allclose(together, together[:, :1] * np.ones(80), atol=1e-9)
    assert np.abs(np.corrcoef(apart.T)[0, 1:]).max() < 0.999


@pytest.mark.parametrize("shared", [0.0, 1.0])
def test_errors_that_all_elements_share(shared: float) -> None:
    made = Made.of(replace(SILENT, edge_step_deg=0.5), {"common_mode_noise": 0.03, "common_mode_noise.shared": shared})
    error = made.signal - Made.of(replace(SILENT, edge_step_deg=0.5)).signal
    size = made.peak ** (1 - shared) * made.peak.mean() ** shared
    np.testing.assert_allclose(error / size, (error / size)[:, :1] * np.ones(16), rtol=0, atol=1e-12)
    assert abs((error[:, 0] / size[0]).std() / 0.03 - 1) < 4 / np.sqrt(2 * len(error))


@pytest.mark.parametrize("power", [1.0, 0.5])
def test_errors_that_grow_with_the_signal(power: float) -> None:
    made = Made.of(SILENT, {"signal_dependent_noise": 0.05, "signal_dependent_noise.power": power})
    z = (made.signal - PLAIN.signal) / (PLAIN.peak * np.abs(PLAIN.signal / PLAIN.peak) ** power)
    assert abs(z.std() / 0.05 - 1) < 4 / np.sqrt(2 * z.size)
    assert abs(z.mean()) < 4 * 0.05 / np.sqrt(z.size)


@pytest.mark.parametrize("size", [None, 0.2])
def test_outliers_have_their_share_and_size(size: float | None) -> None:
    design = replace(SILENT, edge_step_deg=0.5)
    effects = {"outliers": 0.05} | ({} if size is None else {"outliers.size": size})
    made, plain = Made.of(design, effects), Made.of(design)
    error = (made.signal - plain.signal) / plain.peak
    hit = np.abs(error) > 1e-9
    assert abs(hit.mean() - 0.05) < 4 * np.sqrt(0.05 / hit.size)
    # 1300 errors: their sd is known to 2 %
    assert abs(error[hit].std() / (size or 0.58) - 1) < 4 / np.sqrt(2 * hit.sum())


@pytest.mark.parametrize("design", [SILENT, replace(SILENT, contact="hertz"), QUIET_PAD], ids=["layer", "hertz", "pad"])
def test_null_value_of_every_effect_changes_nothing(design: FingerDesign | PadDesign) -> None:
    plain = Made.of(design)
    setting = design.build(np.random.default_rng(0)).setting(design.plan(np.random.default_rng(0)))
    effects = [effect for cls in effect_classes().values() if (effect := cls.suited(setting)) is not None]
    nulls = {
        effect.name: {f"{effect.name}.{p.name}": p.null for p in effect.parameters if p.null is not None}
        for effect in effects
    }
    assert len(nulls) >= 15
    together = Made.of(design, {key: value for each in nulls.values() for key, value in each.items()})
    # Up to rounding: an effect that does nothing may still multiply and add.
    np.testing.assert_allclose(together.signal, plain.signal, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(together.load, plain.load)
    for name, null in nulls.items():  # and one by one, so that they do not undo each other
        np.testing.assert_allclose(Made.of(design, null).signal, plain.signal, rtol=0, atol=1e-9, err_msg=name)


def test_a_touch_without_a_load_is_refused() -> None:
    with pytest.raises(InputError, match="with load_offset of this size a touch is left without a load"):
        simulate(SILENT, effects={"load_offset": 200.0}, seed=0)


def test_a_pad_keeps_its_kernel_under_effects() -> None:
    """Half the load, half the reading: what effects of the rig leave is what presses."""
    made = Made.of(QUIET_PAD, {"load_offset": 0.4})
    truth = made.simulated.truth
    away = np.hypot(made.place[:, :1] - truth["x"], made.place[:, 1:] - truth["y"])
    # the gain is the reading per N right above the element
    kernel, above = (layer_kernel_2d(r, 6.0, 0.48, 1.0, quantity="mean_stress") for r in (away, 0.0))
    expected = (made.load - 0.4)[:, None] * np.array(truth["gain"]) * kernel / above
    np.testing.assert_allclose(made.signal, expected, rtol=1e-12)
