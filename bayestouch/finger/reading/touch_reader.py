"""`FingerTouchReader`: inference of touches on a finger from the rows of a touch table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray, IntArray
from bayestouch.chain.noise import Noise
from bayestouch.contact import composite_radius
from bayestouch.data.arrays import nearest_turn
from bayestouch.data.averages import TouchMeans
from bayestouch.data.sensor import finger_of
from bayestouch.data.survey import Survey
from bayestouch.data.touches import Touches
from bayestouch.effects.contact import BluntEdge
from bayestouch.finger.calibration import finger_chain
from bayestouch.finger.chain_with_effects import ChainWithEffects
from bayestouch.finger.place.chain import FingerWithPlaces
from bayestouch.finger.place.posterior import PlacePosterior
from bayestouch.finger.reading.covariance import CalibrationCovariance
from bayestouch.finger.reading.draws import DRAWN, RADIUS_READ, TIPS, WHITENER, FingerSampler
from bayestouch.finger.reading.likelihood import FingerTouchModel
from bayestouch.finger.reading.misfit import FingerMisfit
from bayestouch.finger.reading.modulus import RadiusOverModulus
from bayestouch.finger.reading.places import CovarianceWithPlaces, table_with_places
from bayestouch.finger.reading.reader import (
    CalibratedFinger,
    FingerPosterior,
    IndenterPriors,
    TouchReadings,
    full_whitener,
)
from bayestouch.finger.reading.reading_table import ReadingTable
from bayestouch.finger.reading.rows import FingerTouches, readings_of, rows_as_touches
from bayestouch.finger.reading.touches_with_effects import observe, prepare
from bayestouch.finger.reading.true_load import changes_load, changing_in_time
from bayestouch.model.observations import Observations
from bayestouch.output.text import those_with
from bayestouch.priors.indenters import UniformRadius
from bayestouch.priors.parameters import Parameter, Uniform
from bayestouch.priors.radius import RadiusOfTips
from bayestouch.reading.ends import graded
from bayestouch.reading.faults import SensorCheck
from bayestouch.reading.options import Options
from bayestouch.reading.touch_reader import Drawn, Estimates
from bayestouch.results.data import TouchRows
from bayestouch.results.objects import Calibration
from bayestouch.results.tips import TipProbabilities

ReadingCovariance = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]


@dataclass(frozen=True, eq=False)
class AveragedTouches:
    """Means of touches; with effects also the observations with times, and a note on the assumed times.

    `recorded_s` (t,) is the time of each touch on the clock of the calibration, None for touches after it.
    """

    means: TouchMeans
    observed: Observations | None = None
    note: str = ""
    recorded_s: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class FingerTouchReader:
    """A calibrated finger that infers touches. A `bayestouch.reading.touch_reader.TouchReader`.

    Attributes
    ----------
    options : Options
        Options of the inference.
    sampler : FingerSampler
        Sampler of touches.
    covariance : callable
        Covariance of readings due to the calibration, even if the sampler treats the calibration as exact.
    typical_load : float
        Typical load of the calibration, N/m.
    noise : Noise
        Noise of the calibration; that of the sampler is larger if the check found a misfit of the model.
    effects_chain : ChainWithEffects or None
        Effects of the calibration.
    check : SensorCheck or None
        Result of the check of the sensor; readings with faults are left out.
    """

    options: Options
    sampler: FingerSampler
    covariance: ReadingCovariance
    typical_load: float
    noise: Noise
    effects_chain: ChainWithEffects | None
    check: SensorCheck | None = None

    least_share = 0.5
    load_unit = "N/m"
    unchecked = ""

    @classmethod
    def from_calibration(cls, calibration: Calibration, options: Options) -> FingerTouchReader:
        """Reader from a calibration of a finger."""
        typical = float(calibration.settings["typical_load"])
        effects_chain = ChainWithEffects.of(calibration) if calibration.has_effects else None
        modulus = None if options.plug_in else _modulus(calibration, options)
        chain, table, covariance = _model(calibration, effects_chain, modulus)
        priors = _with_blunt_edges(IndenterPriors.of_calibration(chain, calibration, options.indenter), effects_chain)
        noise, given = calibration.noise, covariance
        if modulus is not None:
            assert isinstance(covariance, CalibrationCovariance | CovarianceWithPlaces)
            given = covariance.with_known_modulus()
        sampler = FingerSampler(
            chain, priors, table, noise, None if options.plug_in else given, bool(options.groups), modulus
        )
        return cls(options, sampler, covariance, typical, noise, effects_chain)

    @property
    def needs_whole_table(self) -> bool:
        """True if drifts are estimated, an effect depends on earlier touches, loads are corrected or times given."""
        if self.effects_chain is None:
            return False
        return self._with_time or changes_load(self.effects_chain) or self.options.recorded_s is not None

    @property
    def drifts_are_estimated(self) -> bool:
        """True if the calibration has drifts of zeros or gains."""
        return self.effects_chain is not None and bool(self.effects_chain.listed.drifts)

    @property
    def _with_time(self) -> bool:
        """Whether effects depend on time."""
        chain = self.effects_chain
        return chain is not None and (self.drifts_are_estimated or any(e.needs_samples for e in chain.model.effects))

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Unknowns of a touch: R (mm), θ_c (degree) and P (N/m)."""
        priors = self.sampler.priors
        low, high = np.degrees(priors.location.support)
        return (
            Parameter("R", "R", "R", "mm", priors.radius, "composite radius, 1/R = 1/r_b + 1/r_c"),
            Parameter("theta_c", "θ_c", r"\theta_c", "degree", Uniform(float(low), float(high)), "contact location"),
            Parameter("P", "P", "P", "N/m", priors.load, "line load"),
        )

    @property
    def settings(self) -> dict[str, str | float]:
        """Contact model, and the options of fingers."""
        return {
            "contact": self.sampler.chain.contact,
            "each_sample": float(self.options.each_sample),
            "method": self.options.method,
            "indenter": str(self.options.indenter or UniformRadius()),
        }

    def average(self, piece: Touches) -> AveragedTouches:
        """Means of the touches in a piece of the table, minus the rest reading; one per sample if `each_sample`."""
        if self.effects_chain is None:
            return AveragedTouches(rows_as_touches(piece) if self.options.each_sample else piece.averaged())
        observed, few, note = observe(piece, self.effects_chain, self.noise, self.options.each_sample)
        recorded_s = self.options.recorded_s
        if recorded_s is not None:
            recorded_s = observed.of_touches(recorded_s[piece.in_contact])
        touches = AveragedTouches(observed.means, observed, note if self._with_time else "", recorded_s)
        if few is None:
            return touches
        # As before the check of the sensor, whose result does not change the means.
        unchecked = replace(self, check=None, sampler=replace(self.sampler, noise=self.noise))

        def expected(means: TouchMeans) -> tuple[FloatArray, FloatArray]:
            some = replace(touches, means=means)
            fitted = unchecked.fitted(some, unchecked.ready(some), np.arange(means.n_touches))
            return fitted(np.zeros(means.n_elements + 1, dtype=bool)).expected

        return replace(touches, means=few.weighed(touches.means, expected))

    def ready(self, touches: AveragedTouches) -> FingerTouches:
        """The touches with the effects at their times, drifts estimated from all touches, and true loads."""
        means, observed, use_load = touches.means, touches.observed, self.options.use_load
        if self.check is not None:
            means = self.check.corrected(means)
            use_load = use_load and not self.check.force_left_out
            observed = None if observed is None else observed.with_wires(self.check.order)
        unknown = readings_of(means, self.noise.force_sd, use_load)
        if observed is not None and self.effects_chain is not None:
            after = np.full(means.n_touches, np.inf)
            time_s = after if touches.recorded_s is None else touches.recorded_s
            chain, plug_in = self.effects_chain, self.options.plug_in
            unknown = prepare(unknown, observed, chain, self.sampler, time_s=time_s, plug_in=plug_in)
        return FingerTouches(means, unknown)

    def fitted(
        self, touches: AveragedTouches, block: FingerTouches, some: IntArray, rest_variance: FloatArray | None = None
    ) -> FingerMisfit:
        """Fits of some of the touches for the check of the sensor, with the uniform prior of R."""
        sampler, chosen = self.sampler, block.select(some)
        readings = chosen.readings.with_independent_loads()
        # A sound sensor misfits by the uncertainty of the calibration, also if that counts as exact.
        covariance = self.covariance if readings.context is None else readings.context.inexact().covariance
        uniform = UniformRadius().radius_prior(sampler.chain.outer_radius_mm)
        priors = replace(sampler.priors, radius=uniform)
        return FingerMisfit(
            sampler.chain,
            sampler.table,
            priors,
            sampler.noise,
            covariance,
            readings,
            self.typical_load,
            chosen.means.touch,
            rest_variance,
        )

    def without(self, check: SensorCheck) -> FingerTouchReader:
        """The reader without the faulty columns of a check."""
        noise = self.sampler.noise.widened(check.excess)
        chain = None if self.effects_chain is None else self.effects_chain.widened(check.excess)
        return replace(self, check=check, sampler=replace(self.sampler, noise=noise), effects_chain=chain)

    def unknown(self, block: FingerTouches) -> TouchReadings:
        """Readings without reference locations and radii."""
        return block.readings

    def estimates(self, block: FingerTouches, drawn: Drawn, first: int) -> Estimates:
        """Draws of r_c, R, θ_c and P, and readings predicted at their means; grade 0 beyond the priors."""
        means, radius = block.means, self.sampler.priors.radius
        log_probability, whitener = drawn.pop(TIPS, None), drawn.pop(WHITENER, None)
        radius_read = drawn.pop(RADIUS_READ, None)
        posterior = {name: drawn[name] for name in DRAWN}
        reference = self._reference(means, posterior["theta_c"].mean(axis=(0, 1)))
        read = posterior["R"].mean(axis=(0, 1)) if radius_read is None else radius_read
        touch = read, np.radians(posterior["theta_c"].mean(axis=(0, 1))), posterior["P"].mean(axis=(0, 1))
        predicted = self._predicted(block.readings, *touch)
        rows = TouchRows(
            touch=means.touch,
            location={"theta_c": reference["theta_c"]},
            radius_mm=means.indenter_radius_mm,
            load=means.load,
            observed=means.readings,
            predicted=predicted,
            sd=self._sd(block.readings, predicted),
            counts=block.readings.counts,
            samples=means.samples,
            load_reads=means.reads_of_load,
            sample=means.sample,
        )
        tips = None
        if log_probability is not None and isinstance(radius, RadiusOfTips):
            tips = TipProbabilities.of(radius, log_probability)
        stats = {name: values for name, values in drawn.items() if name not in posterior}
        stats = graded(stats, self._beyond_priors(block.readings, posterior), rows.counts)
        model = None
        if whitener is not None:
            sampler = self.sampler
            whiteners = np.ascontiguousarray(np.moveaxis(whitener, -1, 0))
            if radius_read is not None:
                # Given R alone, the modulus is as uncertain as the other parameters.
                whiteners = full_whitener(sampler.noise, block.readings, self.covariance(*touch))
            density = FingerPosterior(sampler.chain, block.readings, sampler.priors, whiteners, sampler.table)
            model = FingerTouchModel(density, self.parameters, means.load)
        return Estimates(posterior, stats, reference, rows, tips, model)

    def notes(self, found: Survey, whole: AveragedTouches | None) -> tuple[str, ...]:
        """Notes on touches without a measured load (if loads are used), and on assumed times and states."""
        missing, what = found.touches_without_load, "touch"
        if self.options.each_sample:
            missing, what = found.rows_without_load, "sample"
        notes = []
        if self.options.use_load and missing:
            notes.append(f"{those_with(missing, what)} no measured load: it is inferred from the elements.")
        if whole is not None and whole.note:
            notes.append(whole.note)
        if self.effects_chain is not None and self.options.recorded_s is None:
            notes += [
                f"{name} changed during the calibration: touches are read with its state at the end of the calibration."
                for name in changing_in_time(self.effects_chain)
            ]
        return tuple(notes)

    def _beyond_priors(self, readings: TouchReadings, draws: Drawn) -> BoolArray:
        """Whether a touch is beyond the priors of location and load, (t,): its posterior is narrow, but wrong."""
        priors = self.sampler.priors
        harder = readings.load > priors.load.support[1]
        return np.asarray(harder | priors.cut_off(np.radians(draws["theta_c"]), draws["P"]))

    def _reference(self, means: TouchMeans, read_deg: FloatArray) -> dict[str, FloatArray]:
        """References of touches that are read at locations (t,), degree."""
        radius, outer = means.indenter_radius_mm, self.sampler.chain.outer_radius_mm
        composite = composite_radius(np.where(np.isnan(radius), 0.0, radius), outer)
        angle = np.full(means.n_touches, np.nan)
        if means.angle_deg is not None:
            # In the turn in which locations are read, that a user may subtract one from the other.
            priors = self.sampler.priors
            row = float(np.degrees(np.mean(priors.location.support)))
            angle = nearest_turn(means.angle_deg, read_deg if priors.whole_turn else row)
        return {"r_c": radius, "R": np.where(np.isnan(radius), np.nan, composite), "theta_c": angle, "P": means.load}

    def _predicted(
        self, readings: TouchReadings, radius: FloatArray, angle: FloatArray, load: FloatArray
    ) -> FloatArray:
        predicted = self.sampler.chain.predict(radius, angle, load)
        if readings.context is None:
            return predicted
        return np.asarray(readings.context.readings(predicted, radius, angle, load, np.arange(len(load))))

    def _sd(self, readings: TouchReadings, predicted: FloatArray) -> FloatArray:
        """Standard deviation (t, m) of the noise of mean readings, with that of effects, for predicted readings."""
        variance = self.sampler.noise.mean_variance(readings.counts, predicted)
        if readings.context is not None:
            variance = variance + readings.context.added_variance(predicted)
        return np.asarray(np.sqrt(variance))


