"""Touches read with many calibrations drawn from a posterior, each taken as exact, and mixed: no propagation at all."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayestouch.data.touches import Touches
from bayestouch.model.body import body_of
from bayestouch.reading.options import Options
from bayestouch.results.objects import Calibration
from bayestouch.sampling.streams import BlockStreams

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class Read:
    """Posteriors of t touches: mean and standard deviation of k quantities, (t, k), and the log evidence (t,)."""

    mean: Array
    sd: Array
    log_evidence: Array


def read(
    calibration: Calibration, touches: Touches, names: Sequence[str], *, plug_in: bool, draws: int, seed: int = 0
) -> Read:
    """Read touches by importance sampling, which gives the evidence of each beside its posterior."""
    reader = body_of(calibration.sensor).reader(calibration, Options(plug_in=plug_in))
    known = reader.unknown(reader.ready(reader.average(touches)))
    t = known.n_touches
    out = Read(np.empty((t, len(names))), np.empty((t, len(names))), np.empty(t))
    effects = getattr(reader, "effects", None)
    for group in reader.sampler.groups(known, np.arange(t)):
        x, log_proposal = group.proposal.draw(BlockStreams(seed, group.rows), draws)
        log = group.log_density(x, np.arange(len(group.rows))) - log_proposal
        top = log.max(axis=1, keepdims=True)
        weight = np.exp(log - top)
        out.log_evidence[group.rows] = top[:, 0] + np.log(weight.mean(axis=1))
        weight /= weight.sum(axis=1, keepdims=True)
        found = group.results(np.moveaxis(x, 1, 0)[None])
        if effects is not None:
            # A pad's sampler has the load that acts.
            found["P"] = effects.pressing(found["P"])
        for k, name in enumerate(names):
            value = found[name][0].T
            mean = (weight * value).sum(axis=1)
            out.mean[group.rows, k] = mean
            out.sd[group.rows, k] = np.sqrt((weight * (value - mean[:, None]) ** 2).sum(axis=1))
    return out


def mixed(calibrations: Iterable[Calibration], touches: Touches, names: Sequence[str], **options: bool | int) -> Read:
    """Posteriors of touches averaged over calibrations, each weighted by what the touch itself says of it.

    A touch of eight readings and three unknowns tells something of the sensor. Posteriors that are mixed without these
    weights are too wide, and not those of any model.
    """
    parts = [read(each, touches, names, seed=i, **options) for i, each in enumerate(calibrations)]  # type: ignore[arg-type]
    log = np.array([part.log_evidence for part in parts])
    weight = np.exp(log - log.max(axis=0))
    weight = (weight / weight.sum(axis=0))[:, :, None]
    means = np.array([part.mean for part in parts])
    mean = (weight * means).sum(axis=0)
    variance = (weight * (np.array([part.sd for part in parts]) ** 2 + (means - mean) ** 2)).sum(axis=0)
    # In place of an evidence: how many calibrations are left by the weights.
    return Read(mean, np.sqrt(variance), 1 / (weight[:, :, 0] ** 2).sum(axis=0))


def matched(rng: np.random.Generator, count: int, dimension: int) -> Array:
    """Standard normal numbers (count, dimension) whose sample mean is 0 and whose sample covariance is 1, exactly.

    What is linear in them then has no Monte Carlo error.
    """
    z = rng.standard_normal((count, dimension))
    z -= z.mean(axis=0)
    return np.asarray(np.linalg.solve(np.linalg.cholesky(z.T @ z / count), z.T).T)


def at_row(calibration: Calibration, change: Array) -> Calibration:
    """A finger's calibration with its most probable values changed, as the rows of its covariance are ordered."""
    mode = {name: np.array(value, dtype=float) for name, value in calibration.mode.items()}
    for name, step in zip(calibration.layout, change, strict=True):
        key, _, element = name.removesuffix("]").partition("[")
        if key == "theta_s_rad":
            mode["theta_s"][int(element)] += np.degrees(step)
        elif element:
            mode[key][int(element)] += step
        elif key.startswith(("log ", "log_")):
            mode[key[4:]] *= np.exp(step)
        else:
            mode[key] += step
    return replace(calibration, mode=mode)


def drawn(calibration: Calibration, count: int, rng: np.random.Generator) -> list[Calibration]:
    """Calibrations of a finger drawn from the normal posterior of its base parameters and effects."""
    root = np.linalg.cholesky(calibration.covariance)
    return [at_row(calibration, root @ z) for z in matched(rng, count, len(root))]
