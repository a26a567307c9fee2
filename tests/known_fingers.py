"""A small simulated finger with known touches, for tests that need a calibration."""

from __future__ import annotations

import numpy as np

from bayestouch.chain.finger import FingerChain
from bayestouch.contact import composite_radius
from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import Finger, Rubber, Sensor
from bayestouch.data.touches import Touches, touches_from

ANGLES = (-26.4, -17.6, -8.8, 0.0, 8.8, 17.6, 26.4)


SAMPLES = 4


NOISE, FORCE_NOISE = 12.0, 1.0


def sensor() -> Sensor:
    return Sensor(
        name="test finger",
        body=Finger(9.4, 12.7, 9.9, ANGLES),
        rubber=Rubber(0.15, 0.46),
        force_noise_sd=FORCE_NOISE,
        reading_unit="counts",
        reading_quantity="capacitance",
        source={},
    )


def true_chain(seed: int = 5) -> FingerChain:
    rng = np.random.default_rng(seed)
    m = len(ANGLES)
    return FingerChain(
        core_radius_mm=9.4,
        outer_radius_mm=12.7,
        response=rng.uniform(3.5, 6.0, m),
        sensing_radius_mm=rng.normal(9.95, 0.1, m),
        angle=np.radians(np.array(ANGLES) + rng.normal(0, 0.5, m)),
        offset=np.zeros(m),
        poisson_ratio=0.465,
        shear_modulus_MPa=0.14,
        largest_load=300.0,
    )


def known_touches(seed: int, noise: float = NOISE, step: float = 2.0) -> Touches:
    """Edges and flats over ±45°, several samples each."""
    rng = np.random.default_rng(seed)
    chain = true_chain()
    places = np.arange(-45.0, 45.1, step)
    angle = np.concatenate([places, places[::2]])
    radius = np.concatenate([np.zeros(len(places)), np.full(len(places[::2]), np.inf)])
    load = rng.uniform(160, 240, len(angle))
    clean = chain.predict(composite_radius(radius, 12.7), np.radians(angle), load)
    index = np.repeat(np.arange(len(angle)), SAMPLES)
    return touches_from(
        touch=index,
        readings=clean[index] + noise * rng.standard_normal((len(index), len(ANGLES))),
        indenter_radius_mm=radius[index],
        angle_deg=angle[index],
        load=load[index] + FORCE_NOISE * (noise > 0.1) * rng.standard_normal(len(index)),
    )


def dataset(calibration: Touches) -> DataSet:
    return DataSet(sensor(), calibration, calibration, None, ())
