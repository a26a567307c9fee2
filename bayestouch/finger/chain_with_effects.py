"""The chain of a finger with effects, from its calibration."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.sensor import finger_of
from bayestouch.effects import Values
from bayestouch.finger.correction_table import CorrectionTable
from bayestouch.finger.empirical.map import EmpiricalCalibration
from bayestouch.finger.layout import FlatLayout
from bayestouch.finger.model import FingerModel
from bayestouch.model.effect_list import EffectList
from bayestouch.model.missing import left_by_missing
from bayestouch.model.observations import UntimedTouches
from bayestouch.results.keys import EFFECT_PEAK
from bayestouch.results.objects import Calibration


@dataclass(frozen=True, eq=False)
class ChainWithEffects:
    """The chain of a calibration with effects.

    Attributes
    ----------
    model : FingerModel
        The model, without touches.
    vector : (d,) array
        Parameters at the mode.
    covariance : (d, d) array
        Covariance of the parameters.
    listed : EffectList
        All effects.
    values : mapping of str to tuple of float
        Values of every effect, by its name.
    correction_table : CorrectionTable or None
        Empirical correction by element and location, if there is one.
    identified : EmpiricalCalibration or None
        E map that was identified with the effects, instead of that of the model.
    calibrated : (n, m) array
        Mean readings of the touches of the calibration; zero where missing.
    """

    model: FingerModel
    vector: FloatArray
    covariance: FloatArray
    listed: EffectList
    values: Mapping[str, Values]
    correction_table: CorrectionTable | None = None
    identified: EmpiricalCalibration | None = None
    calibrated: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))

    @classmethod
    def of(cls, calibration: Calibration) -> ChainWithEffects:
        """The chain of a calibration with effects."""
        from bayestouch.finger.calibration import finger_chain

        finger = finger_of(calibration.sensor)
        listed = EffectList.of(calibration)
        assert listed is not None
        chain = finger_chain(calibration)
        sign = np.where(chain.response < 0, -1.0, 1.0)
        model = FingerModel(
            observed=UntimedTouches(0),
            finger=finger,
            layout=FlatLayout(finger.n_elements, discrepancy=False),
            flat_prior=None,
            sign=sign,
            contact=chain.contact,
            peak=np.asarray(calibration.extra[EFFECT_PEAK]),
            reference_load=listed.setting.reference_load,
            largest_load=chain.largest_load,
            effects=listed.plain,
        )
        values = {
            effect.name: tuple(float(calibration.mode[p.name]) for p in effect.public_parameters())
            for effect in listed.effects
        }
        response = np.where(chain.response == 0, 1e-300, np.abs(chain.response))
        base = [np.log(response), chain.sensing_radius_mm, chain.angle]
        vector = np.concatenate([*base, [chain.poisson_ratio, np.log(chain.shear_modulus_MPa)]])
        for effect in listed.plain:
            coordinates = [p.to_unconstrained(v) for p, v in zip(effect.parameters, values[effect.name], strict=True)]
            vector = np.concatenate([vector, coordinates])
        scale = np.ones(len(vector))
        scale[: finger.n_elements] = 1 / (sign * response)
        identified = None
        if calibration.has_identified_map:
            from bayestouch.finger.empirical.with_effects import effect_neighbours

            neighbours = effect_neighbours(model, vector)
            identified = EmpiricalCalibration.from_arrays(
                calibration.extra, model.chain(vector), calibration.noise, neighbours
            )
        return cls(
            model,
            vector,
            calibration.covariance * np.outer(scale, scale),
            listed,
            values,
            CorrectionTable.from_arrays(calibration.extra),
            identified,
            np.nan_to_num(calibration.rows.observed),
        )

    def left_by_missing(
        self, read: FloatArray, when_s: FloatArray, missing_s: FloatArray, known_s: FloatArray
    ) -> FloatArray:
        """Mean square (t, m, m) of what touches that may be missing leave; see `bayestouch.model.missing`."""
        effects = [(effect, self.values[effect.name]) for effect in self.model.effects]
        return left_by_missing(effects, self.calibrated, self.model.peak, read, when_s, missing_s, known_s)

    def widened(self, excess: float) -> ChainWithEffects:
        """The chain with the noise that its effects add multiplied by `excess`."""
        if excess == 1:
            return self
        return replace(self, listed=replace(self.listed, noise=self.listed.noise.widened(excess)))

    def static(self) -> FingerModel:
        """The model with only those effects that are equal in all samples of a touch."""
        return replace(self.model, effects=tuple(e for e in self.model.effects if not e.needs_samples))
