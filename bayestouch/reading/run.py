"""Preparation of touches and inference block by block; the same for every body, with and without effects."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.data.baseline import Baseline, RestTally
from bayestouch.data.survey import Survey
from bayestouch.data.touch_source import TouchSource
from bayestouch.effects.readout import RestOffset
from bayestouch.errors import few
from bayestouch.output.text import those_with
from bayestouch.reading.check import check_sensor
from bayestouch.reading.draws import DrawPlan, draw_blocks
from bayestouch.reading.driver import TouchRun, in_blocks
from bayestouch.reading.fault_notes import fault_notes, fault_settings
from bayestouch.reading.options import Options
from bayestouch.reading.requested import requested_groups
from bayestouch.reading.touch_reader import Drawn, TouchReader
from bayestouch.results.keys import effect_names
from bayestouch.results.objects import Calibration, TouchPosteriors
from bayestouch.version import __version__

#: Note of touches that are read with the offsets of the calibration.
OWN_OFFSETS = "the calibration has the offset of each element (rest_offset): readings are taken as they are"


@dataclass(frozen=True, eq=False)
class ReadyReader:
    """A calibrated sensor that can infer blocks of touches. A `bayestouch.reading.driver.BlockReader`.

    Attributes
    ----------
    calibration : Calibration
        The calibrated sensor.
    reader : TouchReader
        Functions of this body, without the columns that the check of the sensor left out.
    plan : DrawPlan
        Settings of the sampler.
    settings, notes
        Settings and notes of the result.
    thin, groups
        Groups that are written on request, for every `thin`-th draw of each chain.
    """

    calibration: Calibration
    reader: TouchReader
    plan: DrawPlan
    settings: Mapping[str, str | float]
    notes: tuple[str, ...]
    thin: int = 1
    groups: tuple[str, ...] = ()

    def read(self, block: Any, first: int) -> TouchPosteriors:
        """Posteriors of a block of touches that are numbered from `first`, computed by this process."""
        t = block.n_touches
        return next(self.read_blocks(iter([(first, block)]), t, t, 1, None))[1]

    def read_blocks(
        self,
        blocks: Iterator[tuple[int, Any]],
        n_touches: int,
        largest: int,
        workers: int | None,
        progress: Callable[[int], None] | None,
    ) -> Iterator[tuple[int, TouchPosteriors]]:
        """Posteriors of blocks of touches, computed by `workers` processes; see `bayestouch.reading.driver`."""
        reader = self.reader
        drawn_blocks = draw_blocks(
            reader.sampler, blocks, reader.unknown, self.plan, n_touches, largest, workers, progress
        )
        for first, block, drawn in drawn_blocks:
            yield first, self._posteriors(first, block, drawn)

    def _posteriors(self, first: int, block: Any, drawn: Drawn) -> TouchPosteriors:
        estimates = self.reader.estimates(block, drawn, first)
        groups = {}
        if self.groups and estimates.model is not None:
            kept = {name: values[:, :: self.thin] for name, values in estimates.posterior.items()}
            groups = requested_groups(estimates.model, kept, self.groups, self.plan.seed, first)
        return TouchPosteriors(
            sensor=self.calibration.sensor,
            parameters=self.reader.parameters,
            posterior=estimates.posterior,
            sample_stats=estimates.sample_stats,
            reference=estimates.reference,
            rows=estimates.rows,
            settings=self.settings,
            notes=self.notes,
            tips=estimates.tips,
            groups=groups,
        )


def touch_run(
    reader: TouchReader, source: TouchSource, found: Survey, calibration: Calibration, options: Options
) -> TouchRun:
    """Touches prepared for inference: rest reading subtracted, sensor checked, settings and notes complete.

    Parameters
    ----------
    reader : TouchReader
        The calibrated sensor.
    source, found : TouchSource, Survey
        The touches, and what a first pass over them found.
    calibration, options : Calibration, Options
        The calibration and the options from which `reader` was made.

    Raises
    ------
    InputError
        If the rest reading of the calibration belongs to other elements than the table.
    """
    variance = calibration.noise.tactile_sd**2
    baseline = _baseline(found.rest, calibration, variance)
    # If a touch depends on other touches, the whole table is in memory and is prepared at once.
    whole = reader.average(baseline.subtracted(source.whole())) if reader.needs_whole_table else None
    block = None if whole is None else reader.ready(whole)
    notes = [*found.notes, baseline.note, *_without_reading(found), *reader.notes(found, whole)]
    check = None
    if options.check_sensor and reader.unchecked:
        notes.append(reader.unchecked)
    elif options.check_sensor:
        touches = reader.average(baseline.subtracted(found.sample)) if whole is None else whole
        looked_at = reader.ready(touches) if block is None else block
        shared = baseline.shared_variance
        rest_variance = None if shared is None else np.nan_to_num(variance) * shared
        check = check_sensor(reader, touches, looked_at, source.n_elements, rest_variance)
        notes += fault_notes(check, reader.load_unit)
        if not check.sound:
            reader = reader.without(check)
            block = None if whole is None else reader.ready(whole)
    draws = options.kept.draws
    plan = DrawPlan(draws, options.seed, options.method, min(400.0, reader.least_share * draws))
    settings: dict[str, str | float] = {
        "body": calibration.settings["body"],
        **reader.settings,
        "plug_in": float(options.plug_in),
        "use_load": float(options.use_load),
        **({} if check is None else fault_settings(check)),
        "draws": float(draws),
        "least_ess": plan.least_ess,
        "largest_rhat": plan.largest_rhat,
        "seed": float(options.seed),
        "version": __version__,
    }

    def parts() -> Iterator[Any]:
        if block is not None:
            return iter([block])
        pieces = (baseline.subtracted(piece) for piece in source.pieces() if piece.in_contact.any())
        return (reader.ready(reader.average(piece)) for piece in pieces)

    count = found.n_rows if options.each_sample else found.n_touches
    return TouchRun(
        ReadyReader(
            calibration, reader, plan, settings, tuple(dict.fromkeys(notes)), options.kept.thin, options.groups
        ),
        count if block is None else block.n_touches,
        lambda size: in_blocks(parts(), size),
    )


def _baseline(rest: RestTally, calibration: Calibration, variance: FloatArray) -> Baseline:
    """What is subtracted from the readings; nothing if the calibration has the offset of each element as an effect."""
    if RestOffset.name in effect_names(calibration.settings):
        return Baseline(None, False, OWN_OFFSETS)
    # Each touch is read by itself, with the whole noise of the rest reading.
    before = calibration.rest_reads
    return Baseline.of(rest, calibration.rest_reading, each=True, before=before, variance=variance)


def _without_reading(found: Survey) -> tuple[str, ...]:
    """Note that names touches without a reading; empty if there are none."""
    numbers = found.without_reading
    if not numbers:
        return ()
    who, names = those_with(len(numbers), "touch"), few([str(number) for number in numbers])
    return (f"{who} no reading (touch {names}): nothing but a measured load is known, and the grade is 0",)
