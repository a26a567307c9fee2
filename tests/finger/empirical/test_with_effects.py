"""E maps identified beside effects, on fingers of the independent simulator that no elastic model describes."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from independent import catalogue_forms
from independent.dataset import EFFECTS, simulate, write
from independent.finger import SMALL

import bayestouch
from bayestouch.calibration.with_effects import _with_effect
from bayestouch.effects.stated import StatedModel
from bayestouch.finger.chain_with_effects import ChainWithEffects
from bayestouch.finger.empirical.calibration import identified_map
from bayestouch.finger.empirical.with_effects import _Unmixed
from bayestouch.finger.model import finger_model
from bayestouch.finger.reading.effects import EffectContext
from bayestouch.model.body import body_of
from bayestouch.model.effect_list import named_effects
from bayestouch.model.fitting import Fitted
from bayestouch.model.observations import UntimedTouches
from bayestouch.model.split_data import SplitData

#: 8 elements, noise of 0.6 % of the peak, 83 calibration touches of 5 samples, 70 touches to be read.
DESIGN = replace(SMALL, noise_sd=6.0, edge_step=3.0, tip_step=3.0)
#: An answer to touches 45° away, three times the noise of a touch: no elastic finger has it, and a map can take it up.
LOBE = (EFFECTS["far_lobe: "], 3.0)
FORMS = {
    "gain_nonlinearity": "tanh",
    "crosstalk": "unequal, second neighbours",
    "creep": "logarithmic",
    "baseline_drift": "random walk",
}


@cache
def finger(effect: str = "") -> bayestouch.DataSet:
    """Touches of a finger with the lobe, and with one effect of the same size beside it."""
    also = [(EFFECTS[f"{effect}: {FORMS[effect]}"], 3.0)] if effect else []
    with TemporaryDirectory() as folder:
        return bayestouch.load_dataset(write(simulate(DESIGN, [LOBE, *also], seed=7), Path(folder) / "finger"))


def model_of(effect: str, correction: bool = False) -> StatedModel:
    return StatedModel("finger", "layer", ((effect, {}),), correction)


def read(calibration: bayestouch.Calibration, dataset: bayestouch.DataSet) -> bayestouch.TouchPosteriors:
    return bayestouch.infer(dataset.touches, calibration, draws=128, seed=1)


def error_mm(read: bayestouch.TouchPosteriors) -> float:
    """Root mean square error of R, mm."""
    return float(np.sqrt(np.mean((read.mean("R") - read.reference["R"]) ** 2)))


def covered(read: bayestouch.TouchPosteriors) -> bool:
    """Whether intervals of 90 % cover R: of forty touches of round tips 0.9 ± 0.05 are inside; three of these."""
    low, high = read.interval("R", 0.9)
    round_tip = (read.reference["r_c"] > 0) & np.isfinite(read.reference["r_c"])
    inside = ((low <= read.reference["R"]) & (read.reference["R"] <= high))[round_tip]
    return bool(0.75 < inside.mean() <= 1)


def identified(dataset: bayestouch.DataSet, **options: object) -> bayestouch.Calibration:
    return bayestouch.calibrate(dataset, e_map="empirical", draws=64, seed=1, **options)


@pytest.mark.slow
@pytest.mark.parametrize(("effect", "worse"), [("gain_nonlinearity", 2.0), ("crosstalk", 1.05)])
def test_touches_are_read_as_without_the_effect(effect: str, worse: float, tmp_path: Path) -> None:
    """Map and effect together; a map alone takes up what is in proportion to the load, as crosstalk of edges is."""
    dataset = finger(effect)
    calibration = identified(dataset, model=model_of(effect))
    calibration.save(tmp_path / "calibration.nc")
    found = read(bayestouch.load(tmp_path / "calibration.nc"), dataset)
    np.testing.assert_array_equal(found.posterior["R"], read(calibration, dataset).posterior["R"])
    plain = read(identified(finger()), finger())
    # the same noise and touches: what the effect's own uncertainty adds is less than a fifth
    assert error_mm(found) < 1.2 * error_mm(plain)
    # without the model, and without the map
    assert error_mm(read(identified(dataset), dataset)) > worse * error_mm(found)
    of_model = bayestouch.calibrate(dataset, model=model_of(effect), draws=64, seed=1)
    assert error_mm(read(of_model, dataset)) > 1.3 * error_mm(found)
    assert covered(found)
    assert calibration.statistics["lack_of_fit_empirical"] < 1.5 < of_model.statistics["lack_of_fit"]


@pytest.mark.slow
@pytest.mark.parametrize(("effect", "better"), [("creep", 0.95), ("baseline_drift", 0.9)])
def test_effects_of_time_go_with_a_map(effect: str, better: float) -> None:
    """What changes while a touch is held, and what drifts: the map alone takes them for properties of the place."""
    dataset = finger(effect)
    found = read(identified(dataset, model=model_of(effect)), dataset)
    assert error_mm(found) < better * error_mm(read(identified(dataset), dataset))
    assert covered(found)


@pytest.mark.slow
def test_a_correction_is_left_to_the_map() -> None:
    found = identified(finger("crosstalk"), model=model_of("crosstalk", correction=True))
    assert not any(name.startswith("placed_") for name in found.extra)
    assert any("the identified E map includes" in note for note in found.notes)
    only = identified(finger(), model=StatedModel("finger", "layer", (), True))
    np.testing.assert_array_equal(only.extra["empirical_map"], identified(finger()).extra["empirical_map"])


@cache
def fitted(effect: str) -> Fitted:
    data = SplitData.of_calibration(finger(effect))
    begun = body_of(finger(effect).sensor).begin(data, contact="layer", draws=8, seed=1)
    (of_catalogue,) = named_effects([effect], begun.setting)
    return _with_effect(begun.fitted, of_catalogue, {})[0]


def test_signals_are_the_readings_with_the_effect_taken_off() -> None:
    """Crosstalk as it is written out, of the signals that were found, gives the readings; and so do their errors."""
    fit = fitted("crosstalk")
    model = finger_model(fit.model)
    signal, vector = model.signal(fit.vector).signal, fit.vector
    taken = _Unmixed(fit, bayestouch.calibrate(finger(), draws=8).noise, signal, np.zeros_like(signal))
    touches = taken.touches(vector)
    angles, ((share, reach, lean),) = np.array(model.finger.element_angles_deg), model.values(vector)

    def heard(rows: np.ndarray) -> np.ndarray:
        return catalogue_forms.crosstalk_finger(rows, angles, share, reach, lean)

    readings = model.known.means.readings
    # signals are drawn to those of the model by a millionth: (noise / 100 peaks)²
    np.testing.assert_allclose(heard(touches.signal), readings, atol=1e-4 * model.peak.mean())
    inverse = np.linalg.inv(heard(np.eye(len(angles))).T)
    np.testing.assert_allclose(touches.sd**2, taken.variance @ (inverse**2).T, rtol=1e-3)


def test_a_reading_that_does_not_depend_on_its_signal_counts_for_nothing() -> None:
    """Where an effect takes a signal away, its standard deviation is a hundred peaks; the others do not notice."""
    fit = fitted("gain_nonlinearity")
    model = finger_model(fit.model)
    signal = model.signal(fit.vector).signal
    there = fit.whitening.present.copy()
    root = fit.whitening.root.copy()
    root[:, 0], root[:, :, 0] = 0.0, 0.0
    noise = bayestouch.calibrate(finger(), draws=8).noise
    whole = _Unmixed(fit, noise, signal, np.zeros_like(signal)).touches(fit.vector)
    less = replace(fit, whitening=replace(fit.whitening, root=root))
    without = _Unmixed(less, noise, signal, np.zeros_like(signal)).touches(fit.vector)
    assert there.all() and not without.there[:, 0].any() and np.isinf(without.sd[:, 0]).all()
    np.testing.assert_allclose(without.signal[:, 1:], whole.signal[:, 1:], rtol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("effect", ["gain_nonlinearity", "crosstalk"])
def test_covariance_of_readings_holds_that_of_the_effects(effect: str) -> None:
    """The part of a value against maps that are identified anew beside it a step to either side."""
    calibration = identified(finger(effect), model=model_of(effect))
    chain = ChainWithEffects.of(calibration)
    assert chain.identified is not None
    np.testing.assert_allclose(chain.identified.contact_covariance, chain.covariance[24:, 24:], rtol=1e-9)
    m, pose = 8, (np.array([3.0, 9.0]), np.array([0.1, -0.3]), np.array([200.0, 230.0]))
    exact = EffectContext(
        effects_chain=chain,
        scale=np.ones((2, m)),
        shift=np.zeros((2, m)),
        extra=np.zeros((2, m, m)),
        counts=np.ones((2, m)),
        slopes=np.zeros((0, 2, 2, m)),
        exact=True,
        time_s=np.full(2, np.inf),
    )
    alone = np.zeros_like(chain.covariance)
    alone[3 * m + 2, 3 * m + 2] = 1.0  # of the first value
    map_known = replace(chain.identified, covariance=0 * chain.identified.covariance)
    chain_known = replace(chain, covariance=alone, identified=map_known)
    context = replace(exact, exact=False, effects_chain=chain_known)
    found = context.covariance(*pose) - exact.covariance(*pose)
    fit = fitted(effect)
    model, place = finger_model(fit.model), finger_model(fit.model).n_base
    step, ends = 0.3 * float(np.sqrt(calibration.covariance[place, place])), []
    about = _Unmixed(fit, calibration.noise, model.signal(fit.vector).signal, fit.drifted)
    unknown = model.observing(UntimedTouches(2)).at(*pose)
    for sign in (1, -1):
        vector = fit.vector.copy()
        vector[place] += sign * step
        again = identified_map(about.touches(vector), (), np.zeros((0, 0))).calibration.chain
        ends.append(unknown.readings(replace(unknown.poses(vector), signal=again.predict(*pose)), vector).touches)
    slope = (ends[0] - ends[1]) / (2 * step)
    recording = replace(unknown.poses(fit.vector), signal=chain.identified.chain.predict(*pose))
    up, down, half = unknown.about_value(fit.vector, place)
    by_effect = (unknown.readings(recording, up).touches - unknown.readings(recording, down).touches) / (2 * half)
    # The map makes up for most of what crosstalk does. λ is found anew on either side, and effects are made linear
    # about the model here, not the map: 2 % of what the effect alone does.
    size = float(np.abs(by_effect).max())
    np.testing.assert_allclose(np.sqrt(np.einsum("tee->te", found)), np.abs(slope), atol=0.02 * size)
