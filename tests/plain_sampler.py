"""Plain emcee for one posterior: the reference for everything quicker."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.sampling.diagnostics import bulk_statistics


@dataclass(frozen=True, eq=False)
class PlainDraws:
    """Draws from one posterior of dimension d.

    Attributes
    ----------
    draws : (chain, draw, d) array
        One chain for each independent ensemble: the draws of its walkers, one walker after the other.
    log_density : (chain, draw) array
        Log density at each.
    acceptance : (chain,) array
        Share of proposals accepted.
    ess_bulk, rhat : (d,) arrays
        Bulk effective sample size and R-hat over the ensembles.
    autocorrelation_time : (d,) array
        emcee's estimate in steps, mean over the ensembles; too small where the chains are shorter than 50 of it,
        which grades the result and withholds nothing.
    """

    draws: FloatArray
    log_density: FloatArray
    acceptance: FloatArray
    ess_bulk: FloatArray
    rhat: FloatArray
    autocorrelation_time: FloatArray


def sample_plain(
    log_density: Callable[[FloatArray], FloatArray],
    start: FloatArray,
    *,
    steps: int,
    seed: int,
    left_out: int | None = None,
    thin: int = 1,
    progress: Callable[[float], None] | None = None,
) -> PlainDraws:
    """Draw from one posterior with emcee's stretch and differential-evolution moves.

    Walkers of one ensemble depend on each other, so that R-hat is taken over independent ensembles.

    Parameters
    ----------
    log_density : callable
        ``(n, d) -> (n,)``, up to a constant; ``-inf`` outside the support, never NaN.
    start : (chain, walkers, d) array
        Where the walkers of each ensemble start: at least four ensembles, each of an even number of walkers, at
        least ``2 d``, spread about as wide as the posterior.
    steps : int
        Steps kept of each walker, before thinning.
    seed : int
        Of all random numbers.
    left_out : int, optional
        Steps left out at the start; half of `steps` by default.
    thin : int
        Every `thin`-th step is kept.
    progress : callable, optional
        Called with the share of the work done, 0 to 1.

    Raises
    ------
    ValueError
        `start` has another shape.
    """
    import emcee

    start = np.asarray(start, dtype=float)
    if start.ndim != 3 or start.shape[0] < 4 or start.shape[1] < 2 * start.shape[2] or start.shape[1] % 2:
        raise ValueError(
            f"start: expected (at least 4 ensembles, an even number of at least 2 d walkers, d), got {start.shape}"
        )
    chains, walkers, d = start.shape
    left_out = steps // 2 if left_out is None else left_out
    drawn, log_p, acceptance, times = [], [], [], []
    for chain, seeds in enumerate(np.random.SeedSequence(seed).spawn(chains)):
        sampler = emcee.EnsembleSampler(
            walkers,
            d,
            log_density,
            vectorize=True,
            moves=[(emcee.moves.StretchMove(), 0.5), (emcee.moves.DEMove(), 0.5)],
        )
        random_state = np.random.RandomState(np.random.MT19937(seeds)).get_state()
        state = emcee.State(start[chain], random_state=random_state)
        if left_out:
            state = sampler.run_mcmc(state, left_out, store=False)
        sampler.run_mcmc(state, steps // thin, thin_by=thin, skip_initial_state_check=True)
        drawn.append(np.swapaxes(sampler.get_chain(), 0, 1).reshape(-1, d))
        log_p.append(sampler.get_log_prob().T.reshape(-1))
        acceptance.append(float(sampler.acceptance_fraction.mean()))
        times.append(thin * emcee.autocorr.integrated_time(sampler.get_chain(), quiet=True, tol=0))
        if progress is not None:
            progress((chain + 1) / chains)
    draws = np.stack(drawn)
    ess, rhat = bulk_statistics(draws)
    return PlainDraws(draws, np.stack(log_p), np.array(acceptance), ess, rhat, np.mean(times, axis=0))
