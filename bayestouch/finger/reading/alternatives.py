"""Touches whose indenter is one of several tips: probability of each tip, and a proposal over all of them.

For a given tip, location and load are nearly normal: a Newton search finds their mode, a Student-t distribution about
it is the proposal, and the evidence of the tip is the mean weight of evenly spread points of this distribution. A
density for other indenters has the profile proposal; its evidence is computed in the same way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.finger.reading.cells import cells_proposal
from bayestouch.finger.reading.conditional_modes import conditional_modes, root_of_inverse
from bayestouch.finger.reading.even_points import EvenPoints
from bayestouch.finger.reading.profile import profile_proposal
from bayestouch.finger.reading.reader import FingerPosterior
from bayestouch.priors.parameters import Prior, Uniform
from bayestouch.priors.radius import RadiusOfTips
from bayestouch.sampling import BlockProposal, BlockStreams, StudentTProposal, pareto_shape

# Degrees of freedom of the Student-t for location and load: heavier tails than the posterior, for bounded weights.
DOF = 8.0
# Number of points for the evidence of an alternative; the tests check its accuracy.
EVIDENCE_POINTS = 512
# Largest Pareto shape of the weights for a reliable evidence (Vehtari et al. 2024).
LARGEST_K = 0.7
# Alternatives with a log probability below this do not affect the others.
NEGLIGIBLE = -10.0
# Share of the proposals that is divided equally among all alternatives, in case an evidence is wrong.
EVEN_SHARE = 0.02
# Log ratio of posterior and proposal at which the proposal leaves a point out: a good proposal stays below a third of
# it, in its tails too. And log probability of such points that counts: at 100 sd from the mode, 1 % doubles the sd of
# the location ten times, and 0.03 % doubles it once.
THIN, LEFT_OUT = 3.0, -8.0


@dataclass(frozen=True, eq=False)
class TipProposal:
    """Proposal for one tip: uniform in its cell of w, Student-t in (θ_c, P). A `BlockProposal`.

    Attributes
    ----------
    cell : float
        Lower end of the cell in w.
    rest : StudentTProposal
        Distribution of (θ_c, P), rad and N/m.
    """

    cell: float
    rest: StudentTProposal

    @property
    def n_blocks(self) -> int:
        """Number of blocks B."""
        return self.rest.n_blocks

    @property
    def dimension(self) -> int:
        """Three: w, θ_c, P."""
        return 3

    def select(self, blocks: ArrayLike) -> TipProposal:
        """Proposal of some of the blocks, by position or mask."""
        return TipProposal(self.cell, self.rest.select(blocks))

    def draw(self, streams: BlockStreams, n: int) -> tuple[FloatArray, FloatArray]:
        """Draw n points per block, (B, n, 3), and return them with their log density, (B, n)."""
        rest, log_q = self.rest.draw(streams, n)
        x = np.swapaxes(np.empty((self.n_blocks, 3, n)), 1, 2)
        x[..., 0], x[..., 1:] = self.cell + streams.uniform(n), rest
        return x, log_q

    def log_density(self, x: FloatArray) -> FloatArray:
        """Log density, normalised, (B, n, 3) -> (B, n)."""
        inside = np.floor(x[..., 0]) == self.cell
        return np.where(inside, self.rest.log_density(np.ascontiguousarray(x[..., 1:])), -np.inf)


@dataclass(frozen=True, eq=False)
class AlternativesProposal:
    """Mixture of the proposals of all alternatives. A `BlockProposal`.

    Attributes
    ----------
    parts : sequence of BlockProposal
        Proposal of each alternative.
    shares : (B, k) array
        Probabilities of the alternatives in the mixture.
    """

    parts: Sequence[BlockProposal]
    shares: FloatArray

    @property
    def n_blocks(self) -> int:
        """Number of blocks B."""
        return len(self.shares)

    @property
    def dimension(self) -> int:
        """Three: w, θ_c, P."""
        return 3

    def select(self, blocks: ArrayLike) -> AlternativesProposal:
        """Proposal of some of the blocks, by position or mask."""
        return AlternativesProposal([part.select(blocks) for part in self.parts], self.shares[np.asarray(blocks)])

    def draw(self, streams: BlockStreams, n: int) -> tuple[FloatArray, FloatArray]:
        """Draw n points per block, (B, n, 3), and return them with their log density, (B, n)."""
        sums = np.cumsum(self.shares, axis=1)[:, :, None]
        choice = (streams.uniform(n)[:, None] >= sums[:, :-1]).sum(axis=1)
        x, _ = self.parts[0].draw(streams, n)
        for k, part in enumerate(self.parts[1:], start=1):
            np.copyto(x, part.draw(streams, n)[0], where=(choice == k)[..., None])
        return x, self.log_density(x)

    def log_density(self, x: FloatArray) -> FloatArray:
        """Log density, normalised, (B, n, 3) -> (B, n)."""
        total = np.full(x.shape[:2], -np.inf)
        for part, share in zip(self.parts, self.shares.T, strict=True):
            np.logaddexp(total, np.log(share)[:, None] + part.log_density(x), out=total)
        return total


def search_prior(prior: Prior, outer_radius_mm: float) -> Prior:
    """Density of R for the search of modes: the density of the prior, or uniform if the prior has only tips."""
    if not isinstance(prior, RadiusOfTips):
        return prior
    return prior.density if prior.density is not None else Uniform(0.0, outer_radius_mm)


def propose_alternatives(
    posterior: FingerPosterior, mode: FloatArray, hessian: FloatArray
) -> tuple[AlternativesProposal, FloatArray]:
    """Proposal over all tips and the density, and their log probabilities.

    Parameters
    ----------
    posterior : FingerPosterior
        Posterior whose prior of R is a `RadiusOfTips`.
    mode, hessian : (t, 3), (t, 3, 3) arrays
        From `find_modes` and `hessian_at` with the `search_prior`.

    Returns
    -------
    AlternativesProposal
        Proposal over all alternatives.
    (k, t) array
        Log posterior probability of each tip and, last, of the density; NaN for a touch if the evidence of a probable
        alternative is not reliable.
    """
    tips, density = posterior.indenter.tips, posterior.indenter.density
    assert tips is not None
    parts = _about_mode(posterior, mode, hessian)
    weighed = [_log_evidence(posterior, part) for part in (parts if density is None else parts[:-1])]
    if density is not None:
        value, k = _log_evidence(_without_tips(posterior), parts[-1])
        weighed.append((value + np.log(tips.share), k))
    evidence, shape = (np.stack(values) for values in zip(*weighed, strict=True))
    log_probability = evidence - np.logaddexp.reduce(evidence, axis=0)
    share = np.exp(log_probability.T)
    unsure = ((shape > LARGEST_K) & (log_probability > NEGLIGIBLE)).any(axis=0)
    proposal = AlternativesProposal(parts, (1 - EVEN_SHARE) * share + EVEN_SHARE / len(parts))
    return proposal, np.where(unsure, np.nan, log_probability)


def propose_places(posterior: FingerPosterior, modes: Sequence[tuple[FloatArray, FloatArray]]) -> AlternativesProposal:
    """Proposal over all locations, for touches with more than one mode.

    It is a mixture of a `CellsProposal`, which covers all locations, and of the proposals about the modes, for modes
    that are narrower than its cells. The share of each is the probability that it covers, times its efficiency.

    Parameters
    ----------
    posterior : FingerPosterior
        Posterior of the touches.
    modes : sequence of ((t, 3), (t, 3, 3)) arrays
        Modes with their Hessians, as in `propose_alternatives`.
    """
    parts: list[BlockProposal] = [cells_proposal(posterior)]
    for mode, hessian in modes:
        parts += _about_mode(posterior, mode, hessian)
    weight = np.stack([_log_weights(posterior, part) for part in parts])
    # The mean weight is the probability, and its square over the mean square of the weights the efficiency.
    log_share = 3 * np.logaddexp.reduce(weight, axis=2) - np.logaddexp.reduce(2 * weight, axis=2)
    share = np.exp(log_share - np.logaddexp.reduce(log_share, axis=0)).T
    return AlternativesProposal(parts, (1 - EVEN_SHARE) * share + EVEN_SHARE / len(parts))


def missed(posterior: FingerPosterior, modes: Sequence[tuple[FloatArray, FloatArray]]) -> BoolArray:
    """Whether the proposals about the first of the modes leave out a part of the posterior of a touch, (t,).

    The weights of draws do not show this: they are even if all draws are at one of two places. The points of the
    proposals about the other modes show it, where the posterior is much higher than the proposal.

    Parameters
    ----------
    posterior, modes
        As in `propose_places`.
    """
    first = _about_mode(posterior, *modes[0])
    known = np.stack([_log_evidence(posterior, part)[0] for part in first])
    total = np.logaddexp.reduce(known, axis=0)
    out = np.zeros(len(total), dtype=bool)
    for mode, hessian in modes[1:]:
        for part in _about_mode(posterior, mode, hessian):
            x, log_q = part.draw(EvenPoints(part.n_blocks), EVIDENCE_POINTS)
            log_density = posterior.log_density(x, np.arange(part.n_blocks))
            covered = [share[:, None] + each.log_density(x) for share, each in zip(known, first, strict=True)]
            beyond = log_density > np.logaddexp.reduce(covered, axis=0) + THIN
            share = np.where(beyond, log_density - log_q, -np.inf)
            out |= np.logaddexp.reduce(share, axis=1) - np.log(EVIDENCE_POINTS) > total + LEFT_OUT
    return out


def _about_mode(posterior: FingerPosterior, mode: FloatArray, hessian: FloatArray) -> list[BlockProposal]:
    """Proposals about the mode of each touch (t, 3), for each tip and, last, for the density."""
    parts: list[BlockProposal] = [] if posterior.indenter.tips is None else list(_tip_proposals(posterior, mode))
    if posterior.indenter.density is not None:
        parts.append(profile_proposal(_without_tips(posterior), mode, hessian))
    return parts


def _without_tips(posterior: FingerPosterior) -> FingerPosterior:
    """The posterior with the density of R alone, for a prior that has one."""
    density = posterior.indenter.density
    assert density is not None
    return replace(posterior, priors=replace(posterior.priors, radius=density))


def _tip_proposals(posterior: FingerPosterior, mode: FloatArray) -> list[TipProposal]:
    """Proposal of each tip for all touches: mode and width of (θ_c, P) given the tip."""
    cells = posterior.indenter.cells
    w = np.broadcast_to(cells + 0.5, (len(mode), len(cells)))
    start = np.repeat(mode[:, None, 1:], len(cells), axis=1)
    centre, _, curvature = conditional_modes(posterior, w, start)
    l11, l21, l22 = np.moveaxis(root_of_inverse(curvature), -1, 0)
    root = np.stack([l11, np.zeros(l11.shape), l21, l22], axis=-1).reshape(*l11.shape, 2, 2)
    return [TipProposal(float(cell), StudentTProposal(centre[:, k], root[:, k], DOF)) for k, cell in enumerate(cells)]


def _log_evidence(posterior: FingerPosterior, part: BlockProposal) -> tuple[FloatArray, FloatArray]:
    """Log integral of the posterior density over the region of `part`, and Pareto shape of the weights; (B,) each."""
    log_weight = _log_weights(posterior, part)
    return np.asarray(np.logaddexp.reduce(log_weight, axis=1) - np.log(EVIDENCE_POINTS)), pareto_shape(log_weight)


def _log_weights(posterior: FingerPosterior, part: BlockProposal) -> FloatArray:
    """Log posterior density over that of `part`, at evenly spread points of it, (B, n)."""
    x, log_q = part.draw(EvenPoints(part.n_blocks), EVIDENCE_POINTS)
    return np.asarray(posterior.log_density(x, np.arange(part.n_blocks)) - log_q)
