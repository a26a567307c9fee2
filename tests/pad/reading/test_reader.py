"""Density of touches on a pad with uncertain effects: written out, and as the sum of normals that proposes them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from bayestouch.chain.noise import Noise
from bayestouch.chain.pad_map import PadMap
from bayestouch.data.averages import TouchMeans
from bayestouch.model.noise import AddedNoise
from bayestouch.pad.added_noise import NoiseByEffects
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


PEAK = 2.0 * GAIN
ADDED = AddedNoise(share=0.02, power=0.8, common=0.015, common_touch=0.005, common_shared=0.4)
COUNTS = np.array([[4, 4, 2]])


def with_noise_by_effects() -> PadReader:
    plain = reader()
    map_ = replace(plain.map, by_effect=None, offset_by_effect=None)
    noise = NoiseByEffects(ADDED, PEAK, OFFSET).to(plain.noise)
    return replace(plain, map=map_, noise=noise, changes_of_load=None)


def touched(pad: PadReader, missing: int | None = None) -> PadTouches:
    """A touch whose elements have four and two samples; without one of them it has less to tell."""
    counts = COUNTS.copy()
    if missing is not None:
        counts[0, missing] = 0
    readings = OFFSET + 2.1 * sensitivity(np.array(7.3)) + np.array([0.5, 0.4, 0.6])
    means = TouchMeans(
        np.arange(1), readings[None], counts, np.full(3, np.nan), np.zeros(3),
        np.array([2.0]), np.full(1, np.nan), np.full(1, np.nan), np.full(1, np.nan), None, None, None,
        load_reads=np.ones(1),
    )  # fmt: skip
    return pad.touches(means)


def of_noise(x: np.ndarray, touches: PadTouches) -> float:
    """Normal density of readings and load: elements of n and k samples share those of the one with fewer."""
    place, load = x
    signal, together = load * sensitivity(np.array(place)), PEAK**0.6 * PEAK.mean() ** 0.4
    most = np.maximum(COUNTS[0][:, None], COUNTS[0])
    covariance = (0.015**2 / most + 0.005**2) * np.outer(together, together)
    covariance += np.diag((NOISE**2 + (0.02 * PEAK * (np.abs(OFFSET + signal) / PEAK) ** 0.8) ** 2) / COUNTS[0])
    here = touches.counts[0] > 0
    miss = (touches.readings[0] - OFFSET - signal)[here]
    log = stats.multivariate_normal(np.zeros(here.sum()), covariance[np.ix_(here, here)]).logpdf(miss)
    return float(log + stats.norm(2.0, 0.05).logpdf(load))


@pytest.mark.parametrize("missing", [None, 0, 2])
def test_density_with_noise_of_the_signal_and_of_all_elements(missing: int | None) -> None:
    pad = with_noise_by_effects()
    touches = touched(pad, missing)
    points = np.array([[7.0, 2.0], [7.5, 2.1], [9.0, 1.7], [3.0, 2.3]])
    found = pad.log_density(touches, points[None], np.array([0]))[0]
    wanted = [of_noise(x, touches) for x in points]
    assert np.ptp(wanted) > 10
    np.testing.assert_allclose(found - found[0], np.array(wanted) - wanted[0], atol=2e-3)
    _, alone = pad.apart.predict(points[:1, :1], points[:1, 1], COUNTS)
    _, own = pad.predict(points[:1, :1], points[:1, 1], COUNTS)
    together = PEAK**0.6 * PEAK.mean() ** 0.4
    np.testing.assert_allclose(alone - own, ((0.015**2 / COUNTS + 0.005**2) * together**2), rtol=1e-9)


def test_sum_of_normals_with_noise_of_all_elements() -> None:
    """The nodes of the lattice are chosen with it: 30 times the noise of each element, it moves all readings."""
    pad = with_noise_by_effects()
    added = NoiseByEffects(AddedNoise(common=0.15), PEAK, OFFSET)
    pad = replace(
        pad, noise=added.to(replace(pad.noise.without_effects(), tactile_sd=0.05 * NOISE)), load_measured=False
    )
    touches = replace(touched(pad), readings=OFFSET + 2.1 * sensitivity(np.array([7.3])) + 0.15 * PEAK)
    parts = components_of(pad, touches, lattice_for(pad))
    weight = np.exp(parts.log_weight - parts.log_weight.max())
    weight /= weight.sum()
    mean = weight @ parts.mean
    off = parts.mean - mean
    sd = np.sqrt(np.einsum("n,nii->ni", weight, parts.covariance).sum(axis=0) + weight @ off**2)
    place, load = np.meshgrid(np.linspace(6.8, 7.8, 401), np.linspace(1.5, 2.7, 401), indexing="ij")
    points = np.stack([place.ravel(), load.ravel()], axis=-1)
    log = pad.log_density(touches, points[None], np.array([0]))[0]
    density = np.exp(log - log.max())
    density /= density.sum()
    middle = density @ points
    wanted = np.sqrt(density @ (points - middle) ** 2)
    # readings that are all too high by 0.15 of their peak hardly move it
    assert middle[0] == pytest.approx(7.3, abs=0.1)
    np.testing.assert_array_less(np.abs(mean - middle), 0.2 * wanted)
    np.testing.assert_allclose(sd, wanted, rtol=0.1)