def _with_blunt_edges(priors: IndenterPriors, effects_chain: ChainWithEffects | None) -> IndenterPriors:
    """The priors with the radius of knife edges that the calibration found, for a known tip with r_c = 0."""
    values = {} if effects_chain is None else effects_chain.values
    if BluntEdge.name not in values or not isinstance(priors.radius, RadiusOfTips):
        return priors
    return replace(priors, radius=replace(priors.radius, edge_radius_mm=values[BluntEdge.name][0]))


def _modulus(calibration: Calibration, options: Options) -> RadiusOverModulus | None:
    """Prior of R' of `RadiusOverModulus`; None where it is not needed, or where readings do not depend on P R/μ alone.

    Such readings are those with effects, with an identified E map, or on a surface with a curvature of its own.
    """
    places = PlacePosterior.from_arrays(calibration.extra)
    own_surface = places is not None and places.functions.surface is not None
    if calibration.has_effects or calibration.has_identified_map or own_surface:
        return None
    prior = (options.indenter or UniformRadius()).radius_prior(finger_of(calibration.sensor).outer_radius_mm)
    return RadiusOverModulus.of(prior, calibration.parameters, calibration.posterior, float(calibration.mode["mu"]))


def _model(
    calibration: Calibration,
    effects_chain: ChainWithEffects | None,
    modulus: RadiusOverModulus | None,
) -> tuple[CalibratedFinger, ReadingTable, ReadingCovariance]:
    """Calibrated finger, its reading table, and the covariance of readings due to its calibration."""
    elastic = finger_chain(calibration) if effects_chain is None else effects_chain.model.chain(effects_chain.vector)
    if modulus is not None:
        # The tables reach as far in P R' as in P R.
        elastic = elastic.with_(largest_load=elastic.largest_load * modulus.widest)
    ends = IndenterPriors.of_calibration(elastic, calibration).location.support
    if calibration.has_identified_map:
        from bayestouch.finger.empirical.map import EmpiricalCalibration

        identified = None if effects_chain is None else effects_chain.identified
        empirical = identified or EmpiricalCalibration.from_arrays(calibration.extra, elastic, calibration.noise)
        return empirical.chain, ReadingTable.of_map(empirical.chain, *ends), empirical.reading_covariance
    places = PlacePosterior.from_arrays(calibration.extra)
    if places is not None:
        finger = FingerWithPlaces(elastic, places)
        return finger, table_with_places(finger, *ends), CovarianceWithPlaces(finger)
    return elastic, ReadingTable.of(elastic, *ends), CalibrationCovariance(elastic, calibration.covariance)
