"""`Reader`: posterior of one touch at a time, fast enough for a control loop."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.data.arrays import as_floats
from bayestouch.data.baseline import combined_reads
from bayestouch.data.touch_columns import LARGEST, LARGEST_TIME
from bayestouch.effects.readout import RestOffset
from bayestouch.errors import InputError, about, shown
from bayestouch.live.files import load_setup, save_setup
from bayestouch.model.body import body_of
from bayestouch.output.summary import Summarised
from bayestouch.output.text import plural
from bayestouch.priors.indenters import IndenterPrior, is_indenter_prior
from bayestouch.reading.live import HeldTouch, LiveBody, LiveTouch
from bayestouch.reading.options import Options
from bayestouch.results.keys import effect_names
from bayestouch.results.objects import Calibration

#: Names of the rest reading and of its number of reads among the tables of a saved reader.
REST, READS = "rest_reading", "rest_reads"


class Reader(Summarised):
    """Reads touches one at a time, or sample by sample while a touch is held.

    The density of a touch is that of `bayestouch.infer` with ``check_sensor=False``. It is integrated by deterministic
    quadrature instead of sampling: no random numbers, and less than a millisecond for a finger. A result that this
    quadrature cannot vouch for has `LiveTouch.flags`.

    Parameters
    ----------
    calibration : Calibration
        The calibrated sensor.
    indenter : IndenterPrior, optional
        Prior over indenters, as in `bayestouch.infer`. Fingers only.
    plug_in : bool
        Assume that the calibration is exact.
    use_load : bool
        Whether measured loads are used.

    Attributes
    ----------
    calibration : Calibration
        The calibrated sensor.
    rest_reading : (m,) array
        Readings without contact, which are subtracted: those of the calibration, until `rest` gives others.

    Raises
    ------
    InputError
        If an option does not suit the sensor.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> dataset = bayestouch.simulate(design, seed=3).dataset
    >>> calibration = bayestouch.calibrate(dataset, draws=200)
    >>> reader = bayestouch.Reader(calibration)
    >>> table = dataset.touches
    >>> for sample in range(20):  # the samples of the first touch, one after another
    ...     touch = reader.update(table.readings[sample], load=table.load[sample])
    >>> touch.samples, float(touch.mean[1].round())  # location, degree
    (20, -20.0)
    >>> reader.new_touch()  # the next sample belongs to another touch
    """

    def __init__(
        self,
        calibration: Calibration,
        *,
        indenter: IndenterPrior | None = None,
        plug_in: bool = False,
        use_load: bool = True,
    ) -> None:
        self._set(calibration, None, indenter, plug_in, use_load)

    def _set(
        self,
        calibration: Calibration,
        arrays: Mapping[str, FloatArray] | None,
        indenter: IndenterPrior | None,
        plug_in: bool,
        use_load: bool,
    ) -> None:
        if not isinstance(calibration, Calibration):
            raise InputError(f"calibration: expected a calibrated sensor, got {shown(calibration)}")
        if indenter is not None and not is_indenter_prior(indenter):
            got = shown(indenter)
            raise InputError(f"indenter: expected a prior over indenters such as KnownTips((0, 2)), got {got}")
        options = Options(indenter=indenter, plug_in=plug_in, use_load=use_load, check_sensor=False)
        body = body_of(calibration.sensor)
        body.own(options.of_some_bodies)
        self.calibration = calibration
        self._options = options
        self._body: LiveBody = body.live(calibration, options, arrays)
        rest = calibration.rest_reading
        self.rest_reading: FloatArray = np.zeros(self._body.n_elements) if rest is None else np.nan_to_num(rest)
        # Number of raw reads behind it; None for that of the calibration, which has no noise of its own.
        self._rest_reads: FloatArray | None = None
        self.restart()

    def summary_lines(self) -> list[str]:
        """Lines that ``repr`` shows."""
        samples = 0 if self._held is None else self._held.samples
        held = f"a touch of {plural(samples, 'sample')} is held" if samples else "no touch is held"
        return [f"Reader of a {self.calibration.sensor.body.kind}, {plural(self._body.n_elements, 'element')}", held]

    def restart(self) -> None:
        """Forget all touches: the next sample is the first one of a new stream."""
        self._stream = self._body.stream()
        self._held: HeldTouch | None = None
        self._near: Any = None
        self._time_s = -np.inf

    def read(
        self, values: ArrayLike, load: float | None = None, *, reads: int = 1, time_s: float | None = None
    ) -> LiveTouch:
        """Posterior of one touch from its mean readings.

        Parameters
        ----------
        values : (m,) array_like
            Readings of the elements, in the unit of the calibration; the rest reading is subtracted. NaN if missing.
        load : float, optional
            Measured load, N/m on a finger, N on a pad.
        reads : int
            Number of raw readings of which `values` and `load` are means.
        time_s : float, optional
            Time, s; needed if the calibration has effects that depend on time.

        Returns
        -------
        LiveTouch

        Raises
        ------
        InputError
            If the number of elements is wrong, no reading is present, or a number is impossible.
        """
        sample = self._checked(values, load, reads, time_s)
        self.new_touch()
        return self._added(*sample)

    def update(
        self, values: ArrayLike, load: float | None = None, *, reads: int = 1, time_s: float | None = None
    ) -> LiveTouch:
        """Posterior of the held touch after one more sample; parameters as `read`.

        It equals that of all samples of the touch together: it depends on their sums alone. A pad whose calibration has
        creep or memory uses one sample of a touch, the first or the last, as `bayestouch.infer` does.
        """
        return self._added(*self._checked(values, load, reads, time_s))

    def new_touch(self) -> None:
        """End the held touch, if there is one: the next sample belongs to another touch."""
        if self._held is not None:
            if self._stream is not None:
                self._stream.end()
            self._held = self._near = None

    def rest(self, values: ArrayLike) -> None:
        """Use these readings without contact, (m,) or (samples, m), as the rest reading from now on.

        The noise of their mean counts as noise of each touch, as in `bayestouch.infer`: one reading at rest has as much
        noise as one reading of a touch.

        Raises
        ------
        InputError
            If the number of elements is wrong, or a number is infinite or too large; a missing one is NaN. Or if the
            calibration has the offset of each element as an effect.
        """
        if self._has_offsets:
            raise InputError(f"rest reading: the calibration has the offset of each element ({RestOffset.name})")
        samples = np.atleast_2d(_numbers("rest reading", values))
        if samples.shape[1:] != (self._body.n_elements,) or not len(samples):
            raise InputError(f"rest reading: expected {self._body.n_elements} elements, got shape {samples.shape}")
        _require_not_huge("rest reading", samples)
        here = ~np.isnan(samples)
        total, count = np.where(here, samples, 0.0).sum(axis=0), here.sum(axis=0)
        self.rest_reading = np.where(count > 0, total / np.maximum(count, 1), self.rest_reading)
        before = np.full(len(count), np.inf) if self._rest_reads is None else self._rest_reads
        self._rest_reads = np.where(count > 0, combined_reads(count, self.calibration.rest_reads), before)

    def save(self, path: str | Path) -> None:
        """Write the calibration, the rest reading and the tables of this reader to one file.

        `bayestouch.load` opens it as a calibration. The touches of the stream are not saved.

        Raises
        ------
        InputError
            If the file cannot be written.
        """
        rest = {} if self._has_offsets else {REST: self.rest_reading}
        if self._rest_reads is not None:
            rest |= {READS: self._rest_reads}
        save_setup(path, self.calibration, {**self._body.arrays(), **rest})

    @classmethod
    def load(
        cls,
        path: str | Path,
        *,
        indenter: IndenterPrior | None = None,
        plug_in: bool = False,
        use_load: bool = True,
    ) -> Self:
        """Reader from a file that `save` wrote, or from a calibration file; the options are those of `Reader`.

        Raises
        ------
        InputError
            If the file is missing, damaged, or holds no calibration, or an option does not suit the sensor.
        """
        reader = cls.__new__(cls)
        calibration, arrays = load_setup(path)
        rest, reads = (None if arrays is None else arrays.pop(name, None) for name in (REST, READS))
        with about(path):
            reader._set(calibration, arrays, indenter, plug_in, use_load)
            if rest is not None:
                reader.rest(rest)
            reader._rest_reads = reads
        return reader

    @property
    def _has_offsets(self) -> bool:
        """Whether the calibration has the offset of each element as an effect."""
        return RestOffset.name in effect_names(self.calibration.settings)

    def _added(self, sample: FloatArray, pressed: float, reads: float, now: float) -> LiveTouch:
        """Posterior of the held touch, or of a new one, after a sample that was checked."""
        if self._held is None:
            self._held = HeldTouch.none(self._body.n_elements, self._rest_reads)
            if self._stream is not None:
                self._stream.begin(now)
        if self._stream is None:
            self._held = self._held.after(sample, pressed, reads)
        else:
            self._held = self._stream.add(self._held, sample, pressed, now, reads)
        result, self._near = self._body.read(self._held, self._near, self._stream)
        return result

    def _checked(
        self, values: ArrayLike, load: float | None, reads: int, time_s: float | None
    ) -> tuple[FloatArray, float, float, float]:
        """Readings minus the rest reading, load (NaN not used), number of raw reads, and time (s)."""
        m = self._body.n_elements
        sample = _numbers("values", values)
        if sample.shape != (m,):
            raise InputError(f"values: expected {m} readings, one for each element, got shape {sample.shape}")
        _require_not_huge("values", sample)
        if np.isnan(sample).all():
            raise InputError("values: all readings are missing")
        count = _number("reads", reads)
        if not 1 <= count < np.inf:
            raise InputError(f"reads: expected at least 1, got {shown(reads)}")
        pressed = np.nan if load is None else _number("load", load)
        if abs(pressed) > LARGEST:
            raise InputError("load: expected a finite number up to 1e12, or nothing if it is not measured")
        used = pressed if self._options.use_load else np.nan
        return sample - self.rest_reading, used, count, self._now(time_s)

    def _now(self, time_s: float | None) -> float:
        """Time of a sample, s; where none is given, no effect asks for it."""
        if time_s is None:
            if self._stream is not None and self._stream.needs_time:
                raise InputError(
                    "time_s: this calibration has effects that depend on time: give the time of each sample"
                )
            return 0.0
        now = _number("time_s", time_s)
        if not np.abs(now) <= LARGEST_TIME:
            raise InputError(f"time_s: expected a number from -1e30 to 1e30, got {now:g}")
        if now < self._time_s:
            raise InputError(f"time_s: expected a time that is not before {self._time_s:g} s, got {now:g} s")
        self._time_s = now
        return now


def _numbers(name: str, values: ArrayLike) -> FloatArray:
    try:
        return as_floats(values)
    except InputError as error:
        raise InputError(f"{name}: {error.message}") from None


def _number(name: str, value: float) -> float:
    try:
        # As floats, dates would count their own unit, ns or another, and complex numbers would be their real parts.
        if isinstance(value, np.datetime64 | np.timedelta64 | np.complexfloating):
            raise TypeError
        return float(value)
    except (TypeError, ValueError):
        raise InputError(f"{name}: expected a number, got {shown(value)}") from None


def _require_not_huge(name: str, values: FloatArray) -> None:
    """Refuse readings (..., m) that are infinite or too large."""
    if (huge := np.abs(values) > LARGEST).any():
        element = int(huge.reshape(-1, values.shape[-1]).any(axis=0).argmax()) + 1
        raise InputError(f"{name}: element {element} is infinite or too large; a missing one is NaN")
