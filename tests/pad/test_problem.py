"""Input of the calibration of a pad: the noise of one read where touches were read once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pad_simulation import SimulatedPad, line

from bayestouch.data.touches import Touches
from bayestouch.errors import InputError
from bayestouch.pad.calibration import calibrate_pad
from bayestouch.pad.problem import pad_problem

# Four elements at rest; the last one is read exactly.
AT_REST = np.array([0.01, 0.03, -0.01, 0.02, 0.05])[:, None] * np.array([1.0, 2.0, 3.0, 0.0])
EXACT = "a mean rest reading that touches share counts as exact"


def with_rest(touches: Touches, readings: np.ndarray, touch: np.ndarray | int) -> Touches:
    """The touches with rows without contact before them."""
    n = len(readings)
    rows = np.r_[np.zeros(n, dtype=np.int64), np.arange(touches.n_rows)]
    longer = touches.select(rows)
    contact, ids = np.ones(len(rows)), longer.touch.copy()
    contact[:n], ids[:n] = 0.0, touch
    values, load = longer.readings.copy(), longer.load.copy()
    values[:n], load[:n] = readings, np.nan
    sample = np.r_[np.arange(n), touches.sample]
    return longer.with_(contact=contact, touch=ids, sample=sample, readings=values, load=load)


def read_once(samples: int = 1) -> tuple[SimulatedPad, Touches]:
    made = line(share=0.0)
    return made, made.touch(np.linspace(6, 32, 53)[:, None], np.random.default_rng(2), samples=samples)


def test_noise_of_one_read_is_that_of_rest_readings_of_a_touch() -> None:
    """The sample variance of 1, 3, -1, 2 and 5 is (1 + 1 + 9 + 0 + 9) / 4 about their mean of 2."""
    made, touches = read_once()
    problem, _ = pad_problem(made.sensor, with_rest(touches, AT_REST, 10**6), samples="mean", seed=0)
    np.testing.assert_allclose(problem.read_variance, [5e-4, 4 * 5e-4, 9 * 5e-4, np.nan], rtol=1e-9)
    assert np.isnan(problem.known.pure_error_variance).all()


@pytest.mark.parametrize(("some", "touch"), [(slice(4), 10**6), (slice(5), 10**6 + np.arange(5))])
def test_too_few_rest_readings_of_a_touch_say_nothing(some: slice, touch: np.ndarray | int) -> None:
    made, touches = read_once()
    problem, _ = pad_problem(made.sensor, with_rest(touches, AT_REST[some], touch), samples="mean", seed=0)
    assert np.isnan(problem.read_variance).all()


def test_repeats_decide_where_there_are_any() -> None:
    made, touches = read_once(samples=3)
    problem, _ = pad_problem(made.sensor, with_rest(touches, AT_REST, 10**6), samples="mean", seed=0)
    np.testing.assert_array_equal(problem.read_variance, problem.known.pure_error_variance)


def test_a_calibration_of_touches_that_were_read_once() -> None:
    """Forty rest readings tell the noise of one read; with one, a note says that it is not known."""
    made, touches = read_once()
    rest = np.random.default_rng(5).normal(0.0, made.floor, (40, 4))
    known, unknown = (
        calibrate_pad(
            replace(made.dataset(touches), calibration=with_rest(touches, some, 10**6)),
            kernel="gaussian",
            empirical=False,
            draws=8,
        )
        for some in (rest, rest[:1])
    )
    np.testing.assert_allclose(known.noise.tactile_sd, rest.std(axis=0, ddof=1), rtol=1e-9)
    assert any("is that of the rest readings" in note for note in known.notes)
    assert not unknown.noise.tactile_sd.any() and any(EXACT in note for note in unknown.notes)
    # All noise together is the same.
    total = [np.hypot(each.noise.tactile_sd, each.noise.discrepancy_sd) for each in (known, unknown)]
    np.testing.assert_allclose(total[0], total[1], rtol=0.3)


def test_too_few_places_are_said_not_that_no_element_responds() -> None:
    """A single touch is left: readings of one touch are all the same. Those without a load are counted."""
    pad = line()
    touches = pad.touch(np.linspace(6, 32, 9)[:, None], np.random.default_rng(1), measured=True)
    one_load = touches.with_(load=np.where(touches.touch == 3, touches.load, np.nan))
    alone = "calibration has touches at 1 known location: gain, offset and position of each element need at least 4"
    with pytest.raises(InputError, match=alone):
        pad_problem(pad.sensor, touches.select(touches.touch == 3), samples="mean", seed=0)
    with pytest.raises(InputError, match=r"at 1 known location \(8 touches without a load above zero: left out of the"):
        pad_problem(pad.sensor, one_load, samples="mean", seed=0)
    # The constant kernel has no positions: gain and offset need three touches.
    three = touches.select(touches.touch < 3)
    pad_problem(pad.sensor, three, samples="mean", seed=0, kernel="constant")
    with pytest.raises(InputError, match="touches at 3 known locations"):
        pad_problem(pad.sensor, three, samples="mean", seed=0)
