"""Choice of the model of a pad: a kernel, a kernel with an empirical map, or an empirical map about a constant."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Literal

from bayestouch.chain.kernel_choice import kernel_for, kernel_names
from bayestouch.chain.kernels import Kernel
from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import Sensor, pad_of
from bayestouch.pad.candidates import PadCandidate, add_map, fit_kernel
from bayestouch.pad.priors import check_identifiable
from bayestouch.pad.problem import PadProblem

# A model is preferred to a simpler one, or to one of which the dimensions are stated, if its log predictive density is
# higher by more than this (a factor of twenty).
CLEARLY_BETTER = 3.0

#: Whether a model has an empirical map, by the option `e_map` of `bayestouch.calibrate`.
EMPIRICAL: dict[str, bool | Literal["auto"]] = {"auto": "auto", "model": False, "empirical": True}


def choose_model(
    problem: PadProblem,
    dataset: DataSet,
    kernel: str,
    empirical: bool | Literal["auto"],
    progress: Callable[[float], None] | None = None,
    earlier: Mapping[str, PadCandidate] | None = None,
) -> tuple[PadCandidate, dict[str, PadCandidate]]:
    """The chosen model, and all fitted models by name; `earlier` has models of an equal problem, to be used again.

    If the thickness is stated, other kernels must be clearly better than those of a layer; if only the depth is stated,
    than those of a half-space. At few places all kernels fit the readings, and only the stated dimensions say what is
    read between the places.
    """
    earlier = earlier or {}
    kernels = identifiable_kernels(problem, dataset.sensor, kernel)

    def report(share: float) -> None:
        if progress is not None:
            progress(share)

    models: dict[str, PadCandidate] = {}
    for i, each in enumerate(kernels):
        models[each.name] = earlier.get(each.name) or fit_kernel(problem, each)
        report(0.4 * (i + 1) / len(kernels))
    best = _best_kernel(models, dataset.sensor)
    rivals = [] if empirical is True else [best]
    if empirical is not False:
        with_map = f"{best.kernel.name} with map"
        mapped = models[with_map] = earlier.get(with_map) or add_map(problem, best)
        rivals.append(mapped)
        report(0.7)
        if kernel == "auto":
            constant = kernel_for("constant", dataset.sensor, problem.pitch_mm)
            alone = "map alone"
            models[alone] = earlier.get(alone) or add_map(problem, fit_kernel(problem, constant))
            rivals.append(models[alone])
        report(1.0)
    # The simplest model is first; a later one must be clearly better.
    chosen = rivals[0]
    for rival in rivals[1:]:
        if rival.score > chosen.score + CLEARLY_BETTER:
            chosen = rival
    return chosen, models


def identifiable_kernels(problem: PadProblem, sensor: Sensor, kernel: str = "auto") -> list[Kernel]:
    """The kernels to choose from: one by its name, or all but the constant one.

    Raises
    ------
    InputError
        The touches cannot identify the parameters of one of them.
    """
    dimensions = problem.known.location.shape[1]
    names = [name for name in kernel_names(dimensions) if name != "constant"] if kernel == "auto" else [kernel]
    kernels = [problem.priors.kernel(kernel_for(name, sensor, problem.pitch_mm)) for name in names]
    for each in kernels:
        check_identifiable(problem.known, each, problem.usable)
    return kernels


def _best_kernel(models: Mapping[str, PadCandidate], sensor: Sensor) -> PadCandidate:
    """The kernel that predicts best; see `choose_model`."""
    pad = pad_of(sensor)
    # The names of both kernels of a layer begin so, and those of a half-space, which has a depth only.
    stated = "layer" if pad.thickness_mm is not None else "half-space" if pad.depth_mm is not None else None
    ahead = {name: CLEARLY_BETTER if stated and name.startswith(stated) else 0.0 for name in models}
    return models[max(models, key=lambda name: models[name].score + ahead[name])]
