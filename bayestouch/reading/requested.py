"""Groups of the ArviZ schema that are written on request: likelihoods, priors and predictions of touches at draws."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from bayestouch.array_types import FloatArray, IndexArray
from bayestouch.reading.touch_reader import Drawn, TouchModel
from bayestouch.results.schema import Requested
from bayestouch.sampling.streams import BlockStreams

# Numbers in one array of a piece of touches: 32 MB.
_NUMBERS = 1 << 22
# Streams of random numbers of a touch; the sampler uses small numbers.
_PREDICTED, _PRIOR, _PRIOR_PREDICTED = 101, 102, 103


def requested_groups(
    model: TouchModel, posterior: Mapping[str, FloatArray], groups: Sequence[str], seed: int, first: int
) -> Requested:
    """Groups of touches, among those of `bayestouch.results.schema.GROUPS`.

    ``log_likelihood`` has ``reading``, the log density of each mean reading given the other readings of its touch (the
    error of the calibration is common to the readings of a touch, so they are correlated); ``load``, that of the
    measured load; and ``whole_touch``, that of all readings and the load of a touch together. They are NaN where
    nothing was measured. ``lp`` in ``sample_stats`` is ``whole_touch`` plus the sum of ``log_prior``.

    Parameters
    ----------
    model : TouchModel
        Distribution of readings and loads of t touches.
    posterior : mapping of (chain, draw, t) arrays
        Draws by public name.
    groups : sequence of str
        Names of the groups.
    seed : int
        Seed of the run.
    first : int
        Number of touches before the first one. Random numbers of a touch depend only on the seed and on this number.
    """
    out: Requested = {}
    chains, n, t = next(iter(posterior.values())).shape
    m = model.observed.shape[1]

    def put(group: str, values: Drawn, touches: slice) -> None:
        held = out.setdefault(group, {})
        for name, array in values.items():
            kind = np.float32 if array.ndim == 3 else np.float64
            if name not in held:
                held[name] = np.empty((chains, n, t, *array.shape[2:]), dtype=kind)
            held[name][:, :, touches] = array.reshape(chains, n, *array.shape[1:])

    for touches in _pieces(t, chains * n * m):
        draws = {name: values[..., touches].reshape(chains * n, -1) for name, values in posterior.items()}
        numbers = first + np.arange(t)[touches]

        def random(purpose: int, numbers: IndexArray = numbers) -> BlockStreams:
            return BlockStreams(seed, numbers, purpose)

        logs = model.log_prior(draws, touches) if {"log_prior", "log_likelihood"} & set(groups) else {}
        if "log_prior" in groups:
            put("log_prior", logs, touches)
        if "log_likelihood" in groups:
            likelihood = _log_likelihood(model, draws, touches)
            put("log_likelihood", likelihood, touches)
            put("sample_stats", {"lp": likelihood["whole_touch"] + sum(logs.values())}, touches)
        if "posterior_predictive" in groups:
            put("posterior_predictive", _predicted(model, draws, touches, random(_PREDICTED)), touches)
        if {"prior", "prior_predictive"} & set(groups):
            uniform = random(_PRIOR).uniform(model.n_parameters, chains * n)
            prior = model.prior(np.moveaxis(uniform, 0, -1))
            if "prior" in groups:
                put("prior", prior, touches)
            if "prior_predictive" in groups:
                put("prior_predictive", _predicted(model, prior, touches, random(_PRIOR_PREDICTED)), touches)
    return out


def _pieces(t: int, numbers: int) -> Iterator[slice]:
    step = max(1, _NUMBERS // max(numbers, 1))
    return (slice(start, min(start + step, t)) for start in range(0, t, step))


def _log_likelihood(model: TouchModel, draws: Drawn, touches: slice) -> Drawn:
    normals, observed = model.readings(draws, touches), model.observed[touches]
    sd = model.load_sd[touches]
    z = (model.load[touches] - model.measured_load(draws)) / sd
    load = -0.5 * z * z - np.log(sd * np.sqrt(2 * np.pi))
    return {
        "reading": normals.log_given_others(observed),
        "load": load,
        "whole_touch": normals.log_density(observed) + np.nan_to_num(load),
    }


def _predicted(model: TouchModel, draws: Drawn, touches: slice, random: BlockStreams) -> Drawn:
    """Replicated readings and loads, (n, some, m) and (n, some)."""
    n = len(next(iter(draws.values())))
    standard = np.moveaxis(random.normal(n, model.observed.shape[1] + 1), 0, 1)
    load = model.measured_load(draws) + model.load_sd[touches] * standard[..., -1]
    return {
        "reading": model.readings(draws, touches).draw(standard[..., :-1]),
        "load": load + model.load_shown[touches] - model.load[touches],
    }
