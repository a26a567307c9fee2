"""Calibration of a pad from touches with known location."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

from bayestouch.chain.kernel_choice import kernel_for, kernel_names
from bayestouch.chain.pad_map import PadMap
from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import pad_of
from bayestouch.data.splits import with_calibration
from bayestouch.errors import InputError
from bayestouch.pad.candidates import PadCandidate, add_map, fit_kernel
from bayestouch.pad.known_touches import SAMPLES
from bayestouch.pad.priors import check_identifiable
from bayestouch.pad.problem import PadProblem, pad_problem
from bayestouch.pad.result import pad_calibration_of
from bayestouch.results.objects import Calibration

# Log predictive density that a model must gain to be preferred to a simpler one: a factor of twenty.
_WORTH_A_MAP = 3.0


def calibrate_pad(
    dataset: DataSet,
    *,
    kernel: str = "auto",
    empirical: bool | Literal["auto"] = "auto",
    samples: str = "auto",
    draws: int = 1000,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    further: Callable[[PadCandidate, PadMap], PadMap] | None = None,
) -> Calibration:
    """Calibrate a pad: gains, offsets, positions, kernel, empirical map and noise.

    Three models compete by the log predictive density of each calibration reading left out of the fit: the best
    kernel alone, that kernel with an empirical map, and an empirical map about a constant; a simpler one holds its
    place unless it is clearly worse. The posterior of the parameters is the normal (Laplace) approximation at the
    mode; with a map, it is what is known of the kernel beside the map.

    Parameters
    ----------
    dataset : DataSet
        Of a pad. Without a calibration table the touches are split by location first.
    kernel : str
        One of `bayestouch.chain.kernels.kernel_names`, or ``"auto"``.
    empirical : bool or "auto"
        Whether an empirical map is part of the model.
    samples : {"auto", "mean", "first", "last"}
        Which samples of a touch count; see `bayestouch.pad.known_touches.choose_samples`.
    draws : int
        Posterior draws in all.
    seed : int
    progress : callable, optional
        Called with the share done, 0 to 1.
    further : callable, optional
        Makes the map that is kept from the model and its map.

    Returns
    -------
    Calibration
        ``rows.predicted`` predicts each touch's readings without themselves, ``rows.sd`` with their noise.

    Raises
    ------
    InputError
        The touches cannot identify the parameters, or an option is not known.
    """
    dimensions = pad_of(dataset.sensor, "a calibration with kernels").dimensions
    if samples not in SAMPLES:
        raise InputError(f"expected samples among {', '.join(SAMPLES)}, got {samples!r}")
    if kernel != "auto" and kernel not in kernel_names(dimensions):
        names = ", ".join(("auto", *kernel_names(dimensions)))
        raise InputError(f"expected a kernel among {names}, got {kernel!r}")
    dataset = with_calibration(dataset)
    assert dataset.calibration is not None
    problem, notes = pad_problem(dataset.sensor, dataset.calibration, samples=samples, seed=seed)
    model, rivals = choose_model(problem, dataset, kernel, empirical, progress)
    notes = [*dataset.notes, *dataset.calibration.notes, *notes]
    result = pad_calibration_of(dataset.sensor, problem, model, rivals, notes, draws=draws)
    if further is not None:
        kept = further(model, PadMap.from_arrays(result.extra))
        result = replace(result, extra={**result.extra, **kept.arrays()})
    if progress is not None:
        progress(1.0)
    return result


def choose_model(
    problem: PadProblem,
    dataset: DataSet,
    kernel: str,
    empirical: bool | Literal["auto"],
    progress: Callable[[float], None] | None = None,
) -> tuple[PadCandidate, dict[str, PadCandidate]]:
    """Best model by score, and all that were fitted by name."""
    dimensions = problem.known.location.shape[1]
    names = [name for name in kernel_names(dimensions) if name != "constant"] if kernel == "auto" else [kernel]
    kernels = [kernel_for(name, dataset.sensor, problem.pitch_mm) for name in names]
    for each in kernels:
        check_identifiable(problem.known, each, problem.usable)

    def told(share: float) -> None:
        if progress is not None:
            progress(share)

    models: dict[str, PadCandidate] = {}
    for i, each in enumerate(kernels):
        models[each.name] = fit_kernel(problem, each)
        told(0.3 * (i + 1) / len(kernels))
    best = max(models.values(), key=lambda model: model.score)
    rivals = [] if empirical is True else [best]
    if empirical is not False:
        mapped = add_map(problem, best)
        models[f"{best.kernel.name} with map"] = mapped
        rivals.append(mapped)
        told(0.6)
        if kernel == "auto":
            constant = kernel_for("constant", dataset.sensor, problem.pitch_mm)
            alone = add_map(problem, fit_kernel(problem, constant))
            models["map alone"] = alone
            rivals.append(alone)
        told(0.8)
    # The simplest comes first, and holds its place against one that is hardly better.
    chosen = rivals[0]
    for rival in rivals[1:]:
        if rival.score > chosen.score + _WORTH_A_MAP:
            chosen = rival
    return chosen, models
