"""What a report rests on: the data set, its calibration, and the touches read with it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from bayestouch.data.averages import TouchMeans
from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import Finger, Sensor
from bayestouch.data.splits import with_calibration
from bayestouch.reporting.diagnosed import Diagnosed, light_diagnosis, saved_diagnosis
from bayestouch.results.objects import Calibration, TouchPosteriors

StepProgress = Callable[[float], None]

# Of the time that a run takes, and so of its progress bar.
_CALIBRATED, _READ = 0.25, 0.5


@dataclass(frozen=True, eq=False)
class Evidence:
    """Everything that is known when a report is written.

    Attributes
    ----------
    dataset : DataSet
        Sensor and touches, with the calibration touches that were used.
    calibration : Calibration
    posteriors : TouchPosteriors
        The touches, read with the force sensor where there is one.
    without_load : TouchPosteriors or None
        The same touches read without the force sensor, so that its readings can serve as a reference; None where
        no load was measured.
    embedded : bool
        Whether this is the simulated finger of the package, reported with the paper's tables.
    truth : mapping
        True values of calibration parameters by name, where the data are simulated by this run.
    seed, draws, plug_in
        Options of the run.
    counterpart : Evidence or None
        The same touches read the other way: plugged in where this is propagated, propagated where this is plugged in
        (fingers only).
    diagnosed : Diagnosed or None
        What the model missed; None where that was not asked for.
    """

    dataset: DataSet
    calibration: Calibration
    posteriors: TouchPosteriors
    without_load: TouchPosteriors | None
    embedded: bool
    truth: Mapping[str, Any]
    seed: int
    draws: int
    plug_in: bool
    counterpart: Evidence | None = None
    diagnosed: Diagnosed | None = None

    @property
    def sensor(self) -> Sensor:
        """The sensor reported on."""
        return self.dataset.sensor

    @property
    def is_finger(self) -> bool:
        """Whether the body is a finger (else a pad)."""
        return isinstance(self.sensor.body, Finger)

    @property
    def simulated(self) -> bool:
        """Whether the data say of themselves that they are simulated."""
        return any("simulated" in str(text).lower() for text in self.sensor.source.values())

    def means(self, *, each_sample: bool = False) -> TouchMeans:
        """Touches to be read, averaged as the inference does; or every sample in contact as a touch of its own."""
        touches = self.dataset.touches.baseline_corrected(self.calibration.rest_reading)
        if not each_sample:
            return touches.averaged()
        contact = touches.select(touches.in_contact)
        one_each = np.arange(contact.n_rows), np.zeros(contact.n_rows, dtype=np.int64)
        return contact.with_(touch=one_each[0], sample=one_each[1]).averaged()


def gather(
    dataset: DataSet | None,
    *,
    seed: int,
    draws: int,
    plug_in: bool,
    diagnosis: bool | Path = False,
    progress: StepProgress | None = None,
) -> Evidence:
    """Calibrate and read the touches.

    Parameters
    ----------
    dataset : DataSet or None
        None for the embedded simulated finger.
    seed, draws, plug_in
        As in `bayestouch.infer`.
    diagnosis : bool or Path
        Whether to search for effects, or the folder of a saved diagnosis.
    progress : callable, optional
        Called with the fraction of the whole report that is done.

    Raises
    ------
    InputError
        As `bayestouch.calibrate` and `bayestouch.infer`.
    """
    from bayestouch.calibration import calibrate
    from bayestouch.inference import infer

    embedded, truth = dataset is None, {}
    if dataset is None:
        from bayestouch.simulation import embedded_dataset

        simulated = embedded_dataset()
        dataset, truth = simulated.dataset, dict(simulated.truth)
    advance = progress or _ignore
    given, dataset = dataset, with_calibration(dataset)
    # Read before the work, so that a wrong folder is told at once.
    saved = saved_diagnosis(diagnosis, dataset) if isinstance(diagnosis, Path) else None
    calibration = calibrate(dataset, seed=seed, progress=lambda done: advance(_CALIBRATED * done))
    advance(_CALIBRATED)
    finger = isinstance(dataset.sensor.body, Finger)
    runs = 4 if finger else 2

    def read(exact: bool, use_load: bool, run: int) -> TouchPosteriors:
        return infer(
            dataset.touches,
            calibration,
            plug_in=exact,
            use_load=use_load,
            draws=draws,
            seed=seed,
            progress=lambda done: advance(_CALIBRATED + (_READ - _CALIBRATED) * (run + done) / runs),
        )

    def both(exact: bool, run: int) -> tuple[TouchPosteriors, TouchPosteriors | None]:
        posteriors = read(exact, True, run)
        measured = np.isfinite(posteriors.rows.load).any()
        return posteriors, read(exact, False, run + 1) if measured else None

    seen, unseen = both(plug_in, 0)
    evidence = Evidence(dataset, calibration, seen, unseen, embedded, truth, seed, draws, plug_in)
    if finger:
        seen, unseen = both(not plug_in, 2)
        other = replace(evidence, posteriors=seen, without_load=unseen, plug_in=not plug_in)
        evidence = replace(evidence, counterpart=other)
    advance(_READ)
    if diagnosis is not False:
        # The search parts the touches in its own way, as `bayestouch diagnose` does: a scan of a pad by blocks in time.
        return replace(evidence, diagnosed=saved if saved is not None else light_diagnosis(given, seed))
    return evidence


def _ignore(fraction: float) -> None:
    """Progress that nobody asked for."""
