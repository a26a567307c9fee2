"""Diagnosis of a pad, from its data set to models before and after."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.recording import Recording
from bayestouch.data.dataset import DataSet
from bayestouch.diagnosis.as_stated import at_stated_references
from bayestouch.diagnosis.beginning import Beginning
from bayestouch.diagnosis.correction_basis import Correction
from bayestouch.diagnosis.data import DiagnosisData
from bayestouch.diagnosis.follow import follow
from bayestouch.diagnosis.held_out import HeldOut, design_of, free_load, functions_at, without_wrong_readings
from bayestouch.diagnosis.pad_touches import read_held_out_pad
from bayestouch.diagnosis.quantities import of_pad
from bayestouch.diagnosis.touch_errors import TouchReading
from bayestouch.diagnosis.traced import EvaluatedModel, Traced
from bayestouch.effects import Effect, Setting, catalogue
from bayestouch.model.added import AddedEffect
from bayestouch.model.fitting import Fitted
from bayestouch.model.observations import Observations
from bayestouch.model.timing import Timing
from bayestouch.model.whitening import Whitening
from bayestouch.pad.calibration_with_effects import pad_calibration
from bayestouch.pad.corrected import goes_with_place
from bayestouch.pad.model import PadModel
from bayestouch.pad.start import pad_fit
from bayestouch.progress import Progress

# With fewer samples a touch, what changes while it is held cannot be told from noise.
ENOUGH_SAMPLES = 3
# Each fit with an empirical map solves for hundreds of weights: a second for so many touches of eight elements.
MOST_TOUCHES = 1000


def trace_pad(
    dataset: DataSet,
    *,
    kernel: str | None,
    draws: int,
    sample: bool,
    seed: int,
    progress: Progress | None,
    scheduler: str | None,
) -> Traced:
    """Fit, search, and compare before and after; see `bayestouch.diagnose`."""
    data = _thinned(DiagnosisData.of(dataset), seed)
    begun = begin_pad(data, kernel=kernel, draws=draws, sample=sample, seed=seed)
    return follow(data, begun.fitted, begun.effects, begun.evaluate, progress, scheduler)


def begin_pad(data: DiagnosisData, *, kernel: str | None, draws: int, seed: int, sample: bool = False) -> Beginning:
    """Fit a pad without effects, with its kernel and an empirical map."""
    observed, table = data.observations(data.training), data.table.select(data.training)
    fitted = pad_fit(observed, table, data.dataset, kernel=kernel or "auto", empirical=True, seed=seed)
    setting = data.setting("", fitted.model.reference_load)
    evaluate = _EvaluatePad(data, setting, kernel, draws, sample, seed, fitted.model.peak)
    return Beginning(data, fitted, setting, _not_of_place(setting), evaluate)


def _not_of_place(setting: Setting) -> tuple[Effect, ...]:
    """Effects that the empirical map does not have in it already: it has any response that goes with the place."""
    m = setting.n_elements
    nowhere = Recording(
        indenter_radius_mm=np.full(1, np.nan),
        place=tuple(np.full(1, np.nan) for _ in setting.element_place),
        load=np.ones(1),
        time_s=np.zeros(1),
        held_s=np.zeros(1),
        element_place=setting.element_place,
        peak=np.ones(m),
        reference_load=setting.reference_load,
        signal=np.ones((1, m)),
    )
    return tuple(effect for effect in catalogue(setting) if not goes_with_place(effect, effect.probes[0], nowhere))


def _thinned(data: DiagnosisData, seed: int) -> DiagnosisData:
    """The same with no more training touches than a search has time for."""
    ids = np.unique(data.table.touch[data.training])
    if len(ids) <= MOST_TOUCHES:
        return data
    chosen = np.random.default_rng(seed).choice(ids, MOST_TOUCHES, replace=False)
    note = f"{MOST_TOUCHES:,} of {len(ids):,} touches that are not held out are used, chosen at random"
    return replace(data, training=data.training & np.isin(data.table.touch, chosen), notes=(*data.notes, note))


class _EvaluatePad:
    """Makes an `EvaluatedModel` of a fit: calibration, and errors on the held-out touches."""

    def __init__(
        self,
        data: DiagnosisData,
        setting: Setting,
        kernel: str | None,
        draws: int,
        sample: bool,
        seed: int,
        peak: FloatArray,
    ) -> None:
        # Errors before and after are shares of the same peaks: those of the fit without effects.
        self.peak = peak
        self.data, self.setting, self.kernel = data, setting, kernel
        self.draws, self.sample, self.seed = draws, sample, seed
        self.observed = data.observations(data.held_out) if data.n_held_out else None

    def __call__(self, fitted: Fitted, added: tuple[AddedEffect, ...], correction: Correction | None) -> EvaluatedModel:
        data, model = self.data, fitted.model
        assert isinstance(model, PadModel)
        calibration = pad_calibration(
            fitted,
            added,
            dataset=data.dataset,
            table=data.table,
            clock=Timing(data.time_s, data.held_s, data.unit),
            training=data.training,
            rest=data.rest,
            setting=self.setting,
            kernel=self.kernel or model.pad.kernel.name,
            draws=self.draws,
            seed=self.seed,
            notes=data.notes,
        )
        held = self.held(fitted, correction)
        read: TouchReading | None = None
        if held is not None and self.sample:
            read = read_held_out_pad(calibration, data, held, seed=self.seed)
        # Nothing moves a reference: what is at the stated ones is the same.
        unmoved = at_stated_references(fitted) is fitted
        held_stated = held if unmoved else self.held(fitted, correction, stated=True)
        return EvaluatedModel(fitted, correction, calibration, held, held_stated, read)

    def held(self, fitted: Fitted, correction: Correction | None, *, stated: bool = False) -> HeldOut | None:
        """Residuals of the held-out touches."""
        return (
            None if self.observed is None else held_out_pad(fitted, correction, self.observed, self.peak, stated=stated)
        )


def held_out_pad(
    fitted: Fitted, correction: Correction | None, observed: Observations, peak: FloatArray, *, stated: bool = False
) -> HeldOut:
    """Residuals of a pad's model on touches that it was not fitted to.

    Where touches have several samples the prediction error is that of samples: a pad's samples may be of another time
    of the hold each. A load that was not measured may be anything: what it does to a touch's readings is no lack of
    fit (nor can it be told from one, on a pad of one element).

    Parameters
    ----------
    fitted, correction, observed, stated
        As `bayestouch.diagnosis.held_out.held_out`.
    peak : (m,) array
        Peak readings that errors are shares of; effects may give the model other ones.
    """
    shown = at_stated_references(fitted) if stated else fitted
    observed = without_wrong_readings(fitted, observed)
    model = shown.model.observing(observed)
    assert isinstance(model, PadModel)
    added, functions = functions_at(shown, correction, observed)
    prediction = model.predict(shown.vector)
    predicted = prediction.touches + added
    means, rows = observed.means, observed.row_touch
    reads = np.maximum(means.counts.max(axis=1), 1)
    known = fitted.model.known
    one_load = np.median(fitted.noise.load_sd * np.sqrt(np.maximum(known.means.counts.max(axis=1), 1)))
    measured = np.isfinite(observed.load)
    noise = fitted.noise.with_(load_sd=np.where(measured, one_load / np.sqrt(reads), model.load))
    by_load = model.by_load(shown.vector)
    whitening = Whitening.of(observed, noise, predicted, by_load)
    residual = means.readings - predicted
    present = whitening.present
    recording = model.poses(shown.vector)
    places = [axis for axis in (means.x_mm, means.y_mm) if axis is not None]
    changing = 0.0 if prediction.samples is None else prediction.samples
    by_sample = residual[rows] + observed.deviation - changing
    signal = (predicted - model.chain(shown.vector).offset) / peak
    of_load = by_load * noise.load_sd[:, None]
    noise_sd = np.sqrt(noise.variance(predicted[rows], observed.weight[:, None]) + of_load[rows] ** 2) / peak
    return HeldOut(
        observed=observed,
        residual=np.where(present, residual, np.nan) / peak,
        whitened=np.where(present, whitening.touches(residual), 0.0),
        present=present,
        design=design_of(shown, model.derivatives(shown.vector)[0], functions, whitening),
        reference={**dict(zip(("x", "y"), recording.place, strict=False)), "P": observed.load},
        stated={**dict(zip(("x", "y"), places, strict=False)), "P": observed.load},
        quantities=of_pad(observed, model.element_place, recording.place, observed.load, signal, peak),
        noise_sd=np.where(measured[rows, None], noise_sd, np.nan),
        load_free=free_load(whitening, of_load, measured),
        samples=by_sample / peak,
        repeated=bool(reads.min(initial=ENOUGH_SAMPLES) >= ENOUGH_SAMPLES),
    )
