"""Touches on a calibrated finger for the sampler: posterior density, proposal, and results of the draws."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayestouch.array_types import FloatArray, IndexArray
from bayestouch.chain.noise import Noise
from bayestouch.data.arrays import nearest_turn
from bayestouch.finger.reading.alternatives import missed, propose_alternatives, propose_places, search_prior
from bayestouch.finger.reading.elsewhere import across_the_element, branches, distant_places, fits_as_well
from bayestouch.finger.reading.modes import find_modes, hessian_at, matches, other_places, with_whitener
from bayestouch.finger.reading.modulus import RadiusOverModulus
from bayestouch.finger.reading.profile import profile_proposal
from bayestouch.finger.reading.reader import (
    CalibratedFinger,
    FingerPosterior,
    IndenterPriors,
    TouchReadings,
    full_whitener,
    noise_whitener,
    with_noise_of_signal,
)
from bayestouch.finger.reading.reading_table import ReadingTable
from bayestouch.priors.parameters import Prior
from bayestouch.priors.radius import RadiusOfTips
from bayestouch.reading.touch_reader import Drawn
from bayestouch.sampling import BlockProposal

# Largest number of touches in a piece: enough that the overhead of emcee per step is small, and that of the searches,
# whose last steps are for a few touches (pieces of 512 took up to a tenth more time on one core); fewer if touches are
# drawn again, which takes many steps, so that all cores are used.
PIECE, PIECE_AGAIN = 1024, 128
# Pieces that a block is divided into, as long as each has `SMALL_PIECE` touches: with fewer, cores would have no work.
LEAST_PIECES, SMALL_PIECE = 4, 512
#: Names of the draws, (chain, draw, t).
DRAWN = ("r_c", "R", "theta_c", "P")
#: Name of the log probabilities of each tip and, last, of other indenters, if the prior has tips: (k, t).
TIPS = "tip_log_probability"
#: Whitener of the readings with which each touch was drawn, (m, m, t).
WHITENER = "whitener"
#: Mean of the R with which the readings of each touch are predicted, mm, (t,): R', where the modulus is hardly known.
RADIUS_READ = "radius_read"


@dataclass(frozen=True, eq=False)
class FingerGroup:
    """Touches on a finger that are drawn together. A `bayestouch.reading.touch_reader.TouchGroup`.

    Attributes
    ----------
    rows : (t,) int array
        Rows of the touches in the block.
    posterior : FingerPosterior
        Posterior density of the touches.
    proposal : BlockProposal
        Proposal of the sampler.
    log_probability : (k, t) array or None
        Log probability of each tip, if the prior has tips; NaN if it must be estimated from the draws.
    with_whitener : bool
        Whether the `WHITENER` is among the results.
    modulus : RadiusOverModulus or None
        Prior of R' with which R is drawn from R'; None if the posterior is that of R.
    """

    rows: IndexArray
    posterior: FingerPosterior
    proposal: BlockProposal
    log_probability: FloatArray | None = None
    with_whitener: bool = False
    modulus: RadiusOverModulus | None = None

    def log_density(self, x: FloatArray, touch: IndexArray) -> FloatArray:
        """Log posterior density (B, n) of points (w, θ_c, P), (B, n, 3), for the touches with indices `touch` (B,)."""
        return self.posterior.log_density(x, touch)

    def results(self, draws: FloatArray) -> Drawn:
        """Draws of `DRAWN`, `RADIUS_READ`, `TIPS`, `WHITENER`; from (chain, draw, t, 3). θ_c in degree."""
        indenter = self.posterior.indenter
        radius, indenter_radius = indenter.indenter_radius(draws[..., 0])
        out = {"theta_c": self._degrees(draws[..., 1]), "P": draws[..., 2]}
        if self.modulus is not None:
            over_modulus = indenter.radius(draws[..., 0])
            out[RADIUS_READ] = over_modulus.mean(axis=(0, 1))
            radius, indenter_radius = indenter.below_flat(self.modulus.radius(over_modulus))
        out |= {"R": radius, "r_c": indenter_radius}
        if self.log_probability is not None:
            probability = self.log_probability.copy()
            unsure = np.isnan(probability[0])
            probability[:, unsure] = indenter.log_shares(draws[:, :, unsure, 0])
            out[TIPS] = probability
        if self.with_whitener:
            whitener = self.posterior.whitener
            full = whitener if whitener.ndim == 3 else whitener[:, :, None] * np.eye(whitener.shape[1])
            out[WHITENER] = np.moveaxis(full, 0, -1)
        return out

    def _degrees(self, angle: FloatArray) -> FloatArray:
        """Locations in degree; on a full ring the mean of each touch is within half a turn of the row's middle."""
        degrees = np.degrees(angle)
        if self.posterior.middle is None:
            return degrees
        mean = degrees.mean(axis=(0, 1))
        return np.asarray(degrees + (nearest_turn(mean, float(np.degrees(self.posterior.middle))) - mean))


