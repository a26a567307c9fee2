"""Basis of a report: the data set, its calibration, and the posteriors of its touches."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bayestouch.array_types import BoolArray, IntArray
from bayestouch.data.averages import TouchMeans
from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import Sensor
from bayestouch.reporting.diagnosed import Diagnosed
from bayestouch.results.data import UNREAD
from bayestouch.results.objects import Calibration, TouchPosteriors


@dataclass(frozen=True, eq=False)
class Evidence:
    """Data and results from which a report is written.

    Attributes
    ----------
    dataset : DataSet
        Sensor and touches, including the calibration touches that were used.
    calibration : Calibration
        Calibration of the sensor.
    posteriors : TouchPosteriors
        Posteriors of the touches, with the force sensor if there is one.
    without_load : TouchPosteriors or None
        Posteriors of the same touches without the force sensor, so that its readings can be a reference; None if no
        load was measured.
    embedded : bool
        True for the simulated finger of the package, which is reported with the tables of the paper.
    truth : mapping
        True values of calibration parameters by name, if the data were simulated in this run.
    seed, draws, plug_in
        Options of the run.
    counterpart : Evidence or None
        The same with posteriors of the other kind: with a plugged-in calibration if this one propagates its
        uncertainty, and the reverse. None if the pages of the body do not compare the two.
    diagnosed : Diagnosed or None
        Diagnosis of the model; None if it was not requested.
    without_reading : int
        Number of touches of the data set that are left out of the posteriors, because they have no reading.
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
    without_reading: int = 0

    @property
    def sensor(self) -> Sensor:
        """Sensor of the report."""
        return self.dataset.sensor

    @property
    def simulated(self) -> bool:
        """True if a text of the source of the data set begins with "simulated", as `bayestouch.simulate` writes it."""
        return any(str(text).lower().startswith("simulated") for text in self.sensor.source.values())

    def means(self, *, each_sample: bool = False) -> TouchMeans:
        """Touches to infer, averaged as in the inference; or every sample in contact as a touch of its own."""
        touches = self.dataset.touches.baseline_corrected(self.calibration.rest_reading)
        contact = touches.select(self._inferred)
        if not each_sample:
            return contact.averaged()
        one_each = np.arange(contact.n_rows), np.zeros(contact.n_rows, dtype=np.int64)
        return contact.with_(touch=one_each[0], sample=one_each[1]).averaged()

    @property
    def touch_of_samples(self) -> IntArray:
        """Number of the touch of each sample of `means` with ``each_sample``."""
        return self.dataset.touches.touch[self._inferred]

    @property
    def _inferred(self) -> BoolArray:
        """Rows of the table that the posteriors are of: in contact, and of a touch that is among them."""
        touches = self.dataset.touches
        return np.asarray(touches.in_contact & np.isin(touches.touch, self.posteriors.rows.touch))

    def of_read_touches(self) -> Evidence:
        """The same without the touches that have no reading: what is said of these is the prior, not the sensor.

        If no touch has a reading, all are kept.
        """
        both = [each for each in (self, self.counterpart) if each is not None]
        results = [each for one in both for each in (one.posteriors, one.without_load) if each is not None]
        read = ~np.any([each.sample_stats.get(UNREAD, np.zeros(len(each))) > 0 for each in results], axis=0)
        if read.all() or not read.any():
            return self

        def part(whole: Evidence) -> Evidence:
            without_load = None if whole.without_load is None else whole.without_load[read]
            return replace(
                whole, posteriors=whole.posteriors[read], without_load=without_load, without_reading=int((~read).sum())
            )

        return replace(part(self), counterpart=None if self.counterpart is None else part(self.counterpart))
