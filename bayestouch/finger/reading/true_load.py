"""Loads as they act, where effects of the rig say that the force sensor reads other ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.chain.recording import Recording
from bayestouch.effects import Effect
from bayestouch.finger.chain_with_effects import ChainWithEffects


@dataclass(frozen=True, eq=False)
class TrueLoads:
    """Measured loads after the correction for effects of the rig; t touches, m elements, d parameters.

    The calibration learned these effects together with the responses of the elements. Where the correction of a load
    is wrong, readings are therefore predicted wrongly too, and by how much is known: the two errors are not
    independent.

    Attributes
    ----------
    load, sd : (t,) arrays
        Load and its standard deviation, N/m: noise of the force sensor, and uncertainty of the effects. NaN load where
        none was measured.
    slope : (d, t) array
        Derivative of the load over the parameters of the calibration.
    gain : (t, m) array
        What the readings are expected to be higher by for each N/m that the corrected load is above the true one.
    """

    load: FloatArray
    sd: FloatArray
    slope: FloatArray
    gain: FloatArray

    def select(self, index: IntArray) -> TrueLoads:
        """Some of the touches."""
        return TrueLoads(self.load[index], self.sd[index], self.slope[:, index], self.gain[index])

    def joined(self, parts: Sequence[TrueLoads]) -> TrueLoads:
        """The touches of several, of which this is one."""
        return TrueLoads(
            np.concatenate([part.load for part in parts]),
            np.concatenate([part.sd for part in parts]),
            np.concatenate([part.slope for part in parts], axis=1),
            np.concatenate([part.gain for part in parts]),
        )

    def along(self, root: FloatArray, spread: FloatArray) -> FloatArray:
        """Covariance of the load with the readings, over the load's standard deviation, (t, m).

        Parameters
        ----------
        root : (d, d) array
            Lower Cholesky factor of the covariance of the parameters.
        spread : (d, t, m) array
            Change of the readings for one standard deviation of each column of it.
        """
        together = np.einsum("kt,ktm->tm", root.T @ self.slope, spread)
        return np.where(np.isfinite(self.load)[:, None], together / self.sd[:, None], 0.0)

    def with_gain(self, along: FloatArray) -> TrueLoads:
        """The same with the gain that belongs to the result of `along`."""
        return replace(self, gain=np.nan_to_num(-along / self.sd[:, None]))

    def readings(self, load: FloatArray, touch: IntArray) -> FloatArray:
        """What to add to the readings (n, m) of some touches (n,) if their true loads are `load` (n,)."""
        return np.nan_to_num(self.load[touch] - load)[:, None] * self.gain[touch]


def changes_load(effects_chain: ChainWithEffects) -> bool:
    """Whether the force sensor reads another load than the one that acts."""
    return any(e.stage == "rig" and type(e).pose is not Effect.pose for e in effects_chain.model.effects)


def true_loads(
    effects_chain: ChainWithEffects, angle_deg: FloatArray, load: FloatArray, load_sd: FloatArray, *, exact: bool
) -> TrueLoads:
    """Loads as they act, from loads as read (t,) at locations (t,); with a `gain` of zero.

    Parameters
    ----------
    effects_chain : ChainWithEffects
    angle_deg : (t,) array
    load, load_sd : (t,) arrays
        As read, N/m, NaN where not measured; noise of the force sensor.
    exact : bool
        Whether the calibration is taken as exact.
    """

    def at(vector: FloatArray) -> FloatArray:
        model = effects_chain.model
        recording = Recording(
            indenter_radius_mm=np.full(len(load), np.nan),
            place=(angle_deg,),
            load=load,
            time_s=np.zeros(len(load)),
            held_s=np.zeros(len(load)),
            element_place=(np.asarray(model.finger.element_angles_deg),),
            peak=model.peak,
            reference_load=model.reference_load,
            signal=np.zeros((len(load), model.n_elements)),
        )
        for effect, values in zip(model.effects, model.values(vector), strict=True):
            recording = effect.pose(recording, values)
        return recording.load

    covariance = effects_chain.covariance
    slope = np.zeros((len(covariance), len(load)))
    if not exact:
        for row in range(effects_chain.model.n_base, len(covariance)):
            step = np.zeros(len(covariance))
            step[row] = 0.01 * np.sqrt(covariance[row, row])
            higher, lower = (at(effects_chain.vector + sign * step) for sign in (1, -1))
            slope[row] = np.nan_to_num(higher - lower) / (2 * max(float(step[row]), 1e-300))
    variance = load_sd**2 + np.einsum("at,ab,bt->t", slope, covariance, slope, optimize=True)
    gain = np.zeros((len(load), effects_chain.model.n_elements))
    return TrueLoads(at(effects_chain.vector), np.sqrt(variance), slope, gain)
