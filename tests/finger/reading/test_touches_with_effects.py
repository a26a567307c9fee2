"""What touches say of a drift: by hand."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from live_cases import FINGER, sensor, streamed

import bayestouch
from bayestouch.chain.noise import Noise
from bayestouch.data.touches import touches_from
from bayestouch.effects.stated import StatedModel
from bayestouch.finger.chain_with_effects import ChainWithEffects
from bayestouch.finger.reading import touches_with_effects as module
from bayestouch.finger.reading.effects import EffectContext
from bayestouch.finger.reading.live_effects import blank_context
from bayestouch.finger.reading.reader import TouchReadings
from bayestouch.finger.reading.touch_reader import FingerTouchReader
from bayestouch.finger.reading.true_load import TrueLoads, changing_in_time
from bayestouch.inference import infer_with
from bayestouch.model.effect_list import named_effects
from bayestouch.reading.options import Kept, Options

MODE = np.array([[0.3, 0.1, 20.0], [0.6, -0.2, 50.0]])
PLACES = np.array([0.0, 0.2])


class Chain:
    """Readings P · (R + place · angle)."""

    def predict(self, radius: np.ndarray, angle: np.ndarray, load: np.ndarray) -> np.ndarray:
        return load[:, None] * (radius[:, None] + PLACES * angle[:, None])


class Context(EffectContext):
    """Readings are doubled; the covariance tells which radius, angle and load it was asked for."""

    def __init__(self) -> None:
        model = SimpleNamespace(peak=np.array([4.0, 5.0]), reference_load=30.0)
        object.__setattr__(self, "effects_chain", SimpleNamespace(model=model))

    def readings(self, static: np.ndarray, radius: Any, angle: Any, load: Any, index: Any) -> np.ndarray:
        return 2 * static

    def covariance(self, radius: np.ndarray, angle: np.ndarray, load: np.ndarray) -> np.ndarray:
        return np.stack([np.array([[r, 0.1 * a], [0.1 * a, p]]) for r, a, p in zip(radius, angle, load, strict=True)])


def evidence() -> Any:
    readings = SimpleNamespace(
        context=Context(),
        counts=np.array([[4, 1], [9, 0]]),
        readings=np.array([[13.0, 12.0], [60.0, np.nan]]),
        load=np.array([21.0, np.nan]),
        load_sd=np.array([0.5, 7.0]),
    )
    posterior: Any = SimpleNamespace(touches=readings, radius=lambda w: 5 * w**2, chain=Chain())
    return module._evidence(posterior, MODE, Noise(np.array([0.2, 0.3]), np.zeros(2)))


def test_settings() -> None:
    assert module.ROUNDS == 3


def test_what_a_touch_says_of_an_addition() -> None:
    found = evidence()
    radius = 5 * MODE[:, 0] ** 2
    predicted = 2 * MODE[:, 2:] * (radius[:, None] + PLACES * MODE[:, 1:2])
    np.testing.assert_allclose(
        found.residual, [[13 - predicted[0, 0], 12 - predicted[0, 1]], [60 - predicted[1, 0], 0]]
    )
    # Over w, angle and load: quadratic, linear and linear, so that central differences are exact.
    for touch, (w, angle, load) in enumerate(MODE):
        wanted = 2 * np.stack([np.full(2, load * 10 * w), load * PLACES, 5 * w**2 + PLACES * angle], axis=1)
        np.testing.assert_allclose(found.jacobian[touch], wanted, rtol=1e-8, atol=1e-9)


def test_covariance_of_the_readings_of_a_touch() -> None:
    """What the calibration leaves there, and noise of the mean; a hundred peaks where it is missing."""
    found = evidence()
    radius = 5 * MODE[:, 0] ** 2
    np.testing.assert_allclose(found.covariance[0], [[radius[0] + 0.04 / 4, 0.01], [0.01, 20 + 0.09]])
    np.testing.assert_allclose(found.covariance[1], [[radius[1] + 0.04 / 9, -0.02], [-0.02, 50 + 500.0**2]])


def test_prior_of_the_coordinates() -> None:
    """Loose but for a load that was measured: 4, half a radian, the reference load."""
    found = evidence()
    np.testing.assert_allclose(found.precision, [[1 / 16, 4.0, 4.0], [1 / 16, 4.0, 1 / 900]])
    np.testing.assert_allclose(found.shift, [[0, 0, 1.0], [0, 0, 0]])


@pytest.mark.parametrize("own", [False, True])
def test_columns_of_drifts(monkeypatch: pytest.MonkeyPatch, own: bool) -> None:
    """What each weight adds: the course in time times the signal, zero where it is not known."""
    drift = SimpleNamespace(name="drift", scale=lambda recording: recording.signal, own=lambda values: own)
    monkeypatch.setattr(module, "drift_basis", lambda drift, values, observed: np.array([[1.0, 2.0], [3.0, 4.0]]))
    model = SimpleNamespace(
        n_elements=2,
        peak=np.ones(2),
        reference_load=1.0,
        finger=SimpleNamespace(element_angles_deg=(0.0, 1.0)),
    )
    made: Any = SimpleNamespace(model=model, listed=SimpleNamespace(drifts=(drift,)), values={"drift": (0.1,)})
    observed: Any = SimpleNamespace(touch_time_s=np.zeros(2))
    found = module._columns(made, observed, np.array([[1.0, 10.0], [np.nan, 100.0]]))
    if own:
        assert found.shape == (2, 2, 4)
        np.testing.assert_array_equal(found[0], [[1, 2, 0, 0], [0, 0, 10, 20]])
        np.testing.assert_array_equal(found[1], [[0, 0, 0, 0], [0, 0, 300, 400]])
    else:
        np.testing.assert_array_equal(found, [[[1, 2], [10, 20]], [[0, 0], [300, 400]]])


@pytest.mark.parametrize(("drifts", "shift"), [((), 0.0), (("one",), 0.25)])
def test_drifts_are_looked_for_only_where_there_are_any(
    monkeypatch: pytest.MonkeyPatch, drifts: tuple[str, ...], shift: float
) -> None:
    """Loads are set right in both cases; what drifts add to a reading, 0.25, is taken only where one is listed."""

    @dataclass
    class Posterior:
        chain: Any
        touches: Any
        priors: Any
        whitener: Any
        table: Any

        def radius(self, logit: np.ndarray) -> np.ndarray:
            return logit

    one, many = np.ones((2, 2)), np.zeros((2, 2, 2))
    monkeypatch.setattr(EffectContext, "covariance", lambda *given: many)
    stubs: dict[str, Any] = {
        "timed_signal": lambda *given: one,
        "timed_scale_and_shift": lambda *given: (one, 0 * one),
        "timed_slopes": lambda *given: np.zeros((0, 2, 2, 2)),
        "changes_load": lambda chain: True,
        "true_loads": lambda chain, time_s, angle, load, sd, exact: TrueLoads(
            load + 1.0, sd, np.zeros((3, 2)), np.zeros((2, 2))
        ),
        "FingerPosterior": Posterior,
        "noise_whitener": lambda *given: None,
        "full_whitener": lambda *given: None,
        "with_whitener": lambda posterior, whitener: posterior,
        "find_modes": lambda posterior, start: MODE,
        "_evidence": lambda *given: SimpleNamespace(about_addition=lambda: (None, None)),
        "_predicted": lambda *given: None,
        "_columns": lambda *given: None,
        "drift_of_others": lambda *given: (0.25 * one, many),
    }
    for name, stub in stubs.items():
        monkeypatch.setattr(module, name, stub)
    readings = TouchReadings(one, np.full((2, 2), 4), np.array([20.0, 30.0]), np.ones(2))
    left = np.full((2, 2, 2), 3.0)
    chain: Any = SimpleNamespace(
        vector=None, listed=SimpleNamespace(drifts=drifts), left_by_missing=lambda *given: left
    )
    sampler: Any = SimpleNamespace(noise=None, chain=None, search=None, table=None)
    history = SimpleNamespace(missing_s=None, end_s=None)
    observed, later = cast(Any, SimpleNamespace(touch_time_s=None, history=history)), np.full(2, np.inf)
    found = module.prepare(readings, observed, chain, sampler, time_s=later, plug_in=True)
    assert isinstance(found.context, EffectContext)
    np.testing.assert_array_equal(found.context.shift, np.full((2, 2), shift))
    # What touches that may be missing leave is as uncertain with drifts as without.
    np.testing.assert_array_equal(found.context.extra, left)
    np.testing.assert_array_equal(found.load, [21.0, 31.0])


def errors(result: bayestouch.TouchPosteriors, name: str) -> tuple[float, float]:
    """Rms over touches of the error of the mean, and of this error over the posterior sd."""
    draws = result.posterior[name]
    error = draws.mean(axis=(0, 1)) - result.reference[name]
    return float(np.sqrt(np.mean(error**2))), float(np.sqrt(np.mean((error / draws.std(axis=(0, 1))) ** 2)))


READ: dict[str, Any] = {"check_sensor": False, "draws": 256, "seed": 1, "workers": 1}


def test_a_drift_is_estimated_where_only_tips_are_possible() -> None:
    """As where any radius is: the search for modes needs a density of R, which tips by themselves have not."""
    data, one = sensor("finger", (("baseline_drift", 0.01),), ("baseline_drift",))
    tips = bayestouch.KnownTips(tuple(np.unique(data.touches.indenter_radius_mm)))
    free, known = (bayestouch.infer(data.touches, one, use_load=False, indenter=each, **READ) for each in (None, tips))
    for name in ("theta_c", "P"):
        assert errors(known, name)[0] < 1.1 * errors(free, name)[0] and errors(known, name)[1] < 1.3


@pytest.mark.slow
def test_a_creep_that_depends_on_the_strain_acts_at_the_strain_of_the_touch() -> None:
    """Loads read by the elements alone, of about 195 N/m: evaluated at a signal of one they were 100 N/m too small."""
    data = bayestouch.simulate(FINGER, seed=3).dataset
    assert data.calibration is not None
    peak, power, share = np.abs(data.calibration.readings).max(axis=0), -0.5, 0.1

    def crept(table: bayestouch.Touches) -> bayestouch.Touches:
        held = table.time_s - np.array([table.time_s[table.touch == each].min() for each in table.touch])
        grown = share * -np.expm1(-held / (0.4 * held.max()))
        strain = np.clip(np.abs(table.readings) / peak, 1e-3, 5) ** power
        return table.with_(readings=table.readings * (1 + grown[:, None] * strain))

    touches = crept(data.touches)
    model = StatedModel("finger", "layer", (("creep", {"strain_power": power}),))
    crept_data = replace(data, calibration=crept(data.calibration), touches=touches)
    one = bayestouch.calibrate(crept_data, model=model, draws=64)
    read = bayestouch.infer(touches, one, use_load=False, **READ)
    assert abs(float((read.mean("P") - read.reference["P"]).mean())) < 1.0
    for name in ("R", "theta_c", "P"):
        assert errors(read, name)[1] < 1.4
    # The live reader has the same at the end of each touch.
    live = streamed(bayestouch.Reader(one), touches)
    load = np.array([each.mean[2] for each in live])
    assert np.sqrt(np.mean((load - read.reference["P"]) ** 2)) < 1.0


def test_a_creep_is_no_outlier() -> None:
    """A table with creep and without outliers keeps all but one reading in a hundred."""
    design = replace(FINGER, noise_percent_peak=0.5)
    data = bayestouch.simulate(design, effects={"creep": 0.1, "creep.time": 0.4}, seed=3).dataset
    model = StatedModel("finger", "layer", (("creep", {}), ("outliers", {"probability": 0.01, "size": 0.5})))
    one = bayestouch.calibrate(data, model=model, draws=64)
    chain = ChainWithEffects.of(one)
    assert abs(chain.values["creep"][0] - 0.1) < 0.005
    observed, _, _ = module.observe(data.touches, chain, one.noise, each_sample=False)
    assert np.isnan(observed.deviation).mean() < 0.01


@pytest.mark.parametrize(("name", "size"), [("common_mode_noise", 0.03), ("signal_dependent_noise", 0.08)])
def test_a_mean_of_few_samples_has_the_added_noise_of_few(name: str, size: float) -> None:
    """Above an element that gave one sample of ten: with the noise of ten, errors of R were 3.7 of their sd."""
    design = replace(FINGER, samples_per_touch=10, noise_percent_peak=0.5)
    data = bayestouch.simulate(design, effects={name: size}, seed=1).dataset
    one = bayestouch.calibrate(data, model=StatedModel("finger", "layer", ((name, {}),)), draws=64)
    chain = ChainWithEffects.of(one)
    rng, n, e, angles = np.random.default_rng(0), 60, 2, np.asarray(chain.model.finger.element_angles_deg)
    touch = np.full(n, 4.0), np.radians(angles[e] + rng.uniform(-2, 2, n)), np.full(n, 200.0)
    clean = chain.model.chain(chain.vector).predict(*touch)
    peak, added = chain.model.peak, chain.listed.noise
    own = np.sqrt(one.noise.tactile_sd**2 + (added.share * peak * np.abs(clean / peak) ** added.power) ** 2)
    read = clean[:, None] + own[:, None] * rng.standard_normal((n, 10, len(angles)))
    read += added.common * added.together(peak) * rng.standard_normal((n, 10, 1))
    read[:, 1:, e] = np.nan
    table = touches_from(np.repeat(np.arange(n), 10), read.reshape(-1, len(angles)), load=np.nan, contact=1.0)
    found = bayestouch.infer(table, one, plug_in=True, **READ)
    off = (found.mean("R") - touch[0]) / found.sd("R")
    # Sixty touches: the rms of their standard errors is one to within a tenth, and posteriors of R are a little skewed.
    assert np.sqrt(np.mean(off**2)) < 1.4


def test_readings_that_saturate_are_found_where_they_are() -> None:
    """Hard touches, at 2.5 times the typical load, look like touches far away without the effect."""
    _, one = sensor("finger", (("saturation", 0.6),), ("saturation",))
    reader = FingerTouchReader.from_calibration(one, Options())
    rng, n = np.random.default_rng(1), 40
    load, radius = np.full(n, 2.5 * reader.typical_load), rng.uniform(1, 12, n)
    angle = np.radians(rng.uniform(-20, 20, n))
    touch = radius, angle, load
    assert reader.effects_chain is not None
    context = blank_context(reader.effects_chain, n, exact=False)
    read = context.readings(reader.sampler.chain.predict(*touch), *touch, np.arange(n))
    table = touches_from(
        np.arange(n),
        read + one.noise.tactile_sd * rng.standard_normal(read.shape),
        load=load + one.noise.force_sd * rng.standard_normal(n),
        contact=1.0,
    )
    found = bayestouch.infer(table, one, **READ)
    assert np.abs(found.mean("theta_c") - np.degrees(angle)).max() < 1.5


def test_a_known_knife_edge_is_as_blunt_as_it_was_calibrated() -> None:
    """Edges of 1 mm: as a sharp edge they were a round tip of 2 mm more often than an edge."""
    data, one = sensor("finger", (("blunt_edge", 1.0),), ("blunt_edge",))
    assert data.calibration is not None and data.calibration.angle_deg is not None
    edge = (data.calibration.indenter_radius_mm == 0) & (np.abs(data.calibration.angle_deg) < 30)
    read = bayestouch.infer(data.calibration.select(edge), one, indenter=bayestouch.KnownTips((0.0, 2.0)), **READ)
    assert read.tips is not None and read.tips.probability.mean(axis=0)[0] > 0.7


@cache
def warming() -> tuple[bayestouch.DataSet, bayestouch.Calibration]:
    """A force sensor whose zero goes from 20 to -20 N/m in half a wave over the calibration, found with its waves."""
    data = bayestouch.simulate(FINGER, seed=3).dataset
    table = data.calibration
    assert table is not None
    passed = (table.time_s - table.time_s.min()) / np.ptp(table.time_s)
    data = replace(data, calibration=table.with_(load=table.load + 20 * np.cos(np.pi * passed)))
    model = StatedModel("finger", "layer", (("load_offset", {"offset": 0.0, "offset_wave_1": 20.0}),))
    return data, bayestouch.calibrate(data, model=model, draws=64)


def test_touches_of_the_recording_are_corrected_as_at_their_times() -> None:
    """Touches of the first half of the time, when the zero was 24 N/m above the last one or more.

    The sd of a load is 2 N/m, mostly of the zero and the gains, which all loads share: 5 N/m are 2.5 sd, 4 N/m two.
    """
    data, one = warming()
    table = data.calibration
    assert table is not None and table.angle_deg is not None
    time_s = table.time_s - table.time_s.min()
    true = table.load - 20 * np.cos(np.pi * time_s / time_s.max())
    # the elements reach to 35 degree
    rows = (np.abs(table.angle_deg) < 35) & (time_s < 0.45 * time_s.max()) & table.in_contact
    at_once = {"kept": Kept(64), "method": "importance", "check_sensor": False}
    read = infer_with(table.select(rows), one, Options(**at_once, recorded_s=time_s[rows]))
    acting = np.array([true[rows & (table.touch == touch)].mean() for touch in read.rows.touch])
    assert np.abs(read.mean("P") - acting).max() < 5
    assert not any("load_offset" in note for note in read.notes)
    later = infer_with(table.select(rows), one, Options(**at_once))
    # The elements know the load, too, and hold most of it back.
    assert (later.mean("P") - acting).mean() > 4
    assert abs((read.mean("P") - acting).mean()) < 4
    told = "load_offset changed during the calibration: touches are read with its state at the end of the calibration."
    assert told in later.notes


def test_which_effects_have_another_state_after_the_calibration() -> None:
    """Waves of the prober move stated locations, which no reader uses; a limit that does not fall has one state."""
    chain = ChainWithEffects.of(warming()[1])
    assert changing_in_time(chain) == ("load_offset",)
    for name, values, changes in (
        ("prober_eccentricity", {"turn_wave_1": 1.0}, False),
        ("saturation", {"fall": 0.3}, True),
        ("saturation", {"fall": 0.0}, False),
        ("load_offset", {"offset": 5.0}, False),
    ):
        (effect,) = named_effects([name], chain.listed.setting, {name: values})
        stated = tuple(values.get(each.name, each.null or each.probes[0]) for each in effect.parameters)
        finite = tuple(1.0 if each == np.inf else each for each in stated)
        other = replace(chain, model=chain.model.with_effects((effect,)), values={name: finite})
        assert changing_in_time(other) == ((name,) if changes else ())
