"""Proposal over all locations: density and draws by scipy, and the probability of a cell by a written-out integral."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import integrate, stats

from bayestouch.finger.reading import cells
from bayestouch.finger.reading.cells import CellsProposal, cells_proposal, indenters
from bayestouch.finger.reading.indenter_coordinate import IndenterCoordinate
from bayestouch.priors.parameters import Uniform
from bayestouch.priors.radius import RadiusOfTips
from bayestouch.sampling import BlockStreams

OUTER = 12.7
#: Two tips with a density of R, and a density alone.
BESIDE_TIPS = IndenterCoordinate(RadiusOfTips((0.0, np.inf), (0.3, 0.2), Uniform(2.0, 10.0), OUTER), OUTER)
ALONE = IndenterCoordinate(Uniform(2.0, 10.0), OUTER)
ENDS, LOADS = (-0.5, 1.0), (0.0, 100.0)


def made(indenter: IndenterCoordinate, seed: int = 1) -> CellsProposal:
    """A proposal for two touches with three locations."""
    rng = np.random.default_rng(seed)
    shape = (2, indenter.n_tips + 16, 3)
    mass = rng.dirichlet(np.full(shape[1] * 3, 10.0), 2).reshape(shape)
    return CellsProposal(indenter, ENDS, LOADS, np.log(mass), rng.uniform(-10, 110, shape), rng.uniform(20, 30, shape))


def test_settings() -> None:
    assert (cells.SLICES, cells.LOAD_STEP, cells.LOAD_STEPS) == (16, 1e-2, 2)
    assert (cells.WIDER, cells.OUTSIDE, cells.PART) == (1.1, 4.0, 64)


@pytest.mark.parametrize("indenter", [BESIDE_TIPS, ALONE])
def test_density_of_a_cell(indenter: IndenterCoordinate) -> None:
    """R of the density and θ_c level within the cell, a cut-off normal load; w of a tip level over its cell."""
    proposal = made(indenter)
    # R = 2.3 mm is in the first sixteenth of 2 to 10 mm, 9.9 mm in the last; cells of θ_c are 0.5 rad wide.
    for radius, cell in ((2.3, 0), (9.9, 15)):
        share = (radius - 2.0) / 8.0
        w, jacobian = np.log(share / (1 - share)), share * (1 - share)
        x = np.array([w, 0.6, 40.0])
        i, j = indenter.n_tips + cell, 2
        for block in range(2):
            mean, sd = proposal.load[block, i, j], proposal.load_sd[block, i, j]
            load = stats.truncnorm((0 - mean) / sd, (100 - mean) / sd, mean, sd)
            expected = proposal.log_mass[block, i, j] + np.log(16 * jacobian / 0.5) + load.logpdf(40.0)
            assert proposal.log_density(np.tile(x, (2, 1, 1)))[block, 0] == pytest.approx(expected)
    outside = np.array([[0.0, 1.1, 40.0], [0.0, 0.6, -1.0], [0.0, 0.6, 101.0], [0.0, -0.6, 40.0]])
    assert np.isneginf(proposal.log_density(np.tile(outside, (2, 1, 1)))).all()


def test_density_of_a_tip() -> None:
    """The cells of two tips are -18 to -17 and -17 to -16 in w."""
    proposal = made(BESIDE_TIPS)
    x = np.array([[-17.5, -0.2, 40.0], [-16.1, -0.2, 40.0]])
    found = proposal.log_density(np.tile(x, (2, 1, 1)))
    for block in range(2):
        for tip in range(2):
            mean, sd = proposal.load[block, tip, 0], proposal.load_sd[block, tip, 0]
            load = stats.truncnorm((0 - mean) / sd, (100 - mean) / sd, mean, sd)
            expected = proposal.log_mass[block, tip, 0] - np.log(0.5) + load.logpdf(40.0)
            assert found[block, tip] == pytest.approx(expected)


@pytest.mark.parametrize("indenter", [BESIDE_TIPS, ALONE])
def test_draws_have_the_density(indenter: IndenterCoordinate) -> None:
    """Share of the draws in each location and indenter; the mean of 1/density over them is the volume, for the load."""
    proposal, n = made(indenter), 20000
    x, log_q = proposal.draw(BlockStreams(3, [0, 1]), n)
    np.testing.assert_allclose(log_q, proposal.log_density(x))
    assert proposal.select([1]).n_blocks == 1
    for block in range(2):
        j = np.floor((x[block, :, 1] + 0.5) / 0.5).astype(int)
        expected = np.exp(proposal.log_mass[block]).sum(axis=0)
        np.testing.assert_allclose(np.bincount(j, minlength=3) / n, expected, atol=5 * np.sqrt(0.25 / n))
        if indenter.n_tips:
            tip = (x[block, :, 0] < -17).mean()
            assert tip == pytest.approx(np.exp(proposal.log_mass[block, 0]).sum(), abs=5 * np.sqrt(0.25 / n))
        radius = indenter.radius(x[block, :, 0])
        slices = np.exp(proposal.log_mass[block, indenter.n_tips :]).sum(axis=1)
        inside = (x[block, :, 0] > -16) & (radius < 2 + 8 * 4 / 16)
        assert inside.mean() == pytest.approx(slices[:4].sum(), abs=5 * np.sqrt(0.25 / n))
        # E[1/q] over the loads from 30 to 60 N/m is their width, times the widths of the other coordinates.
        chosen = (x[block, :, 2] > 30) & (x[block, :, 2] < 60) & (np.abs(x[block, :, 0]) < 2)
        weight = np.where(chosen, np.exp(-log_q[block]), 0.0)
        assert weight.mean() == pytest.approx(30 * 4 * 1.5, abs=5 * weight.std() / np.sqrt(n))


def test_coordinate_in_a_cell() -> None:
    """Half of the third sixteenth of 2 to 10 mm is 3.25 mm."""
    w = indenters(BESIDE_TIPS, np.array([0, 1, 4]), np.array([0.25, 0.5, 0.5]))
    np.testing.assert_allclose(w[:2], [-17.75, -16.5])
    assert BESIDE_TIPS.radius(w)[2] == pytest.approx(3.25)


@pytest.mark.parametrize("measured", [False, True])
def test_probability_of_a_cell(measured: bool) -> None:
    """Readings in proportion to the load: the integral over the load, times the prior of the indenter."""
    load = np.array([40.0 if measured else np.nan])

    def predicted(angle: np.ndarray, pressed: np.ndarray) -> np.ndarray:
        return np.stack([np.cos(angle), np.sin(angle)], axis=-1) * pressed[..., None]

    reading, noise = np.array([25.0, 20.0]), 10.0
    posterior: Any = SimpleNamespace(
        indenter=BESIDE_TIPS,
        priors=SimpleNamespace(location=Uniform(*ENDS), load=Uniform(*LOADS)),
        touches=SimpleNamespace(load=load, load_sd=np.array([3.0]), n_touches=1),
        residual=lambda x, blocks: (predicted(x[..., 1], x[..., 2]) - reading) / noise,
    )
    found = np.exp(cells_proposal(posterior).log_mass[0])
    n = found.shape[1]
    assert found.shape == (18, int(np.ceil(1.5 / np.radians(1.0))))

    def density(pressed: float, angle: float) -> float:
        miss = (predicted(np.array(angle), np.array(pressed)) - reading) / noise
        off = (pressed - 40.0) / 3.0 if measured else 0.0
        return float(np.exp(-0.5 * (miss @ miss) - 0.5 * off**2))

    centres = ENDS[0] + 1.5 * (np.arange(n) + 0.5) / n
    value = np.array([integrate.quad(density, *LOADS, args=(angle,), points=[20, 30, 40, 50])[0] for angle in centres])
    prior = np.array([0.3, 0.2, *[0.5 / 16] * 16])
    np.testing.assert_allclose(found, prior[:, None] * value / value.sum(), rtol=0.01)
