"""Simulation-based calibration of the calibration posterior of a pad."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.calibration import calibrate
from bayestouch.calibration.log_density import log_density
from bayestouch.chain.kernel_choice import kernel_for
from bayestouch.chain.kernels import Kernel
from bayestouch.chain.pad import COORDINATES, PadChain
from bayestouch.chain.recording import Recording
from bayestouch.data.dataset import DataSet
from bayestouch.data.grouping import grouped_mean, groups
from bayestouch.data.sensor import Sensor, pad_of
from bayestouch.data.touches import Touches
from bayestouch.errors import InputError
from bayestouch.pad.known_touches import pad_readings
from bayestouch.pad.problem import pad_problem
from bayestouch.priors.parameters import LogNormal, Normal
from bayestouch.simulation_based_calibration.effects import SimulatedEffects, known_touches
from bayestouch.simulation_based_calibration.running import Ranked, by_element, ranks_of

# The priors of a calibration are nearly flat over gains (10 times the signal), offsets and places (3 mm): most draws
# from them are no sensor. True values are drawn from these narrower ones, which are wide against any posterior: factor
# of a gain, offset over the peak, and distance from the place where readings of the data set peak, mm.
GAIN_FACTOR, OFFSET_SHARE, PLACE_MM = 1.3, 0.1, 0.3
# Factor of the noise of an element about that of the data set.
NOISE_FACTOR = 1.5


@dataclass(frozen=True, eq=False)
class PadCalibrationDesign:
    """Calibration touches of a pad to be simulated; m elements.

    Attributes
    ----------
    sensor : Sensor
        The pad as built, with the noise of its force sensor.
    touches : Touches
        Samples of which locations and mean loads are used.
    kernel : Kernel
        Kernel of the simulated pads and of the calibrations; its parameters are drawn from their priors.
    gain, noise_sd : (m,) arrays
        Medians of gains and noise of one reading.
    place : (m, D) array
        Means of the places of the elements, mm.
    draws, seed : int
        Posterior draws of each simulation, and the seed of all random numbers.
    added : SimulatedEffects
        Effects, with the priors from which their values are drawn.
    """

    sensor: Sensor
    touches: Touches
    kernel: Kernel
    gain: FloatArray
    noise_sd: FloatArray
    place: FloatArray
    draws: int
    seed: int
    added: SimulatedEffects

    @classmethod
    def of(
        cls, dataset: DataSet, kernel: str, draws: int, seed: int, effects: Sequence[str] = ()
    ) -> PadCalibrationDesign:
        """Return the design for a data set of a pad.

        Raises
        ------
        InputError
            There are no calibration touches with loads, or the force sensor's noise is not stated.
        """
        sensor, table = dataset.sensor, dataset.calibration
        if table is None or sensor.force_noise_sd is None or not np.isfinite(table.load).any():
            raise InputError(
                "simulation-based calibration needs calibration touches with loads, and the noise of the force sensor"
            )
        touches = known_touches(table)
        problem, _ = pad_problem(sensor, touches, kernel=kernel, samples="mean", seed=seed)
        found = calibrate(DataSet(sensor, touches, touches), kernel=kernel, draws=8, seed=seed)
        chosen = kernel_for(kernel, sensor, problem.pitch_mm)
        load = float(np.median(problem.known.load))
        return cls(
            sensor,
            touches,
            chosen,
            np.abs(found.mode["gain"]),
            # Without repeated samples the calibration counts all noise as an error of the model.
            np.where(found.noise.tactile_sd > 0, found.noise.tactile_sd, found.noise.discrepancy_sd),
            problem.priors.position,
            draws,
            seed,
            SimulatedEffects.of(effects, DataSet(sensor, touches, touches), "", load),
        )

    def ranked(self, number: int) -> Ranked:
        """Ranks of all parameters and of the log density in one simulated calibration."""
        true, touches = self.simulated(np.random.default_rng([self.seed, number]))
        known = DataSet(self.sensor, touches, touches)
        calibration = calibrate(
            known,
            kernel=self.kernel.name,
            model=self.added.stated(self.sensor.body.kind, ""),
            draws=self.draws,
            seed=self.seed + number,
        )
        public = {
            name: values.reshape(-1, *values.shape[2:])
            for name, values in calibration.posterior.items()
            if name in true
        }
        drawn, truth = by_element(public), by_element({name: true[name][None] for name in public})
        if not self.added.effects:
            density = log_density(calibration, known)
            points = (density.from_parameters(each) for each in (public, {n: true[n][None] for n in public}))
            drawn["log density"], truth["log density"] = (density(each) for each in points)
        return ranks_of(drawn, truth)

    def simulated(self, rng: np.random.Generator) -> tuple[dict[str, FloatArray], Touches]:
        """Return parameters by public name, and the design's touches with new readings and loads."""
        touches, pad = self.touches, pad_of(self.sensor)
        ids, group = groups(touches.touch)
        means = pad_readings(touches, pad.dimensions, "mean")
        reads = np.bincount(group, minlength=len(ids))
        m, force_sd = len(self.gain), self.sensor.force_noise_sd
        assert force_sd is not None
        kernel = self.kernel
        values = np.array([float(each.prior.quantile(rng.random())) for each in kernel.parameters])
        gain = LogNormal(1.0, float(np.log(GAIN_FACTOR))).quantile(rng.random(m)) * self.gain
        load = rng.normal(means.load, force_sd / np.sqrt(reads))
        peak = gain * self.added.reference_load
        offset = Normal(0.0, OFFSET_SHARE).quantile(rng.random(m)) * peak
        place = self.place + PLACE_MM * rng.standard_normal(self.place.shape)
        noise = LogNormal(1.0, float(np.log(NOISE_FACTOR))).quantile(rng.random(m)) * self.noise_sd
        chain = PadChain(kernel, values, gain, np.zeros(m), place)

        def press(recording: Recording) -> FloatArray:
            return recording.load[:, None] * chain.sensitivity(np.stack(recording.place, axis=1))

        def measured(clean: FloatArray, rng: np.random.Generator) -> FloatArray:
            return np.where(np.isnan(touches.readings), np.nan, rng.normal(offset + clean, noise))

        of_effects = self.added.draw(rng)
        scatter = rng.normal(0.0, force_sd, len(group))
        scatter -= grouped_mean(scatter, group, len(ids))[group]
        places = tuple(place.T), tuple(means.location.T)
        readings = self.added.readings(of_effects, touches, means, *places, load, peak, press, measured, rng, offset)
        true = {"gain": gain, "offset": offset, **{f"{c}_s": x for c, x in zip(COORDINATES, place.T, strict=False)}}
        true |= {each.name: np.asarray(value) for each, value in zip(kernel.parameters, values, strict=True)}
        return true | self.added.named(of_effects), touches.with_(readings=readings, load=means.load[group] + scatter)
