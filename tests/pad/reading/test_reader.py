"""Density of touches on a pad with uncertain effects: written out, and as the sum of normals that proposes them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from bayestouch.chain.noise import Noise
from bayestouch.chain.pad_map import PadMap
from bayestouch.pad.reading.components import components_of
from bayestouch.pad.reading.lattice import lattice_for
from bayestouch.pad.reading.reader import PadReader, PadTouches

PLACE, STEP = np.arange(-3.0, 23.01, 0.5), 0.5
CENTRE, WIDTH, GAIN = np.array([4.0, 10.0, 16.0]), 4.0, np.array([10.0, 12.0, 9.0])
OFFSET, NOISE = np.array([0.1, -0.2, 0.3]), np.array([0.10, 0.12, 0.08])
# Changes by two causes: of the map as shares of the sensitivity, of the zeros, of a touch's readings and its load.
SHARES, OF_ZERO = np.array([0.03, -0.02]), np.array([[0.05, 0.0, -0.05], [0.02, 0.02, 0.02]])
OF_TOUCH = np.array([[[0.3, 0.5, 0.1, 0.04], [-0.2, 0.1, 0.3, -0.03]]])
LOADS = np.linspace(0.0, 5.0, 6)
OF_LOAD = np.array([0.02 * LOADS, 0.05 - 0.01 * LOADS])


def sensitivity(place: np.ndarray) -> np.ndarray:
    return np.asarray(GAIN * np.exp(-0.5 * ((place[..., None] - CENTRE) / WIDTH) ** 2))


def reader() -> PadReader:
    table = sensitivity(PLACE)
    none = np.zeros_like(table)
    map_ = PadMap(
        origin=PLACE[:1],
        step=np.array([STEP]),
        low=np.array([0.0]),
        high=np.array([20.0]),
        offset=OFFSET,
        offset_variance=np.zeros(3),
        sensitivity=table,
        variance=none,
        covariance=none,
        by_effect=(SHARES[:, None] * table[:, None]).reshape(len(PLACE), -1),
        offset_by_effect=OF_ZERO,
    )
    return PadReader(
        map=map_,
        noise=Noise(NOISE, np.zeros(3), 0.0, 0.05),
        load=2.0,
        load_sd=0.5,
        load_measured=True,
        samples="mean",
        usable=np.ones(3, dtype=bool),
        changes_of_load=np.concatenate([LOADS[None], OF_LOAD]),
    )


def touch(missing: int | None = None) -> PadTouches:
    readings = OFFSET + 2.1 * sensitivity(np.array(7.3)) + np.array([0.2, -0.1, 0.1])
    counts = np.ones((1, 3), dtype=np.int64)
    if missing is not None:
        counts[0, missing] = 0
    # The standard error of the load and the load scatter together are 0.06.
    return PadTouches(readings[None], counts, np.array([2.0]), np.array([0.036]), 0.048, OF_TOUCH)


def written_out(x: np.ndarray, touches: PadTouches) -> float:
    """Normal density of readings and load, of which the causes change what the touch reads less what is expected."""
    place, load = x
    expected = load * sensitivity(np.array(place))
    of_load = np.array([np.interp(load, LOADS, each) for each in OF_LOAD])
    changes = OF_TOUCH[0].copy()
    changes[:, :3] -= load * SHARES[:, None] * sensitivity(np.array(place)) + OF_ZERO
    changes[:, :3] -= of_load[:, None] * sensitivity(np.array(place))
    covariance = np.diag([*NOISE**2, 0.06**2]) + changes.T @ changes
    miss = np.append(touches.readings[0] - OFFSET - expected, touches.load[0] - load)
    here = np.append(touches.counts[0] > 0, True)
    return float(stats.multivariate_normal(np.zeros(here.sum()), covariance[np.ix_(here, here)]).logpdf(miss[here]))


@pytest.mark.parametrize("missing", [None, 2])
def test_density_with_uncertain_effects(missing: int | None) -> None:
    touches = touch(missing)
    points = np.array([[7.0, 2.0], [7.5, 2.1], [9.0, 1.7], [3.0, 2.3]])
    found = reader().log_density(touches, points[None], np.array([0]))[0]
    wanted = [written_out(x, touches) for x in points]
    # cubic splines through a bell in steps of an eighth of its width
    np.testing.assert_allclose(found - found[0], np.array(wanted) - wanted[0], atol=2e-3)


@pytest.mark.parametrize("missing", [None, 2])
def test_sum_of_normals_with_uncertain_effects(missing: int | None) -> None:
    """Mean and standard deviation of location and load, against quadrature.

    That the causes change readings elsewhere differently is left out of the parts, as their variances are: 6 % of a
    standard deviation here. Without the causes it would be a quarter.
    """
    touches, pad = touch(missing), reader()
    parts = components_of(pad, touches, lattice_for(pad))
    weight = np.exp(parts.log_weight - parts.log_weight.max())
    weight /= weight.sum()
    mean = weight @ parts.mean
    off = parts.mean - mean
    covariance = np.einsum("n,nij->ij", weight, parts.covariance + off[:, :, None] * off[:, None])
    place, load = np.meshgrid(np.linspace(5.5, 9.5, 161), np.linspace(1.6, 2.4, 161), indexing="ij")
    points = np.stack([place.ravel(), load.ravel()], axis=-1)
    log = pad.log_density(touches, points[None], np.array([0]))[0]
    density = np.exp(log - log.max())
    density /= density.sum()
    middle = density @ points
    sd = np.sqrt(density @ (points - middle) ** 2)
    np.testing.assert_allclose(mean, middle, atol=0.05 * sd.min())
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), sd, rtol=0.08)
    cross = density @ (points - middle).prod(axis=1)
    np.testing.assert_allclose(covariance[0, 1] / sd.prod(), cross / sd.prod(), atol=0.1)
    exact = components_of(pad, replace(touches, changes=None), lattice_for(pad))
    assert (np.sqrt(exact.covariance[exact.log_weight.argmax(), [0, 1], [0, 1]]) < 0.75 * sd).any()
