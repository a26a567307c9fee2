"""Posteriors of touches on a finger."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.noise import Noise
from bayestouch.contact import composite_radius
from bayestouch.data.averages import TouchMeans
from bayestouch.data.baseline import Baseline
from bayestouch.data.survey import Survey
from bayestouch.data.touch_source import TouchSource
from bayestouch.finger.calibration import finger_chain
from bayestouch.finger.chain_with_effects import ChainWithEffects
from bayestouch.finger.reading.check import check_finger
from bayestouch.finger.reading.covariance import CalibrationCovariance
from bayestouch.finger.reading.draws import DRAWN, TIPS, DrawTask, draw_all
from bayestouch.finger.reading.reader import CalibratedFinger, IndenterPriors, TouchContext
from bayestouch.finger.reading.reading_table import ReadingTable
from bayestouch.finger.reading.rows import FingerTouches, Intake, load_notes
from bayestouch.finger.reading.with_effects import touches_with_effects
from bayestouch.priors.indenters import UniformRadius
from bayestouch.priors.parameters import Parameter, Uniform
from bayestouch.priors.radius import RadiusOfTips
from bayestouch.progress import Progress
from bayestouch.reading.after_check import widened
from bayestouch.reading.driver import TouchRun, in_blocks
from bayestouch.reading.fault_notes import fault_notes, fault_settings
from bayestouch.reading.options import Options
from bayestouch.results.data import TouchRows
from bayestouch.results.objects import Calibration, TouchPosteriors
from bayestouch.results.tips import TipProbabilities
from bayestouch.version import __version__

ReadingCovariance = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]


@dataclass(frozen=True, eq=False)
class FingerBlocks:
    """A calibrated finger that is ready to read touches. A `bayestouch.reading.driver.BlockReader`.

    Attributes
    ----------
    calibration : Calibration
        The calibrated sensor.
    task : DrawTask
        Sensor, priors and how to draw.
    effects_chain : ChainWithEffects or None
        Effects of the calibration.
    settings, notes
        Of the result.
    """

    calibration: Calibration
    task: DrawTask
    effects_chain: ChainWithEffects | None
    settings: Mapping[str, str | float]
    notes: tuple[str, ...]

    def read(self, block: FingerTouches, first: int, workers: int | None, progress: Progress | None) -> TouchPosteriors:
        """Posteriors of touches that are numbered from `first`, by so many processes."""
        means, readings = block.means, block.readings
        drawn = draw_all(self.task, readings, workers, progress, first)
        priors, chain = self.task.priors, self.task.chain
        log_probability = drawn.pop(TIPS, None)
        draws = {name: drawn[name] for name in DRAWN}
        return TouchPosteriors(
            sensor=self.calibration.sensor,
            parameters=_parameters(priors),
            posterior=draws,
            sample_stats={name: value for name, value in drawn.items() if name not in draws},
            reference=_reference(means, chain),
            rows=_rows(means, chain, self.task.noise, draws, readings.context),
            settings=self.settings,
            notes=self.notes,
            tips=_tips(priors, log_probability),
        )


def finger_run(source: TouchSource, found: Survey, calibration: Calibration, options: Options) -> TouchRun:
    """Make touches on a finger ready to be read.

    Effects of a calibration may depend on what was before a touch: they want the whole table in memory.
    """
    baseline = Baseline.of(found.rest, calibration.rest_reading)
    typical = float(calibration.settings["typical_load"])
    intake = Intake(calibration, baseline, options)
    effects_chain = ChainWithEffects.of(calibration) if calibration.has_effects else None
    chain, table, covariance = _model(calibration, typical, effects_chain)
    priors = IndenterPriors.of(chain, typical, options.indenter)
    noise, check = calibration.noise, None
    notes = load_notes(found, options)
    n_touches = found.n_rows if options.each_sample else found.n_touches
    if effects_chain is not None:
        assert isinstance(chain, FingerChain)
        corrected = baseline.subtracted(source.whole())
        whole, noise, check, more = touches_with_effects(
            corrected, calibration, options, effects_chain, chain, table, covariance, priors
        )
        notes, n_touches = (*notes, *more), whole.n_touches
    elif options.check_sensor:
        check = check_finger(intake(found.sample).readings, chain, table, noise, covariance, typical)
        intake, noise = replace(intake, check=check), widened(noise, check.excess)
        notes += fault_notes(check, "N/m")
    task = DrawTask(
        chain=chain,
        priors=priors,
        table=table,
        noise=noise,
        reading_covariance=None if options.plug_in else covariance,
        method=options.method,
        draws=options.kept.draws,
        seed=options.seed,
        least_ess=min(400.0, 0.5 * options.kept.draws),
    )
    settings: dict[str, str | float] = {
        "body": "finger",
        "contact": chain.contact,
        "plug_in": float(options.plug_in),
        "use_load": float(options.use_load),
        **({} if check is None else fault_settings(check)),
        "each_sample": float(options.each_sample),
        "method": options.method,
        "indenter": str(options.indenter or UniformRadius()),
        "draws": float(options.kept.draws),
        "least_ess": task.least_ess,
        "seed": float(options.seed),
        "version": __version__,
    }
    notes = tuple(dict.fromkeys((*found.notes, baseline.note, *notes)))

    def parts() -> Iterator[FingerTouches]:
        return map(intake, source.pieces()) if effects_chain is None else iter([whole])

    return TouchRun(
        FingerBlocks(calibration, task, effects_chain, settings, notes),
        n_touches,
        lambda size: in_blocks(parts(), size),
    )


def _model(
    calibration: Calibration, typical: float, effects_chain: ChainWithEffects | None = None
) -> tuple[CalibratedFinger, ReadingTable, ReadingCovariance]:
    """Calibrated finger, its reading table, and what its calibration leaves uncertain."""
    elastic = finger_chain(calibration) if effects_chain is None else effects_chain.model.chain(effects_chain.vector)
    ends = IndenterPriors.of(elastic, typical).location.support
    if calibration.has_identified_map:
        from bayestouch.finger.empirical.map import EmpiricalCalibration
        from bayestouch.finger.empirical.reading import reading_table

        empirical = EmpiricalCalibration.from_arrays(calibration.extra, elastic, calibration.noise)
        return empirical.chain, reading_table(empirical.chain, *ends), empirical.reading_covariance
    return elastic, ReadingTable.of(elastic, *ends), CalibrationCovariance(elastic, calibration.covariance)


def _reference(means: TouchMeans, chain: CalibratedFinger) -> dict[str, FloatArray]:
    radius = means.indenter_radius_mm
    angle = means.angle_deg if means.angle_deg is not None else np.full(means.n_touches, np.nan)
    return {
        "r_c": radius,
        "R": composite_radius(np.where(np.isnan(radius), 0.0, radius), chain.outer_radius_mm)
        + np.where(np.isnan(radius), np.nan, 0.0),
        "theta_c": angle,
        "P": means.load,
    }


def _rows(
    means: TouchMeans,
    chain: CalibratedFinger,
    noise: Noise,
    draws: dict[str, FloatArray],
    context: TouchContext | None,
) -> TouchRows:
    centre = {name: draws[name].mean(axis=(0, 1)) for name in ("R", "theta_c", "P")}
    angle = np.radians(centre["theta_c"])
    predicted = chain.predict(centre["R"], angle, centre["P"])
    if context is not None:
        predicted = np.asarray(context.readings(predicted, centre["R"], angle, centre["P"], np.arange(len(angle))))
    counts = np.where(np.isnan(means.readings), 0, means.counts)
    return TouchRows(
        touch=means.touch,
        location={"theta_c": means.angle_deg if means.angle_deg is not None else np.full(means.n_touches, np.nan)},
        radius_mm=means.indenter_radius_mm,
        load=means.load,
        observed=means.readings,
        predicted=predicted,
        sd=noise.mean_sd(counts, predicted),
        counts=counts,
    )


def _tips(priors: IndenterPriors, log_probability: FloatArray | None) -> TipProbabilities | None:
    if log_probability is None or not isinstance(priors.radius, RadiusOfTips):
        return None
    return TipProbabilities.of(priors.radius, log_probability)


def _parameters(priors: IndenterPriors) -> tuple[Parameter, ...]:
    low, high = np.degrees(priors.location.support)
    return (
        Parameter("R", "R", "R", "mm", priors.radius, "composite radius, 1/R = 1/r_b + 1/r_c"),
        Parameter("theta_c", "θ_c", r"\theta_c", "degree", Uniform(float(low), float(high)), "contact location"),
        Parameter("P", "P", "P", "N/m", priors.load, "line load"),
    )
