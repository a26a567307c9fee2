"""Proposals over tips: densities and shares by scipy."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from bayestouch.finger.reading import alternatives
from bayestouch.finger.reading.alternatives import AlternativesProposal, TipProposal, search_prior
from bayestouch.priors.parameters import Normal, Uniform
from bayestouch.priors.radius import RadiusOfTips
from bayestouch.sampling import StudentTProposal
from bayestouch.sampling.streams import BlockStreams

CENTRE = np.array([[0.1, 50.0], [-0.2, 80.0]])
ROOT = np.array([[[0.02, 0.0], [0.5, 3.0]], [[0.01, 0.0], [0.0, 1.0]]])


def tip(cell: float) -> TipProposal:
    return TipProposal(cell, StudentTProposal(CENTRE, ROOT, 8.0))


def density(block: int, x: np.ndarray) -> np.ndarray:
    return np.asarray(stats.multivariate_t(CENTRE[block], ROOT[block] @ ROOT[block].T, df=8).logpdf(x))


def test_settings() -> None:
    assert (alternatives.DOF, alternatives.EVIDENCE_POINTS, alternatives.EVEN_SHARE) == (8.0, 512, 0.02)
    assert (alternatives.LARGEST_K, alternatives.NEGLIGIBLE) == (0.7, -10.0)


def test_proposal_of_one_tip() -> None:
    """Even over its cell of the indenter's coordinate, Student-t in location and load; nothing elsewhere."""
    made = tip(3.0)
    assert (made.n_blocks, made.dimension, made.select([1]).n_blocks) == (2, 3, 1)
    x = np.array([[[3.0, 0.12, 51.0], [3.999, 0.08, 40.0], [2.999, 0.1, 50.0], [4.0, 0.1, 50.0]]] * 2)
    found = made.log_density(x)
    for block in range(2):
        np.testing.assert_allclose(found[block, :2], density(block, x[block, :2, 1:]))
    assert np.isneginf(found[:, 2:]).all()
    drawn, log_q = made.draw(BlockStreams(1, np.arange(2)), 2000)
    np.testing.assert_allclose(log_q, made.log_density(drawn))
    assert drawn[..., 0].min() > 3.0 and drawn[..., 0].max() < 4.0
    assert drawn[..., 0].mean() == pytest.approx(3.5, abs=5 / np.sqrt(12 * 4000))


def test_proposal_of_several_tips() -> None:
    """Each in its share of the draws; the density is that of the mixture."""
    shares = np.array([[0.7, 0.1, 0.2], [0.05, 0.05, 0.9]])
    made = AlternativesProposal([tip(0.0), tip(1.0), tip(2.0)], shares)
    assert (made.n_blocks, made.dimension) == (2, 3)
    drawn, log_q = made.draw(BlockStreams(1, np.arange(2)), 4000)
    for block in range(2):
        which = np.floor(drawn[block, :, 0]).astype(int)
        found = np.bincount(which, minlength=3) / 4000
        np.testing.assert_allclose(found, shares[block], atol=5 * np.sqrt(0.25 / 4000))
        wanted = np.log(shares[block][which]) + density(block, drawn[block, :, 1:])
        np.testing.assert_allclose(log_q[block], wanted)
    one = made.select([1])
    np.testing.assert_array_equal(one.shares, shares[1:])
    np.testing.assert_allclose(one.log_density(drawn[1:]), log_q[1:])


def test_evidence_is_the_mean_weight() -> None:
    """Of a density that is e² times the proposal: log evidence 2, and no tail."""
    posterior: Any = SimpleNamespace(log_density=lambda x, blocks: 2.0 + tip(3.0).log_density(x))
    value, _ = alternatives._log_evidence(posterior, tip(3.0))
    np.testing.assert_allclose(value, 2.0)
    # Of a normal one: its integral, by even points to a hundredth.
    normal: Any = SimpleNamespace(
        log_density=lambda x, blocks: np.stack(
            [
                stats.multivariate_normal(CENTRE[b], ROOT[b] @ ROOT[b].T).logpdf(x[b, :, 1:]) + np.log(b + 1.0)
                for b in range(2)
            ]
        )
    )
    value, shape = alternatives._log_evidence(normal, tip(0.0))
    np.testing.assert_allclose(value, np.log([1.0, 2.0]), atol=0.01)
    assert (shape < 0.7).all()


def test_density_to_search_under() -> None:
    even = Uniform(0.0, 5.0)
    assert search_prior(even, 12.7) is even
    tips: Any = RadiusOfTips.__new__(RadiusOfTips)
    for density_, wanted in ((None, Uniform(0.0, 12.7)), (Normal(3.0, 1.0), Normal(3.0, 1.0))):
        object.__setattr__(tips, "density", density_)
        assert search_prior(tips, 12.7) == wanted


