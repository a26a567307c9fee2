"""Start of fits of a pad with effects, and the results that are computed from a fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.recording import Recording
from bayestouch.data.sensor import pad_of
from bayestouch.effects import Effect, Setting, catalogue
from bayestouch.errors import InputError
from bayestouch.model.added import AddedEffect, moved_to
from bayestouch.model.beginning import Beginning
from bayestouch.model.correction import Correction, without_correction
from bayestouch.model.fitting import Fitted
from bayestouch.model.held_out import HeldOut
from bayestouch.model.log_density import LogDensity
from bayestouch.model.observations import Observations
from bayestouch.model.split_data import SplitData
from bayestouch.model.timing import Timing
from bayestouch.model.touch_errors import Infer, TouchReading
from bayestouch.pad.calibration import choose_pad
from bayestouch.pad.calibration_with_effects import has_finer_map, pad_calibration
from bayestouch.pad.candidates import PadCandidate
from bayestouch.pad.choice import EMPIRICAL
from bayestouch.pad.corrected import goes_with_place
from bayestouch.pad.density import PadDensity
from bayestouch.pad.held_out import held_out
from bayestouch.pad.kernel_error import with_kernel_error
from bayestouch.pad.log_density import public_density
from bayestouch.pad.model import PadModel
from bayestouch.pad.priors import used_priors
from bayestouch.pad.requested import PREDICTED
from bayestouch.pad.start import fit_without_effects, pad_fit
from bayestouch.pad.touch_errors import read_held_out
from bayestouch.priors.parameters import Prior
from bayestouch.results.objects import Calibration


def begin(
    data: SplitData,
    *,
    kernel: str | None,
    draws: int,
    seed: int,
    priors: Mapping[str, Prior] | None = None,
    e_map: str = "auto",
    groups: Sequence[str] = (),
) -> Beginning:
    """Fit a pad without effects, with its kernel and an empirical map, or with the kernel alone (`e_map` "model").

    Raises
    ------
    InputError
        For the reasons of `bayestouch.pad.start.pad_fit`, or `groups` has simulated readings.
    """
    if PREDICTED & set(groups):
        raise InputError("groups: a calibration of a pad with effects has corrected readings, and none are simulated")
    training, table = data.observations(data.searched), data.table.select(data.searched)
    empirical = EMPIRICAL[e_map]
    with_map = empirical is not False
    fitted, models = pad_fit(
        training, table, data.dataset, kernel=kernel or "auto", empirical=with_map, stated=priors, seed=seed
    )
    assert isinstance(fitted.model, PadModel)
    used, notes = used_priors(priors or {}, fitted.model.pad)
    if not with_map:
        fitted, _ = with_kernel_error(fitted)
    setting = data.setting("", fitted.model.reference_load)
    observed = data.observations(data.held_out) if data.n_held_out else None
    # A calibration has all training touches; stated priors are those of a kernel, which the start chooses.
    equal = not priors and np.array_equal(data.searched, data.training)
    peak, earlier = fitted.model.peak, models if equal else {}
    evaluation = PadEvaluation(
        data, setting, observed, kernel, draws, seed, peak, tuple(groups), used, empirical, notes, earlier
    )
    no_correction = "" if with_map else 'on a pad it is an empirical map, and e_map is "model"'
    return Beginning(fitted, setting, _not_of_place(setting), evaluation, no_correction)


def _not_of_place(setting: Setting) -> tuple[Effect, ...]:
    """Effects of the catalogue that do not depend on the location; the empirical map includes the others."""
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


@dataclass(frozen=True, eq=False)
class PadEvaluation:
    """A `bayestouch.model.beginning.Evaluation` of fits of a pad.

    Attributes
    ----------
    data : SplitData
        Training and held-out touches.
    setting : Setting
        Setting from which the effects chose their priors.
    observed : Observations or None
        Held-out touches; None if no touch is held out.
    kernel : str or None
        Kernel of the calibrations; that of the fit by default.
    draws, seed : int
        Number of draws and seed of the calibrations.
    peak : (m,) array
        Peak readings of the fit without effects, the unit of errors of all fits.
    groups : tuple of str
        Groups of the ArviZ schema that calibrations have on request.
    priors : mapping of str to Prior
        Stated priors of parameters that the pad has, by name.
    empirical : bool or "auto"
        Whether calibrations have an empirical map.
    notes : tuple of str
        Notes of calibrations on stated priors.
    earlier : mapping of str to PadCandidate
        Models of all training touches without effects, by name, that were fitted at the start.
    """

    data: SplitData
    setting: Setting
    observed: Observations | None
    kernel: str | None
    draws: int
    seed: int
    peak: FloatArray
    groups: tuple[str, ...] = ()
    priors: Mapping[str, Prior] = field(default_factory=dict)
    empirical: bool | Literal["auto"] = "auto"
    notes: tuple[str, ...] = ()
    earlier: Mapping[str, PadCandidate] = field(default_factory=dict)

    def calibration(self, fitted: Fitted, added: tuple[AddedEffect, ...], correction: Correction | None) -> Calibration:
        """Posterior of the fit, for `bayestouch.infer`; with a correction, touches are read with a finer map."""
        data, model = self.data, fitted.model
        assert isinstance(model, PadModel)
        fitted, added = self._to_draw(fitted, added, correction)
        return pad_calibration(
            fitted,
            added,
            corrected=correction is not None,
            dataset=data.dataset,
            table=data.table,
            clock=Timing(data.time_s, data.held_s, data.unit),
            training=data.training,
            rest=data.rest,
            setting=self.setting,
            kernel=self.kernel or model.pad.kernel.name,
            empirical=self.empirical,
            stated=self.priors,
            draws=self.draws,
            seed=self.seed,
            notes=(*data.notes, *self.notes),
            groups=self.groups,
            earlier=self.earlier,
        )

    def uses_correction(self, calibration: Calibration) -> bool:
        """Whether a calibration of a fit with a correction has the finer map."""
        return has_finer_map(calibration)

    def _to_draw(
        self, fitted: Fitted, added: tuple[AddedEffect, ...], correction: Correction | None
    ) -> tuple[Fitted, tuple[AddedEffect, ...]]:
        """The fit, and the effects of its chain, whose posterior is drawn: a correction is a matter of the map."""
        if correction is not None:
            fitted = without_correction(fitted)
            added = moved_to(fitted, added)
        if added and self.empirical is False:
            return with_kernel_error(fitted, added)
        return fitted, added

    def log_density(self, fitted: Fitted, added: tuple[AddedEffect, ...], correction: Correction | None) -> LogDensity:
        """Posterior density of the fit as a function."""
        sensor = self.data.dataset.sensor
        if added:
            density = PadDensity.of(*self._to_draw(fitted, added, correction))
        else:
            model = fitted.model
            assert isinstance(model, PadModel)
            chosen = choose_pad(
                self.data.dataset,
                kernel=self.kernel or model.pad.kernel.name,
                empirical=self.empirical,
                stated=self.priors,
                seed=self.seed,
            )
            density = PadDensity.of(fit_without_effects(chosen.problem, chosen.model, pad_of(sensor)))
        measured = np.isfinite(density.model.known.table.load).any()
        return public_density(density, sensor.reading_unit, sensor.body.load_unit if measured else "")

    def held_out(self, fitted: Fitted, correction: Correction | None, *, stated: bool = False) -> HeldOut | None:
        """Residuals of the held-out touches (at stated references if `stated`); None if no touch is held out."""
        return None if self.observed is None else held_out(fitted, correction, self.observed, self.peak, stated=stated)

    def read(self, infer: Infer, calibration: Calibration, held: HeldOut) -> TouchReading:
        """Posteriors of the held-out touches, read by `infer` as unknown touches, and their errors."""
        return read_held_out(infer, calibration, self.data, held, seed=self.seed)
