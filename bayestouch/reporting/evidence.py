"""What a report rests on: the data set, its calibration, and the touches read with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bayestouch.data.averages import TouchMeans
from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import Sensor
from bayestouch.reporting.diagnosed import Diagnosed
from bayestouch.results.objects import Calibration, TouchPosteriors


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
        The same touches read the other way: plugged in where this is propagated, propagated where this is plugged in;
        None where the body's pages do not compare them.
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
