"""Draws of an element of a pad that no touch reached, against quadrature."""

from __future__ import annotations

import numpy as np
import pytest
from pad_simulation import line

from bayestouch.chain.kernels import HalfSpaceKernel, Kernel
from bayestouch.pad.calibration import choose_pad, drawn
from bayestouch.priors.parameters import LogNormal, Normal

LEVELS = np.array([0.1, 0.3, 0.5, 0.7, 0.9])
NARROW = {"w": Normal(2.5, 1e-3)}
HALF_SPACE = {"z": Normal(4.0, 1e-3), "a": Normal(0.5, 1e-3)}


@pytest.mark.parametrize(
    ("kernel", "stated", "noise"),
    [(None, NARROW, 0.3), (HalfSpaceKernel(6.0, LogNormal(4.0, 0.1)), HALF_SPACE, 1.0)],
)
@pytest.mark.parametrize("seed", [0, 1])
def test_gain_and_place_of_an_element_beyond_the_touches(
    kernel: Kernel | None, stated: dict[str, Normal], noise: float, seed: int
) -> None:
    """The touches end 7 mm before the last element, whose gain may be large and far away, or small and near.

    Its gain (16) is given a normal prior of ten times the others' signals, 120; its signal alone would have given one
    of a tenth of that with the Gaussian. The posterior is that on a grid of gain and place, the offset integrated out.
    """
    values = tuple(prior.mean for prior in stated.values())
    pad = line(kernel, values, floor=noise, share=0.0)
    touches = pad.touch(np.linspace(6, 21, 40)[:, None], np.random.default_rng(seed), measured=True, samples=3)
    dataset = pad.dataset(touches)
    name = pad.chain.kernel.name
    chosen, posterior = drawn(
        choose_pad(dataset, kernel=name, empirical=False, stated=stated), dataset, draws=4000, seed=0
    )
    known, priors = chosen.problem.known, chosen.problem.priors
    assert priors.amplitude[3] == pytest.approx(np.median(priors.amplitude[:3]), rel=0.25)
    gain_sd, offset_sd, middle = 10 * priors.amplitude[3], priors.offset_sd[3], priors.position[3, 0]
    sd = chosen.model.noise.mean_sd(known.counts, np.zeros_like(known.readings))[:, 3]
    precision = np.linalg.inv(np.diag(sd**2) + offset_sd**2)
    gain, place = np.linspace(-6, 6, 1201) * gain_sd, middle + np.linspace(-14, 14, 561)
    shape = known.load[:, None] * pad.chain.kernel(np.abs(known.location - place), np.array(values))
    square = np.einsum("ip,ij,jp->p", shape, precision, shape)
    pull = shape.T @ precision @ (known.readings[:, 3] - priors.offset[3])
    log = gain[:, None] * pull - 0.5 * gain[:, None] ** 2 * (square + gain_sd**-2) - 0.5 * ((place - middle) / 3) ** 2
    density = np.exp(log - log.max())
    for entry, points, marginal in (("gain", gain, density.sum(axis=1)), ("x_s", place, density.sum(axis=0))):
        draws = posterior.draws[entry][..., 3].ravel()
        cumulative = np.cumsum(marginal) - 0.5 * marginal
        at = np.interp(LEVELS, cumulative / marginal.sum(), points)
        # Four standard errors of 2,000 independent draws.
        assert np.mean(draws[:, None] < at, axis=0) == pytest.approx(LEVELS, abs=4 * 0.5 / np.sqrt(2000))
