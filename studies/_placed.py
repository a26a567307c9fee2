"""Simulated fingers that miss the elastic model by functions of place."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bayestouch.chain.finger import FingerChain
from bayestouch.contact import composite_radius, contact_model
from bayestouch.data.dataset import DataSet
from bayestouch.simulation import SimulatedDataSet

# A squared-exponential process has less than a part in a thousand of its power beyond this many modes over its length.
MODES_A_LENGTH = 4.0


@dataclass(frozen=True)
class Missed:
    """Standard deviation and length (degree) of each function of place; Gaussian processes, squared-exponential.

    Attributes
    ----------
    map_percent, map_deg : float
        Of each element's E map, % of its peak: a function of the angle from element to load, which blunter indenters
        feel smoothed by their own pressure.
    place_percent, place_deg : float
        Of each element's readings, % of its peak: a function of the place touched, whatever touches it.
    curvature, curvature_deg : float
        Of the curvature of the surface, 1/mm: it adds to 1/R of every touch.
    """

    map_percent: float = 0.0
    map_deg: float = 8.0
    place_percent: float = 0.0
    place_deg: float = 5.0
    curvature: float = 0.0
    curvature_deg: float = 10.0


@dataclass(frozen=True, eq=False)
class MissedFinger:
    """A finger as it was built, with what the elastic model misses of it.

    Attributes
    ----------
    chain : FingerChain
        The elastic finger.
    map, place, curvature : (2, m, n) arrays and (2, 1, n) array
        Weights of cosine and sine of each mode.
    """

    chain: FingerChain
    map: np.ndarray
    place: np.ndarray
    curvature: np.ndarray

    @classmethod
    def of(cls, chain: FingerChain, missed: Missed, seed: int) -> MissedFinger:
        """Draw the functions."""
        rng = np.random.default_rng([seed, 81])
        m = chain.n_elements
        return cls(
            chain,
            _weights(missed.map_deg, missed.map_percent / 100, m, rng),
            _weights(missed.place_deg, missed.place_percent / 100, m, rng),
            _weights(missed.curvature_deg, missed.curvature, 1, rng),
        )

    def predict(self, radius_mm: np.ndarray, angle: np.ndarray, load: np.ndarray) -> np.ndarray:
        """Readings (t, m) without noise; composite radius R (mm) with a round surface, location (rad), load (N/m)."""
        chain = self.chain
        departure = _summed(self.curvature, angle[:, None])[:, 0]
        # an indenter touches no hollow
        radius = radius_mm / np.maximum(1 + radius_mm * departure, 0.05)
        away = angle[:, None] - chain.angle
        modes = np.arange(self.map.shape[2])
        contact = contact_model(chain.contact, (chain.core_radius_mm, chain.outer_radius_mm), chain.poisson_ratio)
        felt = contact.spectrum(load / 1000 * radius / chain.shear_modulus_MPa, modes)
        added = _summed(self.map, away, felt) + _summed(self.place, away)
        return np.asarray(chain.predict(radius, angle, load) + chain.response * load[:, None] * added)

    def calibrating(self, simulated: SimulatedDataSet) -> DataSet:
        """The data set of this finger without errors, with them in its calibration touches."""
        table = simulated.dataset.calibration
        assert table is not None
        assert table.indenter_radius_mm is not None
        assert table.angle_deg is not None
        load = np.asarray(simulated.truth["calibration"]["P"])[table.touch]
        touch = (
            composite_radius(table.indenter_radius_mm, self.chain.outer_radius_mm),
            np.radians(table.angle_deg),
            load,
        )
        added = self.predict(*touch) - self.chain.predict(*touch)
        return replace(simulated.dataset, calibration=table.with_(readings=table.readings + added))


def _weights(length_deg: float, sd: float, count: int, rng: np.random.Generator) -> np.ndarray:
    """Of cosine and sine, (2, count, n)."""
    modes = np.arange(int(MODES_A_LENGTH / np.radians(length_deg)) + 1)
    power = np.exp(-0.5 * (modes * np.radians(length_deg)) ** 2) * np.where(modes == 0, 0.5, 1.0)
    return np.asarray(sd * np.sqrt(power / power.sum()) * rng.standard_normal((2, count, len(modes))))


def _summed(weights: np.ndarray, angle: np.ndarray, felt: np.ndarray | None = None) -> np.ndarray:
    """Functions at angles (t, count); `felt` (t, n) is how much of each mode a touch feels."""
    turn = angle[..., None] * np.arange(weights.shape[2])
    terms = np.cos(turn) * weights[0] + np.sin(turn) * weights[1]
    return np.asarray(terms.sum(axis=-1) if felt is None else np.einsum("tcn,tn->tc", terms, felt))