@dataclass(frozen=True, eq=False)
class FingerSampler:
    """A calibrated finger that draws touches. A `bayestouch.reading.touch_reader.TouchSampler`.

    Attributes
    ----------
    chain, priors, table, noise
        The calibrated finger, priors of touches, reading table, noise.
    reading_covariance : callable or None
        Covariance (t, m, m) of the readings due to the calibration, from R (mm), θ_c (rad) and P (N/m) of the
        touches; None if the calibration counts as exact.
    with_whitener : bool
        Whether the `WHITENER` of each touch is kept.
    modulus : RadiusOverModulus or None
        Prior of R', if the calibration hardly knows the shear modulus: touches are read with that of the mode, and
        `reading_covariance` is that for a known modulus.
    """

    chain: CalibratedFinger
    priors: IndenterPriors
    table: ReadingTable
    noise: Noise
    reading_covariance: Callable[[FloatArray, FloatArray, FloatArray], FloatArray] | None
    with_whitener: bool = False
    modulus: RadiusOverModulus | None = None

    redraws_together = True

    @cached_property
    def drawn_radius(self) -> Prior:
        """Prior of the radius that is drawn: R, or R'."""
        return self.priors.radius if self.modulus is None else self.modulus

    @cached_property
    def search(self) -> IndenterPriors:
        """Priors for the search of modes, which needs a density of R, also where only some tips are possible."""
        return replace(self.priors, radius=search_prior(self.drawn_radius, self.chain.outer_radius_mm))

    def pieces(self, rows: IndexArray, again: bool) -> list[IndexArray]:
        """Rows in an even number of pieces of about the same size."""
        largest, small = (PIECE_AGAIN, PIECE_AGAIN) if again else (PIECE, SMALL_PIECE)
        count = max(_even(len(rows), largest), min(_even(len(rows), small), LEAST_PIECES), 1)
        return [piece for piece in np.array_split(rows, count) if len(piece)]

    def shapes(self, chains: int, draws: int) -> dict[str, tuple[int, ...]]:
        """Shapes of the results without the axis of touches: `DRAWN`, and the others if there are any."""
        shapes: dict[str, tuple[int, ...]] = dict.fromkeys(DRAWN, (chains, draws))
        if isinstance(self.priors.radius, RadiusOfTips):
            shapes[TIPS] = (self.priors.radius.n_alternatives,)
        if self.modulus is not None:
            shapes[RADIUS_READ] = ()
        if self.with_whitener:
            shapes[WHITENER] = (self.noise.tactile_sd.size, self.noise.tactile_sd.size)
        return shapes

    def groups(self, touches: TouchReadings, rows: IndexArray) -> Iterator[FingerGroup]:
        """The touches in `rows`: those at one location, and those that may be at distant ones too.

        A touch on a full ring is drawn between ends of the location that are a quarter of a turn from its mode at
        least, so that its draws are together.
        """
        some = touches.select(rows)
        posterior = FingerPosterior(self.chain, some, self.search, noise_whitener(self.noise, some), self.table)
        mode = find_modes(posterior)
        covariance_of = self.reading_covariance if some.context is None else some.context.covariance
        if covariance_of is not None:
            covariance = covariance_of(posterior.radius(mode[:, 0]), mode[:, 1], mode[:, 2])
            posterior = with_whitener(posterior, full_whitener(self.noise, some, covariance))
            posterior = with_noise_of_signal(posterior, mode, self.noise, covariance)
            mode = find_modes(posterior, mode)
        if not self.priors.whole_turn:
            yield from self._groups_of(rows, posterior, mode)
            return
        low, high = self.priors.location.support
        outer = np.abs(mode[:, 1] - 0.5 * (low + high)) > 0.5 * np.pi
        for part, priors in ((~outer, self.search), (outer, self.search.half_a_turn_on)):
            if part.any():
                index = np.flatnonzero(part)
                place = mode[index]
                place[:, 1] = priors.in_turn(place[:, 1])
                yield from self._groups_of(rows[index], replace(posterior.select(index), priors=priors), place)

    def _groups_of(self, rows: IndexArray, posterior: FingerPosterior, mode: FloatArray) -> Iterator[FingerGroup]:
        """Groups of touches with their posterior for the search and their modes (t, 3)."""
        matched = list(matches(posterior))
        others = across_the_element(posterior, mode, other_places(posterior, mode, matched))
        several = np.zeros(len(rows), dtype=bool)
        count = np.isfinite(others[:, :, 0]).sum(axis=1)
        for n in np.unique(count[count > 0]):
            hopeful = np.flatnonzero(count == n)
            search = posterior.select(hopeful)
            modes = branches(search, mode[hopeful], others[hopeful, :n])
            at_several = np.flatnonzero(missed(self._drawn(search), modes))
            if len(at_several):
                several[hopeful[at_several]] = True
                modes = [(each[at_several], hessian[at_several]) for each, hessian in modes]
                yield self._at_places(rows[hopeful[at_several]], search.select(at_several), modes)
        place = distant_places(posterior, mode, matched)
        elsewhere = fits_as_well(posterior, mode, place) & ~several
        near = np.flatnonzero(~elsewhere & ~several)
        if len(near):
            yield self._at_one_place(rows[near], posterior.select(near), mode[near])
        if elsewhere.any():
            far = np.flatnonzero(elsewhere)
            search = posterior.select(far)
            modes = [(each, hessian_at(search, each)) for each in (mode[far], find_modes(search, place[far]))]
            yield self._at_places(rows[far], search, modes)

    def _drawn(self, search: FingerPosterior) -> FingerPosterior:
        """The posterior that is drawn, from that of the search."""
        return replace(search, priors=replace(search.priors, radius=self.drawn_radius))

    def _at_one_place(self, rows: IndexArray, search: FingerPosterior, mode: FloatArray) -> FingerGroup:
        """Group of touches whose posterior, that of the `search`, has one mode (t, 3)."""
        hessian = hessian_at(search, mode)
        posterior = self._drawn(search)
        proposal: BlockProposal
        if isinstance(self.priors.radius, RadiusOfTips):
            proposal, log_probability = propose_alternatives(posterior, mode, hessian)
        else:
            proposal, log_probability = profile_proposal(posterior, mode, hessian), None
        return FingerGroup(rows, posterior, proposal, log_probability, self.with_whitener, self.modulus)

    def _at_places(
        self, rows: IndexArray, search: FingerPosterior, modes: Sequence[tuple[FloatArray, FloatArray]]
    ) -> FingerGroup:
        """Group of touches that may be at several locations: modes (t, 3) of the `search` and Hessians (t, 3, 3)."""
        posterior = self._drawn(search)
        log_probability = None
        if isinstance(self.priors.radius, RadiusOfTips):
            # Counted among the draws.
            log_probability = np.full((self.priors.radius.n_alternatives, len(rows)), np.nan)
        proposal = propose_places(posterior, modes)
        return FingerGroup(rows, posterior, proposal, log_probability, self.with_whitener, self.modulus)


def _even(n: int, largest: int) -> int:
    """The even number of pieces, zero of none, into which n touches are divided, with at most `largest` in each."""
    return 2 * -(-n // (2 * largest))
