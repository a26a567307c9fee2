"""Posteriors of touches on a pad."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.pad import COORDINATES
from bayestouch.data.averages import TouchMeans
from bayestouch.data.baseline import Baseline
from bayestouch.data.survey import Survey, survey
from bayestouch.data.touch_source import InMemory, TouchSource
from bayestouch.data.touches import Touches
from bayestouch.pad.corrected import PadEffects
from bayestouch.pad.known_touches import pad_readings
from bayestouch.pad.reading.check import check_pad, corrected_readings
from bayestouch.pad.reading.draws import CHAINS, demands, draw_pad
from bayestouch.pad.reading.effects import as_loads_vary, loads_as_read
from bayestouch.pad.reading.lattice import Lattice, lattice_for
from bayestouch.pad.reading.reader import PadReader
from bayestouch.priors.parameters import Normal, Parameter, Uniform
from bayestouch.progress import Progress
from bayestouch.reading.after_check import widened
from bayestouch.reading.driver import TouchRun, in_blocks
from bayestouch.reading.fault_notes import fault_notes, fault_settings
from bayestouch.reading.faults import SensorCheck
from bayestouch.reading.options import Kept, Options
from bayestouch.results.data import TouchRows
from bayestouch.results.objects import Calibration, TouchPosteriors
from bayestouch.version import __version__


@dataclass(frozen=True, eq=False)
class PadBlocks:
    """A calibrated pad that is ready to read touches. A `bayestouch.reading.driver.BlockReader`.

    Attributes
    ----------
    calibration : Calibration
        Of the pad.
    reader : PadReader
        What the calibration says of readings.
    draws, seed : int
        Draws of each touch in all, and the seed.
    settings, notes
        Of the result.
    effects : PadEffects or None
        Effects that readings and loads are corrected for: loads of the reader are those that act.
    """

    calibration: Calibration
    reader: PadReader
    draws: int
    seed: int
    settings: Mapping[str, str | float]
    notes: tuple[str, ...]
    effects: PadEffects | None = None

    @cached_property
    def lattice(self) -> Lattice:
        """Places that are tried for every touch."""
        return lattice_for(self.reader)

    def read(self, block: TouchMeans, first: int, workers: int | None, progress: Progress | None) -> TouchPosteriors:
        """Posteriors of touches that are numbered from `first`, by so many processes."""
        reader, readings = self.reader, block
        known = reader.touches(readings)
        drawn = draw_pad(
            reader,
            known,
            readings.location,
            self.lattice,
            draws=self.draws,
            seed=self.seed,
            first=first,
            workers=workers,
            progress=progress,
        )
        names = (*COORDINATES[: reader.map.dimensions], "P")
        posterior = {name: np.ascontiguousarray(drawn.draws[..., axis]) for axis, name in enumerate(names)}
        load = self._as_read(readings.load)
        if self.effects is not None:
            calibrated = self.calibration.rows.load
            posterior = as_loads_vary(posterior, self.effects, reader, calibrated, readings.load, self.seed)
        return TouchPosteriors(
            sensor=self.calibration.sensor,
            parameters=self._parameters(),
            posterior=posterior,
            sample_stats=drawn.stats,
            reference={**_by_axis(readings.location), "P": load},
            rows=TouchRows(
                touch=readings.touch,
                location=_by_axis(readings.location),
                radius_mm=readings.indenter_radius_mm,
                load=load,
                observed=readings.readings,
                predicted=drawn.predicted,
                sd=drawn.sd,
                counts=known.counts,
            ),
            settings=self.settings,
            notes=self.notes,
        )

    def _as_read(self, load: FloatArray) -> FloatArray:
        """Loads as a force sensor reads them, of loads as they act."""
        return load if self.effects is None else self.effects.as_read(load)

    def _parameters(self) -> tuple[Parameter, ...]:
        reader, effects = self.reader, self.effects
        low, high = reader.map.low, reader.map.high
        load_unit = str(self.calibration.settings["load_unit"])
        where = [
            Parameter(name, name, name, "mm", Uniform(float(low[k]), float(high[k])), "contact location")
            for k, name in enumerate(COORDINATES[: len(low)])
        ]
        about = "load" if reader.load_measured else "load over that of the calibration"
        prior = Normal(reader.load, reader.load_sd, 0.0)
        if effects is not None and reader.load_measured:
            prior = Normal(*loads_as_read(effects, self.calibration.rows.load), 0.0)
        return (*where, Parameter("P", "P", "P", "N" if load_unit == "N" else "", prior, about))


def pad_run(source: TouchSource, found: Survey, calibration: Calibration, options: Options) -> TouchRun:
    """Make touches on a pad ready to be read.

    In what is read, ``sample_stats["modes"]`` is the number of separate places that a posterior names, and
    ``"reference_level"`` the probability of the smallest region (of highest density) that contains the reference
    location, NaN where it is not known: uniform over touches where posteriors are right. ``rows.predicted`` is the
    posterior mean of the readings. Without measured loads, loads are as uncertain as they varied in the calibration.

    Raises
    ------
    InputError
        The rest reading of the calibration is not that of the table's elements.
    """
    reader = PadReader.from_calibration(calibration, plug_in=options.plug_in)
    baseline = Baseline.of(found.rest, calibration.extra.get("rest_reading"))
    effects = PadEffects.of(calibration)
    draws = options.kept.draws
    settings: dict[str, str | float] = {
        "body": "pad",
        "kernel": calibration.settings["kernel"],
        "samples": reader.samples,
        "plug_in": float(options.plug_in),
        "use_load": float(options.use_load),
        "draws": float(draws),
        "least_ess": demands(-(-draws // CHAINS)).ess_bulk,
        "seed": float(options.seed),
        "version": __version__,
    }

    check: SensorCheck | None = None

    def averaged(piece: Touches) -> TouchMeans:
        corrected = baseline.subtracted(piece)
        if effects is not None:
            corrected = effects.corrected(corrected)
        readings = pad_readings(corrected, reader.map.dimensions, reader.samples)
        return readings if options.use_load else readings.without_load()

    # What effects do may depend on the touches before: then the whole table is read and corrected at once.
    whole = None if effects is None else averaged(source.whole())

    def parts() -> Iterator[TouchMeans]:
        pieces = (averaged(piece) for piece in source.pieces() if piece.in_contact.any())
        every = pieces if whole is None else iter([whole])
        return every if check is None else (corrected_readings(part, check) for part in every)

    notes = (*found.notes, baseline.note, *_notes(reader, found, options.use_load), *_effect_notes(effects))
    # A drift is not taken out of touches, and looks like a changed element: there is nothing to hold it against.
    drifts = effects is not None and bool(effects.listed.drifts)
    if options.check_sensor and drifts:
        notes = (*notes, "the elements are not checked: a drift looks like a fault")
    if options.check_sensor and not drifts:
        check = check_pad(averaged(found.sample) if whole is None else whole, reader)
        reader = replace(reader, noise=widened(reader.noise, check.excess))
        settings |= fault_settings(check)
        notes = (*notes, *fault_notes(check, str(calibration.settings["load_unit"])))
    return TouchRun(
        PadBlocks(calibration, reader, draws, options.seed, settings, tuple(dict.fromkeys(notes)), effects),
        found.n_touches,
        lambda size: in_blocks(parts(), size),
    )


def infer_pad(
    touches: Touches,
    calibration: Calibration,
    *,
    plug_in: bool = False,
    use_load: bool = True,
    draws: int = 1000,
    seed: int = 0,
    progress: Progress | None = None,
) -> TouchPosteriors:
    """Posteriors of location and load of touches on a pad, in memory and by one process; see `bayestouch.infer`."""
    options = Options(plug_in=plug_in, use_load=use_load, kept=Kept(draws), seed=seed)
    source = InMemory(touches)
    options.check(source, calibration)
    run = pad_run(source, survey(source), calibration, options)
    return run.reader.read(next(run.blocks(run.n_touches)), 0, 1, progress)


def _by_axis(location: FloatArray) -> dict[str, FloatArray]:
    return {name: location[:, axis] for axis, name in enumerate(COORDINATES[: location.shape[1]])}


def _notes(reader: PadReader, found: Survey, use_load: bool) -> list[str]:
    missing = found.touches_without_load if use_load else found.n_touches
    if missing < found.n_touches and not reader.load_measured:
        return ["loads are measured but were not in the calibration: they are not used"]
    if reader.load_measured and missing:
        return [
            f"{missing} touches have no measured load: their prior is that of the calibration's loads, "
            f"{reader.load:.3g} ± {reader.load_sd:.2g} N"
        ]
    return []


def _effect_notes(effects: PadEffects | None) -> list[str]:
    if effects is None:
        return []
    corrected = [effect.name for effect in effects.listed.plain if effect.name not in effects.left_to_map]
    notes = (
        [f"readings and loads are corrected for {' and '.join(corrected)}, at its most probable values"]
        if corrected
        else []
    )
    if effects.listed.drifts:
        names = " and ".join(effect.name for effect in effects.listed.drifts)
        notes.append(f"{names} is not taken out of touches that are read: it adds to the noise")
    return notes
