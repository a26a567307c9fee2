"""`PadTouchReader`: inference of touches on a pad from the rows of a touch table."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray, IndexArray, IntArray
from bayestouch.chain.noise import Noise
from bayestouch.chain.pad import COORDINATES
from bayestouch.data.averages import TouchMeans
from bayestouch.data.survey import Survey
from bayestouch.data.touches import Touches
from bayestouch.output.text import those_with
from bayestouch.pad.corrected import PadEffects
from bayestouch.pad.effect_changes import CorrectedMeans, corrected_means
from bayestouch.pad.known_touches import pad_readings
from bayestouch.pad.reading.draws import PREDICTED, PadSampler, coordinates
from bayestouch.pad.reading.effects import true_load_prior, with_true_loads
from bayestouch.pad.reading.felt_load import acting_loads
from bayestouch.pad.reading.likelihood import PadTouchModel
from bayestouch.pad.reading.misfit import PadMisfit
from bayestouch.pad.reading.reader import PadReader
from bayestouch.priors.parameters import Normal, Parameter, Uniform
from bayestouch.reading.ends import graded, is_at_the_end
from bayestouch.reading.faults import SensorCheck
from bayestouch.reading.options import Options
from bayestouch.reading.touch_reader import Drawn, Estimates
from bayestouch.results.data import TouchRows
from bayestouch.results.objects import Calibration
from bayestouch.results.units import load_unit

EXACT = ", at its most probable values"


@dataclass(frozen=True, eq=False)
class AveragedTouches:
    """Means of touches, corrected for effects, and the rows of the table behind them, minus the rest reading."""

    means: TouchMeans
    piece: Touches


@dataclass(frozen=True, eq=False)
class PadTouchReader:
    """A calibrated pad that infers touches. A `bayestouch.reading.touch_reader.TouchReader`.

    In its results, ``sample_stats["modes"]`` is the number of separate locations in a posterior.
    ``"reference_level"`` is the probability of the smallest region of highest density that contains the reference
    location (NaN if unknown); over many touches it is uniformly distributed if posteriors are right. ``rows.predicted``
    is the posterior mean of the readings. The prior of a load that is not measured has the mean and the standard
    deviation of the loads of the calibration, see `bayestouch.pad.known_touches.prior_of_loads`.

    Attributes
    ----------
    options : Options
        Options of the inference.
    sampler : PadSampler
        Draws touches, with felt loads.
    kernel, load_unit : str
        Kernel of the calibration, and the unit of its loads: none where they were not measured.
    calibrated_load : (n,) array
        Acting loads of the calibration.
    effects : PadEffects or None
        Effects for which readings and loads are corrected.
    check : SensorCheck or None
        Faults that are left out, from the check of the sensor.
    calibrated_noise : Noise or None
        Noise of the calibration, if the check widened it.
    """

    options: Options
    sampler: PadSampler
    kernel: str
    load_unit: str
    calibrated_load: FloatArray
    effects: PadEffects | None
    check: SensorCheck | None = None
    calibrated_noise: Noise | None = None

    least_share = 0.4
    drifts_are_estimated = False

    @classmethod
    def from_calibration(cls, calibration: Calibration, options: Options) -> PadTouchReader:
        """Reader from a calibration of a pad.

        Raises
        ------
        InputError
            The calibration is not that of a pad.
        """
        settings = calibration.settings
        sampler = PadSampler.of(PadReader.from_calibration(calibration, plug_in=options.plug_in))
        unit = load_unit(calibration)
        return cls(options, sampler, str(settings["kernel"]), unit, calibration.rows.load, sampler.reader.effects)

    @property
    def needs_whole_table(self) -> bool:
        """True if an effect depends on earlier touches or samples."""
        return self.effects is not None and any(effect.needs_samples for effect in self.effects.listed.plain)

    @property
    def unchecked(self) -> str:
        """Reason to skip the check, or ``""``: readings are not corrected for drifts, and a drift resembles a fault."""
        drifts = self.effects is not None and bool(self.effects.listed.drifts)
        return "the elements are not checked: a drift looks like a fault" if drifts else ""

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Unknowns of a touch: x, y (mm) and P."""
        reader = self.sampler.reader
        low, high = reader.map.low, reader.map.high
        where = [
            Parameter(name, name, name, "mm", Uniform(float(low[k]), float(high[k])), "contact location")
            for k, name in enumerate(COORDINATES[: len(low)])
        ]
        about = "load over that of the calibration"
        if reader.load_measured:
            about = "load (the prior is of a load that is not measured; that of a measured one is flat)"
        prior = Normal(reader.load, reader.load_sd, 0.0)
        if self.effects is not None and reader.load_measured:
            prior = Normal(*true_load_prior(self.effects, self.calibrated_load), 0.0)
        return (*where, Parameter("P", "P", "P", self.load_unit, prior, about))

    @property
    def settings(self) -> dict[str, str | float]:
        """Kernel, and the samples of a touch that are used."""
        return {"kernel": self.kernel, "samples": self.sampler.reader.samples}

    def average(self, piece: Touches) -> AveragedTouches:
        """Means of the touches in a piece of the table, from which the rest reading is subtracted."""
        return AveragedTouches(self._means(piece), piece)

    def _means(self, piece: Touches) -> TouchMeans:
        """Mean readings of the touches in a piece of the table, corrected for effects."""
        reader = self.sampler.reader
        dimensions, exact = reader.map.dimensions, not reader.map.n_causes
        readings = (
            pad_readings(piece, dimensions, reader.samples)
            if self.effects is None
            else corrected_means(self.effects, piece, dimensions, reader.samples, exact=exact)
        )
        # A measured load is no share of the usual load: it is of no use if the calibration has no measured loads.
        readings = readings if self.options.use_load and reader.load_measured else readings.without_load()
        if not isinstance(readings, CorrectedMeans) or readings.few is None:
            return readings

        def in_order(order: IndexArray) -> TouchMeans:
            return self._means(piece.with_wires(order))

        def expected(means: TouchMeans) -> tuple[FloatArray, FloatArray]:
            sampler, order = self._as_calibrated, np.arange(means.n_elements)
            # What few samples say has all noise of a reading, also that of all elements.
            fits = PadMisfit(sampler.reader.apart, sampler.lattice, means, order, in_order)
            return fits(np.zeros(means.n_elements + 1, dtype=bool)).expected

        return readings.few.weighed(replace(readings, few=None), expected)

    @cached_property
    def _as_calibrated(self) -> PadSampler:
        """The sampler before the check of the sensor widened its noise: the check does not change the means."""
        if self.calibrated_noise is None:
            return self.sampler
        return PadSampler.of(replace(self.sampler.reader, noise=self.calibrated_noise))

    def ready(self, touches: AveragedTouches) -> TouchMeans:
        """The touches without the columns that the check leaves out."""
        check = self.check
        if check is None:
            return touches.means
        # Effects differ between elements: readings are exchanged before they are corrected.
        means = self._means(touches.piece.with_wires(check.order)) if check.swapped else touches.means
        means = check.without_faulty(means)
        return means.without_load() if check.force_left_out else means

    def fitted(
        self, touches: AveragedTouches, block: TouchMeans, some: IntArray, rest_variance: FloatArray | None = None
    ) -> PadMisfit:
        """Fits of some of the touches, for the check of the sensor."""

        def in_order(order: IndexArray) -> TouchMeans:
            return self._means(touches.piece.with_wires(order)).select(some)

        order = np.arange(block.n_elements)
        sampler = self.sampler
        return PadMisfit(sampler.reader, sampler.lattice, block.select(some), order, in_order, rest_variance)

    def without(self, check: SensorCheck) -> PadTouchReader:
        """The reader without the faulty columns of a check."""
        reader = self.sampler.reader
        if check.excess == 1:
            return replace(self, check=check)
        wider = replace(reader, noise=reader.noise.widened(check.excess))
        return replace(
            self, check=check, sampler=PadSampler.of(wider), calibrated_noise=self.calibrated_noise or reader.noise
        )

    def unknown(self, block: TouchMeans) -> TouchMeans:
        """The touches; their reference locations are used only for ``reference_level``."""
        return block

    def estimates(self, block: TouchMeans, drawn: Drawn, first: int) -> Estimates:
        """Draws of x, y and P, and posterior means of the readings; grade 0 beyond the calibrated region."""
        reader, effects = self.sampler.reader, self.effects
        posterior = {name: drawn.pop(name) for name in coordinates(reader)}
        predicted, sd = (np.ascontiguousarray(drawn.pop(name).T) for name in PREDICTED)
        stats = {**drawn, "second_round": (drawn["round"] > 1).astype(float)}
        del stats["round"]
        touches = reader.touches(block)
        stats = graded(stats, self._beyond_region(posterior), touches.counts)
        load = block.load
        if isinstance(block, CorrectedMeans):
            load = np.where(np.isnan(load), np.nan, block.load_as_read)
        numbers, seed = first + np.arange(block.n_touches), self.options.seed
        posterior["P"] = acting_loads(posterior["P"], touches, numbers, seed)
        if effects is not None:
            posterior = with_true_loads(posterior, effects, reader, self.calibrated_load, block.load, numbers, seed)
        location = {name: block.location[:, axis] for axis, name in enumerate(COORDINATES[: block.location.shape[1]])}
        rows = TouchRows(
            touch=block.touch,
            location=location,
            radius_mm=block.indenter_radius_mm,
            load=load,
            observed=block.readings,
            predicted=predicted,
            sd=sd,
            counts=touches.counts,
            samples=block.samples,
            load_reads=block.reads_of_load,
        )
        model = PadTouchModel(reader, touches, self.parameters, block.load, load, effects)
        return Estimates(posterior, stats, {**location, "P": load}, rows, model=model)

    def _beyond_region(self, draws: Drawn) -> BoolArray:
        """Whether an end of the calibrated region cuts off the posterior of a touch, (t,)."""
        region = self.sampler.reader.map
        ends = [
            is_at_the_end(distance, float(high - low))
            for name, low, high in zip(COORDINATES, region.low, region.high, strict=False)
            for distance in (draws[name] - low, high - draws[name])
        ]
        return np.asarray(np.any(ends, axis=0))

    def notes(self, found: Survey, whole: AveragedTouches | None) -> tuple[str, ...]:
        """Notes on the use of loads, on assumed times and on the effects that are corrected."""
        time = "" if whole is None or self.effects is None else self.effects.clock(whole.piece).note
        return (*self._load_notes(found), *filter(None, [time]), *self._effect_notes())

    def _load_notes(self, found: Survey) -> list[str]:
        reader, missing = self.sampler.reader, found.touches_without_load
        prior = f"the prior of a load is that of the calibration's loads, {reader.load:.3g} ± {reader.load_sd:.2g} N"
        if not self.options.use_load:
            return [f"measured loads are not used: {prior}"] if reader.load_measured else []
        if missing < found.n_touches and not reader.load_measured:
            return ["loads are measured but were not in the calibration: they are not used"]
        return [f"{those_with(missing, 'touch')} no measured load: {prior}"] if reader.load_measured and missing else []

    def _effect_notes(self) -> list[str]:
        effects = self.effects
        if effects is None:
            return []
        corrected = [effect.name for effect in effects.corrected_for]
        known = self.sampler.reader.map.n_causes > 0
        notes = (
            [f"readings and loads are corrected for {' and '.join(corrected)}" + ("" if known else EXACT)]
            if corrected
            else []
        )
        if effects.listed.drifts:
            names = " and ".join(effect.name for effect in effects.listed.drifts)
            notes.append(f"{names} is not corrected in touches that are read: it adds to the noise")
        return notes
