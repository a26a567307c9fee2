"""Errors of a calibration that elements share: location and load of touches, against a linear model written out."""

from __future__ import annotations

import numpy as np
import pytest
from pad_simulation import SimulatedPad, grid, line, square

from bayestouch.chain.pad_map import PadMap
from bayestouch.pad.calibration import calibrate_pad


def readings(flat: np.ndarray, place: np.ndarray, m: int) -> np.ndarray:
    """Readings under a load of one, (t, m): gains, offsets, coordinates of the elements, width of the bell."""
    gain, offset, *position, width = *flat[:-1].reshape(-1, m), flat[-1]
    square = sum((place[:, axis, None] - own) ** 2 for axis, own in enumerate(position))
    return np.asarray(offset + gain * np.exp(-0.5 * square / width**2))


def derivatives(flat: np.ndarray, place: np.ndarray, m: int) -> np.ndarray:
    """Of `readings`, (t, m, d), by central differences."""
    steps = 1e-5 * np.eye(len(flat))
    return np.stack([(readings(flat + h, place, m) - readings(flat - h, place, m)) / 2e-5 for h in steps], axis=-1)


def displaced(errors: np.ndarray, tangent: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """Standard deviations (k, D + 1) of place and load by weighted least squares, by errors (k, m, m) of readings."""
    pulled = tangent / variance[:, None]
    weights = np.linalg.solve(pulled @ tangent.swapaxes(1, 2), pulled)
    return np.sqrt(np.einsum("kdm,kmn,kdn->kd", weights, errors, weights))


@pytest.mark.parametrize("empirical", [False, True])
@pytest.mark.parametrize("pad", [line(load_spread=0.1, share=0.0), square(load_spread=0.1, share=0.0)])
def test_displacement_of_touches_by_errors_of_the_loads(pad: SimulatedPad, empirical: bool) -> None:
    """With loads that nobody measures, readings of a touch have the covariance ``noise² + spread² signal signalᵀ``.

    The parameters then have the inverse of ``Jᵀ covariance^-1 J``. An empirical map of a pad that is what its kernel
    says has nothing to add, but its own small uncertainty.
    """
    (m, dimensions), rng = pad.chain.position.shape, np.random.default_rng(4)
    place = np.linspace(6, 34, 57)[:, None] if dimensions == 1 else grid(3, 19, 9, 2)
    made = calibrate_pad(pad.dataset(pad.touch(place, rng, samples=3)), kernel="gaussian", empirical=empirical, draws=8)
    map_, mode = PadMap.from_arrays(made.extra), made.mode
    names = [f"{axis}_s" for axis in ("x", "y")[:dimensions]]
    flat = np.concatenate([mode["gain"], mode["offset"], *(mode[name] for name in names), [mode["w"]]])
    signal = readings(flat, place, m) - mode["offset"]
    spread = made.statistics["load_spread"]
    noise = made.noise.mean_variance(np.full(m, 3), signal)
    covariance = noise[:, :, None] * np.eye(m) + spread**2 * signal[:, :, None] * signal[:, None]
    jacobian = derivatives(flat, place, m)
    known = np.linalg.inv(np.einsum("tmd,tmn,tne->de", jacobian, np.linalg.inv(covariance), jacobian))
    where = np.linspace(11, 27, 9)[:, None] if dimensions == 1 else grid(8, 14, 3, 2)
    of_readings = derivatives(flat, where, m)
    wanted = of_readings @ known @ of_readings.swapaxes(1, 2)
    by_load, slope = map_.slopes(where)
    tangent = np.concatenate([slope, by_load[:, None]], axis=1)
    _, alone, with_offset = map_.at(where)
    alone = map_.reading_variance(alone, with_offset, np.ones(len(where)))
    own = alone[:, :, None] * np.eye(m)
    variance = alone + made.noise.mean_variance(np.full(m, 3), by_load)
    shared = map_.shared_at(where)
    found = displaced(own + shared.swapaxes(1, 2) @ shared, tangent, variance)
    expected = displaced(wanted, tangent, variance)
    np.testing.assert_allclose(found, expected, rtol=0.12 if empirical else 0.05)
    # as if the errors of elements were independent
    apart = displaced(np.einsum("kmm->km", wanted)[:, :, None] * np.eye(m), tangent, variance)
    assert np.median(apart[:, 0] / expected[:, 0]) > 1.5


def test_errors_that_matter_little_count_as_independent() -> None:
    """The readings have a noise of 2 % that does not average out, and loads have no error."""
    pad = line(load_spread=0.0, share=0.02)
    touches = pad.touch(np.linspace(6, 34, 57)[:, None], np.random.default_rng(4), samples=3)
    made = calibrate_pad(pad.dataset(touches), kernel="gaussian", empirical=False, draws=8)
    map_ = PadMap.from_arrays(made.extra)
    assert map_.n_shared == 0 and map_.shared_at(np.zeros((5, 1))).shape == (5, 0, 4)
