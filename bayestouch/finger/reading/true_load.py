"""True loads: measured loads corrected for effects of the rig."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.chain.recording import Recording
from bayestouch.effects import Effect
from bayestouch.finger.chain_with_effects import ChainWithEffects
from bayestouch.finger.model import FingerModel


@dataclass(frozen=True, eq=False)
class TrueLoads:
    """Measured loads corrected for effects of the rig; t touches, m elements, d parameters.

    The calibration estimates these effects together with the responses of the elements. The error of a corrected load
    is therefore correlated with the errors of the predicted readings.

    Attributes
    ----------
    load, sd : (t,) arrays
        Load and its standard deviation, N/m: noise of the force sensor, and uncertainty of the effects. The load is NaN
        if not measured.
    slope : (d, t) array
        Derivative of the load over the parameters of the calibration.
    gain : (t, m) array
        Expected change of the readings per N/m of the difference between corrected load and true load.
    """

    load: FloatArray
    sd: FloatArray
    slope: FloatArray
    gain: FloatArray

    def select(self, index: IntArray) -> TrueLoads:
        """Some of the touches."""
        return TrueLoads(self.load[index], self.sd[index], self.slope[:, index], self.gain[index])

    def joined(self, parts: Sequence[TrueLoads]) -> TrueLoads:
        """The loads of all `parts` together; this object is one of them."""
        return TrueLoads(
            np.concatenate([part.load for part in parts]),
            np.concatenate([part.sd for part in parts]),
            np.concatenate([part.slope for part in parts], axis=1),
            np.concatenate([part.gain for part in parts]),
        )

    def along(self, root: FloatArray, spread: FloatArray) -> FloatArray:
        """Covariance of the load with the readings, over the standard deviation of the load, (t, m).

        Parameters
        ----------
        root : (d, d) array
            Lower Cholesky factor of the covariance of the parameters.
        spread : (d, t, m) array
            Change of the readings for each column of `root`.
        """
        together = np.einsum("kt,ktm->tm", root.T @ self.slope, spread)
        return np.where(np.isfinite(self.load)[:, None], together / self.sd[:, None], 0.0)

    def with_gain(self, along: FloatArray) -> TrueLoads:
        """The loads with the gain for the result of `along`."""
        return replace(self, gain=np.nan_to_num(-along / self.sd[:, None]))

    def readings(self, load: FloatArray, touch: IntArray) -> FloatArray:
        """Term to add to the readings (n, m) of the touches `touch` (n,) if their true loads are `load` (n,), N/m."""
        return np.nan_to_num(self.load[touch] - load)[:, None] * self.gain[touch]


def changes_load(effects_chain: ChainWithEffects) -> bool:
    """Whether an effect makes the load as read differ from the acting load; those of locations alone do not."""
    # All around the finger, because an effect may be zero at some locations.
    angle = np.linspace(0, 360, 8, endpoint=False)
    load = np.full(len(angle), effects_chain.model.reference_load)
    recording = _as_read(effects_chain.model, np.full(len(angle), np.inf), angle, load)
    return any(
        effect.stage == "rig"
        and type(effect).pose is not Effect.pose
        # An effect without probes was not tried, and may change it.
        and (not effect.probes or bool((effect.pose(recording, effect.probes[0]).load != recording.load).any()))
        for effect in effects_chain.model.effects
    )


def recorded_touches(
    model: FingerModel,
    time_s: FloatArray,
    angle_deg: FloatArray,
    load: FloatArray,
    signal: NDArray[np.floating],
    indenter_radius_mm: FloatArray,
) -> Recording:
    """Touches that are held no time: times, locations (degree), loads (N/m), tips (mm), (n,) each; signal (n, m)."""
    return Recording(
        indenter_radius_mm=indenter_radius_mm,
        place=(angle_deg,),
        load=load,
        time_s=time_s,
        held_s=np.zeros(len(load)),
        element_place=(np.asarray(model.finger.element_angles_deg),),
        peak=model.peak,
        reference_load=model.reference_load,
        signal=np.asarray(signal),
    )


def changing_in_time(effects_chain: ChainWithEffects) -> tuple[str, ...]:
    """Names of the effects by which the same touch reads, or weighs, otherwise during the calibration than after it.

    Drifts, creep and memory are not among them: a reader has the times of the touches for them.
    """
    model, span = effects_chain.model, effects_chain.listed.setting.span_s
    during = np.linspace(0.0, span, 8)
    # All around the finger, as in `changes_load`, and at the peak readings.
    angle, load = np.linspace(0, 360, 8, endpoint=False), np.full(8, model.reference_load)
    then, after = (
        recorded_touches(model, time, angle, load, np.tile(model.peak, (8, 1)), np.zeros(8))
        for time in (during, np.full(8, np.inf))
    )

    def differs(effect: Effect) -> bool:
        values = effects_chain.values[effect.name]
        # A reader does not use stated locations and tips: of a pose, it corrects the loads of the force sensor.
        if effect.stage == "rig" and (effect.pose(then, values).load != effect.pose(after, values).load).any():
            return True
        return bool((effect.signal(then, values) != effect.signal(after, values)).any())

    return tuple(effect.name for effect in model.effects if not effect.needs_samples and differs(effect))


def _as_read(model: FingerModel, time_s: FloatArray, angle_deg: FloatArray, load: FloatArray) -> Recording:
    """Touches with loads as read, N/m, at given times and locations, degree, (t,); tips and signals do not matter."""
    nothing = np.zeros((len(load), model.n_elements))
    return recorded_touches(model, time_s, angle_deg, load, nothing, np.full(len(load), np.nan))


def true_loads(
    effects_chain: ChainWithEffects,
    time_s: FloatArray,
    angle_deg: FloatArray,
    load: FloatArray,
    load_sd: FloatArray,
    *,
    exact: bool,
) -> TrueLoads:
    """True loads from loads as read, with a `gain` of zero.

    Parameters
    ----------
    effects_chain : ChainWithEffects
        The finger with its effects.
    time_s : (t,) array
        Times of the touches on the clock of the calibration; infinite after its end.
    angle_deg : (t,) array
        True locations of the touches, degree.
    load, load_sd : (t,) arrays
        Load as read (NaN if not measured) and its standard error, N/m.
    exact : bool
        Whether the calibration counts as exact.
    """

    def at(vector: FloatArray) -> FloatArray:
        model = effects_chain.model
        recording = _as_read(model, time_s, angle_deg, load)
        for effect, values in zip(model.effects, model.values(vector), strict=True):
            # The locations of the posterior are true ones already: an effect must not shift them.
            recording = replace(recording, load=effect.pose(recording, values).load)
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
