"""`FingerLive`: posterior of one touch on a finger by deterministic quadrature, for a control loop."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf, dtrtri

from bayestouch.array_types import FloatArray
from bayestouch.data.arrays import nearest_turn
from bayestouch.finger.reading.elsewhere import APART, AS_WELL
from bayestouch.finger.reading.indenter_coordinate import IndenterCoordinate
from bayestouch.finger.reading.live_covariance import LOADS, LOADS_OF_BEND, CovarianceTable
from bayestouch.finger.reading.live_density import Expansion, OneTouch
from bayestouch.finger.reading.live_effects import FingerStream, bends, blank_context
from bayestouch.finger.reading.live_elsewhere import ELSEWHERE, Branch, Fits
from bayestouch.finger.reading.live_summary import Alternatives
from bayestouch.finger.reading.modes import UNEXPLAINED
from bayestouch.finger.reading.places import CovarianceWithPlaces
from bayestouch.finger.reading.reader import TURN, middle_of
from bayestouch.finger.reading.touch_reader import FingerTouchReader
from bayestouch.reading.live import HeldTouch, LiveTouch
from bayestouch.reading.options import Options
from bayestouch.results.objects import Calibration

# Radii of the templates over the largest one, and spacing of their locations.
TEMPLATE_SHARES = np.array([0.03, 0.15, 0.35, 0.55, 0.75, 0.9, 0.98])
TEMPLATE_STEP = np.radians(1.0)
# Newton steps from a template: largest number, and length (sd) at which the search ends before and after the
# covariance of the calibration is known; how many times a step that goes too far is made shorter.
MOST_STEPS, NEAR, SETTLED, SHORTER = 30, 0.3, 0.2, 8
# Distance (sd) from the mode at which a search that ends has found another one: ten times the length at which it ends.
SAME = 2.0


@dataclass(frozen=True, eq=False)
class FingerLive:
    """A calibrated finger that reads one touch at a time. A `bayestouch.reading.live.LiveBody`.

    Attributes
    ----------
    reader : FingerTouchReader
        The reader of `bayestouch.infer`, whose density, tables and covariance are used.
    covariance : CovarianceTable or None
        Covariance of the readings due to the calibration; None if the calibration counts as exact, or if its covariance
        is computed for each touch.
    templates : (n, m) float32 array
        Readings at the typical load of touches at `places`.
    places : (n, 2) array
        Coordinate w and location (rad) of the templates.
    """

    reader: FingerTouchReader
    covariance: CovarianceTable | None
    templates: NDArray[np.float32]
    places: FloatArray

    @classmethod
    def of(
        cls, calibration: Calibration, options: Options, arrays: Mapping[str, FloatArray] | None = None
    ) -> FingerLive:
        """Live reader from a calibration of a finger; `arrays` from an earlier one with the same options."""
        reader = FingerTouchReader.from_calibration(calibration, options)
        table = None
        if not (options.plug_in or _by_radius(reader)):
            # A table for a known modulus holds for these options alone.
            known = arrays if reader.sampler.modulus is None else None
            table = CovarianceTable.from_arrays(known) if known else _covariance_table(reader)
        return cls.with_templates(reader, table)

    @classmethod
    def with_templates(cls, reader: FingerTouchReader, covariance: CovarianceTable | None) -> FingerLive:
        """Live reader with its templates."""
        low, high = reader.sampler.priors.location.support
        # As in `modes`, inside the prior: beyond it the density has no slope to follow.
        angles = np.clip(np.arange(low, high + TEMPLATE_STEP, TEMPLATE_STEP), low + 1e-6, high - 1e-6)
        w, angle = (each.ravel() for each in np.meshgrid(np.log(TEMPLATE_SHARES / (1 - TEMPLATE_SHARES)), angles))
        live = cls(reader, covariance, np.empty((0, 0), dtype=np.float32), np.stack([w, angle], axis=-1))
        blank = live._blank.with_(readings=np.zeros(live.n_elements, dtype=np.float32))
        load = np.full(len(w), reader.typical_load)
        return replace(live, templates=blank.predicted(blank.radii(w), angle, load))

    @property
    def n_elements(self) -> int:
        """Number of elements m."""
        return len(self.reader.noise.tactile_sd)

    def arrays(self) -> dict[str, FloatArray]:
        """The table of the covariance, for a file; none if it holds for these options alone."""
        if self.covariance is None or self.reader.sampler.modulus is not None:
            return {}
        return self.covariance.arrays()

    def stream(self) -> FingerStream | None:
        """A new stream; None if the calibration has no effects."""
        chain = self.reader.effects_chain
        return None if chain is None else FingerStream(chain, exact=self.reader.options.plug_in)

    def read(
        self, touch: HeldTouch, near: FloatArray | None = None, stream: FingerStream | None = None
    ) -> tuple[LiveTouch, FloatArray]:
        """Posterior of a touch and its mode (w, θ_c, P); `near` is not used: templates are fast and find any touch."""
        noise = self.reader.sampler.noise
        readings, counts = touch.readings, touch.counts
        with np.errstate(divide="ignore"):
            variance = noise.tactile_sd**2 / counts + noise.discrepancy_sd**2
        diagonal = 1 / np.sqrt(variance)
        load = touch.load if self.reader.options.use_load else np.nan
        context = None if stream is None else stream.context()
        one = self._blank.with_(
            readings=readings.astype(np.float32),
            whitener=np.diag(diagonal).astype(np.float32),
            load=load,
            load_sd=float(noise.force_sd / np.sqrt(touch.reads_of_load)),
            context=context,
        )
        if context is not None:
            readings = (readings - context.shift[0]) / context.scale[0]
        fits = self._fits(readings, diagonal, load)
        corrected = one
        if stream is not None and stream.corrects_load and load == load:
            # The mode for the load as read may be far from that for the true load, and so has another covariance.
            corrected = stream.with_true_load(one, float(self.places[fits.best, 1]))
            fits = self._fits(readings, diagonal, corrected.load)
        start = self._place(fits, fits.best)
        one, corrected = (each.about(start[1]) for each in (one, corrected))
        found = _climb(corrected, corrected.expansion(start), NEAR)
        columns = None
        if self.covariance is not None:
            w, angle, pressed = found.x.tolist()
            kappa = pressed * float(one.radii(w)) * one.per_modulus
            columns = self.covariance(kappa, float(one.in_row(angle)), pressed).reshape(-1, len(readings))
            columns[len(readings) :] /= pressed
        elif not self.reader.options.plug_in:
            w, angle, pressed = found.x
            mode = np.atleast_1d(one.radii(w)), one.in_row(np.array([angle])), np.array([pressed])
            columns = self.reader.covariance(*mode)[0]
        covariance: FloatArray | None
        if stream is not None and context is not None:
            one, covariance = stream.acting(one, found, context, columns, variance)
            found = one.expansion(found.x) if one.context is not context else found
        else:
            covariance = columns
        if covariance is not None:
            inner = diagonal[:, None] * covariance * diagonal
            inner[range(len(inner)), range(len(inner))] += 1.0
            # LAPACK by itself: numpy's checks take as long as the work. Of a symmetric matrix it reads the upper half.
            root, _ = dtrtri(dpotrf(inner, lower=0)[0], lower=0)
            one = one.with_(whitener=(diagonal[:, None] * root).astype(np.float32))
            found = _climb(one, one.expanded(found.x, found.steps, found.rows), SETTLED)
        if stream is not None:
            stream.keep(one, found)
        degrees = int(np.count_nonzero(counts)) + (load == load) - 3
        far = self._distant(fits)
        off = (fits.load[far] * self.templates[far] - readings) * (1.0 if context is None else context.scale[0])
        off = off @ one.whitener
        if -0.5 * float(off @ off) - found.log_likelihood > -AS_WELL:
            return self._alternatives.posterior(one, found, touch.samples, degrees, [ELSEWHERE]), found.x
        other = fits.other_place(self._locations, len(TEMPLATE_SHARES), float(found.x[1]))
        branch = None if other is None else self._branch(one, found, self._place(fits, other))
        return self._alternatives.posterior(one, found, touch.samples, degrees, [], branch), found.x

    @cached_property
    def _blank(self) -> OneTouch:
        """A touch without readings."""
        sampler, search = self.reader.sampler, self._search
        assert search.density is not None
        w = np.arange(-20.0, 20.0, 0.01)
        nothing = np.zeros(0, dtype=np.float32)
        return OneTouch(
            chain=sampler.chain,
            table=sampler.table,
            per_modulus=1 / (1000 * sampler.chain.shear_modulus_MPa),
            ends=(*sampler.priors.location.support, *sampler.priors.load.support),
            radius_ends=search.density.support,
            w_grid=w,
            w_log_prior=np.maximum(search.log_density(w), -1e30),
            readings=nothing,
            whitener=nothing,
            load=np.nan,
            load_sd=1.0,
            middle=middle_of(sampler.chain, sampler.priors),
        )

    @cached_property
    def _search(self) -> IndenterCoordinate:
        """Coordinate of the indenters for the search of modes: tips without a density have a uniform one."""
        sampler = self.reader.sampler
        return IndenterCoordinate(sampler.search.radius, sampler.chain.outer_radius_mm)

    @cached_property
    def _alternatives(self) -> Alternatives:
        sampler = self.reader.sampler
        return replace(Alternatives.of(sampler.priors.radius), modulus=sampler.modulus)

    def _fits(self, readings: FloatArray, diagonal: FloatArray, load: float) -> Fits:
        """How well each template fits the readings (m,), with the diagonal (m,) of their whitener."""
        typical = self.reader.typical_load
        low, high = self.reader.sampler.priors.load.support
        weight = diagonal * diagonal
        weighted = weight * readings
        cross = self.templates @ weighted.astype(np.float32)
        power = self._squares @ weight.astype(np.float32)
        best = np.full(len(cross), load / typical) if load == load else cross / np.maximum(power, 1e-30)
        best = np.minimum(np.maximum(best, max(low / typical, 1e-3)), high / typical - 1e-6)
        squares = float(weighted @ readings)
        strongest = float(power.max()) * float(best[0]) ** 2 if load == load else 0.0
        return Fits(best, best * (power * best - 2 * cross), UNEXPLAINED * max(squares, strongest) - squares)

    def _place(self, fits: Fits, k: int) -> FloatArray:
        """Place (w, θ_c, P) of a template."""
        return np.array([*self.places[k], fits.load[k] * self.reader.typical_load])

    def _distant(self, fits: Fits) -> int:
        """Template at a distant place that fits best.

        There is one: locations reach 20 degrees beyond the elements on either side.
        """
        far = np.abs(nearest_turn(self._locations - self.places[fits.best, 1], 0.0, TURN)) > APART
        misfit = fits.misfit.reshape(len(far), -1)
        return int(np.where(far[:, None], misfit, np.inf).argmin())

    def _branch(self, one: OneTouch, found: Expansion, place: FloatArray) -> Branch:
        """Where the posterior may continue near another place (w, θ_c, P), given the mode; as `elsewhere.branches`."""
        if one.middle is not None:
            place[1] = nearest_turn(place[1], float(found.x[1]), TURN)
        there = _climb(one, one.expansion(place), SETTLED)
        off = there.x - found.x
        if off @ found.hessian @ off > SAME**2:
            return Branch(there.x, there.covariance, alone=True)
        covariance = np.zeros((3, 3))
        covariance[0, 0] = found.covariance[0, 0]
        return Branch(np.array([found.x[0], *place[1:]]), covariance, alone=False)

    @cached_property
    def _locations(self) -> FloatArray:
        """Locations of the templates, rad, each once."""
        return self.places[:: len(TEMPLATE_SHARES), 1]

    @cached_property
    def _squares(self) -> NDArray[np.float32]:
        return self.templates**2


def _by_radius(reader: FingerTouchReader) -> bool:
    """Whether the covariance depends on R by itself, and not by κ alone: the surface has a curvature of its own."""
    covariance = reader.covariance
    return isinstance(covariance, CovarianceWithPlaces) and covariance.finger.places.functions.surface is not None


def _covariance_table(reader: FingerTouchReader) -> CovarianceTable:
    """Table of the covariance of the readings, and with effects of their values too; see `EffectContext.columns`."""
    sampler, chain = reader.sampler, reader.effects_chain
    columns, loads = sampler.reading_covariance or reader.covariance, np.array([1.0])
    if chain is not None:
        loads = np.array(LOADS_OF_BEND if bends(chain) else LOADS)

        def columns(radius: FloatArray, angle: FloatArray, load: FloatArray) -> FloatArray:
            out = blank_context(chain, len(load), exact=False).columns(radius, angle, load)
            # Covariances of values with readings are in proportion to the load, those of readings to its square.
            out[:, chain.model.n_elements :] *= load[:, None, None]
            return out

    widest = sampler.search.radius.support[1] if sampler.modulus else sampler.chain.outer_radius_mm
    largest = sampler.priors.load.support[1] * widest / sampler.chain.shear_modulus_MPa / 1000
    modulus, ends, scale = sampler.chain.shear_modulus_MPa, sampler.priors.location.support, sampler.table.kappa_scale
    return CovarianceTable.of(columns, modulus, ends, scale, largest, reader.typical_load * loads)


def _climb(one: OneTouch, here: Expansion, settled: float) -> Expansion:
    """Expansion at the mode, by a damped Newton search from an expansion; as `modes.find_modes` for one touch."""
    damping = 1e-2
    for _ in range(MOST_STEPS):
        step = here.newton_step(damping)
        if step @ here.gradient < settled**2:
            break
        step[0] = min(max(step[0], -2.0), 2.0)
        there = one.expansion(here.x + step)
        for _ in range(SHORTER):
            if there.value > here.value:
                break
            # The maximum of the parabola through both values with the slope here.
            slope, rise = float(step @ here.gradient), there.value - here.value
            step *= min(max(0.5 * slope / (slope - rise), 0.1), 0.5)
            there = one.expansion(here.x + step)
        gain = there.value - here.value
        if gain <= 0:
            break
        here, damping = there, damping * 0.1
        if gain < 0.5 * settled**2:
            break
    return here