def proposed(monkeypatch: pytest.MonkeyPatch, evidence: list[list[float]], shape: list[list[float]]) -> Any:
    """Two tips and a density of share 0.25, with these evidences and shapes of two touches."""
    told = iter(zip(np.array(evidence), np.array(shape), strict=True))
    monkeypatch.setattr(alternatives, "_tip_proposals", lambda posterior, mode: [tip(0.0), tip(1.0)])
    monkeypatch.setattr(alternatives, "_log_evidence", lambda posterior, part: next(told))
    monkeypatch.setattr(alternatives, "profile_proposal", lambda *given: tip(2.0))
    monkeypatch.setattr(alternatives, "replace", lambda made, **changes: made)
    indenter = SimpleNamespace(tips=SimpleNamespace(share=0.25), density="density")
    posterior: Any = SimpleNamespace(indenter=indenter, priors=None)
    return alternatives.propose_alternatives(posterior, np.zeros((2, 3)), np.zeros((2, 3, 3)))


def test_probabilities_of_tips(monkeypatch: pytest.MonkeyPatch) -> None:
    """Evidences 2, 1 and 4 with the density's share of a quarter: a half, a quarter, a quarter."""
    made, log_probability = proposed(
        monkeypatch, np.log([[2.0, 1.0], [1.0, 1.0], [4.0, 8.0]]).tolist(), [[0.1, 0.1]] * 3
    )
    np.testing.assert_allclose(np.exp(log_probability), [[0.5, 0.25], [0.25, 0.25], [0.25, 0.5]])
    np.testing.assert_allclose(made.shares, 0.98 * np.exp(log_probability).T + 0.02 / 3)


@pytest.mark.parametrize(
    ("shape", "log_weight", "unsure"), [(0.69, 0.0, False), (0.71, 0.0, True), (0.71, -10.5, False), (0.71, -9.0, True)]
)
def test_unsure_evidence(monkeypatch: pytest.MonkeyPatch, shape: float, log_weight: float, unsure: bool) -> None:
    """A heavy tail of an alternative that may have weight leaves the touch without probabilities."""
    _, found = proposed(
        monkeypatch, [[log_weight, 0.0], [0.0, 0.0], [-50.0, 0.0]], [[shape, 0.1], [0.1, 0.1], [0.1, 0.1]]
    )
    assert np.isnan(found[:, 0]).all() == unsure and np.isfinite(found[:, 1]).all()


def test_proposals_at_every_tip(monkeypatch: pytest.MonkeyPatch) -> None:
    """Searches begin in the middle of each cell at the mode; roots are those of the inverse curvature."""
    curvature = np.array([[4.0, 1.0], [1.0, 9.0]])
    seen: list[Any] = []

    def modes(posterior: Any, w: np.ndarray, start: np.ndarray) -> Any:
        seen.append((np.array(w), start))
        return start + w[..., None], None, np.array([4.0, 1.0, 9.0])[:, None, None] * np.ones((3, 2, 3))

    monkeypatch.setattr(alternatives, "conditional_modes", modes)
    posterior: Any = SimpleNamespace(indenter=SimpleNamespace(cells=np.array([-19.0, -18.0, -17.0])))
    mode = np.array([[9.0, 0.1, 50.0], [9.0, -0.2, 80.0]])
    made = alternatives._tip_proposals(posterior, mode)
    np.testing.assert_array_equal(seen[0][0], [[-18.5, -17.5, -16.5]] * 2)
    np.testing.assert_array_equal(seen[0][1], np.repeat(mode[:, None, 1:], 3, axis=1))
    assert [each.cell for each in made] == [-19.0, -18.0, -17.0] and made[0].rest.dof == 8.0
    np.testing.assert_allclose(made[1].rest.centre, mode[:, 1:] - 17.5)
    np.testing.assert_allclose(made[2].rest.root, np.tile(np.linalg.cholesky(np.linalg.inv(curvature)), (2, 1, 1)))


def test_density_beside_tips_has_the_profile_proposal(monkeypatch: pytest.MonkeyPatch) -> None:
    weighed: list[Any] = []
    monkeypatch.setattr(alternatives, "_tip_proposals", lambda posterior, mode: [tip(0.0), tip(1.0), tip(2.0)])
    monkeypatch.setattr(alternatives, "profile_proposal", lambda *given: tip(7.0))
    monkeypatch.setattr(alternatives, "replace", lambda made, **changes: made)

    def log_evidence(posterior: Any, part: TipProposal) -> Any:
        weighed.append(part.cell)
        return np.zeros(2), np.zeros(2)

    monkeypatch.setattr(alternatives, "_log_evidence", log_evidence)
    indenter = SimpleNamespace(tips=SimpleNamespace(share=0.25), density="density")
    posterior: Any = SimpleNamespace(indenter=indenter, priors=None)
    alternatives.propose_alternatives(posterior, np.zeros((2, 3)), np.zeros((2, 3, 3)))
    assert weighed == [0.0, 1.0, 2.0, 7.0]
